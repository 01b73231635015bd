//! Kinds of calibration curves.

use super::curve::CalibrationCurve;
use super::document::CalibrationPoint;
use super::error::CalibrationError;
use serde::{Deserialize, Serialize};
use std::fmt;

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase")]
pub enum CurveKind {
    /// Monotone cubic pieces through every point.
    #[default]
    Monotone,
    /// Straight lines from point to point of some.
    Segments {
        /// The masses in g through which they go, the first and the last among them.
        through_g: Vec<f64>,
    },
    /// A polynomial by least squares.
    Polynomial {
        /// Its degree, 1 to 5.
        degree: usize,
    },
}

impl fmt::Display for CurveKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Monotone => write!(f, "monotone interpolation"),
            Self::Segments { through_g } => match through_g.len().saturating_sub(1) {
                1 => write!(f, "1 straight segment"),
                count => write!(f, "{count} straight segments"),
            },
            Self::Polynomial { degree } => write!(f, "polynomial of degree {degree}"),
        }
    }
}

impl CurveKind {
    /// Whether the curve goes through every one of these points.
    pub fn meets_all(&self, points: &[CalibrationPoint]) -> bool {
        match self {
            Self::Monotone => true,
            Self::Segments { through_g } => through_g.len() == points.len(),
            Self::Polynomial { .. } => false,
        }
    }

    /// The curve of this kind for points in order of increasing mass.
    pub fn through(
        &self,
        points: &[CalibrationPoint],
    ) -> Result<CalibrationCurve, CalibrationError> {
        let pairs = |points: &mut dyn Iterator<Item = &CalibrationPoint>| -> Vec<(f64, f64)> {
            points.map(|point| (point.newtons.0, point.volts.0)).collect()
        };
        match self {
            Self::Monotone => {
                check_rise(points.iter().enumerate())?;
                Ok(CalibrationCurve::through(&pairs(&mut points.iter())))
            }
            Self::Segments { through_g } => {
                let breaks = break_indices(points, through_g).ok_or_else(|| {
                    CalibrationError::NoSuchBreak { through_g: through_g.clone() }
                })?;
                check_rise(breaks.iter().map(|&i| (i, &points[i])))?;
                Ok(CalibrationCurve::straight(&pairs(&mut breaks.iter().map(|&i| &points[i]))))
            }
            &Self::Polynomial { degree } => {
                CalibrationCurve::polynomial(&pairs(&mut points.iter()), degree)
                    .ok_or(CalibrationError::NotRising { degree, points: points.len() })
            }
        }
    }

    /// So many straight segments through those points from which all others lie nearest, by the sum of
    /// squared voltages; dynamic programming (Bellman, Commun. ACM 4 (1961) 284). `None` for more segments
    /// than there are intervals.
    #[must_use]
    pub fn best_segments(points: &[CalibrationPoint], count: usize) -> Option<Self> {
        let last = points.len().checked_sub(1)?;
        if count == 0 || count > last {
            return None;
        }
        // best[j] = the least sum from the first point to j, and where the last segment begins.
        let mut best: Vec<f64> = (0..=last).map(|j| miss(points, 0, j)).collect();
        let mut begins: Vec<Vec<usize>> = Vec::with_capacity(count);
        for _ in 1..count {
            let mut next = vec![f64::INFINITY; last + 1];
            let mut from = vec![0; last + 1];
            for j in 1..=last {
                for (i, so_far) in best[..j].iter().enumerate().skip(1) {
                    let sum = so_far + miss(points, i, j);
                    if sum < next[j] {
                        (next[j], from[j]) = (sum, i);
                    }
                }
            }
            best = next;
            begins.push(from);
        }
        let mut through = vec![last];
        for from in begins.iter().rev() {
            through.push(from[through[through.len() - 1]]);
        }
        through.push(0);
        let masses = through.iter().rev().map(|&i| points[i].mass_g);
        Some(Self::Segments { through_g: masses.collect() })
    }
}

/// Squared distance in V of the points between two from the line through them; infinite where the line
/// does not rise.
fn miss(points: &[CalibrationPoint], i: usize, j: usize) -> f64 {
    let (a, b) = (&points[i], &points[j]);
    let slope = (b.volts.0 - a.volts.0) / (b.newtons.0 - a.newtons.0);
    if i == j || slope <= 0.0 {
        return f64::INFINITY;
    }
    let line = |point: &CalibrationPoint| a.volts.0 + slope * (point.newtons.0 - a.newtons.0);
    let between = points[i + 1..j].iter();
    between.map(|point| (point.volts.0 - line(point)).powi(2)).sum()
}

/// Which points have these masses: in order, from the first to the last.
fn break_indices(points: &[CalibrationPoint], through_g: &[f64]) -> Option<Vec<usize>> {
    let near =
        |point: &CalibrationPoint, mass: f64| (point.mass_g - mass).abs() <= 1e-6 * (1.0 + mass);
    let place = |&mass: &f64| points.iter().position(|point| near(point, mass));
    let breaks: Vec<usize> = through_g.iter().map(place).collect::<Option<_>>()?;
    let is_whole = breaks.first() == Some(&0) && breaks.last() == Some(&(points.len() - 1));
    (is_whole && breaks.is_sorted_by(|a, b| a < b)).then_some(breaks)
}

/// The signal must rise from each point to the next.
fn check_rise<'a>(
    points: impl Iterator<Item = (usize, &'a CalibrationPoint)>,
) -> Result<(), CalibrationError> {
    let mut before: Option<f64> = None;
    for (index, point) in points {
        let volts = point.volts.0;
        if let Some(before_volts) = before.filter(|before| volts <= *before) {
            return Err(CalibrationError::VoltsNotIncreasing {
                step: index + 1,
                volts,
                before_volts,
            });
        }
        before = Some(volts);
    }
    Ok(())
}
