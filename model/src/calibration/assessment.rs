//! Whether a calibration is good enough to be kept.

use super::CalibrationError;
use super::document::Calibration;
use super::quality::PointQuality;
use super::uncertainty::{ForceUncertainty, UncertaintyTerm};
use crate::assessment::{Assessment, QualityCheck, QualityRank, rank_of};
use crate::units::Newtons;

/// The curve may be uncertain between two weights by so much of the highest force: the error that ASTM E4 allows a testing
/// machine. Beyond it a person should look.
const CURVE_SHARE: f64 = 0.01;
/// Beyond this the coverage interval of a force (twice its standard uncertainty) is a tenth of the range: that is no
/// measurement. The nine weights of the thesis leave 3.5 % in the flat stretch of its cell, two weights 14 %.
const CURVE_SHARE_MAX: f64 = 0.05;
/// Fewer weights tell no curve: ASTM E4 (10.2) verifies a range of forces with five at least. Leaving one out of fewer tells
/// little either: two left out may be met by chance.
const WEIGHTS_MIN: usize = 5;
/// Weights may be so far apart, as a share of the highest force (ASTM E4, 10.2).
const GAP_SHARE: f64 = 1.0 / 3.0;
/// A curve may miss the mean of a weight's readings by so many standard uncertainties of a force there, and one more is bad.
const RESIDUAL_SIGMAS: f64 = 2.0;
/// The empty cell may have moved by so much of the highest force: the zero error of class 2 of ISO 376. Ten times as much,
/// the error that ASTM E4 allows the force itself, is bad.
const ZERO_SHARE: f64 = 1e-3;
/// Forces are compared in plain floating point.
const ROUNDING: f64 = 1e-9;

impl Calibration {
    /// The checks to make before a calibration is kept. `expected` is the highest force that the next protocol is expected to
    /// reach, where that is known.
    pub fn assess(&self, expected: Option<Newtons>) -> Result<Assessment, CalibrationError> {
        let quality = self.quality()?;
        let uncertainty = ForceUncertainty::of(self)?;
        let mut checks = vec![
            weights(&quality.points),
            curve(&quality.points, &uncertainty),
            residuals(&quality.points),
            zero(quality.zero_shift_n, quality.force_max_n),
            components(&uncertainty),
        ];
        checks.extend(expected.map(|expected| range(quality.force_max_n, expected)));
        Ok(Assessment { checks })
    }
}

/// Whether there are enough weights for any curve, and near enough to each other.
fn weights(points: &[PointQuality]) -> QualityCheck {
    let of = |rank, words: String| QualityCheck::new("weights", rank, words);
    let count = points.iter().filter(|point| point.mass_g > 0.0).count();
    let highest = points.last().map_or(0.0, |point| point.force_n);
    if count < WEIGHTS_MIN {
        let words = format!(
            "{count} weights are too few to tell the curve of a load cell; calibrate with {WEIGHTS_MIN} and more"
        );
        return of(QualityRank::Bad, words);
    }
    let gap = points.windows(2).map(|pair| pair[1].force_n - pair[0].force_n).fold(0.0, f64::max);
    let share = gap / highest;
    let advice = if share > GAP_SHARE { "; put another weight between them" } else { "" };
    let words = format!(
        "{count} weights, the furthest two apart by {:.0} % of the highest force{advice}",
        100.0 * share
    );
    of(rank_of(share, GAP_SHARE, f64::INFINITY), words)
}

/// Whether the curve is known between the weights.
fn curve(points: &[PointQuality], uncertainty: &ForceUncertainty) -> QualityCheck {
    let of = |rank, words: String| QualityCheck::new("curve", rank, words);
    let highest = points.last().map_or(0.0, |point| point.force_n);
    let between = points.windows(2).map(|pair| 0.5 * (pair[0].force_n + pair[1].force_n));
    let errors = between.filter_map(|force| {
        let sigma = uncertainty.term_sigma(UncertaintyTerm::Interpolation, Newtons(force))?;
        Some((force, sigma.0))
    });
    let Some((at, worst)) = errors.max_by(|one, other| one.1.total_cmp(&other.1)) else {
        let words = "no weight can be left out to tell how far the curve is off between them";
        return of(QualityRank::NotJudged, words.into());
    };
    let share = worst / highest;
    let rank = rank_of(share, CURVE_SHARE, CURVE_SHARE_MAX);
    let advice = match rank {
        QualityRank::Good => "",
        _ => "; calibrate with more weights around that force",
    };
    of(
        rank,
        format!(
            "between two weights, at {at:.2} N, the curve has a standard uncertainty of {worst:.2} N, {:.1} % of the highest force{advice}",
            100.0 * share
        ),
    )
}

/// Whether the curve meets its weights to within the uncertainty.
fn residuals(points: &[PointQuality]) -> QualityCheck {
    let of = |rank, words: String| QualityCheck::new("residuals", rank, words);
    let known = points.iter().filter_map(|point| {
        let sigma = point.uncertainty_n?.max(ROUNDING);
        Some((point, point.residual_n.abs() / sigma))
    });
    let worst = known.max_by(|one, other| one.1.total_cmp(&other.1));
    let Some((point, ratio)) = worst else {
        let words = "the calibration states no errors to compare its residuals with";
        return of(QualityRank::NotJudged, words.into());
    };
    let rank = rank_of(ratio, RESIDUAL_SIGMAS, RESIDUAL_SIGMAS + 1.0);
    let advice = match rank {
        QualityRank::Good => "",
        _ => "; read that weight again, or choose another curve",
    };
    if point.residual_n.abs() < ROUNDING {
        return of(rank, "the curve passes through every weight".into());
    }
    of(
        rank,
        format!(
            "the curve misses its weights by at most {ratio:.1} standard uncertainties, {:.0} mN at {:.0} g{advice}",
            1e3 * point.residual_n.abs(),
            point.mass_g
        ),
    )
}

/// Whether the empty cell came back to its signal.
fn zero(shift: Option<f64>, highest: f64) -> QualityCheck {
    let of = |rank, words: String| QualityCheck::new("zero", rank, words);
    let Some(shift) = shift else {
        let words = "the empty cell was not read before and after the weights";
        return of(QualityRank::NotJudged, words.into());
    };
    let share = shift.abs() / highest;
    let rank = rank_of(share, ZERO_SHARE, 10.0 * ZERO_SHARE);
    let advice = match rank {
        QualityRank::Good => "",
        _ => "; let the load cell warm up and calibrate again",
    };
    let mn = 1e3 * shift.abs();
    of(
        rank,
        format!(
            "the zero moved by {mn:.1} mN, {:.2} % of the highest force{advice}",
            100.0 * share
        ),
    )
}

/// Whether all components of the uncertainty are known.
fn components(uncertainty: &ForceUncertainty) -> QualityCheck {
    let missing: Vec<&str> = uncertainty.not_stated().iter().map(|term| term.name()).collect();
    let of = |rank, words: String| QualityCheck::new("components", rank, words);
    match missing.is_empty() {
        true => of(QualityRank::Good, "every component of the uncertainty is known".into()),
        false => of(
            QualityRank::Doubtful,
            format!("the uncertainty is too small by what is not known: {}", missing.join(", ")),
        ),
    }
}

/// Whether the weights reach as far as the next protocol is expected to.
fn range(highest: f64, expected: Newtons) -> QualityCheck {
    let of = |rank, words: String| QualityCheck::new("range", rank, words);
    if expected.0 > highest {
        let words = format!(
            "forces up to {expected:.1} are expected of the next protocol, but the heaviest weight is {highest:.2} N; calibrate with a heavier one"
        );
        return of(QualityRank::Doubtful, words);
    }
    let words = format!("weights up to {highest:.2} N cover the {expected:.1} that are expected");
    of(QualityRank::Good, words)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The thesis's table with these masses only, the empty cell included, and its best curve.
    fn thesis_with(masses: &[f64]) -> Calibration {
        let mut calibration = Calibration::thesis();
        calibration.steps.retain(|step| masses.contains(&step.mass_g));
        calibration.curve = calibration.best_curve().unwrap();
        calibration
    }

    fn rank(assessment: &Assessment, name: &str) -> QualityRank {
        assessment.checks.iter().find(|check| check.name == name).unwrap().rank
    }

    #[test]
    fn two_weights_are_too_few_for_a_cell_that_is_not_straight() {
        let all = Calibration::thesis().assess(Some(Newtons(10.0))).unwrap();
        // The flat stretch is known to 3.5 % of the range.
        assert_eq!(rank(&all, "curve"), QualityRank::Doubtful, "{}", all.text());
        assert_eq!(rank(&all, "range"), QualityRank::Good);
        assert_eq!(rank(&all, "weights"), QualityRank::Good);
        let two = thesis_with(&[0.0, 240.0, 540.0, 1040.0]).assess(Some(Newtons(10.5))).unwrap();
        assert_eq!(rank(&two, "curve"), QualityRank::Bad, "{}", two.text());
        assert_eq!(rank(&two, "range"), QualityRank::Doubtful);
        // These two lie on one line with the ends by chance.
        let lucky = thesis_with(&[0.0, 340.0, 840.0, 1040.0]).assess(None).unwrap();
        assert_eq!(rank(&lucky, "curve"), QualityRank::Good, "{}", lucky.text());
        assert_eq!(rank(&lucky, "weights"), QualityRank::Bad, "{}", lucky.text());
        let apart = thesis_with(&[0.0, 140.0, 240.0, 740.0, 840.0, 1040.0]).assess(None).unwrap();
        assert_eq!(rank(&apart, "weights"), QualityRank::Doubtful, "{}", apart.text());
    }
}
