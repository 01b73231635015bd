//! How a body that is known predicts a record that its fit has not seen.

use super::super::sample::{FitError, FitSample};
use super::super::triangle::Triangle;
use super::FamilyOptions;
use crate::families::{Model, by_key};
use crate::units::Seconds;
use std::ops::Range;

/// How far a prediction is off, in N, over the samples looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Predicted {
    /// Root mean square error.
    pub rms: f64,
    /// Largest error.
    pub worst: f64,
    /// The factor on the whole body that fits the record best.
    pub scale: f64,
    /// Root mean square error with that factor.
    pub scaled_rms: f64,
    /// Samples looked at.
    pub samples: usize,
}

/// Predicts `score` of a record; the body stays as it is, while the record's own offset and initial
/// force, which no other record can tell, are found on `own`.
///
/// The factor of [`Predicted::scale`] is found on `own` too.
pub fn predict(
    model: &Model,
    samples: &[FitSample],
    own: Range<usize>,
    score: Range<usize>,
    options: FamilyOptions,
) -> Result<Predicted, FitError> {
    let unsupported = |reason: String| FitError::Unsupported {
        family: model.family.clone(),
        reason,
    };
    let family = by_key(&model.family).map_err(|err| unsupported(err.to_string()))?;
    let path = samples.iter().map(|sample| (sample.t, sample.depth));
    let forces = model
        .along(path)
        .map_err(|err| unsupported(err.to_string()))?;
    let fading = family.fading(&model.outer).filter(|_| options.initial);
    let start = samples.first().map_or(Seconds(0.0), |sample| sample.t);
    // The record's own columns: a constant and what fades.
    let own_columns = |index: usize| {
        let faded = fading.map(|tau| (-(samples[index].t.0 - start.0) / tau).exp());
        let constant = options.offset.then_some(1.0);
        constant.into_iter().chain(faded)
    };
    let count = usize::from(options.offset) + usize::from(fading.is_some());
    let (mut plain, mut scaled) = (Triangle::new(count + 1), Triangle::new(count + 2));
    let mut row = Vec::with_capacity(count + 2);
    for index in own.filter(|&index| samples[index].is_measured()) {
        let (force, weight) = (samples[index].force.0, 1.0 / samples[index].sigma.0);
        row.clear();
        row.extend(own_columns(index));
        row.push(force - forces[index]);
        plain.push(&row, weight);
        row[count] = forces[index];
        row.push(force);
        scaled.push(&row, weight);
    }
    let plain = plain.finish().solve(count);
    let scaled = scaled.finish().solve(count + 1);
    let (mut square, mut scaled_square, mut worst, mut taken) = (0.0, 0.0, 0.0f64, 0usize);
    for index in score.filter(|&index| samples[index].is_measured()) {
        let (mut error, mut scaled_error) = (
            samples[index].force.0 - forces[index],
            samples[index].force.0 - scaled[count] * forces[index],
        );
        for (k, column) in own_columns(index).enumerate() {
            error -= plain[k] * column;
            scaled_error -= scaled[k] * column;
        }
        square += error * error;
        scaled_square += scaled_error * scaled_error;
        worst = worst.max(error.abs());
        taken += 1;
    }
    let mean = |square: f64| (square / taken.max(1) as f64).sqrt();
    let predicted = Predicted {
        rms: mean(square),
        worst,
        scale: scaled[count],
        scaled_rms: mean(scaled_square),
        samples: taken,
    };
    let numbers = [predicted.rms, predicted.scale, predicted.scaled_rms];
    if taken == 0 || numbers.iter().any(|number| !number.is_finite()) {
        return Err(FitError::Overflow);
    }
    Ok(predicted)
}
