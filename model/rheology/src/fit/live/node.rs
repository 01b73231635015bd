//! The linear problem at one relaxation time, from its sums of products.

use super::bank::COLUMNS;

/// A scaled pivot below this is rounding: the column is a combination of those before it.
const PIVOT_MIN: f64 = 1e-10;

const WIDTH: usize = COLUMNS + 1;

/// Which columns take part; one that depends on those before it is left out.
pub(super) type UsedColumns = [bool; COLUMNS];

#[derive(Clone, Copy, Debug)]
pub(super) struct Solution {
    /// Coefficients of the columns; zero for one left out.
    coefficients: [f64; COLUMNS],
    pub residual: f64,
    scale: [f64; WIDTH],
    factor: [[f64; WIDTH]; WIDTH],
    pub used: UsedColumns,
}

impl Solution {
    /// Cholesky on columns scaled to unit length. A column that depends on those before it is left
    /// out; if `needs_all`, there is then no solution.
    pub fn of(gram: &[[f64; WIDTH]; WIDTH], wanted: &UsedColumns, needs_all: bool) -> Option<Self> {
        let scale: [f64; WIDTH] = std::array::from_fn(|i| gram[i][i].sqrt());
        let mut used = *wanted;
        let mut factor = [[0.0; WIDTH]; WIDTH];
        for i in 0..WIDTH {
            if i < COLUMNS && !used[i] {
                continue;
            }
            for j in 0..=i {
                if j < COLUMNS && !used[j] {
                    continue;
                }
                let known: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
                let value = gram[i][j] / (scale[i] * scale[j]) - known;
                if i != j {
                    factor[i][j] = value / factor[j][j];
                } else if i == COLUMNS || value > PIVOT_MIN {
                    factor[i][i] = value.max(0.0).sqrt();
                } else if needs_all {
                    return None;
                } else {
                    // Also where the column is zero and its scaled length is not a number.
                    used[i] = false;
                    factor[i] = [0.0; WIDTH];
                }
            }
        }
        let mut coefficients = [0.0; COLUMNS];
        for i in (0..COLUMNS).rev().filter(|&i| used[i]) {
            let known: f64 = (i + 1..COLUMNS).map(|k| factor[k][i] * coefficients[k]).sum();
            coefficients[i] = (factor[COLUMNS][i] - known) / factor[i][i];
        }
        for (i, coefficient) in coefficients.iter_mut().enumerate().filter(|(i, _)| used[*i]) {
            *coefficient *= scale[COLUMNS] / scale[i];
        }
        let residual = (factor[COLUMNS][COLUMNS] * scale[COLUMNS]).powi(2);
        (residual.is_finite() && coefficients.iter().all(|value| value.is_finite()))
            .then_some(Self { coefficients, residual, scale, factor, used })
    }

    /// A combination of the coefficients.
    pub fn value(&self, combination: &[f64; COLUMNS]) -> f64 {
        let terms = combination.iter().zip(&self.coefficients);
        terms.map(|(share, coefficient)| share * coefficient).sum()
    }

    /// Variance of a combination of the coefficients, for residuals of unit variance: the squared
    /// length of `L^-1 combination`.
    pub fn variance(&self, combination: &[f64; COLUMNS]) -> f64 {
        let mut z = [0.0; COLUMNS];
        for k in (0..COLUMNS).filter(|&k| self.used[k]) {
            let known: f64 = (0..k).map(|m| self.factor[k][m] * z[m]).sum();
            z[k] = (combination[k] / self.scale[k] - known) / self.factor[k][k];
        }
        z.iter().map(|value| value * value).sum()
    }
}
