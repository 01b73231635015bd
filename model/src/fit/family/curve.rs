//! The fitted force of a family beside the record it was fitted to.

use super::super::sample::FitSample;
use super::report::{FamilyFit, RecordFit};
use crate::families::{AlongError, by_key};
use crate::units::Newtons;

impl FamilyFit {
    /// The fitted force at every sample of record `index`, with its offset and initial force; `samples` are
    /// those that were fitted.
    pub fn forces(&self, index: usize, samples: &[FitSample]) -> Result<Vec<Newtons>, AlongError> {
        let family = by_key(&self.model.family).map_err(|err| AlongError::Model(err.into()))?;
        let fading = family.fading(&self.model.outer);
        let path = samples.iter().map(|sample| (sample.t, sample.depth));
        let forces = self.model.along(path)?;
        let RecordFit {
            offset, initial, ..
        } = self.records[index];
        let since = |sample: &FitSample| sample.t.0 - samples[0].t.0;
        let own = |sample: &FitSample| {
            let faded = fading.map_or(0.0, |tau| initial * (-since(sample) / tau).exp());
            offset + faded
        };
        let pairs = forces.into_iter().zip(samples);
        Ok(pairs
            .map(|(force, sample)| Newtons(force + own(sample)))
            .collect())
    }
}

impl RecordFit {
    /// Coefficient of determination over the samples whose force counts, each alike.
    #[must_use]
    pub fn r2(&self, samples: &[FitSample]) -> f64 {
        let known = || samples.iter().filter(|sample| sample.is_measured());
        let mean = known().map(|sample| sample.force.0).sum::<f64>() / self.samples as f64;
        let about: f64 = known().map(|sample| (sample.force.0 - mean).powi(2)).sum();
        1.0 - self.rms.powi(2) * self.samples as f64 / about
    }
}
