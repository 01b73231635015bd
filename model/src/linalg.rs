//! Least squares by an orthogonal triangularisation that takes one row at a time (Givens 1958;
//! Golub & Van Loan, Matrix Computations, section 5.2.5): constant memory, no normal equations.

/// Upper triangle of `[A | y]`, `N` columns with the response as the last.
#[derive(Clone, Debug, PartialEq)]
pub struct Triangle<const N: usize> {
    /// Rows of the triangle; zero below the diagonal.
    pub r: [[f64; N]; N],
}

impl<const N: usize> Default for Triangle<N> {
    fn default() -> Self {
        Self { r: [[0.0; N]; N] }
    }
}

impl<const N: usize> Triangle<N> {
    /// Rotates one row into the triangle.
    pub fn push(&mut self, mut row: [f64; N]) {
        for i in 0..N {
            if row[i] == 0.0 {
                continue;
            }
            let (a, b) = (self.r[i][i], row[i]);
            let norm = a.hypot(b);
            let (cos, sin) = (a / norm, b / norm);
            self.r[i][i] = norm;
            for (top, bottom) in self.r[i].iter_mut().zip(&mut row).skip(i + 1) {
                (*top, *bottom) = (cos * *top + sin * *bottom, cos * *bottom - sin * *top);
            }
        }
    }

    /// Squared length of one column.
    pub fn length_squared(&self, column: usize) -> f64 {
        self.r.iter().map(|row| row[column].powi(2)).sum()
    }

    /// Sum of squared residuals.
    pub fn residual_sum(&self) -> f64 {
        self.r[N - 1][N - 1].powi(2)
    }

    /// Coefficients of the first `count` columns with the later ones left out; `None` if singular.
    pub fn solve(&self, count: usize) -> Option<[f64; N]> {
        self.back_substitute(count, |i| self.r[i][N - 1])
    }

    /// Entry `(i, i)` of the inverse of `AᵀA` over the first `count` columns.
    pub fn inverse_diagonal(&self, index: usize, count: usize) -> Option<f64> {
        // Row `index` of R^-1: solve for each unit vector and keep that row.
        let mut sum = 0.0;
        for column in index..count {
            let unit = self.back_substitute(count, |i| f64::from(u8::from(i == column)))?;
            sum += unit[index].powi(2);
        }
        Some(sum)
    }

    fn back_substitute(&self, count: usize, rhs: impl Fn(usize) -> f64) -> Option<[f64; N]> {
        let scale = (0..count).fold(0.0f64, |scale, i| scale.max(self.r[i][i].abs()));
        let mut x = [0.0; N];
        for i in (0..count).rev() {
            // A pivot this small is rounding of the others.
            if self.r[i][i].abs() <= 1e-14 * scale {
                return None;
            }
            let known: f64 = (i + 1..count).map(|j| self.r[i][j] * x[j]).sum();
            x[i] = (rhs(i) - known) / self.r[i][i];
        }
        Some(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn recovers_a_cubic_and_its_covariance() {
        let mut triangle = Triangle::<4>::default();
        let mut normal = 0.0;
        for i in 0..100 {
            let t = f64::from(i) * 0.01;
            let noise = if i % 2 == 0 { 1e-3 } else { -1e-3 };
            triangle.push([1.0, t, t * t, 2.0 - 3.0 * t + 0.5 * t * t + noise]);
            normal += 1.0;
        }
        let x = triangle.solve(3).unwrap();
        assert!(
            (x[0] - 2.0).abs() < 1e-3 && (x[1] + 3.0).abs() < 1e-3 && (x[2] - 0.5).abs() < 1e-3
        );
        assert!((triangle.residual_sum() - normal * 1e-6).abs() < 2e-7);
        // A constant alone: (AᵀA)^-1 = 1 / rows.
        let mut constant = Triangle::<2>::default();
        (0..100).for_each(|_| constant.push([1.0, 0.0]));
        assert!((constant.inverse_diagonal(0, 1).unwrap() - 0.01).abs() < 1e-15);
    }

    #[test]
    fn equal_columns_are_singular() {
        let mut triangle = Triangle::<3>::default();
        (0..50).for_each(|i| triangle.push([f64::from(i), 2.0 * f64::from(i), 1.0]));
        assert_eq!(triangle.solve(2), None);
    }
}
