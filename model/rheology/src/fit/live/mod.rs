//! The fit while samples arrive: constant cost and memory per sample, however long the session.
//!
//! A bank of relaxation times, each with its exact filter states and the sums of products of its
//! columns. An answer solves every node's linear problem, and finds the least residual and all
//! values there by polynomials in log tau. Sums of products lose half the digits; [`super::fit`]
//! works on the samples, and is the fit of record.

mod bank;
mod blocks;
mod identifiability;
mod node;
mod path;
mod residual_blocks;
mod stencil;

use super::design::linear_units;
use super::inflation::{inflation, triangle};
use super::options::{LINEAR, LINEAR_COUNT, PARAMETER_NAMES, PARAMETER_UNITS, TAU};
use super::report::FittedParameter;
use bank::{Bank, COLUMNS, Grid, NODES};
use blocks::Blocks;
use identifiability::BlindParameters;
use node::{Solution, UsedColumns};
use palpate_model::autocorrelation::{BlockedResiduals, memory};
use palpate_model::estimate::student_t975;
use palpate_model::estimate::{Identifiability, LiveEstimate};
use palpate_model::units::{Depth, Newtons, Seconds};
use path::Path;
use stencil::{STENCIL_MAX, Stencil};

pub use residual_blocks::ResidualBlocks;

/// A parameter counts as identified when its standard error is below this share of its value.
const IDENTIFIED_SHARE: f64 = 0.5;

/// Blocks in which the autocorrelation of the residuals is estimated: coarser than in the fit of record,
/// since it is estimated again with every answer.
const NOISE_BLOCKS: usize = 256;
/// Residuals this small relative to the forces are rounding of sums of products.
const ROUNDING: f64 = 1e-6;

/// The fit in progress: memory and cost of a sample do not grow with the run.
#[derive(Clone, Debug, PartialEq)]
pub struct LiveFit {
    depth_max: f64,
    bank: Bank,
    blocks: Blocks,
    path: Path,
    /// Time and scaled depth of the newest sample.
    last: Option<(f64, f64)>,
    /// Time of the newest force that counts.
    measured_until: f64,
    samples: u64,
}

/// The least residual over relaxation times, for one choice of columns.
struct Minimum {
    stencil: Stencil,
    /// Of the nodes of the stencil.
    solutions: Vec<Solution>,
    place: f64,
    used: UsedColumns,
}

impl LiveFit {
    /// For indentations down to about `depth_max`, which scales the columns.
    #[must_use]
    pub fn new(depth_max: Depth) -> Self {
        Self::with_grid(depth_max, Grid { nodes: NODES })
    }

    /// The same with another number of relaxation times in the bank: a multiple of eight from 16 to
    /// 512, or there is none. `palpate trade` measures what they buy.
    #[must_use]
    pub fn with_relaxation_times(depth_max: Depth, count: usize) -> Option<Self> {
        Grid::of(count).map(|grid| Self::with_grid(depth_max, grid))
    }

    fn with_grid(depth_max: Depth, grid: Grid) -> Self {
        Self {
            depth_max: if depth_max.0 > 0.0 { depth_max.0 } else { 1.0 },
            bank: Bank::new(grid),
            blocks: Blocks::new(grid.nodes),
            path: Path::default(),
            last: None,
            measured_until: f64::NEG_INFINITY,
            samples: 0,
        }
    }

    /// Takes a sample. Samples that are not numbers or do not advance in time are left out; of one
    /// with an infinite `sigma` the depth counts and the force does not.
    pub fn push(&mut self, t: Seconds, depth: Depth, force: Newtons, sigma: Newtons) {
        let is_number = t.is_finite() && depth.is_finite() && sigma.0 > 0.0;
        let is_censored = sigma.0 == f64::INFINITY;
        if !is_number
            || !(force.is_finite() || is_censored)
            || self.last.is_some_and(|(last, _)| t.0 <= last)
        {
            return;
        }
        let x = depth.0 / self.depth_max;
        if let Some((last_t, last_x)) = self.last {
            self.bank.advance(last_x, x, t.0 - last_t);
        }
        self.last = Some((t.0, x));
        self.path.push(t.0, x);
        if !is_censored {
            self.bank.weigh(force.0, sigma.0.powi(-2));
            self.samples += 1;
            self.measured_until = t.0;
        }
        self.blocks.count(t.0, &mut self.bank);
    }

    /// The answer so far; `None` before there is any minimum to speak of.
    pub fn estimate(&self) -> Option<LiveEstimate> {
        if self.samples <= 2 * COLUMNS as u64 {
            return None;
        }
        let mut bank = self.bank.clone();
        bank.flush();
        let grams: Vec<_> = (0..bank.grid().nodes).map(|node| bank.gram(node)).collect();
        // Movement while no force counts identifies nothing.
        let corners = path::until(self.path.corners(), self.measured_until);
        let judge = |minimum: &Minimum| {
            let jet = minimum.stencil.jet(minimum.place);
            let values = self.maps().map(|map| minimum.value(&jet, &map));
            let units = linear_units(self.depth_max);
            let scaled = std::array::from_fn(|k| values[k] * units[k]);
            BlindParameters::of(&corners, bank.grid().tau_at(minimum.place), &scaled)
        };
        let minimum = Minimum::find(&grams, [true; COLUMNS])?;
        let blind = judge(&minimum);
        // A column that the path cannot show is left out even where stairs or noise of the depth
        // make it look determined; the others then keep their meaning.
        let mut allowed = [true; COLUMNS];
        for group in &blind.groups {
            for k in group.iter().filter_map(|index| index.checked_sub(LINEAR)) {
                let is_last = group.iter().all(|&other| other <= LINEAR + k);
                allowed[k] &= k < 3 || !is_last;
            }
        }
        let minimum = if (0..COLUMNS).all(|k| allowed[k] || !minimum.used[k]) {
            minimum
        } else {
            Minimum::find(&grams, allowed)?
        };
        self.report(&minimum, &blind, bank.shared()[0])
    }

    fn report(
        &self,
        minimum: &Minimum,
        blind: &BlindParameters,
        weight: f64,
    ) -> Option<LiveEstimate> {
        let Minimum { stencil, place, used, .. } = minimum;
        let jet = stencil.jet(*place);
        let freedom = self.samples as f64 - 1.0 - used.iter().filter(|&&used| used).count() as f64;
        let at = |node: usize| minimum.at(node);
        let residual = stencil.value(&jet, |node| at(node).residual).max(0.0);
        let curvature = stencil.curvature(&jet, |node| at(node).residual);
        let variance = residual / freedom;
        let grid = self.bank.grid();
        let tau = grid.tau_at(*place);
        // Half the curvature of the residual sum is the information, per node spacing.
        let place_error = (2.0 * variance / curvature).sqrt();
        let mut values = vec![(tau, tau * grid.spacing() * place_error)];
        for map in self.maps() {
            let of = |node: usize| at(node).value(&map);
            let through_tau = stencil.slope(&jet, of) * place_error;
            let linear = stencil.value(&jet, |node| at(node).variance(&map)).max(0.0) * variance;
            let error = (linear + through_tau * through_tau).sqrt();
            values.push((stencil.value(&jet, of), error));
        }
        if values.iter().any(|(value, error)| !(value.is_finite() && error.is_finite())) {
            return None;
        }
        let mut parameters = Vec::new();
        let mut verdicts = Vec::new();
        let is_seen: Vec<bool> = (0..values.len()).map(|k| blind.reason(k).is_none()).collect();
        let inflations = self.inflations(&values, &is_seen, variance);
        for (index, (value, error)) in values.into_iter().enumerate() {
            let (inflation, uncertainty) = inflations[index];
            let error = error * inflation.sqrt();
            let reason = blind.reason(index).or_else(|| uncertainty_reason(index, value, error));
            let quantile = student_t975(freedom.min(2.0 / uncertainty));
            let known = reason.is_none().then_some((error, quantile));
            parameters.push(parameter(index, value, known));
            verdicts.push(Identifiability {
                parameter: PARAMETER_NAMES[index].into(),
                is_identified: reason.is_none(),
                reason,
            });
        }
        Some(LiveEstimate {
            parameters,
            rmse_weighted_n: (residual / weight).sqrt(),
            samples: self.samples,
            verdicts,
        })
    }

    /// By how much autocorrelated residuals multiply the variance of each parameter, and the
    /// variance of the logarithm of that, as in the fit of record but from coarser blocks.
    fn inflations(&self, values: &[(f64, f64)], is_seen: &[bool], white: f64) -> Vec<(f64, f64)> {
        let mut inflations = vec![(1.0, 0.0); values.len()];
        let linear: [f64; LINEAR_COUNT] = std::array::from_fn(|k| values[LINEAR + k].0);
        let Some(means) = self.residual_blocks(Seconds(values[TAU].0), &linear) else {
            return inflations;
        };
        let seen: Vec<usize> = (0..values.len()).filter(|&k| is_seen[k]).collect();
        let joined = means.residuals.len().div_ceil(NOISE_BLOCKS).max(1);
        let ranges = (0..means.residuals.len() / joined).map(|b| b * joined..(b + 1) * joined);
        let mut blocks = BlockedResiduals {
            residuals: Vec::new(),
            columns: vec![Vec::new(); seen.len()],
            places: Vec::new(),
            length: (means.samples_per_block * joined as u64) as f64,
        };
        for (place, range) in ranges.enumerate() {
            // Sums of weighted residuals over the root of the sum of weights.
            let weight: f64 = means.weights[range.clone()].iter().sum();
            if weight <= 0.0 {
                continue;
            }
            blocks.places.push(place);
            let over_root = 1.0 / weight.sqrt();
            let sum = |of: &dyn Fn(usize) -> f64| -> f64 {
                range.clone().map(|i| means.weights[i] * of(i)).sum()
            };
            blocks.residuals.push(over_root * sum(&|i| means.residuals[i]));
            for (column, &k) in blocks.columns.iter_mut().zip(&seen) {
                column.push(over_root * sum(&|i| means.jacobian[i][k]));
            }
        }
        if white * self.samples as f64 <= ROUNDING * ROUNDING * self.bank.shared()[2] {
            return inflations;
        }
        let memory = memory(&blocks, &vec![true; seen.len()], white);
        let factor = triangle(std::iter::once(&blocks), seen.len()).finish();
        let records = [(blocks, memory, white)];
        for (place, &k) in seen.iter().enumerate() {
            let mut unit = vec![0.0; seen.len()];
            unit[place] = 1.0;
            inflations[k] = inflation(&records, &factor, &unit, white);
        }
        inflations
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

impl Minimum {
    /// Solves every node, with those of the `allowed` columns that do not depend on others at the
    /// best one, and refines between nodes.
    fn find(grams: &[[[f64; COLUMNS + 1]; COLUMNS + 1]], allowed: UsedColumns) -> Option<Self> {
        let (best, free) = grams
            .iter()
            .enumerate()
            .filter_map(|(node, gram)| Some((node, Solution::of(gram, &allowed, false)?)))
            .min_by(|a, b| a.1.residual.total_cmp(&b.1.residual))?;
        let used = free.used;
        let solve = |node: usize| Solution::of(&grams[node], &used, true);
        let mut low = best;
        while low > 0 && best - low < STENCIL_MAX && solve(low - 1).is_some() {
            low -= 1;
        }
        let mut high = best;
        while high < grams.len() - 1 && high - best < STENCIL_MAX && solve(high + 1).is_some() {
            high += 1;
        }
        let stencil = Stencil::around(best, (low, high))?;
        let solutions: Vec<Solution> =
            (stencil.first..stencil.first + stencil.count).filter_map(solve).collect();
        let place = stencil.minimum(best, |node| solutions[node - stencil.first].residual)?;
        Some(Self { stencil, solutions, place, used })
    }

    fn at(&self, node: usize) -> &Solution {
        &self.solutions[node - self.stencil.first]
    }

    fn value(&self, jet: &stencil::Jet, map: &[f64; COLUMNS]) -> f64 {
        self.stencil.value(jet, |node| self.at(node).value(map))
    }
}

/// Why a parameter that the path can show is still too uncertain to be of use.
fn uncertainty_reason(index: usize, value: f64, error: f64) -> Option<String> {
    // Initial force and offset are near zero by design; their size says nothing of identification.
    let is_level = index >= LINEAR + LINEAR_COUNT - 2;
    if is_level || error < IDENTIFIED_SHARE * value.abs() {
        return None;
    }
    let name = PARAMETER_NAMES[index];
    Some(if index == TAU {
        format!("{name} is uncertain by more than half its value so far; hold longer")
    } else {
        format!("{name} cannot yet be distinguished from zero; continue, or press deeper")
    })
}

fn parameter(index: usize, value: f64, known: Option<(f64, f64)>) -> FittedParameter {
    FittedParameter {
        name: PARAMETER_NAMES[index].into(),
        value,
        unit: PARAMETER_UNITS[index].into(),
        std_error: known.map(|(error, _)| error),
        ci95: known.map(|(error, quantile)| [value - quantile * error, value + quantile * error]),
        is_fixed: false,
        systematic_error: None,
        total95: None,
        budget: Vec::new(),
    }
}
