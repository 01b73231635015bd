//! The runner: the only place where decisions meet hardware, disk and clock.
//!
//! One named thread owns the rig. It feeds what the rig reports to the engine, does what the
//! engine asks (stop commands first), writes the session log and publishes snapshots. It contains
//! no experiment logic.
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

mod active_run;
pub mod base;
mod board;
mod clock;
pub mod demonstration;
pub mod fidelity;
mod handle;
#[cfg(feature = "haptics")]
pub mod haptics;
mod leading;
mod live_feed;
mod main_loop;
pub mod panic_stop;
pub mod programme;
pub mod replay;
mod run_log;
mod snapshot;
mod start;
mod started_run;
pub mod study;
#[cfg(test)]
mod tests;
mod watch;

use active_run::to_json;
use board::{Board, LogState};
pub use clock::{Stopwatch, TimeScale, driver_clock, wall_now};
pub use handle::RunnerHandle;
pub use leading::{LeadSource, SharedLeadSource, SlaveSample};
use live_feed::LiveFeed;
pub use main_loop::{Runner, RunnerRequest};
pub use snapshot::{
    ContactTrigger, Lateness, LogLine, PlannedWeight, PromptView, RigView, RunView, RunnerSnapshot,
};
pub use start::{AfterStop, PromptResponder, RunRequest, StartError};
pub use started_run::{RunnerEnded, StartedRun};
