//! Vocabulary and mathematics of soft-tissue indentation.
//!
//! This crate knows units, the words in which a rig is commanded and observed, the load-cell
//! calibration, what a signal tells (contact, settling) and the exact step of the modified Kelvin
//! body, on which both the simulated rig and the model families stand.
//! It never reads a file, a port or a clock, starts no thread and draws nothing:
//! every result is a function of its arguments.
//!
//! Start reading at [`units`], then [`rig`] for the words every crate shares.
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

pub mod assessment;
pub mod autocorrelation;
pub mod calibration;
pub mod control_chart;
pub mod estimate;
pub mod linalg;
pub mod metadata;
mod named;
pub mod panics;
pub mod quantity;
pub mod random;
pub mod rig;
pub mod signal;
pub mod time;
pub mod typed_number;
pub mod units;
pub mod viscoelastic;

pub use time::Nanos;
pub use units::{Depth, MmPerS, MmPerS2, Newtons, Position, Seconds, Volts};

/// For fields that a record leaves out where they say nothing.
fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}
