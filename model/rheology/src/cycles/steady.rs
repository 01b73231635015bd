//! When cycles have stopped changing.

use super::loops::CycleAnalysis;
use palpate_model::units::Depth;

/// When cycles count as steady: peak and place of the loop both change by less than so much, so many times in a row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SteadyRule {
    /// Largest change from one cycle to the next: of the peak in percent of it, of the place in percent of the greatest
    /// depth.
    pub percent: f64,
    /// Changes in a row that have to be so small.
    pub in_a_row: usize,
}

impl Default for SteadyRule {
    /// One percent is a tenth of what preconditioning changes, and what one specimen repeats itself within; once could
    /// be luck, as a peak has its own noise.
    fn default() -> Self {
        Self { percent: 1.0, in_a_row: 2 }
    }
}

/// Change from the cycle before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CycleChange {
    /// The later of the two cycles.
    pub cycle: u32,
    /// Change of the peak in percent of the one before; negative where it fell.
    pub peak_percent: f64,
    /// Shift toward greater depth, at half the first peak; `None` where one of the two never reached it.
    pub shift: Option<Depth>,
    /// The shift in percent of the greatest depth.
    pub shift_percent: Option<f64>,
}

/// Changes from cycle to cycle and what they amount to.
#[derive(Clone, Debug, PartialEq)]
pub struct Steadiness {
    /// One for every cycle but the first.
    pub changes: Vec<CycleChange>,
    /// First cycle after which nothing changed by more than the rule, so many times in a row, to the end of the record;
    /// `None` if there is none.
    pub steady_from: Option<u32>,
}

impl SteadyRule {
    /// Judges cycles in their order.
    pub fn judge(&self, cycles: &[CycleAnalysis]) -> Steadiness {
        let changes: Vec<CycleChange> =
            cycles.windows(2).map(|pair| change(&pair[0], &pair[1])).collect();
        let late = changes.iter().rev().take_while(|change| self.is_small(change)).count();
        // A change belongs between two cycles: the first of the row is the one into the cycle after the steady one.
        let steady_from =
            (late >= self.in_a_row.max(1)).then(|| cycles[changes.len() - late].cycle);
        Steadiness { changes, steady_from }
    }

    fn is_small(&self, change: &CycleChange) -> bool {
        change.peak_percent.abs() < self.percent
            && change.shift_percent.is_some_and(|shift| shift.abs() < self.percent)
    }
}

fn change(before: &CycleAnalysis, after: &CycleAnalysis) -> CycleChange {
    let (one, other) = (before.force_peak.value.0, after.force_peak.value.0);
    let shift = match (before.depth_at_half_peak(), after.depth_at_half_peak()) {
        (Some(from), Some(to)) => Some(Depth(to.0 - from.0)),
        _ => None,
    };
    CycleChange {
        cycle: after.cycle,
        peak_percent: 100.0 * (other / one - 1.0),
        shift,
        shift_percent: shift.map(|shift| 100.0 * shift.0 / after.depth_peak.0),
    }
}
