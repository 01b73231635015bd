//! What is done with a rig: plans, the engine that runs them, the runner and replay.
//!
//! A plan describes; [`engine`] decides, one pure step at a time; [`runner`] is the only place
//! where decisions meet hardware, disk and clock; [`replay`] feeds a recorded session to the
//! same engine. Nothing here draws, and nothing in [`engine`] or [`plans`] does any I/O.
//! Start reading at [`engine::step`].

pub mod base;
pub mod engine;
pub mod fidelity;
pub mod file;
pub mod haptics;
pub mod plans;
pub mod preview;
pub mod programme;
pub mod replay;
pub mod runner;
mod steps;
pub mod weighed;
