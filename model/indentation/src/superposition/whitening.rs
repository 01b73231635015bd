//! Least squares of numbers with correlated errors.

use crate::triangle::Triangle;

/// The lower triangle `L` of a covariance `L L'` (Cholesky; Golub and Van Loan, Matrix Computations, section 4.2): `L^-1` makes errors
/// independent and of variance one.
pub(super) struct Whitening {
    rows: Vec<Vec<f64>>,
}

impl Whitening {
    /// `None` where a number is known exactly beside the others.
    pub fn of(covariance: &[Vec<f64>]) -> Option<Self> {
        let mut rows: Vec<Vec<f64>> = Vec::with_capacity(covariance.len());
        for (index, entries) in covariance.iter().enumerate() {
            let mut row: Vec<f64> = Vec::with_capacity(index + 1);
            for (column, entry) in entries[..=index].iter().enumerate() {
                let above = rows.get(column).unwrap_or(&row);
                let known: f64 = row.iter().zip(above).map(|(a, b)| a * b).sum();
                let left = entry - known;
                row.push(match column == index {
                    // Less than this of a variance is rounding of the others.
                    true => Some(left).filter(|left| *left > 1e-14 * entry)?.sqrt(),
                    false => left / above[column],
                });
            }
            rows.push(row);
        }
        Some(Self { rows })
    }

    pub fn whiten(&self, values: &[f64]) -> Vec<f64> {
        let mut white: Vec<f64> = Vec::with_capacity(values.len());
        for (row, value) in self.rows.iter().zip(values) {
            let known: f64 = row.iter().zip(&white).map(|(a, b)| a * b).sum();
            white.push((value - known) / row[white.len()]);
        }
        white
    }

    /// Of columns of which the last is the right-hand side.
    pub fn triangle(&self, columns: &[&[f64]]) -> Triangle {
        Triangle::new(columns.iter().map(|column| self.whiten(column)).collect())
    }

    pub fn chi_square(&self, residuals: &[f64]) -> f64 {
        self.whiten(residuals).iter().map(|one| one * one).sum()
    }
}

/// 99.9 % point of chi-square over its degrees of freedom (Wilson and Hilferty, Proc. Natl. Acad. Sci. 17 (1931) 684): one pair of a
/// thousand that is one curve is above it by chance.
pub(super) fn chi_square_ratio_max(degrees_of_freedom: usize) -> f64 {
    let spread = 2.0 / (9.0 * degrees_of_freedom as f64);
    (1.0 - spread + 3.090_232 * spread.sqrt()).powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two numbers with the variances 4 and 3 and the covariance 2: `L = [[2, 0], [1, sqrt(2)]]`.
    #[test]
    fn covariance_of_two_by_hand() {
        let whitening = Whitening::of(&[vec![4.0, 2.0], vec![2.0, 3.0]]).unwrap();
        let white = whitening.whiten(&[2.0, 3.0]);
        assert!((white[0] - 1.0).abs() < 1e-15 && (white[1] - 2f64.sqrt()).abs() < 1e-15);
        assert!((whitening.chi_square(&[2.0, 3.0]) - 3.0).abs() < 1e-14);
        assert!(Whitening::of(&[vec![4.0, 2.0], vec![2.0, 1.0]]).is_none());
    }

    /// A table's 99.9 % points of chi-square: 10.83, 27.88 and 59.70 at 1, 9 and 30.
    #[test]
    fn limit_of_chi_square_is_that_of_a_table() {
        for (count, exact, allowed) in [(1, 10.828, 0.35), (9, 27.877, 0.2), (30, 59.703, 0.2)] {
            let found = chi_square_ratio_max(count) * count as f64;
            assert!((found - exact).abs() < allowed, "{count}: {found}");
        }
    }
}
