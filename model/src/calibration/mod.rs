//! Load-cell calibration: weights to volts and back, and what a force read this way is worth.
//!
//! Start at [`Calibration`], the document. Its [`Calibration::curve`] turns volts into newtons.

mod assessment;
mod choice;
mod curve;
mod document;
mod error;
mod hysteresis;
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

pub use choice::{CurveCandidate, assess_curve_kind, curve_candidates};
pub use curve::{CalibrationCurve, DEGREE_MAX};
pub use document::{
    CALIBRATION_FORMAT, Calibration, CalibrationPoint, CalibrationReading, CalibrationSeries,
    Direction, NamedWeight, SeriesStep, VALID_DAYS,
};
pub use error::CalibrationError;
pub use hysteresis::HysteresisLoop;
pub use kind::CurveKind;
pub use quality::{CalibrationQuality, FlatStretch, Hysteresis, PointQuality};
pub use settle::{SettleDetector, SettleProgress, SettleRule, SettleState, SteadySignal};
pub use uncertainty::{ForceUncertainty, UncertaintyTerm};
pub use validity::{
    CHECK_LIMIT_PERCENT, CalibrationUse, KnownWeight, WARNING_DAYS, WeightCheck, WeightCheckError,
};
pub use weight_steps::{STANDARD_GRAVITY, WeightStep, newtons_of};
