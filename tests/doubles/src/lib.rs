//! Faulty stand-ins for tests: they take a rig's commands, give its reports and fail by script.
//!
//! For tests only: no program depends on this crate.

mod faulty_rig;
mod script;
mod wired;

pub use faulty_rig::FaultyRig;
pub use script::{FaultKind, Rail, ScriptedFault};
pub use wired::WiredRig;
