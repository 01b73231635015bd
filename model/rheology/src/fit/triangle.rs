//! Least squares by orthogonal triangularisation, rows streamed in blocks.
//!
//! Householder reflections of a triangle stacked on a block of rows (Golub & Van Loan, "Matrix
//! Computations", 4th ed., section 6.5.3): the design is never held and never squared, so a
//! condition of 1e2 costs two digits and not four.

use super::design::{LANES, Lane};
use crate::vectors::run_wide;

/// A scaled design worse than this does not separate its parameters. Useful protocols lie between 20 and 1e4, a single
/// ramp drawn as one straight piece above 1e10.
pub(crate) const CONDITION_MAX: f64 = 1e6;
/// Parameters with at least this share of the largest entry belong to a combination that a design is blind to.
const NAMED_SHARE: f64 = 0.2;

/// Positions of the parameters that make up a combination.
pub(crate) fn dominant_entries(combination: &[f64]) -> Vec<usize> {
    let sizes = || combination.iter().map(|value| value.abs());
    let least = NAMED_SHARE * sizes().fold(0.0, f64::max);
    let dominant = sizes().enumerate().filter(|(_, size)| *size >= least);
    dominant.map(|(place, _)| place).collect()
}

/// The upper triangle of all rows so far.
#[derive(Clone, Debug)]
pub(crate) struct Triangle {
    width: usize,
    /// `r[i * width + j]`, zero below the diagonal.
    r: Vec<f64>,
    /// Column-major block of waiting rows.
    block: Vec<Lane>,
    waiting: usize,
}

impl Triangle {
    /// An empty triangle for rows of `width` numbers.
    pub fn new(width: usize) -> Self {
        Self { width, r: vec![0.0; width * width], block: vec![[0.0; LANES]; width], waiting: 0 }
    }

    /// Adds a row given number by number, times `weight`.
    #[inline]
    pub fn push(&mut self, row: &[f64], weight: f64) {
        for (column, value) in self.block.iter_mut().zip(row) {
            column[self.waiting] = value * weight;
        }
        self.waiting += 1;
        if self.waiting == LANES {
            self.flush();
        }
    }

    /// Adds the first `count` rows of whole columns, which are used up.
    #[inline(always)]
    pub fn push_lanes(&mut self, columns: &mut [Lane], count: usize) {
        if count < LANES {
            for column in columns.iter_mut() {
                column[count..].fill(0.0);
            }
        }
        reduce(&mut self.r, self.width, columns);
    }

    /// Takes out the row of the first unknown. The second becomes the first, and the second is a new one of which nothing is
    /// known; rows stay an upper triangle.
    pub fn pass_first(&mut self) -> Vec<f64> {
        self.flush();
        let (first, rest) = self.r.split_at_mut(self.width);
        let passed = first.to_vec();
        let second = &mut rest[..self.width];
        first.copy_from_slice(second);
        (first[0], first[1]) = (second[1], 0.0);
        second.fill(0.0);
        passed
    }

    /// The finished triangle, `width` by `width`, row by row.
    pub fn finish(mut self) -> Factor {
        self.flush();
        Factor { width: self.width, r: self.r }
    }

    fn flush(&mut self) {
        if self.waiting == 0 {
            return;
        }
        for column in &mut self.block {
            column[self.waiting..].fill(0.0);
        }
        self.waiting = 0;
        run_wide(
            #[inline(always)]
            || reduce(&mut self.r, self.width, &mut self.block),
        );
    }
}

/// Rotates a block of rows, given by columns, into the triangle `r`.
#[inline(always)]
fn reduce(r: &mut [f64], width: usize, block: &mut [Lane]) {
    for j in 0..width.min(block.len()) {
        let (done, rest) = block.split_at_mut(j + 1);
        let v = &mut done[j];
        let below = dot(v, v);
        if below == 0.0 {
            continue;
        }
        let diagonal = r[j * width + j];
        let norm = (diagonal * diagonal + below).sqrt();
        let new_diagonal = if diagonal > 0.0 { -norm } else { norm };
        let head = diagonal - new_diagonal;
        // Reflection I - tau w w' with w = (1, v / head).
        let tau = -head / new_diagonal;
        let over_head = 1.0 / head;
        for value in v.iter_mut() {
            *value *= over_head;
        }
        r[j * width + j] = new_diagonal;
        for (offset, column) in rest.iter_mut().enumerate() {
            let top = &mut r[j * width + j + 1 + offset];
            let share = tau * (*top + dot(v, column));
            *top -= share;
            for (value, v) in column.iter_mut().zip(v.iter()) {
                *value -= share * v;
            }
        }
    }
}

/// Thirty-two partial sums, so that the additions do not wait for each other.
#[inline(always)]
fn dot(a: &Lane, b: &Lane) -> f64 {
    const PARTS: usize = LANES / 2;
    let mut sums = [0.0; PARTS];
    for i in 0..PARTS {
        sums[i] = a[i] * b[i] + a[i + PARTS] * b[i + PARTS];
    }
    let mut width = PARTS;
    while width > 1 {
        width /= 2;
        for i in 0..width {
            sums[i] += sums[i + width];
        }
    }
    sums[0]
}

/// A finished triangle whose last column is the measured force.
#[derive(Clone, Debug)]
pub(crate) struct Factor {
    width: usize,
    r: Vec<f64>,
}

impl Factor {
    /// How many columns, the force included.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Row `i`.
    pub fn row(&self, i: usize) -> &[f64] {
        &self.r[i * self.width..(i + 1) * self.width]
    }

    fn at(&self, i: usize, j: usize) -> f64 {
        self.r[i * self.width + j]
    }

    /// Sum of squares left after fitting the first `columns` columns to the last.
    pub fn residual_sum(&self, columns: usize) -> f64 {
        (columns..self.width).map(|i| self.at(i, self.width - 1).powi(2)).sum()
    }

    /// Sum of squares that any `solution` of all columns but the last leaves of the last.
    pub fn residual_sum_of(&self, solution: &[f64]) -> f64 {
        let residual = |i: usize| {
            let row = self.row(i);
            let fitted: f64 = row.iter().zip(solution).map(|(a, b)| a * b).sum();
            row[solution.len()] - fitted
        };
        (0..self.width()).map(|i| residual(i).powi(2)).sum()
    }

    /// Coefficients of the first `columns` columns that fit the last column best.
    pub fn solve(&self, columns: usize) -> Vec<f64> {
        self.solve_given(columns, &[])
    }

    pub fn is_finite(&self) -> bool {
        self.r.iter().all(|value| value.is_finite())
    }

    /// Subtracts what the first columns explain from the last; rows stay an upper triangle but for the last column.
    pub fn subtract_explained(mut self, explained: &[f64]) -> Self {
        for row in self.r.chunks_mut(self.width) {
            let known: f64 = row.iter().zip(explained).map(|(a, b)| a * b).sum();
            row[self.width - 1] -= known;
        }
        self
    }

    /// The triangle of some of the columns and the last.
    pub fn select_columns(&self, columns: &[usize]) -> Self {
        let mut triangle = Triangle::new(columns.len() + 1);
        let mut chosen = vec![0.0; columns.len() + 1];
        for i in 0..self.width {
            let row = self.row(i);
            for (slot, &k) in chosen.iter_mut().zip(columns) {
                *slot = row[k];
            }
            chosen[columns.len()] = row[self.width - 1];
            triangle.push(&chosen, 1.0);
        }
        triangle.finish()
    }

    /// The triangle of some of the columns, the last of them as the force.
    pub fn select_leading(&self, columns: &[usize]) -> Self {
        let mut triangle = Triangle::new(columns.len());
        for i in 0..self.width {
            let row = self.row(i);
            let chosen: Vec<f64> = columns.iter().map(|&k| row[k]).collect();
            triangle.push(&chosen, 1.0);
        }
        triangle.finish()
    }

    /// The triangle without the first columns, whatever these explain subtracted.
    pub fn without_first(&self, count: usize) -> Self {
        let rows = (count..self.width).flat_map(|i| self.row(i)[count..].iter().copied());
        Self { width: self.width - count, r: rows.collect() }
    }

    pub fn rows_mut(&mut self) -> impl Iterator<Item = &mut [f64]> {
        self.r.chunks_mut(self.width)
    }

    /// Coefficients of the first `columns` columns that fit the last column best, those behind them having the values
    /// of `others`.
    pub fn solve_given(&self, columns: usize, others: &[f64]) -> Vec<f64> {
        let mut solution = vec![0.0; columns];
        solution.extend_from_slice(others);
        for i in (0..columns).rev() {
            let known = i + 1..solution.len();
            let known: f64 = known.map(|j| self.at(i, j) * solution[j]).sum();
            solution[i] = (self.at(i, self.width - 1) - known) / self.at(i, i);
        }
        solution.truncate(columns);
        solution
    }

    /// `|R^-T l|` over the first columns: the standard deviation of the combination `l` of
    /// coefficients, for residuals of unit variance.
    pub fn deviation(&self, combination: &[f64]) -> f64 {
        let y = self.forward(combination);
        y.iter().map(|y| y * y).sum::<f64>().sqrt()
    }

    /// `(R'R)^-1 l` over the first columns: how the estimate of the combination `l` of
    /// coefficients weighs the columns.
    pub fn influence(&self, combination: &[f64]) -> Vec<f64> {
        let y = self.forward(combination);
        let mut solution = vec![0.0; y.len()];
        for i in (0..y.len()).rev() {
            let known: f64 = (i + 1..y.len()).map(|j| self.at(i, j) * solution[j]).sum();
            solution[i] = (y[i] - known) / self.at(i, i);
        }
        solution
    }

    /// `R^-T l`.
    fn forward(&self, combination: &[f64]) -> Vec<f64> {
        let mut y = vec![0.0; combination.len()];
        for i in 0..combination.len() {
            let known: f64 = (0..i).map(|j| self.at(j, i) * y[j]).sum();
            y[i] = (combination[i] - known) / self.at(i, i);
        }
        y
    }

    /// Which of the first `columns` columns are not separable; `None` where all are.
    pub fn inseparable_columns(&self, columns: usize) -> Option<Vec<usize>> {
        let (condition, combination) = self.condition(columns);
        // A condition of NaN is not separable.
        let is_separable = condition < CONDITION_MAX;
        (!is_separable).then(|| dominant_entries(&combination))
    }

    /// Singular values of the first `columns` columns, each scaled to unit length, with the right
    /// vector of the smallest: `(largest / smallest, vector)`. A column of zeros counts as
    /// infinitely ill. One-sided Jacobi rotations (Hestenes, J. SIAM 6 (1958) 51-90).
    pub fn condition(&self, columns: usize) -> (f64, Vec<f64>) {
        let mut a: Vec<Vec<f64>> =
            (0..columns).map(|j| (0..columns).map(|i| self.at(i, j)).collect()).collect();
        let mut v: Vec<Vec<f64>> = (0..columns)
            .map(|j| (0..columns).map(|i| f64::from(u8::from(i == j))).collect())
            .collect();
        for (j, column) in a.iter_mut().enumerate() {
            let norm = sum_of_products(column, column).sqrt();
            if norm == 0.0 {
                return (f64::INFINITY, v.swap_remove(j));
            }
            column.iter_mut().for_each(|value| *value /= norm);
        }
        for _ in 0..30 {
            let mut is_diagonal = true;
            for p in 0..columns {
                for q in p + 1..columns {
                    let pp = sum_of_products(&a[p], &a[p]);
                    let qq = sum_of_products(&a[q], &a[q]);
                    let pq = sum_of_products(&a[p], &a[q]);
                    if pq.abs() <= 1e-15 * (pp * qq).sqrt() {
                        continue;
                    }
                    is_diagonal = false;
                    let zeta = (qq - pp) / (2.0 * pq);
                    let t = zeta.signum() / (zeta.abs() + (1.0 + zeta * zeta).sqrt());
                    let c = 1.0 / (1.0 + t * t).sqrt();
                    rotate(&mut a, p, q, c, c * t);
                    rotate(&mut v, p, q, c, c * t);
                }
            }
            if is_diagonal {
                break;
            }
        }
        let lengths: Vec<f64> = a.iter().map(|col| sum_of_products(col, col).sqrt()).collect();
        let largest = lengths.iter().copied().fold(0.0, f64::max);
        let mut smallest = 0;
        for (index, length) in lengths.iter().enumerate() {
            if *length < lengths[smallest] {
                smallest = index;
            }
        }
        if columns == 0 {
            return (1.0, Vec::new());
        }
        (largest / lengths[smallest], v.swap_remove(smallest))
    }
}

fn sum_of_products(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn rotate(columns: &mut [Vec<f64>], p: usize, q: usize, c: f64, s: f64) {
    let (left, right) = columns.split_at_mut(q);
    for (a, b) in left[p].iter_mut().zip(right[0].iter_mut()) {
        (*a, *b) = (c * *a - s * *b, s * *a + c * *b);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line() -> Factor {
        let mut triangle = Triangle::new(3);
        for i in 0..150 {
            let x = f64::from(i) * 0.1;
            let scatter = if i % 2 == 0 { 0.01 } else { -0.01 };
            triangle.push(&[1.0, x, 2.0 - 3.0 * x + scatter], 2.0);
        }
        triangle.finish()
    }

    #[test]
    fn fits_a_line_with_its_uncertainty() {
        let factor = line();
        let solution = factor.solve(2);
        assert!((solution[0] - 2.0).abs() < 1e-3 && (solution[1] + 3.0).abs() < 1e-3);
        let sum = factor.residual_sum(2);
        assert!((sum - 150.0 * 4e-4).abs() < 1e-4, "{sum}");
        // Textbook slope deviation 1 / sqrt(sum w (x - mean)^2), weight 2^2.
        let spread: f64 = (0..150).map(|i| (f64::from(i) * 0.1 - 7.45).powi(2)).sum();
        let exact = 1.0 / (4.0 * spread).sqrt();
        assert!((factor.deviation(&[0.0, 1.0]) - exact).abs() < 1e-12);
    }

    #[test]
    fn inseparable_combination_is_named() {
        let mut triangle = Triangle::new(4);
        for i in 0..300 {
            let x = f64::from(i) * 0.01;
            triangle.push(&[1.0, x, 5.0 * x, x * x], 1.0);
        }
        let (condition, vector) = triangle.finish().condition(3);
        assert!(condition > 1e12, "{condition}");
        assert!(vector[0].abs() < 1e-6, "{vector:?}");
        assert!((vector[1] + vector[2]).abs() < 1e-6, "{vector:?}");
    }

    #[test]
    fn condition_of_a_known_pair() {
        // Two unit columns at angle a: condition cot(a / 2).
        let mut triangle = Triangle::new(3);
        triangle.push(&[3.0, 0.5, 0.0], 1.0);
        triangle.push(&[0.0, 0.5, 0.0], 1.0);
        let (condition, _) = triangle.finish().condition(2);
        let exact = 1.0 / (std::f64::consts::FRAC_PI_8).tan();
        assert!((condition - exact).abs() < 1e-12, "{condition} {exact}");
    }
}
