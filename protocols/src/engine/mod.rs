//! The engine: `step(state, now, input) -> (state, effects)`, pure and total.
//!
//! [`Input`] is everything the engine can see and [`Effect`] everything it can do. It reads no
//! clock, holds no device and knows no disk, so a dry run, a replay and a real run are the same
//! code fed from different places.

mod between;
mod block_mean;
mod context;
mod input;
mod interlock;
mod monitor;
mod pause;
mod record;
mod state;
mod step;
mod stop;
#[cfg(test)]
mod tests;

pub(crate) use block_mean::BlockMean;
pub(crate) use context::{Context, NOT_TARED, outside_travel};
pub use input::{Effect, Input, Operator};
pub use interlock::Interlock;
pub use record::{Answer, EndingKind, FailureResponse, Outcome, Record};
pub use state::{Config, Contact, Derived, Drift, PauseView, Power, State, UnloadedSignal};
pub(crate) use step::NOT_HOMED;
pub use step::{PLAN_COMPLETE, step};

/// Version of the engine's decisions. Raised whenever a recorded session could decide
/// differently; replay compares decisions only where versions match.
pub const ENGINE_VERSION: u32 = 2;
