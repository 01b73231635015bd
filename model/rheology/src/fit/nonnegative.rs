//! Least squares with coefficients that must not be negative.

use super::triangle::Factor;

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
    let found = factor.select_columns(&chosen).solve(chosen.len());
    let mut solution = vec![0.0; passive.len()];
    for (&k, value) in chosen.iter().zip(found) {
        solution[k] = value;
    }
    solution
}

/// How fast the fit improves with each column: correlation with what is left, relative to both sizes.
fn gradient(factor: &Factor, solution: &[f64]) -> Vec<f64> {
    let last = factor.width() - 1;
    let residual: Vec<f64> = (0..factor.width())
        .map(|i| {
            let row = factor.row(i);
            let fitted: f64 = row.iter().zip(solution).map(|(a, b)| a * b).sum();
            row[last] - fitted
        })
        .collect();
    let force: f64 = (0..factor.width()).map(|i| factor.row(i)[last].powi(2)).sum();
    (0..solution.len())
        .map(|k| {
            let (mut along, mut size) = (0.0, 0.0);
            for (i, residual) in residual.iter().enumerate() {
                along += factor.row(i)[k] * residual;
                size += factor.row(i)[k].powi(2);
            }
            along / (size * force).sqrt().max(f64::MIN_POSITIVE)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::triangle::Triangle;
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
