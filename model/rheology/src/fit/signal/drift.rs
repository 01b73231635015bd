//! How large the noise and the wandering of a zero are, from where the probe touches nothing.
//!
//! The restricted likelihood of a random walk under white noise (Harville, J. Am. Stat. Assoc. 72 (1977) 320-338)
//! is averaged over the size of the walk: where the record can hardly tell it, its most likely size is often none,
//! and intervals that believe so are too narrow.

use super::UnloadedMean;
use super::zero::{ZeroFilter, ZeroNodes};

/// Nodes of the zero over a record.
const NODES: f64 = 64.0;
/// Sizes of the walk that are looked at, evenly in their logarithm: its standard deviation over the whole record,
/// in standard deviations of the mean of all unloaded samples. The least is a tenth of what noise hides.
const SIZES: (f64, f64) = (0.1, 1e4);
const SIZE_COUNT: i32 = 41;

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
}

impl Drift {
    /// Of the means out of contact, for nodes from `start` to `end` in s; `None` where there are too few.
    pub fn estimate(unloaded: &[UnloadedMean], start: f64, end: f64) -> Option<Self> {
        let spacing = (end - start) / NODES;
        let count: usize = unloaded.iter().map(|one| one.count).sum();
        if unloaded.len() < 4 || spacing <= 0.0 {
            return None;
        }
        let of = |size: f64| {
            // In units of the noise of one sample.
            let walk = size / ((count as f64).sqrt() * (end - start).sqrt());
            let nodes = ZeroNodes { start, spacing, step_weight: 1.0 / (walk * spacing.sqrt()) };
            let mut filter = ZeroFilter::new(nodes, 1);
            for one in unloaded {
                filter.push(one.t.0, &[one.volts.0], (one.count as f64).sqrt());
            }
            let solution = filter.finish();
            // Level and trend are found besides the walk.
            let spare = (unloaded.len() - 2) as f64;
            let square = solution.factor.residual_sum(0);
            let steps = solution.steps as f64;
            let deviance =
                spare * square.ln() + 2.0 * solution.logs - 2.0 * steps * nodes.step_weight.ln();
            let variance = square / spare;
            (deviance, variance, walk * walk * variance)
        };
        let ratio = (SIZES.1 / SIZES.0).ln() / f64::from(SIZE_COUNT - 1);
        let sizes = (0..SIZE_COUNT).map(|k| SIZES.0 * (ratio * f64::from(k)).exp());
        let all: Vec<_> = sizes.map(of).filter(|one| one.0.is_finite()).collect();
        let best = all.iter().fold(f64::INFINITY, |best, one| best.min(one.0));
        let weights = all.iter().map(|one| (-0.5 * (one.0 - best)).exp());
        let (mut sum, mut noise, mut walk) = (0.0, 0.0, 0.0);
        for (weight, (_, own_noise, own_walk)) in weights.zip(&all) {
            sum += weight;
            noise += weight * own_noise;
            walk += weight * own_walk;
        }
        let found = Self { noise: (noise / sum).sqrt(), walk: (walk / sum).sqrt(), start, spacing };
        (found.noise > 0.0 && found.walk.is_finite()).then_some(found)
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
