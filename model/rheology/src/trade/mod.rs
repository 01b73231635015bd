//! Error against time, as measured on one machine: what to use, and how far to trust it.
//!
//! Pure: errors and times are measured by whoever has a clock. The haptic loop and the scene plan from
//! [`TradeCurves::recommend`]; where it may come from another machine or another time,
//! [`TradeCurves::doubts`] says so.

mod advice;
mod check;
mod machine;
mod pareto;

pub use advice::{Advice, AdvisedSetting, Recommendation};
pub use check::{CurveError, rounding_share};
pub use machine::{Machine, STALE_DAYS};
pub use pareto::{find_pareto_front, mark_pareto_optimal};

use crate::integrators::{Precision, Scheme};
use palpate_model::units::Newtons;
use serde::{Deserialize, Serialize};

/// Version of the stored form; another one is not read.
pub const TRADE_FORMAT: u32 = 1;

/// A measured time and its repeatability.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MeasuredCost {
    /// Time of one in ns: the least over all rounds, since other work on the machine only adds.
    pub ns: f64,
    /// By how much the middle round was above the least, as a share of it.
    pub spread: f64,
    /// By how much the least of the even rounds and that of the odd ones differ, as a share.
    pub halves: f64,
}

/// Largest error of force on the paths measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ForceError {
    /// On the ramp and hold, in N.
    pub ramp_hold_n: f64,
    /// On the poke, in N.
    pub poke_n: f64,
}

/// One integrator at one step in one precision.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IntegratorRow {
    pub scheme: Scheme,
    pub precision: Precision,
    /// Step in s.
    pub step_s: f64,
    /// Its error; null where it has none.
    pub error: Option<ForceError>,
    pub refused: Option<String>,
    pub cost: MeasuredCost,
    /// Cost of a second of simulated time, in ns.
    pub second_ns: f64,
    /// Whether nothing is both cheaper and more exact.
    pub front: bool,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FamilyRow {
    pub family: String,
    /// Rows of one target compete.
    pub target: String,
    /// Largest force of the target, in N.
    pub peak_n: f64,
    /// Largest error of force in N.
    pub error_n: f64,
    /// Cost of a step at any rate.
    pub cost: MeasuredCost,
    /// Whether nothing for this target is both cheaper and more exact.
    pub front: bool,
}

/// The fit of a recording, thinned.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FitRow {
    /// Samples per second that are left.
    pub rate_hz: f64,
    pub samples: usize,
    /// Root mean square error of the relaxation time over the seeds, as a share of it.
    pub tau_error: f64,
    /// Root mean square over the seeds of the largest error of the fitted force, in N.
    pub error_n: f64,
    pub cost: MeasuredCost,
    /// Whether nothing is both cheaper and more exact.
    pub front: bool,
}

/// The live fit with so many relaxation times in its bank.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LiveRow {
    pub nodes: usize,
    /// How far its last answer is from the fit of record on a noiseless recording, as a share of the
    /// relaxation time; null where it has no answer.
    pub tau_error: Option<f64>,
    pub cost: MeasuredCost,
    /// Whether nothing is both cheaper and more exact.
    pub front: bool,
}

/// Everything measured in one go on one machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TradeCurves {
    pub format: u32,
    /// Version of palpate that measured.
    pub version: String,
    pub machine: Machine,
    /// When, RFC 3339 in UTC.
    pub measured_at: String,
    /// Whether only a few rows were measured, briefly.
    pub quick: bool,
    /// Largest forces of the two paths, in N.
    pub peak: ForceError,
    /// First seed of the noise in the fits, and how many followed.
    pub seeds: [u64; 2],
    /// Integrators by step and precision.
    pub integrators: Vec<IntegratorRow>,
    pub families: Vec<FamilyRow>,
    /// The fit by sampling rate.
    pub fit: Vec<FitRow>,
    /// The live fit by size of its bank.
    pub live: Vec<LiveRow>,
}

impl ForceError {
    /// The larger of the two beside the peaks of their paths.
    pub fn share_of(&self, peak: &Self) -> f64 {
        (self.ramp_hold_n / peak.ramp_hold_n).max(self.poke_n / peak.poke_n)
    }

    /// Whether both are within a tolerance.
    pub fn is_within(&self, tolerance: crate::tolerance::Tolerance, peak: &Self) -> bool {
        let within = |error: f64, peak: f64| error <= tolerance.in_newtons(Newtons(peak)).0;
        within(self.ramp_hold_n, peak.ramp_hold_n) && within(self.poke_n, peak.poke_n)
    }
}

impl TradeCurves {
    /// Marks in every table the rows than which nothing is both cheaper and more exact.
    pub fn mark_fronts(&mut self) {
        let peak = self.peak;
        let points = self.integrators.iter().map(|row| {
            let error = row.error.map(|error| error.share_of(&peak));
            (error, row.second_ns)
        });
        let front = mark_pareto_optimal(&points.collect::<Vec<_>>());
        self.integrators.iter_mut().zip(front).for_each(|(row, front)| row.front = front);
        for index in 0..self.families.len() {
            let target = &self.families[index].target;
            let rivals = self.families.iter().filter(|row| row.target == *target);
            let row = &self.families[index];
            self.families[index].front = !rivals.into_iter().any(|rival| {
                pareto::beats((rival.error_n, rival.cost.ns), (row.error_n, row.cost.ns))
            });
        }
        let points: Vec<_> =
            self.fit.iter().map(|row| (Some(row.tau_error), row.cost.ns)).collect();
        self.fit
            .iter_mut()
            .zip(mark_pareto_optimal(&points))
            .for_each(|(row, front)| row.front = front);
        let points: Vec<_> = self.live.iter().map(|row| (row.tau_error, row.cost.ns)).collect();
        self.live
            .iter_mut()
            .zip(mark_pareto_optimal(&points))
            .for_each(|(row, front)| row.front = front);
    }

    pub fn costs(&self) -> impl Iterator<Item = &MeasuredCost> {
        let integrators = self.integrators.iter().map(|row| &row.cost);
        let families = self.families.iter().map(|row| &row.cost);
        let fits = self.fit.iter().map(|row| &row.cost);
        integrators.chain(families).chain(fits).chain(self.live.iter().map(|row| &row.cost))
    }

    /// Largest difference between two halves of the measurement, as a share: how far the times would
    /// be reproduced.
    pub fn worst_halves(&self) -> f64 {
        self.costs().map(|cost| cost.halves).fold(0.0, f64::max)
    }
}

#[cfg(test)]
mod tests;
