//! Whether the record can tell the parameters apart at all.
//!
//! Judged on the path behind the measured depth, not on the measured depth: one ramp at constant
//! speed cannot separate `mu1` from `tau_sig` (the filtered drive is exactly speed times the
//! filtered depth), but read in 15-micrometre stairs its design looks healthy and the fit is wrong
//! by forty of its own standard deviations. So the depth is first redrawn with as few straight
//! pieces as stay within a tolerance, which removes stairs and noise and keeps ramps and holds.

use super::options::{LINEAR, LINEAR_COUNT, PARAMETER_NAMES, TAU};
use super::problem::{Outer, Problem, Scaled, product};
use super::sample::{FitError, FitSample};
use super::triangle::Triangle;
use crate::units::Depth;

/// A scaled design worse than this does not separate its parameters. Real protocols lie between
/// 20 and 1e4, a single ramp redrawn as one straight piece above 1e10.
const CONDITION_MAX: f64 = 1e6;
/// Parameters with at least this share of the largest entry belong to the blind combination.
const NAMED_SHARE: f64 = 0.2;
/// Tolerance of redrawing, as a share of the greatest depth.
const TOLERANCE_SHARE: f64 = 0.002;
/// The tolerance grows to the height of measured stairs, but not beyond this share.
const TOLERANCE_SHARE_MAX: f64 = 0.01;

/// Refuses if the linear parameters (and `log tau`, given coefficients to differentiate at)
/// cannot be told apart on the redrawn path.
pub(super) fn check(
    problem: &Problem<'_>,
    redrawn: &[FitSample],
    options_free: &[usize],
    outer: Outer,
    at: Option<&Scaled>,
) -> Result<(), FitError> {
    let path = problem.on(redrawn);
    let mut names: Vec<&str> = options_free
        .iter()
        .filter(|&&k| (LINEAR..LINEAR + LINEAR_COUNT).contains(&k))
        .map(|&k| PARAMETER_NAMES[k])
        .collect();
    let linear: Vec<usize> = options_free
        .iter()
        .filter_map(|&k| k.checked_sub(LINEAR).filter(|&k| k < LINEAR_COUNT))
        .collect();
    let with_tau = at.filter(|_| options_free.contains(&TAU));
    if with_tau.is_some() {
        names.push(PARAMETER_NAMES[TAU]);
    }
    let width = names.len();
    let mut triangle = Triangle::new(width + 1);
    let mut row = [0.0; LINEAR_COUNT + 2];
    path.visit(outer, |sample, columns| {
        let values = columns.row();
        for (slot, &k) in row.iter_mut().zip(&linear) {
            *slot = values[k];
        }
        if let Some(at) = with_tau {
            row[width - 1] = product(&columns.tau_row(), at);
        }
        triangle.push(&row[..=width], path.weight(sample));
    });
    let (condition, blind) = triangle.finish().condition(width);
    if condition < CONDITION_MAX {
        return Ok(());
    }
    let largest = blind
        .iter()
        .fold(0.0, |max: f64, value| max.max(value.abs()));
    let names: Vec<String> = names
        .iter()
        .zip(&blind)
        .filter(|(_, value)| value.abs() >= NAMED_SHARE * largest)
        .map(|(name, _)| (*name).to_owned())
        .collect();
    let advice = if names == ["mu1", "tau_sig"] {
        "the depth moves at one speed only; add a hold of about 5 tau or a second speed"
    } else {
        "along this path they change the force in the same way; add a hold of about 5 tau or a \
         second speed, or fix one of them"
    };
    Err(FitError::Inseparable {
        names,
        advice: advice.to_owned(),
    })
}

/// The samples with their depth redrawn: straight pieces, each as long as all its samples stay
/// within the tolerance (a cone of slopes from its start, narrowed sample by sample).
pub(super) fn redraw(samples: &[FitSample], depth_scale: f64) -> Vec<FitSample> {
    let tolerance = tolerance(samples, depth_scale);
    let mut redrawn = samples.to_vec();
    let (mut anchor, mut level) = (0, samples[0].depth.0);
    let mut cone = (f64::NEG_INFINITY, f64::INFINITY);
    let mut index = 1;
    while index < samples.len() {
        let run = samples[index].t.0 - samples[anchor].t.0;
        let rise = samples[index].depth.0 - level;
        let narrowed = (
            cone.0.max((rise - tolerance) / run),
            cone.1.min((rise + tolerance) / run),
        );
        if narrowed.0 <= narrowed.1 {
            cone = narrowed;
            index += 1;
            if index < samples.len() {
                continue;
            }
        }
        // The piece ends at the sample before `index`.
        let slope = 0.5 * (cone.0 + cone.1);
        let start = samples[anchor].t.0;
        for sample in &mut redrawn[anchor..index] {
            sample.depth = Depth(level + slope * (sample.t.0 - start));
        }
        anchor = index - 1;
        level = redrawn[anchor].depth.0;
        cone = (f64::NEG_INFINITY, f64::INFINITY);
    }
    redrawn
}

fn tolerance(samples: &[FitSample], depth_scale: f64) -> f64 {
    let mut moves: Vec<f64> = samples
        .windows(2)
        .map(|pair| (pair[1].depth.0 - pair[0].depth.0).abs())
        .filter(|&step| step > 0.0)
        .collect();
    let stair = if moves.is_empty() {
        0.0
    } else {
        let middle = moves.len() / 2;
        *moves.select_nth_unstable_by(middle, f64::total_cmp).1
    };
    (1.5 * stair)
        .max(TOLERANCE_SHARE * depth_scale)
        .min(TOLERANCE_SHARE_MAX * depth_scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::{Newtons, Seconds};

    #[test]
    fn stairs_become_a_ramp_and_corners_stay() {
        let samples: Vec<FitSample> = (0..=6000)
            .map(|i| {
                let t = f64::from(i) * 1e-2;
                let path = (0.75 * t).min(30.0);
                FitSample {
                    t: Seconds(t),
                    depth: Depth((path / 0.015).floor() * 0.015),
                    force: Newtons(0.0),
                    sigma: Newtons(1.0),
                }
            })
            .collect();
        let redrawn = redraw(&samples, 30.0);
        let mut bends = 0;
        for triple in redrawn.windows(3) {
            let bend = triple[2].depth.0 - 2.0 * triple[1].depth.0 + triple[0].depth.0;
            bends += u32::from(bend.abs() > 1e-9);
        }
        assert!((1..=3).contains(&bends), "{bends}");
        for (old, new) in samples.iter().zip(&redrawn) {
            assert!((old.depth.0 - new.depth.0).abs() < 0.0601);
        }
    }
}
