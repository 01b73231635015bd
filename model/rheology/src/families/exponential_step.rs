//! The exact response of a first-order filter to an exponential of depth that moves straight.
//!
//! Over a step with `b = B d` and `r = h / tau`,
//!
//! ```text
//! chi(b, r)   = r int_0^1 e^(b s) e^(-r (1-s)) ds = r (e^b - e^-r) / (b + r)
//! omega(b, r) = chi(b, r) - psi_0(r)              = r int_0^1 (e^(b s) - 1) e^(-r (1-s)) ds
//! ```
//!
//! are to `e^(B x)` what the psi functions are to the powers of `x`. `omega` is formed without the
//! difference, which for slow movement would leave no digit of it.

use palpate_model::viscoelastic::psi;

/// Below this size of both arguments the series is short and the closed form would cancel.
const SMALL: f64 = 1.0;
/// Terms of the series: `1 / 20!` of the first is below the last digit.
const TERMS: u32 = 20;

/// `(chi, omega)` at `b` and `r >= 0`; infinite where they overflow.
pub(super) fn chi_omega(b: f64, r: f64) -> (f64, f64) {
    let psi_0 = psi(0, r);
    if r == f64::INFINITY {
        // No memory: the filter is at its input.
        return (b.exp(), b.exp_m1());
    }
    let sum = b + r;
    if r < SMALL && b.abs() < SMALL && sum.abs() < SMALL {
        let omega = (-r).exp() * r * b * divided_difference(r, sum);
        return (psi_0 + omega, omega);
    }
    // r e^b (1 - e^-sum) / sum, written for either sign of the sum so that nothing overflows early.
    let chi = if sum > 0.0 {
        r * b.exp() * (-(-sum).exp_m1() / sum)
    } else if sum < 0.0 {
        r * (-r).exp() * (sum.exp_m1() / sum)
    } else {
        r * (-r).exp()
    };
    // Where `b` is small, `r` is not and `r e^b - r - b psi_0` keeps its digits.
    let omega = if b.abs() < 0.5 { (r * b.exp_m1() - b * psi_0) / sum } else { chi - psi_0 };
    (chi, omega)
}

/// Divided difference over `u` and `v` of `phi_1(z) = (e^z - 1) / z = sum_n z^n / (n+1)!`: the sum of
/// complete homogeneous polynomials of the two over factorials.
fn divided_difference(u: f64, v: f64) -> f64 {
    let (mut homogeneous, mut power, mut factorial, mut sum) = (1.0, 1.0, 2.0, 0.5);
    for n in 2..TERMS {
        power *= u;
        homogeneous = power + v * homogeneous;
        factorial *= f64::from(n + 1);
        sum += homogeneous / factorial;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The integral by Gauss-Legendre quadrature with 20 nodes on each of `parts` parts, which for
    /// these arguments is exact to rounding: an independent way to the same number.
    fn by_quadrature(b: f64, r: f64) -> (f64, f64) {
        let (nodes, weights) = crate::families::quadrature::gauss_legendre(20);
        let parts = 40;
        let (mut chi, mut omega) = (0.0, 0.0);
        for part in 0..parts {
            for (node, weight) in nodes.iter().zip(&weights) {
                let s = (f64::from(part) + 0.5 * (node + 1.0)) / f64::from(parts);
                let kernel = r * (-r * (1.0 - s)).exp() * 0.5 * weight / f64::from(parts);
                chi += kernel * (b * s).exp();
                omega += kernel * (b * s).exp_m1();
            }
        }
        (chi, omega)
    }

    #[test]
    fn chi_and_omega_agree_with_the_integral() {
        let sizes = [1e-9, 1e-4, 0.01, 0.3, 0.49, 0.51, 0.99, 1.01, 3.0, 20.0];
        for r in sizes {
            for size in sizes {
                for b in [size, -size, -r, -r * (1.0 + 1e-9)] {
                    let (chi, omega) = chi_omega(b, r);
                    let (exact_chi, exact_omega) = by_quadrature(b, r);
                    // Quadrature and exponentials round some ten times in e^20.
                    let miss = (chi / exact_chi - 1.0).abs();
                    assert!(miss < 3e-14, "chi({b}, {r}): {chi} {exact_chi}");
                    let miss = (omega / exact_omega - 1.0).abs();
                    assert!(miss < 3e-14, "omega({b}, {r}): {omega} {exact_omega}");
                }
            }
        }
    }

    #[test]
    fn chi_and_omega_are_right_at_the_ends_of_their_range() {
        assert_eq!(chi_omega(0.0, 0.0), (0.0, 0.0));
        assert_eq!(chi_omega(1.0, f64::INFINITY), (1f64.exp(), 1f64.exp_m1()));
        let (chi, omega) = chi_omega(0.0, 2.0);
        assert!((chi - psi(0, 2.0)).abs() < 1e-16 && omega == 0.0);
        // Fast and far out: e^-r r e^.. stays finite.
        let (chi, _) = chi_omega(-1e3, 1e3);
        assert!(chi.is_finite());
    }
}
