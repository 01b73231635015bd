//! What is done with a rig, as values: plans, the language they are written in, and the engine that runs them.
//!
//! A plan describes; [`engine`] decides, one pure step at a time; [`preview`] says before a start what a plan
//! will do. The manifest names the model and no other crate of ours, so nothing here can reach a rig, a file
//! or a clock. What does is `palpate-runner`.
//! Start reading at [`engine::step`].
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

pub mod engine;
pub mod file;
pub mod plans;
pub mod preview;
mod steps;
pub mod weight_readings;

pub use steps::{MeterSample, StepMeter, StepTarget};
