//! The fit while samples arrive: constant cost and memory per sample, however long the session.
//!
//! A bank of relaxation times, each with its exact filter states and the Gram matrix of its
//! columns. An answer solves every node's linear problem, finds the smallest residual and refines
//! between nodes by polynomials in log tau. Gram matrices lose half the digits, which a display
//! can afford and a report cannot: [`super::fit`] works on the samples.

use super::live_stencil::{Solution, Stencil};
use super::options::{PARAMETER_NAMES, PARAMETER_UNITS};
use super::report::Parameter;
use crate::units::{Depth, Newtons, Seconds};
use crate::viscoelastic::{NEGLIGIBLE, psi_all};
use serde::{Deserialize, Serialize};

/// Relaxation times in the bank and their range in s: soft tissue from a tap to a creep test.
pub(super) const NODES: usize = 64;
const TAU_RANGE: [f64; 2] = [0.01, 1000.0];

/// Columns: three orthogonal depth terms, the viscous one, initial force, offset; then the force.
pub(super) const COLUMNS: usize = 6;
const WIDTH: usize = COLUMNS + 1;
const GRAM: usize = WIDTH * (WIDTH + 1) / 2;

/// A scaled pivot below this is rounding: the columns cannot be told apart.
const PIVOT_MIN: f64 = 1e-10;

/// A parameter counts as identified when its standard error is below this share of its value.
const IDENTIFIED_SHARE: f64 = 0.5;

/// Samples folded into the Gram matrices together, so that each of their 1792 numbers is loaded and
/// stored once for several samples. Batch and matrices fit a first-level cache of 32 KB.
const BATCH: usize = 4;

type Lane = [f64; NODES];
type Batch = [[Lane; BATCH]; WIDTH];

/// The bank and what it has accumulated.
#[derive(Clone, Debug, PartialEq)]
pub struct LiveFit {
    depth_max: f64,
    taus: Lane,
    /// Filtered powers 1..3 of depth / `depth_max`, viscous column, decay of the initial force.
    states: [Lane; 5],
    /// Without the samples that wait in `batch`.
    gram: Vec<Lane>,
    batch: Batch,
    waiting: usize,
    steps: Option<Steps>,
    last: Option<(f64, f64)>,
    weight_sum: f64,
    samples: u64,
}

/// psi functions of every node for one sampling interval.
#[derive(Clone, Debug, PartialEq)]
struct Steps {
    dt: f64,
    psi: [Lane; 4],
}

impl Steps {
    fn new(taus: &Lane, dt: f64) -> Self {
        let mut psi = [[0.0; NODES]; 4];
        for (node, tau) in taus.iter().enumerate() {
            let all = psi_all(dt / tau);
            for (lane, value) in psi.iter_mut().zip(all) {
                lane[node] = value;
            }
        }
        Self { dt, psi }
    }
}

/// What is known so far.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LiveEstimate {
    /// The five of the body, then `f0` and `f_offset`. Without a standard error a parameter is not
    /// identified yet.
    pub parameters: Vec<Parameter>,
    /// Weighted root mean square residual in N.
    #[serde(alias = "rmse_n")]
    pub rmse_weighted_n: f64,
    /// Samples taken.
    pub samples: u64,
}

impl LiveFit {
    /// A bank for indentations down to about `depth_max`.
    #[must_use]
    pub fn new(depth_max: Depth) -> Self {
        let [low, high] = TAU_RANGE.map(f64::ln);
        let taus = std::array::from_fn(|node| {
            (low + (high - low) * node as f64 / (NODES - 1) as f64).exp()
        });
        let mut states = [[0.0; NODES]; 5];
        states[4] = [1.0; NODES];
        Self {
            depth_max: if depth_max.0 > 0.0 { depth_max.0 } else { 1.0 },
            taus,
            states,
            gram: vec![[0.0; NODES]; GRAM],
            batch: [[[0.0; NODES]; BATCH]; WIDTH],
            waiting: 0,
            steps: None,
            last: None,
            weight_sum: 0.0,
            samples: 0,
        }
    }

    /// Takes a sample. Samples that are not numbers or do not advance in time are left out.
    pub fn push(&mut self, t: Seconds, depth: Depth, force: Newtons, sigma: Newtons) {
        let is_number = t.is_finite() && depth.is_finite() && force.is_finite() && sigma.0 > 0.0;
        if !is_number || self.last.is_some_and(|(last, _)| t.0 <= last) {
            return;
        }
        let x = depth.0.max(0.0) / self.depth_max;
        if let Some((last_t, last_x)) = self.last {
            self.advance(t.0 - last_t, last_x, x);
        }
        self.last = Some((t.0, x));
        self.accumulate(force.0, sigma.0.powi(-2));
        self.samples += 1;
    }

    /// Steps every filter exactly over one straight piece of depth.
    fn advance(&mut self, dt: f64, from: f64, to: f64) {
        // Times are multiples of a tick rounded to doubles; a billionth of the interval is that.
        let is_same = self
            .steps
            .as_ref()
            .is_some_and(|steps| (steps.dt - dt).abs() <= 1e-9 * dt);
        if !is_same {
            self.steps = Some(Steps::new(&self.taus, dt));
        }
        let Some(Steps {
            psi: [psi0, psi1, psi2, psi3],
            ..
        }) = &self.steps
        else {
            return;
        };
        let d = to - from;
        let (from2, d2) = (from * from, d * d);
        let rate = d / dt;
        let [f1, f2, f3, g, e] = &mut self.states;
        for node in 0..NODES {
            let (p0, p1, p2, p3) = (psi0[node], psi1[node], psi2[node], psi3[node]);
            let w1 = from * p0 + d * p1;
            let w2 = from2 * p0 + 2.0 * from * d * p1 + d2 * p2;
            let w3 = from2 * from * p0 + 3.0 * (from2 * d * p1 + from * d2 * p2) + d2 * d * p3;
            f1[node] += w1 - p0 * f1[node];
            f2[node] += w2 - p0 * f2[node];
            f3[node] += w3 - p0 * f3[node];
            g[node] = settled(g[node] + rate * w1 - p0 * g[node]);
            e[node] = settled(e[node] - p0 * e[node]);
        }
    }

    /// Writes the weighted row of every node into the batch and folds a full batch.
    fn accumulate(&mut self, force: f64, weight: f64) {
        let root = weight.sqrt();
        let [f1, f2, f3, g, e] = &self.states;
        let slot = self.waiting;
        let [r0, r1, r2, r3, r4, r5, r6] = &mut self.batch;
        let rows = [r0, r1, r2, r3, r4, r5, r6].map(|row| &mut row[slot]);
        let [r0, r1, r2, r3, r4, r5, r6] = rows;
        for node in 0..NODES {
            let (f1, f2, f3) = (root * f1[node], root * f2[node], root * f3[node]);
            r0[node] = f1;
            r1[node] = 2.0 * f2 - f1;
            r2[node] = 6.0 * (f3 - f2) + f1;
            r3[node] = root * g[node];
            r4[node] = root * e[node];
            r5[node] = root;
            r6[node] = root * force;
        }
        self.waiting += 1;
        if self.waiting == BATCH {
            fold(&mut self.gram, &self.batch);
            self.waiting = 0;
        }
        self.weight_sum += weight;
    }

    /// The Gram matrices with the waiting samples folded in.
    fn gram_so_far(&self) -> Vec<Lane> {
        let mut gram = self.gram.clone();
        let mut batch = self.batch;
        for rows in &mut batch {
            rows[self.waiting..].fill([0.0; NODES]);
        }
        fold(&mut gram, &batch);
        gram
    }

    /// The answer so far; `None` while the record cannot tell the parameters apart.
    #[must_use]
    pub fn estimate(&self) -> Option<LiveEstimate> {
        if self.samples <= 2 * COLUMNS as u64 {
            return None;
        }
        let gram = self.gram_so_far();
        let solutions: Vec<Option<Solution>> =
            (0..NODES).map(|node| self.solve(&gram, node)).collect();
        let best = (0..NODES)
            .filter_map(|node| solutions[node].map(|solution| (node, solution.residual)))
            .min_by(|a, b| a.1.total_cmp(&b.1))?
            .0;
        // A minimum at the edge of what can be solved is not a minimum.
        if best == 0 || best == NODES - 1 {
            return None;
        }
        solutions[best - 1].and(solutions[best + 1])?;
        let stencil = Stencil::around(best, &solutions)?;
        let (offset, curvature) = stencil.minimum()?;
        self.report(&stencil, offset, curvature)
    }

    fn report(&self, stencil: &Stencil, offset: f64, curvature: f64) -> Option<LiveEstimate> {
        let freedom = self.samples as f64 - (COLUMNS + 1) as f64;
        let residual = stencil.at(offset, |solution| solution.residual).max(0.0);
        let variance = residual / freedom;
        let spacing = (TAU_RANGE[1] / TAU_RANGE[0]).ln() / (NODES - 1) as f64;
        let tau = (self.taus[stencil.first].ln() + spacing * offset).exp();
        // Half the curvature of the residual sum is the information, per node spacing.
        let tau_error = tau * spacing * (2.0 * variance / curvature).sqrt();
        // Change of a value over one standard error of tau, from a hundredth of a node each way.
        let tau_share = (2.0 * variance / curvature).sqrt() / 0.02;
        let mut values = vec![(tau, tau_error)];
        for i in 0..COLUMNS {
            let value = |at: f64| stencil.at(at, |solution| solution.values[i]);
            let through_tau = (value(offset + 0.01) - value(offset - 0.01)) * tau_share;
            let linear = stencil.at(offset, |s| s.variances[i]).max(0.0) * variance;
            values.push((value(offset), (linear + through_tau * through_tau).sqrt()));
        }
        if values
            .iter()
            .any(|(value, error)| !(value.is_finite() && error.is_finite()))
        {
            return None;
        }
        Some(LiveEstimate {
            parameters: PARAMETER_NAMES
                .into_iter()
                .zip(PARAMETER_UNITS)
                .zip(values)
                .map(parameter)
                .collect(),
            rmse_weighted_n: (residual / self.weight_sum).sqrt(),
            samples: self.samples,
        })
    }

    /// Solves one node by Cholesky on columns scaled to unit length.
    fn solve(&self, gram: &[Lane], node: usize) -> Option<Solution> {
        let gram = |i: usize, j: usize| {
            let (i, j) = (i.max(j), i.min(j));
            gram[i * (i + 1) / 2 + j][node]
        };
        let scale: [f64; WIDTH] = std::array::from_fn(|i| gram(i, i).sqrt());
        if scale[..COLUMNS]
            .iter()
            .any(|length| length.is_nan() || *length <= 0.0)
        {
            return None;
        }
        let mut factor = [[0.0; WIDTH]; WIDTH];
        for i in 0..WIDTH {
            for j in 0..=i {
                let known: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
                let value = gram(i, j) / (scale[i] * scale[j].max(f64::MIN_POSITIVE)) - known;
                if i == j {
                    if i < COLUMNS && value <= PIVOT_MIN {
                        return None;
                    }
                    factor[i][i] = value.max(0.0).sqrt();
                } else {
                    factor[i][j] = value / factor[j][j];
                }
            }
        }
        let mut coefficients = [0.0; COLUMNS];
        let mut variances = [0.0; COLUMNS];
        for i in (0..COLUMNS).rev() {
            let known: f64 = (i + 1..COLUMNS)
                .map(|k| factor[k][i] * coefficients[k])
                .sum();
            coefficients[i] = (factor[COLUMNS][i] - known) / factor[i][i];
        }
        for (i, coefficient) in coefficients.iter_mut().enumerate() {
            *coefficient *= scale[COLUMNS] / scale[i];
        }
        let mut values = [0.0; COLUMNS];
        for (i, map) in self.maps().iter().enumerate() {
            values[i] = (0..COLUMNS).map(|k| map[k] * coefficients[k]).sum();
            // Variance of map . coefficients: the squared length of L^-1 map.
            let mut z = [0.0; COLUMNS];
            for k in 0..COLUMNS {
                let known: f64 = (0..k).map(|m| factor[k][m] * z[m]).sum();
                z[k] = (map[k] / scale[k] - known) / factor[k][k];
            }
            variances[i] = z.iter().map(|value| value * value).sum();
        }
        let residual = (factor[COLUMNS][COLUMNS] * scale[COLUMNS]).powi(2);
        Some(Solution {
            values,
            variances,
            residual,
        })
    }

    /// Rows that turn coefficients of the columns into parameters: the exact map from
    /// `q1 u + q2 u(2u-1) + q3 u(6u^2-6u+1)`, `u = depth / depth_max`, to powers of depth.
    fn maps(&self) -> [[f64; COLUMNS]; COLUMNS] {
        let x = self.depth_max;
        let (x2, x3) = (x * x, x * x * x);
        [
            [1.0 / x, -1.0 / x, 1.0 / x, 0.0, 0.0, 0.0],
            [0.0, 2.0 / x2, -6.0 / x2, 0.0, 0.0, 0.0],
            [0.0, 0.0, 6.0 / x3, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 1.0 / x2, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 1.0, 0.0],
            [0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        ]
    }
}

/// Adds the products of a batch of rows to the Gram matrices.
fn fold(gram: &mut [Lane], batch: &Batch) {
    let mut sums = gram.iter_mut();
    for i in 0..WIDTH {
        for j in 0..=i {
            let Some(sum) = sums.next() else { return };
            let ([a0, a1, a2, a3], [b0, b1, b2, b3]) = (&batch[i], &batch[j]);
            for node in 0..NODES {
                sum[node] += (a0[node] * b0[node] + a1[node] * b1[node])
                    + (a2[node] * b2[node] + a3[node] * b3[node]);
            }
        }
    }
}

fn parameter(((name, unit), (value, error)): ((&str, &str), (f64, f64))) -> Parameter {
    // Initial force and offset are near zero by design; their size says nothing of identification.
    let is_level = matches!(name, "f0" | "f_offset");
    let is_identified = is_level || error < IDENTIFIED_SHARE * value.abs();
    Parameter {
        name: name.into(),
        value,
        unit: unit.into(),
        std_error: is_identified.then_some(error),
        // 1.96 standard errors: two-sided 95 % of a normal distribution.
        ci95: is_identified.then_some([value - 1.96 * error, value + 1.96 * error]),
        is_fixed: false,
    }
}

/// Zero for what decayed beyond meaning, which would otherwise slow every later sample down.
#[inline]
fn settled(value: f64) -> f64 {
    if value.abs() < NEGLIGIBLE { 0.0 } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    const THESIS: [f64; 5] = [1.023, 0.053_33, -0.0086, 0.000_434_5, 0.06];

    /// Thesis body under ramp and hold, by the closed form of the ramp in small steps of the ODE's
    /// exact solution for a forcing taken linear over 0.1 ms.
    fn feed(fit: &mut LiveFit, hold_secs: f64) {
        let [tau, mu1, mu2, mu3, tau_sig] = THESIS;
        let (speed, depth_max) = (0.75, 30.0);
        let (mut force, mut x) = (0.0, 0.0f64);
        let h = 1e-4f64;
        let (e, r) = ((-h / tau).exp(), h / tau);
        let forcing = |x: f64, v: f64| ((mu3 * x + mu2) * x + mu1) * x + tau_sig * x * v;
        fit.push(Seconds(0.0), Depth(0.0), Newtons(0.0), Newtons(0.02));
        for i in 0..((40.0 + hold_secs) * 1000.0) as u32 {
            for k in 0..10 {
                let t = f64::from(i * 10 + k) * h;
                let v = if t < 40.0 - 1e-9 { speed } else { 0.0 };
                let next = (speed * (t + h)).min(depth_max);
                let (a, b) = (forcing(x, v), forcing(next, v));
                force = e * force + (1.0 - e) * a + (b - a) * (1.0 - (1.0 - e) / r);
                x = next;
            }
            fit.push(
                Seconds(f64::from(i + 1) * 1e-3),
                Depth(x),
                Newtons(force),
                Newtons(0.02),
            );
        }
    }

    #[test]
    fn finds_the_thesis_body_between_its_nodes() {
        let mut fit = LiveFit::new(Depth(30.0));
        feed(&mut fit, 50.0);
        let estimate = fit.estimate().unwrap();
        for (parameter, truth) in estimate.parameters.iter().zip(THESIS) {
            // Six nodes 0.18 apart in log tau interpolate to about a thousandth.
            let relative = (parameter.value / truth - 1.0).abs();
            assert!(relative < 5e-3, "{} {relative:e}", parameter.name);
            assert!(parameter.std_error.is_some());
        }
    }

    #[test]
    fn a_part_filled_batch_counts() {
        // Odd lengths leave samples waiting; every answer must know of all of them.
        let mut fit = LiveFit::new(Depth(30.0));
        feed(&mut fit, 20.0);
        for extra in 1..=5 {
            fit.push(
                Seconds(60.0 + f64::from(extra) * 1e-3),
                Depth(30.0),
                Newtons(50.0),
                Newtons(1e-4),
            );
            let mut sums = 0.0;
            for lane in &fit.gram_so_far()[GRAM - 1..] {
                sums += lane[0];
            }
            let heavy = 2500.0 * 1e8 * f64::from(extra);
            assert!((sums / heavy - 1.0).abs() < 0.02, "{extra}: {sums:e}");
        }
    }

    #[test]
    fn says_nothing_before_there_is_something_to_say() {
        let mut fit = LiveFit::new(Depth(30.0));
        assert_eq!(fit.estimate(), None);
        for i in 0..1000 {
            fit.push(
                Seconds(f64::from(i) * 1e-3),
                Depth(0.0),
                Newtons(0.0),
                Newtons(0.02),
            );
        }
        assert_eq!(fit.estimate(), None);
    }
}
