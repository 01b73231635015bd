//! Linear least squares of a few columns.

/// The triangle of columns whose last is the right-hand side, by Gram and Schmidt's modified method, each column twice (Björck,
/// Numerical Methods for Least Squares Problems, 1996, section 2.4).
pub(crate) struct Triangle {
    /// Column `j` above and on the diagonal.
    columns: Vec<Vec<f64>>,
}

/// A column of which less than this is left is a sum of those before it.
const DEPENDENT: f64 = 1e-13;

impl Triangle {
    pub fn new(mut columns: Vec<Vec<f64>>) -> Self {
        let mut triangle = Vec::with_capacity(columns.len());
        for index in 0..columns.len() {
            let (before, rest) = columns.split_at_mut(index);
            let column = &mut rest[0];
            let whole = norm(column);
            let mut shares = vec![0.0; index + 1];
            for _ in 0..2 {
                for (share, direction) in shares.iter_mut().zip(before.iter()) {
                    let part = dot(direction, column);
                    *share += part;
                    for (value, along) in column.iter_mut().zip(direction) {
                        *value -= part * along;
                    }
                }
            }
            let left = norm(column);
            // The right-hand side may well be a sum of the columns.
            if left > DEPENDENT * whole {
                shares[index] = left;
                column.iter_mut().for_each(|value| *value /= left);
            } else {
                column.fill(0.0);
            }
            triangle.push(shares);
        }
        Self { columns: triangle }
    }

    /// Sums of columns, by their numbers and shares, and the right-hand side, as short as the triangle is wide.
    pub fn combined(&self, sums: &[Vec<(usize, f64)>]) -> Self {
        let last = self.columns.len() - 1;
        let column = |parts: &Vec<(usize, f64)>| {
            let mut sum = vec![0.0; last + 1];
            for (number, share) in parts {
                for (value, own) in sum.iter_mut().zip(&self.columns[*number]) {
                    *value += share * own;
                }
            }
            sum
        };
        Self::new(sums.iter().chain([&vec![(last, 1.0)]]).map(column).collect())
    }

    /// The coefficients that leave the least, or `None` where a column is a sum of others.
    pub fn solve(&self) -> Option<Vec<f64>> {
        let (right, columns) = self.columns.split_last()?;
        self.back_substitute(right[..columns.len()].to_vec())
    }

    /// The sum of squares that is left.
    pub fn left_over(&self) -> f64 {
        self.columns.last().and_then(|column| column.last()).map_or(0.0, |value| value * value)
    }

    /// The inverse of the normal matrix: the covariance of the coefficients for a variance of one.
    pub fn covariance(&self) -> Option<Vec<Vec<f64>>> {
        let count = self.columns.len() - 1;
        let unit = |number: usize| (0..count).map(|i| f64::from(u8::from(i == number))).collect();
        let inverse: Option<Vec<Vec<f64>>> =
            (0..count).map(|number| self.back_substitute(unit(number))).collect();
        let inverse = inverse?;
        let entry =
            |i: usize, j: usize| inverse.iter().map(|column| column[i] * column[j]).sum::<f64>();
        Some((0..count).map(|i| (0..count).map(|j| entry(i, j)).collect()).collect())
    }

    fn back_substitute(&self, mut values: Vec<f64>) -> Option<Vec<f64>> {
        for index in (0..values.len()).rev() {
            let column = &self.columns[index];
            if column[index] == 0.0 {
                return None;
            }
            values[index] /= column[index];
            let found = values[index];
            for (value, share) in values[..index].iter_mut().zip(column) {
                *value -= found * share;
            }
        }
        Some(values)
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn norm(column: &[f64]) -> f64 {
    dot(column, column).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line through (0, 1), (1, 3), (2, 4), (3, 4): slope 1, offset 1.5, by hand.
    #[test]
    fn line_by_hand() {
        let columns = vec![vec![1.0; 4], vec![0.0, 1.0, 2.0, 3.0], vec![1.0, 3.0, 4.0, 4.0]];
        let triangle = Triangle::new(columns);
        for triangle in [triangle.combined(&[vec![(0, 1.0)], vec![(1, 1.0)]]), triangle] {
            let found = triangle.solve().unwrap();
            assert!((found[0] - 1.5).abs() < 1e-14 && (found[1] - 1.0).abs() < 1e-14, "{found:?}");
            assert!((triangle.left_over() - 1.0).abs() < 1e-14);
            // The inverse of [[4, 6], [6, 14]].
            let covariance = triangle.covariance().unwrap();
            let expected = [[0.7, -0.3], [-0.3, 0.2]];
            for (row, expected) in covariance.iter().zip(expected) {
                for (value, expected) in row.iter().zip(expected) {
                    assert!((value - expected).abs() < 1e-14, "{covariance:?}");
                }
            }
        }
    }

    #[test]
    fn dependent_columns_have_no_answer() {
        let columns = vec![vec![1.0, 2.0, 3.0], vec![2.0, 4.0, 6.0], vec![1.0, 0.0, 0.0]];
        let triangle = Triangle::new(columns);
        assert_eq!(triangle.solve(), None);
        assert_eq!(triangle.covariance(), None);
    }
}
