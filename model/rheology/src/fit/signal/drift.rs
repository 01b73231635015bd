//! How large the noise and the wandering of a zero are.
//!
//! The restricted likelihood of a random walk under white noise (Harville, J. Am. Stat. Assoc. 72 (1977) 320-338)
//! is averaged over the size of the walk: where a record can hardly tell it, its most likely size is often none,
//! and intervals that believe so are too narrow. The record itself tells it too, once its force is known, but only
//! among the sizes that are possible where the probe touches nothing: what a wrong model of the tissue leaves is no
//! drift.

use super::UnloadedMean;
use super::zero::{ZeroFilter, ZeroNodes, ZeroSolution};

/// Nodes of the zero over a record: every 3.4 s of a ramp and hold, where the lab rig's zero wanders by 12 uV, two thirds of
/// the 17 uV that its noise leaves of a mean.
const NODES: f64 = 64.0;
/// Sizes of the walk that are looked at, evenly in their logarithm: its standard deviation over the whole record,
/// in standard deviations of the mean of all unloaded samples. The least is a tenth of what noise hides.
const SIZES: (f64, f64) = (0.1, 1e4);
const SIZE_COUNT: i32 = 33;
/// A size whose deviance is larger by so much than the least is impossible: the 99 % point of chi-square with one degree
/// of freedom.
const POSSIBLE: f64 = 6.63;

/// Noise and wandering of a zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct Drift {
    /// White noise of one sample in V.
    pub noise: f64,
    /// Random walk in V per root of a second.
    pub walk: f64,
    /// Time of the first node and time between nodes in s.
    pub start: f64,
    pub spacing: f64,
    /// Variance of the walk's variance, as a share of its square.
    pub spread: f64,
}

impl Drift {
    /// Time between nodes of the zero over a time in s.
    pub fn spacing_over(secs: f64) -> f64 {
        secs / NODES
    }

    /// The nodes for rows that weigh by one over their noise, times `scale`.
    pub fn nodes(&self, scale: f64) -> ZeroNodes {
        ZeroNodes {
            start: self.start,
            spacing: self.spacing,
            step_weight: scale / (self.walk * self.spacing.sqrt()),
        }
    }
}

/// One size of the walk, and how well it describes a signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct DriftSize {
    /// Walk per root of a second, in noises of one sample.
    ratio: f64,
    /// Twice the negative logarithm of the restricted likelihood.
    deviance: f64,
    /// Variance of one sample in V^2.
    variance: f64,
}

/// The possible sizes of the walk of one signal.
#[derive(Clone, Debug, PartialEq)]
pub(in super::super) struct DriftSizes {
    start: f64,
    spacing: f64,
    sizes: Vec<DriftSize>,
}

impl DriftSizes {
    /// Of the means out of contact, for nodes from `start` to `end` in s; `None` where there are too few.
    pub fn of(unloaded: &[UnloadedMean], start: f64, end: f64) -> Option<Self> {
        let spacing = Drift::spacing_over(end - start);
        if unloaded.len() < 4 || spacing <= 0.0 {
            return None;
        }
        let count: usize = unloaded.iter().map(|one| one.count).sum();
        let least = 1.0 / ((count as f64).sqrt() * (end - start).sqrt());
        let step = (SIZES.1 / SIZES.0).ln() / f64::from(SIZE_COUNT - 1);
        let ratios = (0..SIZE_COUNT).map(|k| least * SIZES.0 * (step * f64::from(k)).exp());
        let all = Self { start, spacing, sizes: Vec::new() }.with(ratios, |nodes| {
            let mut filter = ZeroFilter::new(nodes, 1);
            for one in unloaded {
                filter.push(one.t.0, &[one.volts.0], (one.count as f64).sqrt());
            }
            let solution = filter.finish();
            let square = solution.factor.residual_sum(0);
            (solution, square, 0.0, unloaded.len())
        });
        let best = all.best();
        let is_possible = |one: &&DriftSize| one.deviance - best < POSSIBLE;
        let sizes: Vec<DriftSize> = all.sizes.iter().filter(is_possible).copied().collect();
        let is_noisy = sizes.iter().all(|one| one.variance > 0.0);
        (!sizes.is_empty() && is_noisy).then_some(Self { sizes, ..all })
    }

    /// The one size that is known.
    pub fn given(drift: &Drift) -> Self {
        let size = DriftSize {
            ratio: drift.walk / drift.noise,
            deviance: 0.0,
            variance: drift.noise.powi(2),
        };
        Self { start: drift.start, spacing: drift.spacing, sizes: vec![size] }
    }

    /// The same sizes judged by more rows: `solve` gives the problem without the zero, the sum of squares left, the sum of
    /// the logarithms of the pivots of everything else that is found, and the number of rows less that of these.
    pub fn judged_by(&self, solve: impl Fn(ZeroNodes) -> (ZeroSolution, f64, f64, usize)) -> Self {
        let ratios: Vec<f64> = self.sizes.iter().map(|one| one.ratio).collect();
        Self { sizes: Vec::new(), ..*self }.with(ratios.into_iter(), solve)
    }

    fn with(
        mut self,
        ratios: impl Iterator<Item = f64>,
        solve: impl Fn(ZeroNodes) -> (ZeroSolution, f64, f64, usize),
    ) -> Self {
        let of = |ratio: f64| {
            let step_weight = 1.0 / (ratio * self.spacing.sqrt());
            let nodes = ZeroNodes { start: self.start, spacing: self.spacing, step_weight };
            let (solution, square, logs, rows) = solve(nodes);
            // Level and trend are found besides the walk.
            let spare = rows as f64 - 2.0;
            let deviance = spare * square.ln() + 2.0 * (solution.logs + logs)
                - 2.0 * solution.steps as f64 * step_weight.ln();
            DriftSize { ratio, deviance, variance: square / spare }
        };
        let sizes = ratios.map(of).filter(|one| one.deviance.is_finite());
        self.sizes = sizes.collect();
        self
    }

    fn best(&self) -> f64 {
        self.sizes.iter().fold(f64::INFINITY, |best, one| best.min(one.deviance))
    }

    /// The mean squares of noise and walk over all sizes, each as likely as it is.
    pub fn mean(&self) -> Option<Drift> {
        let best = self.best();
        let (mut sum, mut noise, mut walk) = (0.0, 0.0, 0.0);
        let mut walk_square = 0.0;
        for one in &self.sizes {
            let weight = (-0.5 * (one.deviance - best)).exp();
            sum += weight;
            noise += weight * one.variance;
            let square = one.variance * one.ratio.powi(2);
            walk += weight * square;
            walk_square += weight * square * square;
        }
        let spread = (walk_square * sum / (walk * walk) - 1.0).max(0.0);
        let [noise, walk] = [noise, walk].map(|square| (square / sum).sqrt());
        let found = Drift { noise, walk, start: self.start, spacing: self.spacing, spread };
        (noise > 0.0 && walk > 0.0 && walk.is_finite()).then_some(found)
    }
}
