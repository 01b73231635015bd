//! Gauss-Legendre nodes and weights, for relaxation spectra.

/// Nodes in -1..1, ascending, and weights that add up to 2, exact for polynomials up to degree
/// `2 count - 1`.
///
/// Newton's iteration on the Legendre polynomial from Tricomi's first guess (Hale & Townsend, SIAM
/// J. Sci. Comput. 35 (2013) A652, section 2); to rounding for the counts used here, below 100.
pub(super) fn gauss_legendre(count: usize) -> (Vec<f64>, Vec<f64>) {
    let (mut nodes, mut weights) = (vec![0.0; count], vec![0.0; count]);
    for i in 0..count {
        let guess = std::f64::consts::PI * (i as f64 + 0.75) / (count as f64 + 0.5);
        let mut x = guess.cos();
        let mut slope = 1.0;
        // Convergence is quadratic from a guess good to 1/count^2; eight rounds are ample.
        for _ in 0..8 {
            let (mut before, mut value) = (1.0, x);
            for k in 2..=count {
                let k = k as f64;
                (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
            }
            slope = count as f64 * (x * value - before) / (x * x - 1.0);
            x -= value / slope;
        }
        nodes[count - 1 - i] = x;
        weights[count - 1 - i] = 2.0 / ((1.0 - x * x) * slope * slope);
    }
    (nodes, weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_are_integrated_exactly() {
        for count in [2, 5, 12, 31] {
            let (nodes, weights) = gauss_legendre(count);
            for degree in 0..2 * count as i32 {
                let sum: f64 = nodes.iter().zip(&weights).map(|(x, w)| w * x.powi(degree)).sum();
                let exact = if degree % 2 == 0 { 2.0 / f64::from(degree + 1) } else { 0.0 };
                assert!((sum - exact).abs() < 3e-15, "{count} {degree}: {sum}");
            }
        }
    }
}
