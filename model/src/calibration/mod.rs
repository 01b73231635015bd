//! Load-cell calibration: weights to volts and back.

mod curve;
mod weight_steps;

pub use curve::Curve;
pub use weight_steps::{Calibration, CalibrationError, STANDARD_GRAVITY, WeightStep};
