//! The force that a fitted body would give along other depths, and how well that is known.

use super::sample::FitError;
use super::solve::FitSolution;
use super::uncertainty::DIFFERENCE;
use crate::families::Model;
use palpate_model::estimate::student_t975;
use palpate_model::units::{Depth, Newtons, Seconds};

/// A force that a fit predicts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PredictedForce {
    pub force: Newtons,
    /// 95 % interval of what the fit leaves open of its body, without the noise of a measurement.
    pub ci95: [Newtons; 2],
}

impl FitSolution<'_> {
    /// The forces of a record's body along a path of time and depth, at rest before it, to first order in its errors.
    pub fn predict_band(
        &self,
        record: usize,
        path: &[(Seconds, Depth)],
    ) -> Result<Vec<PredictedForce>, FitError> {
        let layout = self.system.layout();
        let point = &self.refined.points[record];
        let mut values = self.system.physical_values(record, point);
        values.truncate(layout.outers + layout.coefficients);
        let middle = self.forces_along(&values, path)?;
        // What each free parameter of the body does to each force, and to each unknown.
        let mut gradients = Vec::new();
        for k in (0..values.len()).filter(|&k| self.system.fixed(record, k).is_none()) {
            let step = DIFFERENCE * values[k].abs().max(f64::MIN_POSITIVE);
            let mut ends = [Vec::new(), Vec::new()];
            for (end, sign) in ends.iter_mut().zip([1.0, -1.0]) {
                let mut moved = values.clone();
                moved[k] += sign * step;
                *end = self.forces_along(&moved, path)?;
            }
            let [up, down] = ends;
            let slopes = up.iter().zip(&down).map(|(up, down)| (up - down) / (2.0 * step));
            gradients
                .push((slopes.collect::<Vec<f64>>(), self.system.combination(record, k, point)));
        }
        let spare = (self.system.measured() - self.system.unknowns.len()) as f64;
        let predicted = middle.iter().enumerate().map(|(i, &force)| {
            let mut combination = vec![0.0; self.system.unknowns.len()];
            for (slopes, one) in &gradients {
                for (sum, share) in combination.iter_mut().zip(one) {
                    *sum += slopes[i] * share;
                }
            }
            let error = self.uncertainty().error(&self.refined, &combination, spare);
            let half = match error {
                // Before contact the body has no part in the force.
                _ if combination.iter().all(|share| *share == 0.0) => 0.0,
                Some(error) => student_t975(error.freedom) * error.std_error,
                None => f64::INFINITY,
            };
            let ci95 = [Newtons(force - half), Newtons(force + half)];
            PredictedForce { force: Newtons(force), ci95 }
        });
        Ok(predicted.collect())
    }

    fn forces_along(
        &self,
        values: &[f64],
        path: &[(Seconds, Depth)],
    ) -> Result<Vec<f64>, FitError> {
        let family = &self.system.source.family;
        let (outer, linear) = values.split_at(self.system.layout().outers);
        let refused = |reason: String| FitError::Unsupported { family: family.name(), reason };
        let model: Model = family.model(outer, linear).map_err(|err| refused(err.to_string()))?;
        model.along(path.iter().copied()).map_err(|err| refused(err.to_string()))
    }
}
