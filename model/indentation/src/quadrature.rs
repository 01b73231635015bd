//! Gauss and Legendre's quadrature.

use std::f64::consts::PI;

/// Nodes and weights on the interval from zero to `end` (Abramowitz and Stegun, 25.4.30, by Newton's method).
pub fn gauss_legendre(count: usize, end: f64) -> Vec<(f64, f64)> {
    let n = count as f64;
    (0..count)
        .map(|index| {
            let mut x = (PI * (index as f64 + 0.75) / (n + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..100 {
                let (mut last, mut value) = (0.0, 1.0);
                for order in 0..count {
                    let order = order as f64;
                    let next = ((2.0 * order + 1.0) * x * value - order * last) / (order + 1.0);
                    (last, value) = (value, next);
                }
                slope = n * (x * value - last) / (x * x - 1.0);
                let step = value / slope;
                x -= step;
                if step.abs() < 1e-15 {
                    break;
                }
            }
            let weight = 2.0 / ((1.0 - x * x) * slope * slope);
            (0.5 * end * (1.0 - x), 0.5 * end * weight)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With n nodes, polynomials up to degree 2 n - 1 are exact.
    #[test]
    fn polynomials_are_exact() {
        for count in [1, 2, 5, 40, 400] {
            for degree in [0, 1, (2 * count - 1).min(60) as i32] {
                let sum: f64 =
                    gauss_legendre(count, 1.0).iter().map(|(x, w)| w * x.powi(degree)).sum();
                let exact = 1.0 / f64::from(degree + 1);
                assert!((sum - exact).abs() < 1e-13, "{count} {degree}: {sum} {exact}");
            }
        }
    }
}
