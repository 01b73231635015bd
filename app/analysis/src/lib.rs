//! Use cases for recorded sessions, once for every front end: read, fit, compare, report, export.
//!
//! A use case takes a typed request and gives a typed result or error; it names no command-line flag
//! and no button, prints nothing and draws in no window. It never commands a rig.
//!
//! Start reading at [`source`], which makes samples of a session or a table, and [`fit`].
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

pub mod analyse;
pub mod analysed;
pub mod analyses;
pub mod calibrations;
pub mod compliance;
pub mod cycles;
pub mod daily;
pub mod edited;
pub mod edits;
pub mod exports;
#[cfg(feature = "extremes")]
pub mod extremes;
pub mod fidelity;
pub mod find;
pub mod fit;
#[cfg(feature = "haptics")]
pub mod follow_session;
#[cfg(feature = "haptics")]
pub mod haptics;
#[cfg(feature = "haptics")]
pub mod haptics_tape;
pub mod imports;
#[cfg(feature = "haptics")]
pub mod margin;
pub mod opening;
pub mod plan;
pub mod pool;
pub mod progress;
pub mod recorded;
pub mod report;
#[cfg(feature = "haptics")]
pub mod scene;
#[cfg(feature = "haptics")]
pub mod scene_bench;
pub mod select;
pub mod source;
pub mod sources;
pub mod support_bundle;
pub mod trade;
