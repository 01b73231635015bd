//! Prediction of a record by a model fitted elsewhere, and its error.

use super::Estimate;
use super::local::line;
use crate::fit::FitSample;
use palpate_model::units::{Depth, Newtons, Seconds};
use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
use thiserror::Error;

/// Last part of loading and of the rest from which errors at the turning point and at the end are read.
const NEAR: f64 = 0.02;

/// A prediction beside its record; errors are predicted minus measured.
#[derive(Clone, Debug, PartialEq)]
pub struct CyclePrediction {
    /// Predicted force at every sample, in N.
    pub forces: Vec<Newtons>,
    /// Measured force at the turning point: what percentages refer to.
    pub peak: Newtons,
    /// Root mean square of the error over all measured samples.
    pub rms: Newtons,
    /// Mean error: a fit gives every recording an offset of its own, a prediction has none.
    pub mean: Newtons,
    /// Standard deviation of the error about its mean: what is wrong with the shape.
    pub sd: Newtons,
    /// Largest error, with its sign, and when it was. A single sample: noise is in it.
    pub worst: (Newtons, Seconds),
    /// Error at the turning point, from a line through the last fiftieth of loading.
    pub at_peak: Estimate<Newtons>,
    /// Error at the end, from a line through the last fiftieth of what follows; `None` where nothing follows.
    pub at_end: Option<Estimate<Newtons>>,
}

/// There is nothing to compare.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PredictionError {
    #[error(
        "the record has only {measured} samples with a known force before the turning point, too few for a comparison; record more samples"
    )]
    TooFew { measured: usize },
    #[error(
        "the prediction is not a number; check the parameters of the model, and that the times of the record increase"
    )]
    NotFinite,
}

impl CyclePrediction {
    /// An error in percent of the measured peak.
    pub fn percent(&self, error: Newtons) -> f64 {
        100.0 * error.0 / self.peak.0
    }
}

/// Predicts the force along the path of a record that starts with the probe outside the tissue or just touching, by the
/// exact step, and compares it with what was measured. Nothing is fitted.
pub fn predict_cycles(
    body: &ModifiedKelvin,
    samples: &[FitSample],
) -> Result<CyclePrediction, PredictionError> {
    let mut state = KelvinState::at_rest_from(samples.first().map_or(Depth(0.0), |one| one.depth));
    let mut before = samples.first().map_or(0.0, |one| one.t.0);
    let forces: Vec<Newtons> = samples
        .iter()
        .map(|one| {
            let dt = Seconds(one.t.0 - before);
            before = one.t.0;
            state.step(body, one.depth, dt)
        })
        .collect();
    if !forces.iter().all(|force| force.is_finite()) {
        return Err(PredictionError::NotFinite);
    }
    let errors: Vec<(&FitSample, f64)> = samples
        .iter()
        .zip(&forces)
        .filter(|(one, _)| one.is_measured())
        .map(|(one, force)| (one, force.0 - one.force.0))
        .collect();
    let deepest = errors.iter().map(|(one, _)| one.depth.0).fold(f64::MIN, f64::max);
    let turn = errors.iter().position(|(one, _)| one.depth.0 >= deepest);
    let turn = turn
        .filter(|turn| *turn >= 2)
        .ok_or(PredictionError::TooFew { measured: turn.unwrap_or(0) })?;
    let too_few = || PredictionError::TooFew { measured: turn };
    let (at_peak, peak) = last_of(&errors[..=turn]).ok_or_else(too_few)?;
    let square: f64 = errors.iter().map(|(_, error)| error * error).sum();
    let count = errors.len() as f64;
    let mean = errors.iter().map(|(_, error)| error).sum::<f64>() / count;
    let about: f64 = errors.iter().map(|(_, error)| (error - mean).powi(2)).sum();
    let worst = errors
        .iter()
        .copied()
        .fold(errors[0], |worst, one| if one.1.abs() > worst.1.abs() { one } else { worst });
    Ok(CyclePrediction {
        peak: Newtons(peak),
        rms: Newtons((square / count).sqrt()),
        mean: Newtons(mean),
        sd: Newtons((about / count).sqrt()),
        worst: (Newtons(worst.1), worst.0.t),
        at_peak,
        at_end: last_of(&errors[turn + 1..]).map(|(end, _)| end),
        forces,
    })
}

/// Error and measured force at the end of a stretch: lines through its last fiftieth, three samples at least.
fn last_of(part: &[(&FitSample, f64)]) -> Option<(Estimate<Newtons>, f64)> {
    let (first, last) = (part.first()?.0.t.0, part.last()?.0.t.0);
    let from = part.partition_point(|(one, _)| one.t.0 < last - NEAR * (last - first));
    let tail = &part[from.min(part.len().checked_sub(3)?)..];
    let read = |value: fn(&(&FitSample, f64)) -> f64| {
        let points: Vec<[f64; 2]> = tail.iter().map(|one| [one.0.t.0, value(one)]).collect();
        Some(line(&points, last)?.value)
    };
    let error = read(|(_, error)| *error)?;
    Some((Estimate::of(Newtons, error), read(|(one, _)| one.force.0)?[0]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The thesis protocol at 100 Hz with the force of a body, plus an offset from 20 mm on.
    fn record(body: &ModifiedKelvin, offset: f64) -> Vec<FitSample> {
        let mut state = KelvinState::at_rest();
        (0..=9000)
            .map(|i| 0.01 * f64::from(i))
            .map(|t| {
                let depth = Depth((0.75 * t).min(30.0));
                let dt = if t > 0.0 { 0.01 } else { 0.0 };
                let force = state.step(body, depth, Seconds(dt)).0;
                FitSample {
                    t: Seconds(t),
                    depth,
                    force: Newtons(force + if depth.0 > 20.0 { offset } else { 0.0 }),
                    sigma: Newtons(0.02),
                }
            })
            .collect()
    }

    #[test]
    fn the_right_body_predicts_without_error_and_an_offset_is_found() {
        let body = ModifiedKelvin::THESIS;
        let exact = predict_cycles(&body, &record(&body, 0.0)).unwrap();
        assert!(exact.rms.0 < 1e-12 && exact.worst.0.0.abs() < 1e-12);
        // The thesis's peak, 6.396495 N, but for the curvature over the last 0.8 s.
        assert!((exact.peak.0 - 6.3965).abs() < 3e-3, "{:?}", exact.peak);
        let off = predict_cycles(&body, &record(&body, -0.1)).unwrap();
        assert!((off.at_peak.value.0 - 0.1).abs() < 1e-12);
        assert!((off.at_end.unwrap().value.0 - 0.1).abs() < 1e-12);
        assert!((off.worst.0.0 - 0.1).abs() < 1e-12 && off.worst.1.0 > 20.0 / 0.75);
        // From 20 mm, 26.68 s, on: 6333 of 9001 samples.
        assert!((off.rms.0 - 0.1 * (6333.0f64 / 9001.0).sqrt()).abs() < 1e-4);
        // sqrt(p (1 - p)) of a step of 0.1 N.
        let share = 6333.0 / 9001.0;
        assert!((off.mean.0 - 0.1 * share).abs() < 1e-4);
        assert!((off.sd.0 - 0.1 * (share * (1.0f64 - share)).sqrt()).abs() < 1e-4);
        assert!((off.percent(Newtons(0.1)) - 10.0 / off.peak.0).abs() < 1e-12);
    }

    #[test]
    fn unknown_forces_do_not_count_and_too_few_are_refused() {
        let body = ModifiedKelvin::THESIS;
        let mut samples = record(&body, 0.0);
        samples[5000].force = Newtons(99.0);
        samples[5000].sigma = Newtons(f64::INFINITY);
        assert!(predict_cycles(&body, &samples).unwrap().worst.0.0.abs() < 1e-12);
        assert!(matches!(
            predict_cycles(&body, &samples[..2]),
            Err(PredictionError::TooFew { .. })
        ));
        assert!(matches!(predict_cycles(&body, &[]), Err(PredictionError::TooFew { .. })));
        samples[100].t = Seconds(0.0);
        assert_eq!(predict_cycles(&body, &samples), Err(PredictionError::NotFinite));
    }
}
