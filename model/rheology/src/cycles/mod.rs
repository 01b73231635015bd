//! Quantities of repeated indentations of one specimen: loops, their shift and decay, relaxation, creep, and the response
//! to a sine; and what a fitted body's prediction of a record is worth.
//!
//! Everything is measured on the record itself; no model is assumed but where a name says so. Standard errors hold
//! for independent noise. [`analyse_cycles`] does the cycles; [`sine`], [`creep`] and [`predict_cycles`] stand alone.

mod creep;
mod local;
mod loops;
mod predict;
mod relaxation;
mod sine;
mod split;
mod steady;

pub use creep::{Creep, creep};
pub use loops::{CycleAnalysis, LEVELS, LevelDepth, Stiffness, analyse_cycles, stiffness_at};
pub use predict::{CyclePrediction, PredictionError, predict_cycles};
pub use relaxation::{StressRelaxation, relaxation};
pub use sine::{Sinusoid, SinusoidError, fit_sinusoid};
pub use split::split_by_depth;
pub use steady::{CycleChange, Steadiness, SteadyRule};

use palpate_model::rig::Phase;
use palpate_model::units::{Depth, Newtons, Seconds};

/// One sample of a record in cycles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CycleSample {
    /// Time from the start of the record.
    pub t: Seconds,
    pub depth: Depth,
    pub force: Newtons,
    /// Ramp, hold, creep or unload; other phases are between cycles.
    pub phase: Phase,
    /// Which cycle, from 1.
    pub cycle: u32,
    /// Which step of the plan, from 0; 0 throughout where there was none.
    pub step: u32,
}

/// A measured number and its standard error, of one unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate<T> {
    pub value: T,
    /// For independent noise.
    pub std_error: T,
}

impl<T> Estimate<T> {
    fn of(unit: impl Fn(f64) -> T, [value, std_error]: [f64; 2]) -> Self {
        Self { value: unit(value), std_error: unit(std_error) }
    }
}
