//! Load-cell calibration: weights to volts and back, and what a force read this way is worth.
//!
//! Start at [`Calibration`], the document. Its [`Calibration::curve`] turns volts into newtons.

mod choice;
mod curve;
mod document;
mod error;
mod kind;
mod quality;
mod settle;
#[cfg(test)]
mod tests;
mod uncertainty;
#[cfg(test)]
mod uncertainty_tests;
mod validity;
mod weight_steps;

pub use choice::{Candidate, candidates, judge_kind};
pub use curve::{Curve, DEGREE_MAX};
pub use document::{
    CALIBRATION_FORMAT, Calibration, CalibrationPoint, CalibrationReading, Direction, NamedWeight,
    Series, SeriesStep, VALID_DAYS,
};
pub use error::CalibrationError;
pub use kind::CurveKind;
pub use quality::{FlatStretch, Hysteresis, PointQuality, Quality};
pub use settle::{Settle, SettleRule, Settling, SettlingNow, Steady};
pub use uncertainty::{ForceUncertainty, Term};
pub use validity::{Bench, CHECK_LIMIT_PERCENT, CheckResult, KnownWeight, WeightCheckError};
pub use weight_steps::{STANDARD_GRAVITY, WeightStep, newtons_of};
