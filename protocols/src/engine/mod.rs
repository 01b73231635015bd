//! The engine: `step(state, now, input) -> (state, effects)`, pure and total.
//!
//! [`EngineInput`] is everything the engine can see and [`Effect`] everything it can do. It reads no
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
pub use input::{Effect, EngineInput, Operator};
pub use interlock::Interlock;
pub use record::{EndingKind, FailureResponse, PromptAnswer, Record, RunOutcome};
pub use state::{
    ContactPosition, DerivedValues, Drift, EngineConfig, EngineState, PauseView, Power,
    UnloadedSignal,
};
pub(crate) use step::NOT_HOMED;
pub use step::{PLAN_COMPLETE, step};

/// Version of the engine's decisions. Raised whenever a recorded session could decide
/// differently; replay compares decisions only where versions match.
pub const ENGINE_VERSION: u32 = 2;
