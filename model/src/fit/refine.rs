//! Gauss-Newton on the projected problem (Kaufman, BIT 15 (1975) 49-57), on all samples.

use super::options::{CONTACT, TAU};
use super::system::{Outer, Pass, Point, System};

/// A step of the outer parameters below this leaves its square: rounding, once it is taken.
const STEP_MIN: f64 = 1e-9;
/// Halving steps ends here.
const STEP_ZERO: f64 = 1e-13;
/// A step below this share of its standard error is the last. It is taken whole, and what it leaves
/// is its own square plus what Kaufman's simplification leaves under noise: with a contraction of
/// 1e-4 on the thesis protocol (and 1e-2 allowed for) less than a thousandth of a standard error.
const STEP_SHARE: f64 = 0.1;
/// But only where it is short enough for its square to be small.
const STEP_LONG: f64 = 1e-2;
/// Iterations and step halvings together.
const PASSES_MAX: usize = 60;
/// Longest single step of `ln tau` and of the scaled contact.
const STEP_MAX: [f64; 2] = [1.0, 0.08];
/// Rounding level of a sum of squares, relative to that of the forces.
const ROUNDING: f64 = 1e-26;

/// Where the outer parameters of a record may go.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ranges {
    pub log_tau: (f64, f64),
    /// Scaled.
    pub contact: (f64, f64),
}

/// The end of the iteration.
#[derive(Clone, Debug)]
pub(super) struct Refined {
    pub points: Vec<Point>,
    /// The triangles within one last small step of the end.
    pub pass: Pass,
    /// Weighted sum of squares left.
    pub sum: f64,
    pub is_converged: bool,
}

/// Follows a start to the minimum of the weighted sum of squares.
pub(super) fn refine(system: &System<'_>, start: &[Point], ranges: &[Ranges]) -> Refined {
    let (linear, all) = (system.linear, system.unknowns.len());
    let mut points = start.to_vec();
    let force_square = system.force_square();
    // The sum bends more sharply over the contact than over the relaxation time.
    let is_contact_free = system.fixed(CONTACT).is_none();
    let share = if is_contact_free { 0.01 } else { 1.0 } * STEP_SHARE;
    let mut best: Option<Refined> = None;
    // The step that led from the best point to the present one.
    let mut step = vec![0.0; all - linear];
    for _ in 0..PASSES_MAX {
        let pass = system.pass(&points);
        let sum = pass.joint.residual_sum(linear);
        let solution = pass.joint.solve(all);
        let is_usable = sum.is_finite() && solution.iter().all(|value| value.is_finite());
        if let Some(best) = &mut best {
            let allowed = best.sum * (1.0 + 1e-10) + ROUNDING * force_square;
            if !is_usable || sum > allowed {
                step.iter_mut().for_each(|step| *step *= 0.5);
                if length(&step) < STEP_ZERO {
                    best.is_converged = true;
                    break;
                }
                points = moved(system, &best.points, &step, ranges).0;
                continue;
            }
        } else if !is_usable {
            return Refined {
                points,
                pass,
                sum,
                is_converged: false,
            };
        }
        let wanted: Vec<f64> = solution[linear..]
            .iter()
            .zip(&system.unknowns[linear..])
            .map(|(step, unknown)| {
                let longest = STEP_MAX[usize::from(unknown.parameter == CONTACT)];
                step.clamp(-longest, longest)
            })
            .collect();
        let (mut target, taken) = moved(system, &points, &wanted, ranges);
        let is_whole = taken == solution[linear..];
        step = taken;
        // Coefficients that go with the step to first order; where it was cut short, those of here.
        let change_here = pass.joint.solve(linear);
        let change = if is_whole {
            &solution[..linear]
        } else {
            &change_here
        };
        for (record, point) in target.iter_mut().enumerate() {
            point.at = system.changed(record, &points[record].at, change);
        }
        // Of what the step leaves: without noise that is rounding, and the iteration goes on.
        let scatter =
            (pass.joint.residual_sum(all) / (system.measured() - all).max(1) as f64).sqrt();
        let is_lost_in_noise = step.iter().enumerate().all(|(i, step)| {
            let mut outer = vec![0.0; all];
            outer[linear + i] = 1.0;
            let error = pass.joint.deviation(&outer) * scatter;
            step.abs() < (share * error).min(STEP_LONG)
        });
        let is_last = is_lost_in_noise || length(&step) < STEP_MIN;
        let is_converged = length(&step) < STEP_ZERO || (is_whole && is_last);
        let mut here = std::mem::replace(&mut points, target);
        for (record, point) in here.iter_mut().enumerate() {
            point.at = system.changed(record, &point.at, &change_here);
        }
        best = Some(Refined {
            points: if is_converged { points.clone() } else { here },
            sum: if is_converged && is_whole {
                pass.joint.residual_sum(all)
            } else {
                sum
            },
            pass,
            is_converged,
        });
        if is_converged {
            break;
        }
    }
    best.unwrap_or_else(|| Refined {
        pass: system.pass(&points),
        points,
        sum: f64::NAN,
        is_converged: false,
    })
}

fn length(step: &[f64]) -> f64 {
    step.iter()
        .fold(0.0, |longest, step| longest.max(step.abs()))
}

/// The points after a step of the outer unknowns, and the step as far as the ranges allow it.
fn moved(
    system: &System<'_>,
    from: &[Point],
    step: &[f64],
    ranges: &[Ranges],
) -> (Vec<Point>, Vec<f64>) {
    // A fixed value may lie outside the searched range.
    let within = |from: f64, step: f64, (low, high): (f64, f64)| {
        if step == 0.0 {
            from
        } else {
            (from + step).clamp(low, high)
        }
    };
    let outer = &system.unknowns[system.linear..];
    let mut taken = step.to_vec();
    let points: Vec<Point> = from
        .iter()
        .enumerate()
        .map(|(record, point)| {
            let Outer {
                mut tau,
                mut contact,
            } = point.outer;
            for ((unknown, step), taken) in outer.iter().zip(step).zip(&mut taken) {
                if unknown.record.is_some_and(|own| own != record) {
                    continue;
                }
                if unknown.parameter == TAU {
                    let log_tau = tau.ln();
                    let allowed = within(log_tau, *step, ranges[record].log_tau);
                    if allowed != log_tau + step {
                        *taken = allowed - log_tau;
                    }
                    tau += tau * taken.exp_m1();
                } else {
                    let target = within(contact, *step, ranges[record].contact);
                    if target != contact + step {
                        *taken = target - contact;
                    }
                    contact = target;
                }
            }
            Point {
                outer: Outer { tau, contact },
                ..*point
            }
        })
        .collect();
    (points, taken)
}
