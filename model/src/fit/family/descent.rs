//! Damped Gauss-Newton on the outer parameters (Levenberg 1944, Marquardt 1963), the linear unknowns
//! projected out.

use super::super::triangle::{Factor, Triangle};
use super::nonnegative::non_negative;
use super::problem::{Problem, Rows};

/// Longest single step in search coordinates, a factor of e.
const STEP_MAX: f64 = 1.0;
/// A step below this is the last.
const STEP_MIN: f64 = 1e-9;
/// So is one that gains less than this share of the sum of squares: a thousandth of the share that one
/// sample has in a long record.
pub(super) const GAIN_EXACT: f64 = 1e-9;
/// The same where the parameters shall be right to a tenth of a standard error.
pub(super) const GAIN_THIN: f64 = 1e-6;
/// The same where valleys are compared.
pub(super) const GAIN_VALLEY: f64 = 1e-4;
/// Damping, relative to the size of the column, beyond which no step helps.
const DAMPING_MAX: f64 = 1e8;
/// Steps at most; each either lowers the sum or raises the damping tenfold.
const STEPS_MAX: usize = 80;

/// A place in the outer parameters and the best linear unknowns there.
#[derive(Clone, Debug)]
pub(super) struct Place {
    pub z: Vec<f64>,
    pub solution: Vec<f64>,
    /// Weighted sum of squares left.
    pub sum: f64,
    pub is_converged: bool,
}

/// The place at `z`, its coefficients within the family's bounds; `None` where the body has no finite
/// force.
pub(super) fn place(problem: &Problem<'_>, z: &[f64], rows: Rows) -> Option<Place> {
    let factor = problem.values(z, rows)?;
    let linear = problem.linear();
    let is_bound = |k: usize| k < problem.coefficients && problem.family.is_non_negative(k);
    let mut solution = factor.solve(linear);
    let mut sum = factor.residual_sum(linear);
    // Few places need it, and those that do are no better than the bounds allow.
    if solution
        .iter()
        .enumerate()
        .any(|(k, &value)| value < 0.0 && is_bound(k))
    {
        let bounds: Vec<bool> = (0..linear).map(is_bound).collect();
        solution = non_negative(&factor, &bounds);
        sum = factor.left_by(&solution);
    }
    let is_finite = sum.is_finite() && solution.iter().all(|value| value.is_finite());
    is_finite.then(|| Place {
        z: z.to_vec(),
        solution,
        sum,
        is_converged: problem.outers() == 0,
    })
}

/// Follows a start down to its valley's floor, until a step gains less than `gain_min`.
pub(super) fn descend(problem: &Problem<'_>, start: Place, rows: Rows, gain_min: f64) -> Place {
    let mut here = Place {
        is_converged: problem.outers() == 0,
        ..start
    };
    let mut damping = 1e-3;
    let mut factor = None;
    for _ in 0..STEPS_MAX {
        if here.is_converged {
            break;
        }
        if factor.is_none() {
            factor = problem.slopes(&here.z, &here.solution, rows);
        }
        let Some(known) = &factor else { break };
        let step = bounded_step(problem, known, damping, &here.z);
        let target: Vec<f64> = here
            .z
            .iter()
            .zip(&step)
            .zip(&problem.ranges)
            .map(|((z, step), (low, high))| {
                (z + step.clamp(-STEP_MAX, STEP_MAX)).clamp(*low, *high)
            })
            .collect();
        let moved = here
            .z
            .iter()
            .zip(&target)
            .fold(0.0f64, |longest, (a, b)| longest.max((a - b).abs()));
        match place(problem, &target, rows).filter(|there| there.sum <= here.sum) {
            Some(there) => {
                let gain = 1.0 - there.sum / here.sum;
                // A damped step may be short for being damped only.
                let is_last = moved < STEP_MIN || (gain < gain_min && damping < 1e-2);
                here = Place {
                    is_converged: is_last || there.sum == 0.0,
                    ..there
                };
                damping = (0.1 * damping).max(1e-12);
                factor = None;
            }
            None if moved < STEP_MIN || damping > DAMPING_MAX => here.is_converged = true,
            None => damping *= 10.0,
        }
    }
    here
}

/// The damped step, with the parameters held that it would push over the end of their range.
fn bounded_step(problem: &Problem<'_>, factor: &Factor, damping: f64, z: &[f64]) -> Vec<f64> {
    let mut is_held = vec![false; z.len()];
    loop {
        let step = step(problem, factor, damping, &is_held);
        let over = (0..z.len()).find(|&i| {
            let (low, high) = problem.ranges[i];
            (z[i] <= low && step[i] < 0.0) || (z[i] >= high && step[i] > 0.0)
        });
        match over {
            Some(index) => is_held[index] = true,
            None => return step,
        }
    }
}

/// The damped step of the outer parameters that are not held; zero where it is not determined.
fn step(problem: &Problem<'_>, factor: &Factor, damping: f64, is_held: &[bool]) -> Vec<f64> {
    let (linear, outers) = (problem.linear(), problem.outers());
    let mut triangle = Triangle::new(outers + 1);
    let mut sizes = vec![0.0f64; outers];
    let mut row = vec![0.0; outers + 1];
    for i in linear..factor.width() {
        row.copy_from_slice(&factor.row(i)[linear..]);
        for ((value, size), held) in row.iter_mut().zip(&mut sizes).zip(is_held) {
            if *held {
                *value = 0.0;
            }
            *size += *value * *value;
        }
        triangle.push(&row, 1.0);
    }
    // Along a direction that the linear unknowns make up for nothing is left; the largest of the
    // others still bounds the step.
    let largest = sizes.iter().fold(0.0f64, |all, size| all.max(*size));
    for (i, size) in sizes.iter().enumerate() {
        let mut row = vec![0.0; outers + 1];
        row[i] = match is_held[i] {
            true => 1.0,
            false => (damping * size.max(1e-12 * largest)).sqrt(),
        };
        triangle.push(&row, 1.0);
    }
    let step = triangle.finish().solve(outers);
    if step.iter().all(|value| value.is_finite()) {
        step
    } else {
        vec![0.0; outers]
    }
}
