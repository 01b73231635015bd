//! The columns of the linear problem at one relaxation time, with their exact derivatives.
//!
//! Depth is scaled by its greatest value, so every column is of order one:
//! `[phi_1, phi_2, phi_3, gamma, decay, 1]` multiply the scaled
//! `[mu1 X, mu2 X^2, mu3 X^3, tau_sig X^2, f0, f_offset]`.

use super::options::LINEAR_COUNT;
use crate::viscoelastic::{
    Compensated, NEGLIGIBLE, PSI_COUNT, Pieces, StepWeights, forcing, psi_derivatives,
};

/// Step lengths this close (relative) share their psi, corrected to first order; the remaining
/// relative error is the square of this.
const SAME_STEP: f64 = 1e-8;
/// The scan does not correct; jitter below this does not move a minimum it brackets.
const SAME_STEP_SCAN: f64 = 1e-5;
/// Distinct step lengths remembered at a time.
const STEPS_KEPT: usize = 8;

#[derive(Clone, Copy, Debug)]
struct Weights {
    step: StepWeights,
    slope: [f64; 4],
}

/// psi by step length at one tau, so that a regular record computes it once.
#[derive(Clone, Debug)]
struct StepTable<const EXACT: bool> {
    tau: f64,
    kept: Vec<Weights>,
    newest: usize,
    replaced: usize,
}

impl<const EXACT: bool> StepTable<EXACT> {
    fn fresh(&self, dt: f64) -> Weights {
        let step = StepWeights::new(dt, self.tau);
        let slope = if EXACT {
            psi_derivatives(step.r, &step.psi)
        } else {
            [0.0; 4]
        };
        Weights { step, slope }
    }

    #[inline]
    fn get(&mut self, dt: f64) -> Weights {
        let same = if EXACT { SAME_STEP } else { SAME_STEP_SCAN };
        let is_same = |kept: &Weights| (dt - kept.step.dt).abs() <= same * kept.step.dt;
        if !self.kept.get(self.newest).is_some_and(is_same) {
            self.newest = match self.kept.iter().position(is_same) {
                Some(index) => index,
                None => self.keep(dt),
            };
        }
        let mut weights = self.kept[self.newest];
        if EXACT && dt != weights.step.dt {
            let delta = (dt - weights.step.dt) / self.tau;
            for (psi, slope) in weights.step.psi.iter_mut().zip(weights.slope) {
                *psi += delta * slope;
            }
            weights.step.dt = dt;
        }
        weights
    }

    #[cold]
    fn keep(&mut self, dt: f64) -> usize {
        let weights = self.fresh(dt);
        if self.kept.len() < STEPS_KEPT {
            self.kept.push(weights);
            return self.kept.len() - 1;
        }
        self.replaced = (self.replaced + 1) % STEPS_KEPT;
        self.kept[self.replaced] = weights;
        self.replaced
    }
}

/// Filter states of all columns. `EXACT` carries rounding errors along and the derivatives by
/// `log tau` and by the contact position; without it the scan runs several times faster.
#[derive(Clone, Debug)]
pub(super) struct Columns<const EXACT: bool> {
    table: StepTable<EXACT>,
    powers: [Compensated; 3],
    viscous: Compensated,
    decay: Compensated,
    /// Derivatives of `powers` and `viscous` by `log tau`.
    tau_slopes: [f64; 4],
    /// Filtered "in contact" (the zeroth power) and filtered speed in contact.
    touch: f64,
    speed: f64,
    elapsed: f64,
    depth: f64,
}

impl<const EXACT: bool> Columns<EXACT> {
    /// At the first sample: nothing filtered yet, the probe at scaled depth `depth`.
    pub fn new(tau: f64, depth: f64) -> Self {
        const { assert!(PSI_COUNT == 5) };
        Self {
            table: StepTable {
                tau,
                kept: Vec::with_capacity(STEPS_KEPT),
                newest: 0,
                replaced: 0,
            },
            powers: [Compensated::default(); 3],
            viscous: Compensated::default(),
            decay: Compensated::new(1.0),
            tau_slopes: [0.0; 4],
            touch: 0.0,
            speed: 0.0,
            elapsed: 0.0,
            depth,
        }
    }

    /// Moves straight to scaled depth `to` within `dt > 0` seconds.
    #[inline]
    pub fn advance(&mut self, to: f64, dt: f64) {
        let from = self.depth;
        self.depth = to;
        self.elapsed += dt;
        let weights = self.table.get(dt);
        match Pieces::of(from, to) {
            Pieces::Inside => self.piece(from, to - from, 1.0, &weights),
            Pieces::Outside => self.piece(0.0, 0.0, 0.0, &weights),
            Pieces::Entering(outside) => {
                self.part(0.0, 0.0, 0.0, dt * outside);
                self.part(0.0, to, 1.0, dt * (1.0 - outside));
            }
            Pieces::Leaving(inside) => {
                self.part(from, -from, 1.0, dt * inside);
                self.part(0.0, 0.0, 0.0, dt * (1.0 - inside));
            }
        }
    }

    #[cold]
    fn part(&mut self, x0: f64, d: f64, contact: f64, dt: f64) {
        if dt > 0.0 {
            let weights = self.table.fresh(dt);
            self.piece(x0, d, contact, &weights);
        }
    }

    #[inline]
    fn piece(&mut self, x0: f64, d: f64, contact: f64, weights: &Weights) {
        let StepWeights { dt, r, psi } = &weights.step;
        let psi_0 = psi[0];
        let speed = d / dt;
        let weighted = forcing(x0, d, psi);
        let drive = speed * weighted[0];
        if EXACT {
            let slope = &weights.slope;
            let sloped = forcing(x0, d, slope);
            let old = [
                self.powers[0].value,
                self.powers[1].value,
                self.powers[2].value,
                self.viscous.value,
            ];
            let sloped = [sloped[0], sloped[1], sloped[2], speed * sloped[0]];
            for ((q, old), sloped) in self.tau_slopes.iter_mut().zip(old).zip(sloped) {
                // d r / d log tau = -r.
                *q -= psi_0 * *q + r * (sloped - slope[0] * old);
                if q.abs() < NEGLIGIBLE {
                    *q = 0.0;
                }
            }
            for (power, weighted) in self.powers.iter_mut().zip(weighted) {
                power.relax(weighted, psi_0);
            }
            self.viscous.relax(drive, psi_0);
            self.decay.relax(0.0, psi_0);
            self.touch += psi_0 * (contact - self.touch);
            self.speed += psi_0 * (contact * speed - self.speed);
        } else {
            for (power, weighted) in self.powers.iter_mut().zip(weighted) {
                power.value += weighted - psi_0 * power.value;
            }
            self.viscous.relax(drive, psi_0);
            self.decay.relax(0.0, psi_0);
        }
    }

    /// `[phi_1, phi_2, phi_3, gamma, decay, 1]` now.
    #[inline]
    pub fn row(&self) -> [f64; LINEAR_COUNT] {
        let [f1, f2, f3] = &self.powers;
        [
            f1.value,
            f2.value,
            f3.value,
            self.viscous.value,
            self.decay.value,
            1.0,
        ]
    }

    /// Derivative of the row by `log tau`.
    #[inline]
    pub fn tau_row(&self) -> [f64; LINEAR_COUNT] {
        let [f1, f2, f3, g] = self.tau_slopes;
        let decay = self.elapsed / self.table.tau * self.decay.value;
        [f1, f2, f3, g, decay, 0.0]
    }

    /// Derivative of the row by the scaled contact position.
    #[inline]
    pub fn contact_row(&self) -> [f64; LINEAR_COUNT] {
        [
            -self.touch,
            -2.0 * self.powers[0].value,
            -3.0 * self.powers[1].value,
            -self.speed,
            0.0,
            0.0,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A path in and out of contact with uneven steps; the row at its end.
    fn run(tau: f64, contact: f64) -> Columns<true> {
        let path = [
            (-0.2, 0.0),
            (0.5, 1.0),
            (0.5, 0.3),
            (0.9, 0.31),
            (0.9, 2.0),
            (0.2, 0.7),
        ];
        let mut columns = Columns::new(tau, path[0].0 - contact);
        for (depth, dt) in &path[1..] {
            for part in 1..=4 {
                let from = columns.depth + contact;
                let to = from + (depth - from) * 1.0 / f64::from(5 - part);
                columns.advance(to - contact, dt / 4.0);
            }
        }
        columns
    }

    fn check(numerical: [f64; 6], exact: [f64; 6]) {
        for (numerical, exact) in numerical.into_iter().zip(exact) {
            let miss = (numerical - exact).abs();
            assert!(miss < 1e-9 * exact.abs().max(0.01), "{numerical} {exact}");
        }
    }

    #[test]
    fn derivative_by_log_tau_is_exact() {
        for tau in [0.02, 0.4, 1.0, 30.0] {
            let h = 1e-5f64;
            let (high, low) = (
                run(tau * h.exp(), 0.1).row(),
                run(tau * (-h).exp(), 0.1).row(),
            );
            let numerical = std::array::from_fn(|k| (high[k] - low[k]) / (2.0 * h));
            check(numerical, run(tau, 0.1).tau_row());
        }
    }

    #[test]
    fn derivative_by_contact_is_exact() {
        for tau in [0.2, 1.0, 30.0] {
            let h = 1e-5;
            let (high, low) = (run(tau, 0.1 + h).row(), run(tau, 0.1 - h).row());
            let numerical = std::array::from_fn(|k| (high[k] - low[k]) / (2.0 * h));
            check(numerical, run(tau, 0.1).contact_row());
        }
    }

    #[test]
    fn nearly_equal_steps_are_corrected() {
        let mut exact = Columns::<true>::new(0.5, 0.0);
        let mut jittered = Columns::<true>::new(0.5, 0.0);
        let mut t = 0.0;
        for i in 1..=1000 {
            let next = f64::from(i) * 1e-3 * (1.0 + 4e-9 * f64::from(i % 7));
            jittered.advance(next, next - t);
            t = next;
        }
        exact.advance(t, t);
        for (one, other) in exact.row().into_iter().zip(jittered.row()) {
            assert!((one - other).abs() < 1e-14, "{one} {other}");
        }
    }
}
