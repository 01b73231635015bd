//! The loop of a load cell between loading and unloading.

use super::document::{Calibration, CalibrationPoint};
use crate::units::Newtons;

/// Points read both ways that are needed: two numbers are found from them, and their scatter.
const POINTS_MIN: usize = 4;

/// How far a load cell lags behind its force: it reads too little while the force rises and too much while it falls,
/// most in the middle of its range and nothing at its ends, where both ways meet.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HysteresisLoop {
    /// Half the distance between both ways in the middle of the range.
    pub half: Newtons,
    /// Its standard uncertainty.
    pub std_error: Newtons,
    /// Ends of the range in N.
    pub range: (f64, f64),
}

impl HysteresisLoop {
    /// Share of the middle's distance at a force, 0..=1.
    pub fn share_at(&self, force: f64) -> f64 {
        let (from, to) = self.range;
        let place = ((force - from) / (to - from)).clamp(0.0, 1.0);
        4.0 * place * (1.0 - place)
    }

    /// By least squares over the points that were read both ways, beside a steady drift of the signal: under a weight that
    /// is taken off late, it drifts for longer. `None` where too few points were read both ways.
    pub fn of(calibration: &Calibration) -> Option<Self> {
        let points = calibration.points().ok()?;
        let curve = calibration.curve.through(&points).ok()?;
        let (from, to) = curve.force_range();
        let unit = Self { half: Newtons(1.0), std_error: Newtons(0.0), range: (from.0, to.0) };
        let count = points.len() as f64;
        let row = |(place, point): (usize, &CalibrationPoint)| {
            let apart = point.hysteresis()?.0;
            let loading = curve.sensitivity_at(point.newtons) * unit.share_at(point.newtons.0);
            Some([-2.0 * loading, 1.0 - (place as f64 + 0.5) / count, apart])
        };
        let rows: Vec<[f64; 3]> = points.iter().enumerate().filter_map(row).collect();
        if rows.len() < POINTS_MIN {
            return None;
        }
        let sum = |i: usize, j: usize| rows.iter().map(|row| row[i] * row[j]).sum::<f64>();
        let [aa, ab, bb, ay, by] = [sum(0, 0), sum(0, 1), sum(1, 1), sum(0, 2), sum(1, 2)];
        let determinant = aa * bb - ab * ab;
        let half = (bb * ay - ab * by) / determinant;
        let drift = (aa * by - ab * ay) / determinant;
        let miss = |[a, b, y]: &[f64; 3]| (y - half * a - drift * b).powi(2);
        let variance = rows.iter().map(miss).sum::<f64>() / (rows.len() - 2) as f64;
        let std_error = (variance * bb / determinant).sqrt();
        let found = Self { half: Newtons(half), std_error: Newtons(std_error), ..unit };
        (half.is_finite() && std_error.is_finite()).then_some(found)
    }
}
