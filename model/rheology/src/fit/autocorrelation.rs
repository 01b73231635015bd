//! Autocorrelation of the residuals of a fit that another crate made.

use super::inflation::{freedom, inflation, triangle};
use palpate_model::autocorrelation::{BlockedResiduals, Memory, memory};

/// What the residuals of a least-squares fit say of its uncertainty, as [`fit()`](super::fit()) takes it.
#[derive(Clone, Debug)]
pub struct ResidualAutocorrelation {
    blocks: BlockedResiduals,
    memory: Memory,
    /// Variance of the residuals.
    white: f64,
    samples: usize,
    /// Samples beyond the unknowns.
    spare: usize,
}

impl ResidualAutocorrelation {
    /// Of residuals at even times, and of how what is fitted rises with each unknown at those times. `None` where there is no
    /// residual beyond the unknowns.
    #[must_use]
    pub fn of(residuals: &[f64], tangents: &[Vec<f64>]) -> Option<Self> {
        let samples = residuals.len();
        let spare = samples.checked_sub(tangents.len()).filter(|spare| *spare > 0)?;
        let white = residuals.iter().map(|one| one * one).sum::<f64>() / spare as f64;
        let blocks = BlockedResiduals::of(residuals, tangents);
        let memory = memory(&blocks, &vec![true; tangents.len()], white);
        let memory = memory.unwrap_or_else(|| Memory::none(white));
        Some(Self { blocks, memory, white, samples, spare })
    }

    /// Number of independent samples that carry the same information.
    #[must_use]
    pub fn effective_samples(&self) -> f64 {
        let samples = self.samples as f64;
        match self.memory.long_run() {
            long_run if long_run > 0.0 => (samples * self.white / long_run).clamp(1.0, samples),
            _ => samples,
        }
    }

    /// Factor on the variance under independence of a combination of the unknowns, at least one, and the degrees of freedom of
    /// that variance, for Student's t.
    #[must_use]
    pub fn inflation(&self, combination: &[f64]) -> (f64, f64) {
        let factor = triangle([&self.blocks].into_iter(), combination.len()).finish();
        let records = [(self.blocks.clone(), Some(self.memory), self.white)];
        let (inflation, uncertainty) = inflation(&records, &factor, combination, self.white);
        (inflation, freedom(self.spare as f64, uncertainty))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::random::SplitMix;

    /// A constant under noise that forgets by `keep` from sample to sample: the variance of its mean is
    /// `(1 + keep) / (1 - keep)` times that of independent noise.
    #[test]
    fn inflation_is_that_of_the_process() {
        for keep in [0.0, 0.9, 0.98] {
            let (mut factors, mut freedoms, mut effective) = (Vec::new(), Vec::new(), Vec::new());
            for seed in 0..20 {
                let mut random = SplitMix::seeded(seed);
                let mut value = 0.0;
                let residuals: Vec<f64> = (0..20_000)
                    .map(|_| {
                        value = keep * value + random.normal();
                        value
                    })
                    .collect();
                let constant = vec![1.0; residuals.len()];
                let found = ResidualAutocorrelation::of(&residuals, &[constant]).unwrap();
                let (factor, freedom) = found.inflation(&[1.0]);
                factors.push(factor);
                freedoms.push(freedom);
                effective.push(found.effective_samples());
            }
            // A record in twenty passes for one of longer memory.
            let median = |mut numbers: Vec<f64>| {
                numbers.sort_by(f64::total_cmp);
                numbers[numbers.len() / 2]
            };
            let (factor, freedom, effective) =
                (median(factors), median(freedoms), median(effective));
            // Independent samples all tell of the variance, and what lasts is told by far fewer.
            assert_eq!(freedom > 1e4, keep == 0.0, "{keep}: {freedom}");
            let exact = (1.0 + keep) / (1.0 - keep);
            assert!((factor / exact - 1.0).abs() < 0.15, "{keep}: {factor} {exact}");
            assert!((effective * exact / 20_000.0 - 1.0).abs() < 0.15, "{keep}: {effective}");
        }
    }

    #[test]
    fn few_residuals_say_nothing() {
        assert!(ResidualAutocorrelation::of(&[0.1], &[vec![1.0]]).is_none());
        let few = ResidualAutocorrelation::of(&[0.1, -0.1, 0.2], &[vec![1.0; 3]]).unwrap();
        assert_eq!(few.effective_samples(), 3.0);
    }
}
