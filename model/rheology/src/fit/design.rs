//! The columns of the linear problem at one relaxation time, with their exact derivatives, 64
//! samples at a time.
//!
//! Depth is scaled by its greatest value, so every column is of order one. The depth terms are the
//! filtered `u`, `u (2u - 1)` and `u (6u^2 - 6u + 1)`, `u = x / X`: `u` times the Legendre
//! polynomials on 0..1, nearly orthogonal over the depths passed where bare powers are nearly
//! parallel. The others are the viscous drive, the decay of the initial force, and one.

pub(super) use super::options::LINEAR_COUNT;
use super::sample::FitSample;
use crate::vectors::wide;
use palpate_model::viscoelastic::{
    Compensated, NEGLIGIBLE, PSI_COUNT, Pieces, StepWeights, forcing, psi_derivatives,
};

/// Samples worked on together.
pub(super) const LANES: usize = 64;
/// One number for each of them.
pub(super) type Lane = [f64; LANES];
/// Coefficients of the columns: three Legendre depth terms, viscous, initial force, offset.
pub(super) type Coefficients = [f64; LINEAR_COUNT];

/// Step lengths this close (relative) share their psi, corrected to first order; the remaining
/// relative error is the square of this.
const SAME_STEP: f64 = 1e-8;
/// Distinct step lengths remembered at a time: every block length of a thinned record.
const STEPS_KEPT: usize = 16;

#[derive(Clone, Copy, Debug)]
struct Weights {
    step: StepWeights,
    /// Derivatives of `psi_0 ..= psi_3` by `r`.
    slope: [f64; 4],
}

/// psi by step length at one tau, so that a regular record computes it once.
#[derive(Clone, Debug)]
struct StepTable {
    tau: f64,
    kept: Vec<Weights>,
    newest: usize,
    replaced: usize,
}

impl StepTable {
    fn fresh(&self, dt: f64) -> Weights {
        let step = StepWeights::new(dt, self.tau);
        let slope = psi_derivatives(step.r, &step.psi);
        Weights { step, slope }
    }

    /// The remembered weights of a step of about `dt`.
    #[inline]
    fn near(&mut self, dt: f64) -> &Weights {
        let is_same = |kept: &Weights| (dt - kept.step.dt).abs() <= SAME_STEP * kept.step.dt;
        if !self.kept.get(self.newest).is_some_and(is_same) {
            self.newest = match self.kept.iter().position(is_same) {
                Some(index) => index,
                None => self.keep(dt),
            };
        }
        &self.kept[self.newest]
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

    #[inline]
    fn get(&mut self, dt: f64) -> Weights {
        let tau = self.tau;
        let mut weights = *self.near(dt);
        if dt != weights.step.dt {
            let delta = (dt - weights.step.dt) / tau;
            for (psi, slope) in weights.step.psi.iter_mut().zip(weights.slope) {
                *psi += delta * slope;
            }
            weights.step.dt = dt;
        }
        weights
    }
}

/// Filter states of all columns. `SLOPES` carries the derivatives by `log tau` and by the contact
/// position along.
#[derive(Clone, Debug)]
pub(super) struct Columns<const SLOPES: bool> {
    table: StepTable,
    /// Filtered powers 1, 2, 3 of depth, filtered viscous drive, with their rounding errors as in
    /// `Compensated`, side by side.
    filtered: [f64; 4],
    carry: [f64; 4],
    decay: Compensated,
    /// Derivatives of `filtered` by `log tau`.
    tau_slopes: [f64; 4],
    /// Filtered "in contact" (the zeroth power) and filtered speed in contact.
    touch: f64,
    speed: f64,
    elapsed: f64,
    depth: f64,
}

/// The columns at up to 64 samples.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    /// Filtered powers 1, 2, 3 and viscous drive.
    filtered: [Lane; 4],
    decay: Lane,
    tau_slopes: [Lane; 4],
    touch: Lane,
    speed: Lane,
    elapsed: Lane,
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

    /// Writes the six columns.
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
pub(super) fn six(at: &[f64]) -> Coefficients {
    std::array::from_fn(|k| at[k])
}

/// What to divide scaled coefficients of powers by for N/mm, N/mm^2, N/mm^3, N*s/mm^2, N, N.
pub(super) fn linear_units(depth_mm: f64) -> Coefficients {
    let x = depth_mm;
    [x, x * x, x * x * x, x * x, 1.0, 1.0]
}

/// Coefficients of the bare powers `u, u^2, u^3` of Legendre depth terms.
pub(super) fn powers_from_legendre(at: &Coefficients) -> [f64; 3] {
    let [a, b, c, ..] = *at;
    [a - b + c, 2.0 * b - 6.0 * c, 6.0 * c]
}

/// Legendre depth terms of bare powers, the other coefficients unchanged.
pub(super) fn legendre_from_powers(scaled: &Coefficients) -> Coefficients {
    let [a, b, c, viscous, initial, offset] = *scaled;
    [
        a + b / 2.0 + c / 3.0,
        b / 2.0 + c / 2.0,
        c / 6.0,
        viscous,
        initial,
        offset,
    ]
}

/// Steps and forcing of 64 samples whose intervals are alike.
struct Forcing {
    psi_0: Lane,
    /// Of the filtered powers and the viscous drive.
    weighted: [Lane; 4],
    /// The same by `r`, times `r`.
    sloped: [Lane; 4],
}

impl Forcing {
    /// Straight moves from `from` to `x` in about `kept` s each, for psi and its slopes there.
    #[inline(always)]
    fn new<const SLOPES: bool>(
        from: &Lane,
        x: &Lane,
        dt: &Lane,
        (kept, r, tau): (f64, f64, f64),
        psi: &[f64; PSI_COUNT],
        slope: &[f64; 4],
    ) -> Self {
        let mut forcing = Self {
            psi_0: [0.0; LANES],
            weighted: [[0.0; LANES]; 4],
            sloped: [[0.0; LANES]; 4],
        };
        let [w1, w2, w3, w4] = &mut forcing.weighted;
        let [s1, s2, s3, s4] = &mut forcing.sloped;
        for i in 0..LANES {
            let (x0, d) = (from[i], x[i] - from[i]);
            let speed = d / dt[i];
            let delta = (dt[i] - kept) / tau;
            let p0 = psi[0] + delta * slope[0];
            let p1 = psi[1] + delta * slope[1];
            let p2 = psi[2] + delta * slope[2];
            let p3 = psi[3] + delta * slope[3];
            let (x2, d2) = (x0 * x0, d * d);
            let (xd2, d2x3, x2d3) = (2.0 * x0 * d, 3.0 * d2 * x0, 3.0 * x2 * d);
            let (x3, d3) = (x2 * x0, d2 * d);
            let first = x0 * p0 + d * p1;
            forcing.psi_0[i] = p0;
            w1[i] = first;
            w2[i] = x2 * p0 + (xd2 * p1 + d2 * p2);
            w3[i] = (x3 * p0 + x2d3 * p1) + (d2x3 * p2 + d3 * p3);
            w4[i] = speed * first;
            if SLOPES {
                let [r0, r1, r2, r3] = slope.map(|slope| r * slope);
                let first = x0 * r0 + d * r1;
                s1[i] = first;
                s2[i] = x2 * r0 + (xd2 * r1 + d2 * r2);
                s3[i] = (x3 * r0 + x2d3 * r1) + (d2x3 * r2 + d3 * r3);
                s4[i] = speed * first;
            }
        }
        forcing
    }
}

impl<const SLOPES: bool> Columns<SLOPES> {
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
            filtered: [0.0; 4],
            carry: [0.0; 4],
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
            Pieces::Entering([outside, inside]) => {
                self.part(0.0, 0.0, 0.0, dt * outside);
                self.part(0.0, to, 1.0, dt * inside);
            }
            Pieces::Leaving([inside, outside]) => {
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
        let [w1, w2, w3] = forcing(x0, d, psi);
        if SLOPES {
            let slope = &weights.slope;
            let [s1, s2, s3] = forcing(x0, d, slope);
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
            self.decay = Compensated::default();
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
        let weights = self.table.kept[self.table.newest];
        wide(
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
                self.slope(
                    psi_0,
                    r_slope_0,
                    forcing.sloped.each_ref().map(|lane| lane[i]),
                );
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
        let StepWeights { dt: kept, r, psi } = weights.step;
        let slope = weights.slope;
        let uneven = dt
            .iter()
            .fold(0.0f64, |uneven, dt| uneven.max((dt - kept).abs()));
        if shallowest < 0.0 || uneven > SAME_STEP * kept {
            return None;
        }
        let mut from = [self.depth; LANES];
        from[1..].copy_from_slice(&x[..LANES - 1]);
        Some(wide(
            #[inline(always)]
            || Forcing::new::<SLOPES>(&from, &x, &dt, (kept, r, tau), &psi, &slope),
        ))
    }
}

/// Scaled depth in contact: `depth / scale - contact`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    /// Depth in mm that counts as one.
    pub depth_mm: f64,
    /// Scaled contact position.
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
mod tests {
    use super::*;
    use palpate_model::units::{Depth, Newtons, Seconds};

    const AT: Coefficients = [0.7, -0.4, 0.3, 1.1, 0.2, 0.1];

    fn sample(t: f64, depth: f64) -> FitSample {
        FitSample {
            t: Seconds(t),
            depth: Depth(depth),
            force: Newtons(0.0),
            sigma: Newtons(1.0),
        }
    }

    /// A path in and out of contact with uneven steps, then 200 even ones.
    fn path() -> Vec<FitSample> {
        let corners = [
            (-0.2, 0.0),
            (0.5, 1.0),
            (0.5, 0.3),
            (0.9, 0.31),
            (0.9, 2.0),
            (-0.2, 0.7),
            (0.4, 0.8),
        ];
        let mut samples = vec![sample(0.0, corners[0].0)];
        let (mut t, mut x) = (0.0, corners[0].0);
        for (to, span) in &corners[1..] {
            for part in 1..=4 {
                let share = f64::from(part) / 4.0;
                samples.push(sample(t + span * share, x + (to - x) * share));
            }
            (t, x) = (t + span, *to);
        }
        for i in 1..=200 {
            samples.push(sample(t + 0.01 * f64::from(i), x + 0.002 * f64::from(i)));
        }
        samples
    }

    /// Modelled force and its two derivatives at every sample.
    fn force(tau: f64, contact: f64) -> Vec<[f64; 3]> {
        let scale = Scale {
            depth_mm: 1.0,
            contact,
        };
        let mut all = Vec::new();
        walk::<true>(&path(), scale, tau, |samples, rows| {
            let mut columns = [[0.0; LANES]; 6];
            rows.values(&mut columns);
            let (tau_slope, contact_slope) = (rows.tau_slope(&AT, tau), rows.contact_slope(&AT));
            for i in 0..samples.len() {
                let force = columns.iter().zip(AT).map(|(c, a)| c[i] * a).sum();
                all.push([force, tau_slope[i], contact_slope[i]]);
            }
        });
        all
    }

    fn check(high: &[[f64; 3]], low: &[[f64; 3]], h: f64, here: &[[f64; 3]], which: usize) {
        for ((high, low), here) in high.iter().zip(low).zip(here) {
            let numerical = (high[0] - low[0]) / (2.0 * h);
            let exact = here[which];
            // Differences over 1e-5 or less keep about ten digits of forces of order one.
            let miss = (numerical - exact).abs();
            assert!(miss < 1e-9 * exact.abs().max(0.1), "{numerical} {exact}");
        }
    }

    #[test]
    fn derivative_by_log_tau_is_exact() {
        for tau in [0.02, 0.4, 1.0, 30.0] {
            let h = 1e-5f64;
            let (high, low) = (force(tau * h.exp(), 0.1), force(tau * (-h).exp(), 0.1));
            check(&high, &low, h, &force(tau, 0.1), 1);
        }
    }

    #[test]
    fn derivative_by_contact_is_exact() {
        for tau in [0.2, 1.0, 30.0] {
            // No sample lies within h of the contact, where the derivative has a kink.
            let h = 2e-6;
            let (high, low) = (force(tau, 0.11 + h), force(tau, 0.11 - h));
            check(&high, &low, h, &force(tau, 0.11), 2);
        }
    }

    #[test]
    fn blocks_agree_with_single_steps() {
        let samples = path();
        let scale = Scale {
            depth_mm: 1.0,
            contact: 0.0,
        };
        let mut single = Columns::<true>::new(0.3, scale.depth(&samples[0]));
        let mut before = samples[0].t.0;
        let mut index = 0;
        walk::<true>(&samples, scale, 0.3, |block, rows| {
            for (i, sample) in block.iter().enumerate() {
                if index > 0 {
                    single.advance(scale.depth(sample), sample.t.0 - before);
                }
                before = sample.t.0;
                index += 1;
                let row = single.row();
                for (lane, exact) in rows.filtered.iter().zip(row) {
                    assert!((lane[i] - exact).abs() < 1e-15, "{} {exact}", lane[i]);
                }
                assert!((rows.decay[i] - row[4]).abs() < 1e-15);
                let miss = rows.tau_slopes[3][i] - single.tau_slopes[3];
                assert!(miss.abs() < 1e-14, "{miss}");
            }
        });
        assert_eq!(index, samples.len());
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

    #[test]
    fn legendre_terms_and_powers_map_both_ways() {
        let [p1, p2, p3] = powers_from_legendre(&AT);
        let back = legendre_from_powers(&[p1, p2, p3, AT[3], AT[4], AT[5]]);
        for (one, other) in back.into_iter().zip(AT) {
            assert!((one - other).abs() < 1e-15);
        }
    }
}
