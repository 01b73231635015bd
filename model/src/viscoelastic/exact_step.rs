//! The exact response of first-order filters to depth that moves straight between samples.
//!
//! Over one interval of length `h` let `x(s) = x0 + d s / h`. The filtered power
//! `f_k + tau f_k' = x^k` and the filtered viscous drive `G + tau G' = x x'` then obey
//!
//! ```text
//! f_k(+) = f_k + sum_j C(k,j) x0^(k-j) d^j psi_j(r) - psi_0(r) f_k        r = h / tau
//! G(+)   = G + (d / h) (x0 psi_0(r) + d psi_1(r)) - psi_0(r) G
//! ```
//!
//! with no time-step error. The increment form matters: `exp(-r) f + w` rounds `exp(-r)`, which
//! shifts tau by about `eps tau / h`, a relative 1e-10 in the identified parameters at 1 kHz and
//! tau of 100 s. Neither depth nor force is ever differentiated.

use super::psi::{PSI_COUNT, psi_all};

/// Far below the last digit of any force (1e-16 of 1e-3 N), far above the subnormal numbers.
pub const NEGLIGIBLE: f64 = 1e-200;

/// A running sum with its rounding error carried along (Dekker's fast two-sum, Numer. Math. 18 (1971)
/// 224-242: exact where the sum outweighs the increment, and where it does not, there is little to
/// lose yet).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CompensatedSum {
    pub value: f64,
    carry: f64,
}

impl CompensatedSum {
    /// A sum that starts at `value`.
    pub const fn new(value: f64) -> Self {
        Self { value, carry: 0.0 }
    }

    /// Adds one increment.
    #[inline]
    pub fn add(&mut self, increment: f64) {
        let increment = increment + self.carry;
        let sum = self.value + increment;
        self.carry = increment - (sum - self.value);
        self.value = sum;
    }

    /// One filter step, towards a forcing already weighted by psi.
    #[inline]
    pub fn relax(&mut self, weighted: f64, psi_0: f64) {
        self.add(weighted - psi_0 * self.value);
        // A filter left alone decays for ever; below the smallest normal number every operation
        // on it would take a hundred times as long and still mean nothing.
        if self.value.abs() < NEGLIGIBLE {
            *self = Self::default();
        }
    }
}

/// The psi functions of one step length at one relaxation time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepWeights {
    /// Step length in s.
    pub dt: f64,
    /// `dt / tau`.
    pub r: f64,
    /// `psi_0 ..= psi_4`.
    pub psi: [f64; PSI_COUNT],
}

impl StepWeights {
    /// Weights of a step of `dt > 0` seconds at `tau >= 0` seconds.
    pub fn new(dt: f64, tau: f64) -> Self {
        let r = dt / tau;
        Self { dt, r, psi: psi_all(r) }
    }
}

/// The weighted forcing of `f_1, f_2, f_3` over a straight piece from `x0` to `x0 + d`, by any
/// functions in the place of psi (psi itself, or its derivative).
#[inline]
pub fn forcing(x0: f64, d: f64, psi: &[f64]) -> [f64; 3] {
    let linear = x0 * psi[0] + d * psi[1];
    let square = x0 * x0 * psi[0] + d * (2.0 * x0 * psi[1] + d * psi[2]);
    let cube =
        x0 * x0 * x0 * psi[0] + d * (3.0 * x0 * x0 * psi[1] + d * (3.0 * x0 * psi[2] + d * psi[3]));
    [linear, square, cube]
}

/// A straight piece of depth, cut where it crosses the surface: at most one part in contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactPieces {
    /// In contact all the way.
    Inside,
    /// Out of contact all the way.
    Outside,
    /// Out of contact, then in contact; the shares of the step spent outside and inside.
    Entering([f64; 2]),
    /// In contact, then out; the shares of the step spent inside and outside.
    Leaving([f64; 2]),
}

impl ContactPieces {
    /// Where a straight move from depth `from` to depth `to` touches; depth 0 is the surface.
    ///
    /// Each share is formed on its own: one less the other would keep no digit of a touch at the very
    /// end of a step.
    pub fn of(from: f64, to: f64) -> Self {
        let shares = || [from / (from - to), to / (to - from)];
        match (from >= 0.0, to >= 0.0) {
            (true, true) => Self::Inside,
            (false, false) => Self::Outside,
            (false, true) => Self::Entering(shares()),
            (true, false) => Self::Leaving(shares()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn compensation_keeps_what_plain_sums_lose() {
        let mut sum = CompensatedSum::new(1.0);
        for _ in 0..1_000_000 {
            sum.add(1e-17);
        }
        assert!((sum.value - (1.0 + 1e-11)).abs() < 1e-15);
    }

    #[test]
    fn forcing_of_a_still_probe_is_the_power_itself() {
        let weights = StepWeights::new(0.7, 0.3);
        let force = forcing(3.0, 0.0, &weights.psi);
        for (k, value) in force.iter().enumerate() {
            let exact = 3f64.powi(k as i32 + 1) * weights.psi[0];
            assert!((value - exact).abs() < 1e-14 * exact);
        }
    }

    #[test]
    fn crossings_are_cut_at_the_surface() {
        assert_eq!(ContactPieces::of(0.0, 0.0), ContactPieces::Inside);
        assert_eq!(ContactPieces::of(-2.0, -0.1), ContactPieces::Outside);
        assert_eq!(ContactPieces::of(-1.0, 3.0), ContactPieces::Entering([0.25, 0.75]));
        assert_eq!(ContactPieces::of(3.0, -1.0), ContactPieces::Leaving([0.75, 0.25]));
        assert_eq!(ContactPieces::of(0.0, -1.0), ContactPieces::Leaving([0.0, 1.0]));
        assert_eq!(ContactPieces::of(-1.0, 1e-20), ContactPieces::Entering([1.0, 1e-20]));
    }
}
