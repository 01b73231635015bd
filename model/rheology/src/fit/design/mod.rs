//! The columns of the linear problem at one relaxation time, with their exact derivatives, 64
//! samples at a time.
//!
//! Depth is scaled by its greatest value, so every column is of order one. The depth terms are the
//! filtered `u`, `u (2u - 1)` and `u (6u^2 - 6u + 1)`, `u = x / X`: `u` times the Legendre
//! polynomials on 0..1, nearly orthogonal over the depths passed where bare powers are nearly
//! parallel. The others are the viscous drive, the decay of the initial force, and one.

pub(super) mod blocks;
mod forcing;
mod rows;
mod step_table;

use super::sample::FitSample;
use crate::vectors::run_wide;
use forcing::Forcing;
use palpate_model::viscoelastic::{
    CompensatedSum, ContactPieces, NEGLIGIBLE, PSI_COUNT, StepWeights, forcing as drive,
};
pub(super) use rows::{
    Coefficients, LANES, LINEAR_COUNT, Lane, Rows, legendre_from_powers, linear_units,
    powers_from_legendre, six,
};
use step_table::{SAME_STEP, StepTable, Weights};

/// Filter states of all columns. `SLOPES` carries the derivatives by `log tau` and by the contact
/// position along.
#[derive(Clone, Debug)]
pub(super) struct Columns<const SLOPES: bool> {
    table: StepTable,
    /// Filtered powers 1, 2, 3 of depth, filtered viscous drive, with their rounding errors as in
    /// `Compensated`, side by side.
    filtered: [f64; 4],
    carry: [f64; 4],
    decay: CompensatedSum,
    /// Derivatives of `filtered` by `log tau`.
    tau_slopes: [f64; 4],
    /// Filtered "in contact" (the zeroth power) and filtered speed in contact.
    touch: f64,
    speed: f64,
    elapsed: f64,
    depth: f64,
}

impl<const SLOPES: bool> Columns<SLOPES> {
    /// At the first sample: nothing filtered yet, the probe at scaled depth `depth`.
    pub fn new(tau: f64, depth: f64) -> Self {
        const { assert!(PSI_COUNT == 5) };
        Self {
            table: StepTable::new(tau),
            filtered: [0.0; 4],
            carry: [0.0; 4],
            decay: CompensatedSum::new(1.0),
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
        match ContactPieces::of(from, to) {
            ContactPieces::Inside => self.piece(from, to - from, 1.0, &weights),
            ContactPieces::Outside => self.piece(0.0, 0.0, 0.0, &weights),
            ContactPieces::Entering([outside, inside]) => {
                self.part(0.0, 0.0, 0.0, dt * outside);
                self.part(0.0, to, 1.0, dt * inside);
            }
            ContactPieces::Leaving([inside, outside]) => {
                self.part(from, -from, 1.0, dt * inside);
                self.part(0.0, 0.0, 0.0, dt * outside);
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
        let [w1, w2, w3] = drive(x0, d, psi);
        if SLOPES {
            let slope = &weights.slope;
            let [s1, s2, s3] = drive(x0, d, slope);
            let sloped = [s1, s2, s3, speed * s1].map(|sloped| r * sloped);
            self.slope(psi_0, r * slope[0], sloped);
            self.touch += psi_0 * (contact - self.touch);
            self.speed += psi_0 * (contact * speed - self.speed);
        }
        self.relax(psi_0, [w1, w2, w3, speed * w1]);
        self.settle();
    }

    /// The derivatives by `log tau`, before the filters move: `d r / d log tau = -r`.
    #[inline(always)]
    fn slope(&mut self, psi_0: f64, r_slope_0: f64, sloped: [f64; 4]) {
        for ((q, old), sloped) in self.tau_slopes.iter_mut().zip(self.filtered).zip(sloped) {
            *q -= psi_0 * *q + (sloped - r_slope_0 * old);
        }
    }

    #[inline(always)]
    fn relax(&mut self, psi_0: f64, weighted: [f64; 4]) {
        let sums = self.filtered.iter_mut().zip(&mut self.carry);
        for ((value, carry), weighted) in sums.zip(weighted) {
            let increment = (weighted - psi_0 * *value) + *carry;
            let sum = *value + increment;
            *carry = increment - (sum - *value);
            *value = sum;
        }
        self.decay.add(-psi_0 * self.decay.value);
    }

    /// Zero for what decayed beyond meaning: subnormal numbers cost a hundred times as much.
    #[inline]
    fn settle(&mut self) {
        for (value, carry) in self.filtered.iter_mut().zip(&mut self.carry) {
            if value.abs() < NEGLIGIBLE {
                (*value, *carry) = (0.0, 0.0);
            }
        }
        if self.decay.value.abs() < NEGLIGIBLE {
            self.decay = CompensatedSum::default();
        }
        for slope in &mut self.tau_slopes {
            if slope.abs() < NEGLIGIBLE {
                *slope = 0.0;
            }
        }
    }

    /// The present state as lane `i`.
    #[inline(always)]
    fn write(&self, rows: &mut Rows, i: usize) {
        for (lane, filtered) in rows.filtered.iter_mut().zip(&self.filtered) {
            lane[i] = *filtered;
        }
        rows.decay[i] = self.decay.value;
        if SLOPES {
            for (lane, slope) in rows.tau_slopes.iter_mut().zip(self.tau_slopes) {
                lane[i] = slope;
            }
            rows.touch[i] = self.touch;
            rows.speed[i] = self.speed;
            rows.elapsed[i] = self.elapsed;
        }
    }

    /// `[phi_1, phi_2, phi_3, gamma, decay, 1]` now, bare powers.
    pub fn row(&self) -> [f64; LINEAR_COUNT] {
        let [f1, f2, f3, g] = self.filtered;
        [f1, f2, f3, g, self.decay.value, 1.0]
    }

    /// Derivative by `log tau` of the modelled force now.
    pub fn tau_slope(&self, at: &Coefficients) -> f64 {
        let [p1, p2, p3] = powers_from_legendre(at);
        let initial = at[4] * self.elapsed / self.table.tau * self.decay.value;
        let slopes = self.tau_slopes.iter().zip([p1, p2, p3, at[3]]);
        initial + slopes.map(|(slope, share)| slope * share).sum::<f64>()
    }

    /// Passes a block of samples, `before` being the time of the one before it.
    fn block(&mut self, samples: &[FitSample], scale: Scale, before: f64, rows: &mut Rows) {
        let Some(forcing) = self.regular(samples, scale, before) else {
            let mut before = before;
            for (i, sample) in samples.iter().enumerate() {
                self.advance(scale.depth(sample), sample.t.0 - before);
                before = sample.t.0;
                self.write(rows, i);
            }
            return;
        };
        let weights = *self.table.newest();
        run_wide(
            #[inline(always)]
            || self.recur(samples, scale, &forcing, &weights, rows),
        );
        self.settle();
        self.depth = scale.depth(&samples[LANES - 1]);
    }

    /// The recursions over a block, each sample on the one before it.
    #[inline(always)]
    fn recur(
        &mut self,
        samples: &[FitSample],
        scale: Scale,
        forcing: &Forcing,
        weights: &Weights,
        rows: &mut Rows,
    ) {
        let (r_slope_0, dt) = (weights.step.r * weights.slope[0], weights.step.dt);
        let mut from = self.depth;
        for (i, sample) in samples.iter().enumerate() {
            let psi_0 = forcing.psi_0[i];
            if SLOPES {
                self.slope(psi_0, r_slope_0, forcing.sloped.each_ref().map(|lane| lane[i]));
                let to = scale.depth(sample);
                self.touch += psi_0 * (1.0 - self.touch);
                self.speed += psi_0 * ((to - from) / dt - self.speed);
                self.elapsed += dt;
                from = to;
            }
            self.relax(psi_0, forcing.weighted.each_ref().map(|lane| lane[i]));
            self.write(rows, i);
        }
    }

    /// The forcing of a full block in contact with even steps; `None` for any other.
    fn regular(&mut self, samples: &[FitSample], scale: Scale, before: f64) -> Option<Forcing> {
        if samples.len() != LANES || self.depth < 0.0 {
            return None;
        }
        let mut x = [0.0; LANES];
        let mut dt = [0.0; LANES];
        let (mut t, mut shallowest) = (before, 0.0f64);
        for ((x, dt), sample) in x.iter_mut().zip(&mut dt).zip(samples) {
            *x = scale.depth(sample);
            *dt = sample.t.0 - t;
            t = sample.t.0;
            shallowest = shallowest.min(*x);
        }
        let tau = self.table.tau;
        let weights = self.table.near(dt[0]);
        let StepWeights { dt: nominal, r, psi } = weights.step;
        let slope = weights.slope;
        let uneven = dt.iter().fold(0.0f64, |uneven, dt| uneven.max((dt - nominal).abs()));
        if shallowest < 0.0 || uneven > SAME_STEP * nominal {
            return None;
        }
        let mut from = [self.depth; LANES];
        from[1..].copy_from_slice(&x[..LANES - 1]);
        Some(run_wide(
            #[inline(always)]
            || Forcing::new::<SLOPES>(&from, &x, &dt, (nominal, r, tau), &psi, &slope),
        ))
    }
}

/// Scaled depth in contact: `depth / scale - contact`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    /// Depth in mm that counts as one.
    pub depth_mm: f64,
    pub contact: f64,
}

impl Scale {
    #[inline]
    pub fn depth(self, sample: &FitSample) -> f64 {
        self.of(sample.depth.0)
    }

    #[inline]
    pub fn of(self, depth: f64) -> f64 {
        depth / self.depth_mm - self.contact
    }
}

/// Visits all samples in blocks of up to 64 with the columns at them.
pub(super) fn walk<const SLOPES: bool>(
    samples: &[FitSample],
    scale: Scale,
    tau: f64,
    mut visit: impl FnMut(&[FitSample], &Rows),
) {
    let Some((first, rest)) = samples.split_first() else {
        return;
    };
    let mut columns = Columns::<SLOPES>::new(tau, scale.depth(first));
    let mut rows = Rows::new();
    columns.write(&mut rows, 0);
    visit(std::slice::from_ref(first), &rows);
    let mut before = first.t.0;
    for block in rest.chunks(LANES) {
        columns.block(block, scale, before, &mut rows);
        before = block[block.len() - 1].t.0;
        visit(block, &rows);
    }
}

#[cfg(test)]
mod tests;
