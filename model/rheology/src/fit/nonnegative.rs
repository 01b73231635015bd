//! Least squares with coefficients that must not be negative, and the relaxation times it finds.

use super::super::triangle::{Factor, Triangle};
use super::problem::{Problem, Rows};
use crate::families::{Drive, Relaxation};

/// Relaxation times of the grid from which a Prony series is grown: at least so many, and so many for
/// each factor of ten, since non-negative sums of neighbours closer than that cannot be told apart.
const GRID: (usize, f64) = (40, 6.0);

/// Coefficients of the columns of `factor` that fit its last column best, those marked not below
/// zero (Lawson & Hanson, "Solving Least Squares Problems", chapter 23).
pub(super) fn non_negative(factor: &Factor, is_bound: &[bool]) -> Vec<f64> {
    let columns = is_bound.len();
    let mut passive: Vec<bool> = is_bound.iter().map(|bound| !bound).collect();
    let mut solution = best(factor, &passive);
    // Each round frees or binds a column; three times their number is the authors' own limit.
    for _ in 0..3 * columns {
        let gradient = gradient(factor, &solution);
        let next = (0..columns)
            .filter(|&k| !passive[k])
            .max_by(|&a, &b| gradient[a].total_cmp(&gradient[b]));
        let Some(next) = next.filter(|&k| gradient[k] > 1e-10) else {
            break;
        };
        passive[next] = true;
        loop {
            let trial = best(factor, &passive);
            let blocking = (0..columns)
                .filter(|&k| is_bound[k] && passive[k] && trial[k] <= 0.0)
                .map(|k| (k, solution[k] / (solution[k] - trial[k])))
                .min_by(|a, b| a.1.total_cmp(&b.1));
            let Some((first, share)) = blocking else {
                solution = trial;
                break;
            };
            for (value, trial) in solution.iter_mut().zip(&trial) {
                *value += share.clamp(0.0, 1.0) * (trial - *value);
            }
            passive[first] = false;
            solution[first] = 0.0;
        }
    }
    solution
}

/// The unbounded solution over some columns, zero in the others.
fn best(factor: &Factor, passive: &[bool]) -> Vec<f64> {
    let chosen: Vec<usize> = (0..passive.len()).filter(|&k| passive[k]).collect();
    let last = factor.width() - 1;
    let mut triangle = Triangle::new(chosen.len() + 1);
    for i in 0..factor.width() {
        let row = factor.row(i);
        let mut small: Vec<f64> = chosen.iter().map(|&k| row[k]).collect();
        small.push(row[last]);
        triangle.push(&small, 1.0);
    }
    let found = triangle.finish().solve(chosen.len());
    let mut solution = vec![0.0; passive.len()];
    for (&k, value) in chosen.iter().zip(found) {
        solution[k] = value;
    }
    solution
}

/// How fast the fit improves with each column: correlation with what is left, relative to both sizes.
fn gradient(factor: &Factor, solution: &[f64]) -> Vec<f64> {
    let last = factor.width() - 1;
    let left: Vec<f64> = (0..factor.width())
        .map(|i| {
            let row = factor.row(i);
            let fitted: f64 = row.iter().zip(solution).map(|(a, b)| a * b).sum();
            row[last] - fitted
        })
        .collect();
    let force: f64 = (0..factor.width())
        .map(|i| factor.row(i)[last].powi(2))
        .sum();
    (0..solution.len())
        .map(|k| {
            let (mut along, mut size) = (0.0, 0.0);
            for (i, left) in left.iter().enumerate() {
                along += factor.row(i)[k] * left;
                size += factor.row(i)[k].powi(2);
            }
            along / (size * force).sqrt().max(f64::MIN_POSITIVE)
        })
        .collect()
}

/// Where a series of `terms` relaxation times may start, in search coordinates: a non-negative fit over a
/// dense grid of times, neighbours merged until so many are left.
pub(super) fn grown(problem: &Problem<'_>, terms: usize) -> Option<Vec<f64>> {
    let (low, high) = problem.ranges.first().copied()?;
    let spring = Drive::power(1, 1.0);
    let decades = (high - low) / std::f64::consts::LN_10;
    let grid = GRID.0.max((GRID.1 * decades).ceil() as usize);
    let log_taus: Vec<f64> = (0..grid)
        .map(|i| low + (high - low) * i as f64 / (grid - 1) as f64)
        .collect();
    let relaxing = log_taus
        .iter()
        .map(|log_tau| vec![Relaxation::maxwell(spring, log_tau.exp())]);
    let columns: Vec<Vec<Relaxation>> = std::iter::once(vec![Relaxation::spring(spring)])
        .chain(relaxing)
        .collect();
    let factor = problem.columns_factor(&columns, None, Rows::Thin)?;
    let is_bound: Vec<bool> = (0..factor.width() - 1).map(|k| k <= grid).collect();
    let solution = non_negative(&factor, &is_bound);
    // Weight and centre of each run of neighbours.
    let mut groups: Vec<(f64, f64)> = Vec::new();
    let mut is_running = false;
    for (log_tau, &weight) in log_taus.iter().zip(&solution[1..=grid]) {
        match groups.last_mut().filter(|_| is_running && weight > 0.0) {
            Some(group) => *group = merged(*group, (weight, *log_tau)),
            None if weight > 0.0 => groups.push((weight, *log_tau)),
            None => {}
        }
        is_running = weight > 0.0;
    }
    while groups.len() > terms {
        let cost = |i: usize| {
            let ((a, x), (b, y)) = (groups[i], groups[i + 1]);
            a * b / (a + b) * (y - x).powi(2)
        };
        let cheapest = (0..groups.len() - 1).min_by(|&i, &j| cost(i).total_cmp(&cost(j)))?;
        groups[cheapest] = merged(groups[cheapest], groups[cheapest + 1]);
        groups.remove(cheapest + 1);
    }
    let mut log_taus: Vec<f64> = groups.iter().map(|group| group.1).collect();
    if log_taus.is_empty() {
        log_taus.push(0.5 * (low + high));
    }
    // Too few: new ones go into the widest gaps between those found, where something relaxes; the ends of
    // the range count only beside a single one.
    while log_taus.len() < terms {
        let mut ends = log_taus.clone();
        if ends.len() == 1 {
            ends.insert(0, low);
            ends.push(high);
        }
        let widest = (0..ends.len() - 1)
            .max_by(|&i, &j| (ends[i + 1] - ends[i]).total_cmp(&(ends[j + 1] - ends[j])))?;
        log_taus.push(0.5 * (ends[widest] + ends[widest + 1]));
        log_taus.sort_by(f64::total_cmp);
    }
    Some(log_taus)
}

fn merged((a, x): (f64, f64), (b, y): (f64, f64)) -> (f64, f64) {
    (a + b, (a * x + b * y) / (a + b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bound_that_holds_and_one_that_does_not() {
        // y = 2 a - 1 b: with b bound at zero the best a is the projection of y on a.
        let rows = [[1.0, 1.0], [1.0, 0.0], [1.0, -0.5], [1.0, 2.0]];
        let mut triangle = Triangle::new(3);
        let (mut ay, mut aa) = (0.0, 0.0);
        for [a, b] in rows {
            let y = 2.0 * a - b;
            triangle.push(&[a, b, y], 1.0);
            ay += a * y;
            aa += a * a;
        }
        let factor = triangle.finish();
        let free = non_negative(&factor, &[false, false]);
        assert!((free[0] - 2.0).abs() < 1e-14 && (free[1] + 1.0).abs() < 1e-14);
        let bound = non_negative(&factor, &[true, true]);
        assert!((bound[0] - ay / aa).abs() < 1e-14, "{bound:?}");
        assert!(bound[1] == 0.0);
    }
}
