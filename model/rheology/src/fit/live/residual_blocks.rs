//! Block means of the residuals and of the model's derivatives, from which the correlation time of
//! the noise is estimated.

use super::LiveFit;
use super::bank::FILTERED;
use super::blocks::Mark;
use super::stencil::{Jet, Stencil};
use palpate_model::units::Seconds;

/// Means over equally long blocks of samples, oldest first.
#[derive(Clone, Debug, PartialEq)]
pub struct ResidualBlocks {
    pub samples_per_block: u64,
    /// From the end of one block to the end of the next, in s.
    pub seconds_per_block: Seconds,
    /// Weighted mean of measured minus modelled force in N; zero in a block without weight.
    pub residuals: Vec<f64>,
    /// Weighted means of the derivatives of the modelled force, in N per unit of each parameter, by
    /// `tau_eps, mu1, mu2, mu3, tau_sig, f0, f_offset`.
    pub jacobian: Vec<[f64; 7]>,
    /// Sum of the weights of a block in 1/N^2.
    pub weights: Vec<f64>,
}

impl LiveFit {
    /// Residuals of the samples so far under given parameters, block by block; `linear` are
    /// `mu1, mu2, mu3, tau_sig, f0, f_offset` in their units. Exact up to rounding and to
    /// interpolation in log tau (1e-8); `None` for a tau outside the bank.
    #[must_use]
    pub fn residual_blocks(&self, tau: Seconds, linear: &[f64; 6]) -> Option<ResidualBlocks> {
        let grid = self.bank.grid();
        let place = grid.place_of(tau.0);
        if !(1.0..=(grid.nodes - 2) as f64).contains(&place) {
            return None;
        }
        let stencil = Stencil::around(place.round() as usize, (0, grid.nodes - 1))?;
        let jet = stencil.jet(place);
        let marks = &self.blocks.marks;
        let count = marks.len() - 1;
        let mut blocks = ResidualBlocks {
            samples_per_block: self.blocks.length,
            seconds_per_block: Seconds(match marks.get(1..) {
                Some([first, .., last]) => (last.t - first.t) / (count - 1) as f64,
                _ => f64::NAN,
            }),
            residuals: Vec::with_capacity(count),
            jacobian: Vec::with_capacity(count),
            weights: Vec::with_capacity(count),
        };
        for pair in marks.windows(2) {
            let weight = pair[1].shared[0] - pair[0].shared[0];
            let over_weight = if weight > 0.0 { 1.0 / weight } else { 0.0 };
            let means = self.means(pair, &stencil, &jet, over_weight);
            let force = (pair[1].shared[1] - pair[0].shared[1]) * over_weight;
            let mut row = [0.0; 7];
            let mut modelled = 0.0;
            for (k, (value, by_place)) in means.into_iter().enumerate() {
                row[1 + k] = value;
                row[0] += linear[k] * by_place / (grid.spacing() * tau.0);
                modelled += linear[k] * value;
            }
            blocks.residuals.push(force - modelled);
            blocks.jacobian.push(row);
            blocks.weights.push(weight);
        }
        Some(blocks)
    }

    /// Mean of each column of the powers of depth in mm, with its derivative by the place in the
    /// bank.
    fn means(
        &self,
        pair: &[Mark],
        stencil: &Stencil,
        jet: &Jet,
        over_weight: f64,
    ) -> [(f64, f64); 6] {
        let q: [(f64, f64); FILTERED] = std::array::from_fn(|k| {
            let of = |node: usize| (pair[1].sums[node][k] - pair[0].sums[node][k]) * over_weight;
            (stencil.value(jet, of), stencil.slope(jet, of))
        });
        let x = self.depth_max;
        let mix = |shares: [f64; 3], unit: f64| {
            let sum = |of: fn(&(f64, f64)) -> f64| -> f64 {
                unit * (0..3).map(|k| shares[k] * of(&q[k])).sum::<f64>()
            };
            (sum(|pair| pair.0), sum(|pair| pair.1))
        };
        let offset = if over_weight > 0.0 { 1.0 } else { 0.0 };
        // The inverse of `u, u(2u-1), u(6u^2-6u+1)`.
        [
            mix([1.0, 0.0, 0.0], x),
            mix([0.5, 0.5, 0.0], x * x),
            mix([1.0 / 3.0, 0.5, 1.0 / 6.0], x * x * x),
            (x * x * q[3].0, x * x * q[3].1),
            q[4],
            (offset, 0.0),
        ]
    }
}
