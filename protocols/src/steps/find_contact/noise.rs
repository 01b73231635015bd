//! Limits of noise and drift on a contact search.

use crate::engine::{Context, UnloadedSignal};
use palpate_model::units::{Newtons, Seconds, Volts};

/// The criterion is at least this many standard deviations of the filtered signal.
const CRITERION_SIGMAS: f64 = 6.0;

/// A drift counts as far as it is beyond so many of its standard errors. At three, one steady but noisy cell in a
/// thousand was refused; at five it is less than one in a million, and the fit of the contact allows for the drift
/// that is left.
const DRIFT_SIGMAS: f64 = 5.0;

/// The force that a mean of so many samples reaches only by touching something, and the noise of one sample.
pub(in crate::steps) fn above_noise(
    cx: &Context<'_>,
    unloaded: &UnloadedSignal,
    target: Newtons,
    samples: usize,
) -> (Newtons, Newtons) {
    let noise = cx.curve().force_sigma(Newtons(0.0), unloaded.noise);
    let filtered = noise.0 / (samples as f64).sqrt();
    (Newtons(target.0.max(CRITERION_SIGMAS * filtered)), noise)
}

/// `target` is the criterion of the plan, `criterion` the one that [`above_noise`] made of it.
pub(in crate::steps) fn second_touch_error(
    touch: &str,
    target: Newtons,
    criterion: Newtons,
) -> String {
    let advice = if criterion > target {
        format!(
            "because of noise, the contact criterion is {criterion:.3} instead of {target:.3}; reduce the noise, tare and search again"
        )
    } else {
        "check whether the specimen or its support moved, then search again".to_owned()
    };
    format!("the second {touch} found no contact where the first one did: {advice}")
}

/// Refuses a drift that surely moves the force by half of the criterion within the time an approach may take.
pub(super) fn check_drift(
    cx: &Context<'_>,
    unloaded: &UnloadedSignal,
    span: Seconds,
    criterion: Newtons,
) -> Result<(), String> {
    let Some(drift) = unloaded.drift else {
        return Ok(());
    };
    let sure = (drift.volts_per_s.abs() - DRIFT_SIGMAS * drift.std_error).max(0.0);
    let curve = cx.curve();
    let moved = curve.force_sigma(Newtons(0.0), Volts(sure * span.0));
    if moved.0 > 0.5 * criterion.0 {
        return Err(format!(
            "the unloaded signal drifts by {:.2} mV a minute, which could move the force by {moved:.3} during the approach; let the load cell warm up, then tare again",
            drift.volts_per_s * 6e4
        ));
    }
    Ok(())
}
