//! Vocabulary and mathematics of soft-tissue indentation.
//!
//! This crate knows units, the words in which a rig is commanded and observed,
//! the load-cell calibration, the viscoelastic force models and their fit.
//! It never reads a file, a port or a clock, starts no thread and draws nothing:
//! every result is a function of its arguments.
//!
//! Start reading at [`units`], then [`rig`] for the words every crate shares,
//! [`viscoelastic`] for the force model and [`fit`] for its identification.

pub mod calibration;
pub mod cycles;
pub mod expected;
pub mod extremes;
pub mod families;
pub mod fit;
pub mod haptics;
pub mod integrators;
mod linalg;
pub mod quantity;
pub mod random;
pub mod reference;
pub mod rig;
pub mod scene;
pub mod select;
pub mod signal;
pub mod surface;
pub mod time;
pub mod tolerance;
pub mod trade;
pub mod units;
mod vectors;
pub mod viscoelastic;

pub use time::Nanos;
pub use units::{Depth, MmPerS, MmPerS2, Newtons, Position, Seconds, Volts};
