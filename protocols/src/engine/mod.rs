//! The engine: `step(state, now, input) -> (state, effects)`, pure and total.
//!
//! [`Input`] is everything the engine can see and [`Effect`] everything it can do. It reads no
//! clock, holds no device and knows no disk, so a dry run, a replay and a real run are the same
//! code fed from different places.

mod base;
mod between;
mod contact;
mod context;
mod creep;
mod follow;
mod hold;
mod home;
mod input;
mod interlock;
mod load;
mod millisecond;
mod monitor;
mod pause;
mod prompt;
mod self_test;
mod state;
mod stats;
mod step;
mod stop;
mod tare;
#[cfg(test)]
mod tests;
mod touch_log;
mod weigh;

pub(crate) use base::SEATED_SHARE;
pub(crate) use contact::NOT_TARED;
pub(crate) use context::outside_travel;
pub use input::{Answer, Effect, EndingKind, Input, Operator, Outcome, Record, Recovery};
pub use interlock::Interlock;
pub use state::{Config, Contact, Derived, Drift, PauseView, Power, State, Tare};
pub(crate) use step::NOT_HOMED;
pub use step::{PLAN_COMPLETE, step};

/// Version of the engine's decisions. Raised whenever a recorded session could decide
/// differently; replay compares decisions only where versions match.
pub const ENGINE_VERSION: u32 = 2;
