//! Block bootstrap: the fit repeated on its own residuals, shuffled in blocks.
//!
//! Blocks longer than the correlation time preserve it; what lies within a block stays together (Kunsch, Ann.
//! Stat. 17 (1989) 1217-1241). It assumes neither a shape of the noise nor a parabola of the sum of
//! squares, and takes hundreds of fits.

use super::record::Record;
use super::refine::{StopRule, refine};
use super::sample::{FitError, FitSample};
use super::solve::FitSolution;
use super::system::Rows;
use super::uncertainty::Uncertainty;
use palpate_model::random::SplitMix;
use palpate_model::units::Newtons;
use serde::{Deserialize, Serialize};

/// Correlation times in a block; beyond three the ends of blocks hardly matter.
const MEMORIES: f64 = 4.0;

/// Fewer blocks than this cannot be shuffled to any purpose.
const BLOCKS_MIN: usize = 8;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bootstrap {
    /// Seed of the shuffling: the same seed gives the same intervals on any machine.
    pub seed: u64,
    /// Fits; 200 give the ends of a 95 % interval to about a tenth of its width.
    pub repeats: usize,
}

/// A 95 % interval from the percentiles of repeated fits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BootstrapInterval {
    pub name: String,
    /// Standard deviation of the repeated fits, in the parameter's unit.
    pub std_dev: f64,
    /// 2.5 % and 97.5 % points.
    pub ci95: [f64; 2],
}

impl FitSolution<'_> {
    /// Bootstrap intervals of the free parameters of one record; `progress` gets how many fits are
    /// done. Refused where the correlation time is so long that the record has too few blocks.
    pub fn bootstrap(
        &self,
        record: usize,
        choice: Bootstrap,
        mut progress: impl FnMut(usize),
    ) -> Result<Vec<BootstrapInterval>, FitError> {
        if record >= self.system.records.len() {
            return Ok(Vec::new());
        }
        let uncertainty = self.uncertainty();
        let sources: Vec<ResidualSource> = (0..self.system.records.len())
            .map(|record| self.residual_source(uncertainty, record))
            .collect();
        if let Some(short) = sources.iter().find(|source| source.blocks() < BLOCKS_MIN) {
            return Err(FitError::TooFewBlocks { blocks: short.blocks(), needed: BLOCKS_MIN });
        }
        // Shuffled residuals are of forces: where a signal was fitted, an offset stands for its zero again.
        let base = self.system.without_signals();
        let start = base.at_fixed_contacts(&self.refined.points);
        let free: Vec<usize> =
            (0..base.layout().count()).filter(|&k| base.fixed(record, k).is_none()).collect();
        let mut random = SplitMix::seeded(choice.seed);
        let mut found: Vec<Vec<f64>> = vec![Vec::with_capacity(choice.repeats); free.len()];
        for done in 0..choice.repeats {
            let shuffled: Vec<Vec<FitSample>> = sources
                .iter()
                .zip(&self.system.records)
                .map(|(source, record)| source.shuffled(record.samples, &mut random))
                .collect();
            let system = base.with_samples(&shuffled);
            let refined = refine(&system, &start, Rows::All, StopRule::Noise);
            let refined = refined.ok_or(FitError::Overflow)?;
            let values = system.physical_values(record, &refined.points[record]);
            for (list, &parameter) in found.iter_mut().zip(&free) {
                list.push(values[parameter]);
            }
            progress(done + 1);
        }
        Ok(free
            .iter()
            .zip(found)
            .filter(|(_, list)| list.len() > 1)
            .map(|(&parameter, mut list)| {
                list.sort_by(f64::total_cmp);
                let count = list.len() as f64;
                let mean = list.iter().sum::<f64>() / count;
                let square: f64 = list.iter().map(|value| (value - mean).powi(2)).sum();
                BootstrapInterval {
                    name: self.system.known()[parameter].name.clone(),
                    std_dev: (square / (count - 1.0)).sqrt(),
                    ci95: [0.025, 0.975].map(|share| quantile(&list, share)),
                }
            })
            .collect())
    }

    /// Model and residuals of a record, the latter in units of each sample's sigma and widened by
    /// what the fit has taken out of them.
    fn residual_source(&self, uncertainty: &Uncertainty, record: usize) -> ResidualSource {
        let Record { samples, measured, .. } = self.system.records[record];
        let point = &self.refined.points[record];
        let scale = self.system.scale(&point.outer);
        let model = self.system.source.forces(samples, scale, point);
        let model = model.unwrap_or_else(|| vec![f64::NAN; samples.len()]);
        let known = samples.iter().zip(&model);
        let mut residuals: Vec<f64> = known
            .filter(|(sample, _)| sample.is_measured())
            .map(|(sample, force)| (sample.force.0 - force) / sample.sigma.0)
            .collect();
        let block = uncertainty.block_length(record);
        let memory = uncertainty.memory(record);
        let correlation_samples = memory
            .filter(|memory| memory.neighbour > 0.0)
            .map_or(0.0, |memory| block / -memory.forgetting.ln());
        let white = uncertainty.scatter.unwrap_or(0.0).powi(2);
        let effective = memory
            .filter(|memory| memory.long_run() > 0.0)
            .map_or(measured as f64, |memory| measured as f64 * white / memory.long_run())
            .clamp(1.0, measured as f64);
        let taken = self.system.unknowns.len() as f64;
        let widened = (effective / (effective - taken).max(1.0)).sqrt();
        residuals.iter_mut().for_each(|residual| *residual *= widened);
        // The cube root of the count is the usual length for noise without memory.
        let length = (MEMORIES * correlation_samples).max((measured as f64).cbrt()) as usize;
        ResidualSource { model, length: length.clamp(1, residuals.len().max(1)), residuals }
    }
}

struct ResidualSource {
    model: Vec<f64>,
    residuals: Vec<f64>,
    length: usize,
}

impl ResidualSource {
    /// How many blocks the record has.
    fn blocks(&self) -> usize {
        self.residuals.len() / self.length
    }

    fn shuffled(&self, samples: &[FitSample], random: &mut SplitMix) -> Vec<FitSample> {
        let starts = self.residuals.len() - self.length + 1;
        let (mut next, mut remaining) = (0, 0);
        samples
            .iter()
            .zip(&self.model)
            .map(|(sample, model)| {
                if !sample.is_measured() {
                    return *sample;
                }
                if remaining == 0 {
                    (next, remaining) = (random.below(starts), self.length);
                }
                let residual = self.residuals[next] * sample.sigma.0;
                (next, remaining) = (next + 1, remaining - 1);
                FitSample { force: Newtons(model + residual), ..*sample }
            })
            .collect()
    }
}

fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * (sorted.len() - 1) as f64;
    let below = place.floor() as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}
