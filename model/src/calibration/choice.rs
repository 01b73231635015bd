//! Which kind of curve predicts a weight that it was not fitted to.
//!
//! Each weight between the ends is left out in turn, with all its repeats in both directions; the curve through
//! the others reads its force (leave-one-out cross-validation, Stone, J. R. Stat. Soc. B 36 (1974) 111-147). The
//! first and the last weight are left out as well, but there the curve is only continued straight: that
//! error is reported separately and does not count.

use super::curve::CalibrationCurve;
use super::document::CalibrationPoint;
use super::kind::CurveKind;
use super::quality::{TaredCurve, rms};
use serde::Serialize;

/// Straight segments are tried up to this many; the thesis drew "a few".
const SEGMENTS_MAX: usize = 6;
/// Degrees tried.
const DEGREES: std::ops::RangeInclusive<usize> = 1..=super::curve::DEGREE_MAX;

/// One kind of curve and what it misses.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveCandidate {
    pub curve: CurveKind,
    pub name: String,
    /// Root mean square error in N of the forces read for weights left out between the ends.
    pub left_out_rms_n: Option<f64>,
    /// The largest of them in N, with its sign.
    pub left_out_worst_n: Option<f64>,
    /// Root mean square error in N where the first or the last weight is left out.
    pub left_out_ends_rms_n: Option<f64>,
    /// Read minus true force in N at each weight, all weights known to the curve.
    pub residuals_n: Vec<f64>,
    /// The same as signal in V: curve minus mean reading.
    pub residuals_v: Vec<f64>,
    /// Why it cannot be used, if so.
    pub refused: Option<String>,
}

enum Recipe {
    Fixed(CurveKind),
    Segments(usize),
}

impl Recipe {
    fn of(kind: &CurveKind) -> Self {
        match kind {
            CurveKind::Segments { through_g } => Self::Segments(through_g.len().saturating_sub(1)),
            _ => Self::Fixed(kind.clone()),
        }
    }

    /// The curve without one of the points, and the other points.
    fn curve_without(
        &self,
        points: &[CalibrationPoint],
        index: usize,
    ) -> Option<(CalibrationCurve, Vec<CalibrationPoint>)> {
        let mut others = points.to_vec();
        others.remove(index);
        let curve = self.kind(&others)?.through(&others).ok()?;
        Some((curve, others))
    }

    /// The kind as this recipe makes it of these points.
    fn kind(&self, points: &[CalibrationPoint]) -> Option<CurveKind> {
        match self {
            Self::Fixed(kind) => Some(kind.clone()),
            // With a weight less there may be a segment less.
            Self::Segments(count) => {
                CurveKind::best_segments(points, (*count).min(points.len() - 1))
            }
        }
    }
}

/// Every kind tried, the best first; those that cannot be used come last. The first one counts as chosen.
///
/// With fewer than four weights nothing can be compared, and the monotone curve stands alone.
#[must_use]
pub fn curve_candidates(points: &[CalibrationPoint]) -> Vec<CurveCandidate> {
    let mut recipes = vec![Recipe::Fixed(CurveKind::Monotone)];
    if points.len() >= 4 {
        let all = points.len() - 1;
        recipes.extend((1..=SEGMENTS_MAX.min(all)).map(Recipe::Segments));
        if all > SEGMENTS_MAX {
            recipes.push(Recipe::Segments(all));
        }
        recipes.extend(DEGREES.map(|degree| Recipe::Fixed(CurveKind::Polynomial { degree })));
    }
    let judged = recipes.iter().filter_map(|recipe| judge(recipe, points));
    let mut candidates: Vec<CurveCandidate> = judged.collect();
    let score = |one: &CurveCandidate| one.left_out_rms_n.unwrap_or(f64::INFINITY);
    candidates.sort_by(|a, b| {
        let unusable = |one: &CurveCandidate| one.refused.is_some();
        let order = unusable(a).cmp(&unusable(b));
        order.then(score(a).total_cmp(&score(b)))
    });
    candidates
}

/// Errors of a given kind of curve at these points.
#[must_use]
pub fn assess_curve_kind(kind: &CurveKind, points: &[CalibrationPoint]) -> Option<CurveCandidate> {
    judge_as(kind.clone(), &Recipe::of(kind), points)
}

fn judge(recipe: &Recipe, points: &[CalibrationPoint]) -> Option<CurveCandidate> {
    judge_as(recipe.kind(points)?, recipe, points)
}

fn judge_as(
    kind: CurveKind,
    recipe: &Recipe,
    points: &[CalibrationPoint],
) -> Option<CurveCandidate> {
    let mut candidate = CurveCandidate {
        name: kind.to_string(),
        curve: kind,
        left_out_rms_n: None,
        left_out_worst_n: None,
        left_out_ends_rms_n: None,
        residuals_n: Vec::new(),
        residuals_v: Vec::new(),
        refused: None,
    };
    let curve = match candidate.curve.through(points) {
        Ok(curve) => curve,
        Err(refusal) => {
            candidate.refused = Some(refusal.to_string());
            return Some(candidate);
        }
    };
    let zeroed = TaredCurve::of(&curve, points);
    for point in points {
        candidate.residuals_n.push(zeroed.force(point.volts).0 - point.newtons.0);
        candidate.residuals_v.push(zeroed.signal(point.newtons).0 - point.volts.0);
    }
    match left_out(recipe, points) {
        Ok(errors) => {
            let ends = [0, points.len() - 1];
            let (outer, inner): (Vec<_>, Vec<_>) =
                errors.into_iter().partition(|(i, _)| ends.contains(i));
            let values = |errors: Vec<(usize, f64)>| errors.into_iter().map(|(_, error)| error);
            let inner: Vec<f64> = values(inner).collect();
            candidate.left_out_rms_n = rms(inner.iter().copied());
            candidate.left_out_worst_n =
                inner.into_iter().max_by(|a, b| a.abs().total_cmp(&b.abs()));
            candidate.left_out_ends_rms_n = rms(values(outer));
        }
        Err(reason) => candidate.refused = Some(reason),
    }
    Some(candidate)
}

/// Errors in N of every reading with its weight left out, with the index of the weight. The zero of the
/// empty cell is known in any case, as it is from the tare.
fn left_out(recipe: &Recipe, points: &[CalibrationPoint]) -> Result<Vec<(usize, f64)>, String> {
    let mut errors = Vec::new();
    if points.len() < 3 {
        return Ok(errors);
    }
    for (i, out) in points.iter().enumerate() {
        let is_end = i == 0 || i == points.len() - 1;
        let (curve, others) = match recipe.curve_without(points, i) {
            Some(found) => found,
            None if is_end => continue,
            None => {
                return Err(format!(
                    "the curve without the weight of {} g does not rise everywhere",
                    out.mass_g
                ));
            }
        };
        let zeroed = TaredCurve::of(&curve, &others);
        let error = |volts| zeroed.force(volts).0 - out.newtons.0;
        errors.extend(out.readings.iter().map(|reading| (i, error(reading.volts))));
    }
    Ok(errors)
}

/// Errors in V at each weight with it left out, the mean of its readings; `None` at the ends and where the
/// others make no curve.
pub(super) fn left_out_volts(kind: &CurveKind, points: &[CalibrationPoint]) -> Vec<Option<f64>> {
    let recipe = Recipe::of(kind);
    let error = |i: usize| {
        if i == 0 || i + 1 == points.len() || points.len() < 3 {
            return None;
        }
        let (curve, others) = recipe.curve_without(points, i)?;
        let signal = TaredCurve::of(&curve, &others).signal(points[i].newtons);
        Some(signal.0 - points[i].volts.0)
    };
    (0..points.len()).map(error).collect()
}
