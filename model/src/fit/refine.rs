//! Gauss-Newton on the projected problem (Kaufman, BIT 15 (1975) 49-57), on all samples.

use super::problem::{Outer, Problem, Scaled};
use super::scan::Start;
use super::triangle::Factor;

/// Steps of the outer parameters below this end the iteration.
const STEP_MIN: f64 = 1e-12;
/// Iterations and step halvings together.
const PASSES_MAX: usize = 60;
/// Longest single step of `ln tau` and of the scaled contact.
const STEP_MAX: [f64; 2] = [1.0, 0.08];
/// Rounding level of a sum of squares, relative to that of the forces.
const ROUNDING: f64 = 1e-26;

/// Where the outer parameters may go.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ranges {
    pub log_tau: (f64, f64),
    /// Scaled.
    pub contact: (f64, f64),
}

/// The end of the iteration.
#[derive(Clone, Debug)]
pub(super) struct Refined {
    pub outer: Outer,
    pub scaled: Scaled,
    /// Triangle at the end: free columns, free outer parameters, force.
    pub factor: Factor,
    /// Weighted sum of squares left.
    pub sum: f64,
    pub is_converged: bool,
}

/// Follows a start to the minimum of the weighted sum of squares.
pub(super) fn refine(problem: &Problem<'_>, start: &Start, ranges: Ranges) -> Refined {
    let free = problem.basis.len();
    let all = free + problem.outer_free();
    let mut outer = start.outer;
    let mut scaled = start.scaled;
    let mut best: Option<Refined> = None;
    // The step that led from the best point to the present one.
    let mut step: [f64; 2] = [0.0; 2];
    for _ in 0..PASSES_MAX {
        let factor = problem.exact_factor(outer, &scaled);
        let sum = factor.residual_sum(free);
        let solution = factor.solve(all);
        let is_usable = sum.is_finite() && solution.iter().all(|value| value.is_finite());
        if let Some(best) = &mut best {
            let allowed = best.sum * (1.0 + 1e-10) + ROUNDING * factor.residual_sum(0);
            if !is_usable || sum > allowed {
                step = [0.5 * step[0], 0.5 * step[1]];
                if step[0].abs().max(step[1].abs()) < STEP_MIN {
                    best.is_converged = true;
                    break;
                }
                outer = moved(best.outer, step, ranges);
                continue;
            }
        } else if !is_usable {
            return Refined {
                outer,
                scaled,
                factor,
                sum,
                is_converged: false,
            };
        }
        let mut outer_step = solution[free..].iter();
        let mut next = |is_free: bool, max: f64| -> f64 {
            let wanted = if is_free { outer_step.next() } else { None };
            wanted.copied().unwrap_or(0.0).clamp(-max, max)
        };
        let wanted = [
            next(problem.fixed_tau.is_none(), STEP_MAX[0]),
            next(problem.fixed_contact.is_none(), STEP_MAX[1]),
        ];
        let target = moved(outer, wanted, ranges);
        step = [
            target.log_tau - outer.log_tau,
            target.contact - outer.contact,
        ];
        let is_converged = step[0].abs().max(step[1].abs()) < STEP_MIN;
        // The derivative columns were taken at the coefficients of the point before; with them
        // renewed at this point the iteration converges as if they were exact.
        scaled = problem.scaled(&factor.solve(free));
        best = Some(Refined {
            outer,
            scaled,
            factor,
            sum,
            is_converged,
        });
        if is_converged {
            break;
        }
        outer = target;
    }
    best.unwrap_or_else(|| Refined {
        outer,
        scaled,
        factor: problem.exact_factor(outer, &scaled),
        sum: f64::NAN,
        is_converged: false,
    })
}

fn moved(from: Outer, step: [f64; 2], ranges: Ranges) -> Outer {
    // A fixed value may lie outside the searched range.
    let within = |from: f64, step: f64, (low, high): (f64, f64)| {
        if step == 0.0 {
            from
        } else {
            (from + step).clamp(low, high)
        }
    };
    Outer {
        log_tau: within(from.log_tau, step[0], ranges.log_tau),
        contact: within(from.contact, step[1], ranges.contact),
    }
}
