//! Prediction of a record by a model fitted to other records.

use super::sample::{FitError, FitSample};
use super::triangle::Triangle;
use crate::families::Model;
use std::ops::Range;

/// How far a prediction is off, in N, over the samples looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForcePrediction {
    pub rms: f64,
    pub worst: f64,
    /// The factor on the whole body that fits the record best.
    pub scale: f64,
    /// Root mean square error with that factor.
    pub scaled_rms: f64,
    pub samples: usize,
}

/// Predicts `score` of a record from rest at its first depth; the body stays as it is, while the record's own offset,
/// which no other record determines, is found on `own`.
///
/// The factor of [`ForcePrediction::scale`] is found on `own` too.
pub fn predict(
    model: &Model,
    samples: &[FitSample],
    own: Range<usize>,
    score: Range<usize>,
) -> Result<ForcePrediction, FitError> {
    let unsupported =
        |reason: String| FitError::Unsupported { family: model.family.clone(), reason };
    let path = samples.iter().map(|sample| (sample.t, sample.depth));
    let forces = model.along(path).map_err(|err| unsupported(err.to_string()))?;
    let (mut plain, mut scaled) = (Triangle::new(2), Triangle::new(3));
    for index in own.filter(|&index| samples[index].is_measured()) {
        let (force, weight) = (samples[index].force.0, 1.0 / samples[index].sigma.0);
        plain.push(&[1.0, force - forces[index]], weight);
        scaled.push(&[1.0, forces[index], force], weight);
    }
    let offset = plain.finish().solve(1)[0];
    let scaled = scaled.finish().solve(2);
    let (mut square, mut scaled_square, mut worst, mut taken) = (0.0, 0.0, 0.0f64, 0usize);
    for index in score.filter(|&index| samples[index].is_measured()) {
        let error = samples[index].force.0 - forces[index] - offset;
        let scaled_error = samples[index].force.0 - scaled[1] * forces[index] - scaled[0];
        square += error * error;
        scaled_square += scaled_error * scaled_error;
        worst = worst.max(error.abs());
        taken += 1;
    }
    let mean = |square: f64| (square / taken.max(1) as f64).sqrt();
    let predicted = ForcePrediction {
        rms: mean(square),
        worst,
        scale: scaled[1],
        scaled_rms: mean(scaled_square),
        samples: taken,
    };
    let numbers = [predicted.rms, predicted.scale, predicted.scaled_rms];
    if taken == 0 || numbers.iter().any(|number| !number.is_finite()) {
        return Err(FitError::Overflow);
    }
    Ok(predicted)
}
