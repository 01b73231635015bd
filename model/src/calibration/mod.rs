//! Load-cell calibration: weights to volts and back.

mod curve;
mod settle;
mod weight_steps;

pub use curve::Curve;
pub use settle::{Settle, SettleRule, Settling, Steady, Unsettled};
pub use weight_steps::{Calibration, CalibrationError, STANDARD_GRAVITY, WeightStep};
