//! Damped Gauss-Newton on the outer parameters (Levenberg 1944, Marquardt 1963), the linear unknowns
//! projected out.

use super::super::triangle::{Factor, Triangle};
use super::problem::{Problem, Rows};

/// Longest single step in search coordinates, a factor of e.
const STEP_MAX: f64 = 1.0;
/// A step below this is the last.
const STEP_MIN: f64 = 1e-9;
/// So is one that gains less than this share of the sum of squares: a thousandth of the share a single
/// sample has in a long record.
const GAIN_MIN: f64 = 1e-9;
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

/// The place at `z`; `None` where the body has no finite force.
pub(super) fn place(problem: &Problem<'_>, z: &[f64], rows: Rows) -> Option<Place> {
    let factor = problem.values(z, rows)?;
    let linear = problem.linear();
    let solution = factor.solve(linear);
    let sum = factor.residual_sum(linear);
    let is_finite = sum.is_finite() && solution.iter().all(|value| value.is_finite());
    is_finite.then(|| Place {
        z: z.to_vec(),
        solution,
        sum,
        is_converged: problem.outers() == 0,
    })
}

/// Follows a start down to its valley's floor.
pub(super) fn descend(problem: &Problem<'_>, start: Place, rows: Rows) -> Place {
    let mut here = start;
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
        let step = step(problem, known, damping);
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
                let is_last = moved < STEP_MIN || (gain < GAIN_MIN && damping < 1e-2);
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

/// The damped step of the outer parameters; zero where it is not determined.
fn step(problem: &Problem<'_>, factor: &Factor, damping: f64) -> Vec<f64> {
    let (linear, outers) = (problem.linear(), problem.outers());
    let mut triangle = Triangle::new(outers + 1);
    let mut sizes = vec![0.0f64; outers];
    for i in linear..factor.width() {
        let row = &factor.row(i)[linear..];
        triangle.push(row, 1.0);
        for (size, value) in sizes.iter_mut().zip(row) {
            *size += value * value;
        }
    }
    // Along a direction that the linear unknowns make up for nothing is left; the largest of the
    // others still bounds the step.
    let largest = sizes.iter().fold(0.0f64, |all, size| all.max(*size));
    for (i, size) in sizes.iter().enumerate() {
        let mut row = vec![0.0; outers + 1];
        row[i] = (damping * size.max(1e-12 * largest)).sqrt();
        triangle.push(&row, 1.0);
    }
    let step = triangle.finish().solve(outers);
    if step.iter().all(|value| value.is_finite()) {
        step
    } else {
        vec![0.0; outers]
    }
}
