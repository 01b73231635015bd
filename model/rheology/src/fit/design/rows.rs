//! The columns at the samples of a block, and what coefficients make of them.

pub(in super::super) use super::super::options::LINEAR_COUNT;

/// Samples worked on together.
pub(in super::super) const LANES: usize = 64;
/// One number for each of them.
pub(in super::super) type Lane = [f64; LANES];
/// Coefficients of the columns: three Legendre depth terms, viscous, initial force, offset.
pub(in super::super) type Coefficients = [f64; LINEAR_COUNT];

/// The columns at up to 64 samples.
#[derive(Clone, Debug)]
pub(in super::super) struct Rows {
    /// Filtered powers 1, 2, 3 and viscous drive.
    pub(super) filtered: [Lane; 4],
    pub(super) decay: Lane,
    pub(super) tau_slopes: [Lane; 4],
    pub(super) touch: Lane,
    pub(super) speed: Lane,
    pub(super) elapsed: Lane,
}

impl Rows {
    pub fn new() -> Self {
        Self {
            filtered: [[0.0; LANES]; 4],
            decay: [0.0; LANES],
            tau_slopes: [[0.0; LANES]; 4],
            touch: [0.0; LANES],
            speed: [0.0; LANES],
            elapsed: [0.0; LANES],
        }
    }

    #[inline(always)]
    pub fn values(&self, columns: &mut [Lane]) {
        let [c1, c2, c3, c4, c5, c6, ..] = columns else {
            return;
        };
        let [f1, f2, f3, g] = &self.filtered;
        for i in 0..LANES {
            c1[i] = f1[i];
            c2[i] = 2.0 * f2[i] - f1[i];
            c3[i] = 6.0 * (f3[i] - f2[i]) + f1[i];
        }
        *c4 = *g;
        *c5 = self.decay;
        *c6 = [1.0; LANES];
    }

    /// The modelled force for coefficients of the bare powers and the other columns.
    #[inline(always)]
    pub fn force(&self, scaled: &Coefficients) -> Lane {
        let [p1, p2, p3, viscous, initial, offset] = *scaled;
        let [f1, f2, f3, g] = &self.filtered;
        std::array::from_fn(|i| {
            let elastic = p1 * f1[i] + p2 * f2[i] + p3 * f3[i];
            elastic + viscous * g[i] + initial * self.decay[i] + offset
        })
    }

    /// The derivative by `log tau` of the modelled force.
    #[inline(always)]
    pub fn tau_slope(&self, at: &Coefficients, tau: f64) -> Lane {
        let [p1, p2, p3] = powers_from_legendre(at);
        let (viscous, initial) = (at[3], at[4] / tau);
        let [q1, q2, q3, q4] = &self.tau_slopes;
        std::array::from_fn(|i| {
            let elastic = p1 * q1[i] + p2 * q2[i] + p3 * q3[i];
            elastic + viscous * q4[i] + initial * self.elapsed[i] * self.decay[i]
        })
    }

    /// The derivative by the scaled contact position of the modelled force.
    #[inline(always)]
    pub fn contact_slope(&self, at: &Coefficients) -> Lane {
        let [p1, p2, p3] = powers_from_legendre(at);
        let [f1, f2, ..] = &self.filtered;
        std::array::from_fn(|i| {
            let elastic = p1 * self.touch[i] + 2.0 * p2 * f1[i] + 3.0 * p3 * f2[i];
            -elastic - at[3] * self.speed[i]
        })
    }
}

/// The six coefficients of a record.
#[inline(always)]
pub(in super::super) fn six(at: &[f64]) -> Coefficients {
    std::array::from_fn(|k| at[k])
}

/// Divisors that turn scaled coefficients of powers into N/mm, N/mm^2, N/mm^3, N*s/mm^2, N, N.
pub(in super::super) fn linear_units(depth_mm: f64) -> Coefficients {
    let x = depth_mm;
    [x, x * x, x * x * x, x * x, 1.0, 1.0]
}

/// Coefficients of the bare powers `u, u^2, u^3` of Legendre depth terms.
pub(in super::super) fn powers_from_legendre(at: &Coefficients) -> [f64; 3] {
    let [a, b, c, ..] = *at;
    [a - b + c, 2.0 * b - 6.0 * c, 6.0 * c]
}

/// Legendre depth terms of bare powers, the other coefficients unchanged.
pub(in super::super) fn legendre_from_powers(scaled: &Coefficients) -> Coefficients {
    let [a, b, c, viscous, initial, offset] = *scaled;
    [a + b / 2.0 + c / 3.0, b / 2.0 + c / 2.0, c / 6.0, viscous, initial, offset]
}
