//! The functions that carry a first-order filter exactly over one straight piece of depth.
//!
//! `psi_j(r) = r * integral_0^1 s^j exp(-r (1 - s)) ds = j! r phi_{j+1}(-r)`, with `r = dt / tau`
//! and `phi` the functions of exponential integrators (Hochbruck & Ostermann, "Exponential
//! integrators", Acta Numerica 19 (2010) 209-286, section 2.1). All are 0 at `r = 0`, rise, and
//! tend to 1.

/// `psi_0 ..= psi_4` at one `r`: enough for a cubic forcing and its derivative by `tau`.
pub const PSI_COUNT: usize = 5;

/// `psi_j(r)` for `r >= 0`, dimensionless; NaN for a negative or NaN `r`.
///
/// Relative error below 1e-15 for `j <= 5` over `r` in 1e-12..1e12: `-expm1(-r)` for `j = 0`; else
/// the power series where `r < max(1, j)` and above it the recurrence
/// `psi_j = 1 - (j / r) psi_{j-1}`, which halves errors there and multiplies them below.
#[must_use]
pub fn psi(j: u32, r: f64) -> f64 {
    if r.is_nan() || r < 0.0 {
        return f64::NAN;
    }
    if j == 0 {
        return -(-r).exp_m1();
    }
    if r < f64::from(j) {
        return series(f64::from(j), r);
    }
    let mut value = -(-r).exp_m1();
    for i in 1..=j {
        value = 1.0 - f64::from(i) / r * value;
    }
    value
}

/// Derivative of `psi_j` by `r`, dimensionless.
///
/// Below `max(1, j)` from `psi_j' = psi_j / r - psi_j + psi_{j+1}`; above it, where those terms
/// cancel, from the differentiated recurrence.
#[must_use]
pub fn psi_derivative(j: u32, r: f64) -> f64 {
    if r.is_nan() || r < 0.0 {
        return f64::NAN;
    }
    if j == 0 {
        return (-r).exp();
    }
    if r == 0.0 {
        return 1.0 / f64::from(j + 1);
    }
    if r < f64::from(j) {
        let value = psi(j, r);
        return value / r - value + psi(j + 1, r);
    }
    let mut value = -(-r).exp_m1();
    let mut slope = (-r).exp();
    for i in 1..=j {
        let i_over_r = f64::from(i) / r;
        (value, slope) = (1.0 - i_over_r * value, i_over_r * (value / r - slope));
    }
    slope
}

/// `psi_0 ..= psi_4` together.
pub fn psi_all(r: f64) -> [f64; PSI_COUNT] {
    psi_first(r)
}

/// The first `N` of the functions together.
///
/// Below 1 only the highest comes from its series; the others follow downwards by
/// `psi_{j-1} = (r / j)(1 - psi_j)`, which damps errors because `psi_j < 1/2` there.
pub fn psi_first<const N: usize>(r: f64) -> [f64; N] {
    let mut all = [0.0; N];
    if r < 1.0 {
        let top = N - 1;
        all[top] = series(top as f64, r);
        for j in (1..=top).rev() {
            all[j - 1] = r / j as f64 * (1.0 - all[j]);
        }
    } else {
        for (j, slot) in all.iter_mut().enumerate() {
            *slot = psi(j as u32, r);
        }
    }
    all
}

/// The derivatives of `psi_0 ..= psi_3` at `r`, given [`psi_all`] there.
pub fn psi_derivatives(r: f64, all: &[f64; PSI_COUNT]) -> [f64; 4] {
    if r < 1.0 {
        std::array::from_fn(|j| match j {
            0 => 1.0 - all[0],
            _ if r == 0.0 => 1.0 / (j + 1) as f64,
            _ => all[j] / r - all[j] + all[j + 1],
        })
    } else {
        std::array::from_fn(|j| psi_derivative(j as u32, r))
    }
}

/// `sum_m (-1)^m r^(m+1) j! / (m+j+1)!`, nested so that no factorial is formed.
fn series(j: f64, r: f64) -> f64 {
    // Terms until the next one cannot matter; their ratio is below one because r < j + 1.
    let mut term = 1.0;
    let mut last = j + 2.0;
    while term > 1e-18 {
        term *= r / last;
        last += 1.0;
    }
    let mut sum = 1.0;
    while last > j + 1.5 {
        sum = 1.0 - r / last * sum;
        last -= 1.0;
    }
    r / (j + 1.0) * sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (j, r, psi) in 50 digits, made by `scripts/psi_reference.py`.
    fn reference() -> Vec<(u32, f64, f64)> {
        include_str!("../../tests/data/psi_reference.txt")
            .lines()
            .filter(|line| !line.starts_with('#'))
            .map(|line| {
                let mut fields = line.split(' ');
                let mut next = || fields.next().unwrap();
                (next().parse().unwrap(), next().parse().unwrap(), next().parse().unwrap())
            })
            .collect()
    }

    #[test]
    fn agrees_with_fifty_digits() {
        let rows = reference();
        // Every 0.02 in 0.5..8 for each j, and the decades.
        let dense =
            |j| rows.iter().filter(|row| row.0 == j && (0.5..8.01).contains(&row.1)).count();
        assert!((0..=5).all(|j| dense(j) >= 376));
        let mut worst: f64 = 0.0;
        for (j, r, exact) in rows {
            let relative = (psi(j, r) - exact).abs() / exact;
            assert!(relative < 1e-15, "psi_{j}({r:e}): {relative:e}");
            worst = worst.max(relative);
            if let Some(&value) = psi_all(r).get(j as usize) {
                let relative = (value - exact).abs() / exact;
                assert!(relative < 1e-15, "all, psi_{j}({r:e}): {relative:e}");
                worst = worst.max(relative);
            }
            let relative = (psi_first::<6>(r)[j as usize] - exact).abs() / exact;
            assert!(relative < 1e-15, "first, psi_{j}({r:e}): {relative:e}");
        }
        println!("psi within {worst:.1e} of 50 digits");
    }

    #[test]
    fn derivative_agrees_with_differences() {
        for (j, r, _) in reference() {
            if !(1e-6..1e6).contains(&r) {
                continue;
            }
            // Differences of complements, 1 - psi = O(1/r), keep their digits at large r.
            let h = 1e-4 * r;
            let numerical = (psi(j, r - 2.0 * h) - psi(j, r + 2.0 * h)
                + 8.0 * (psi(j, r + h) - psi(j, r - h)))
                / (12.0 * h);
            let slope = psi_derivative(j, r);
            let allowed = 1e-11 * slope.abs() + 2e-12 * psi(j, r) / r;
            assert!(
                (numerical - slope).abs() < allowed,
                "psi_{j}'({r:e}): {numerical:e} {slope:e}"
            );
        }
    }

    #[test]
    fn derivatives_together_agree_with_one_by_one() {
        for (j, r, _) in reference() {
            if let Some(&slope) = psi_derivatives(r, &psi_all(r)).get(j as usize) {
                let alone = psi_derivative(j, r);
                let miss = (slope - alone).abs();
                assert!(miss <= 4e-15 * alone, "psi_{j}'({r:e}): {miss:e}");
            }
        }
    }

    #[test]
    fn ends_of_the_range() {
        for j in 0..=5 {
            assert_eq!(psi(j, 0.0), 0.0);
            assert_eq!(psi(j, f64::INFINITY), 1.0);
            assert!(psi(j, -1.0).is_nan() && psi(j, f64::NAN).is_nan());
            let slope = psi_derivative(j, 0.0);
            assert!((slope - 1.0 / f64::from(j + 1)).abs() < 1e-15);
        }
    }
}
