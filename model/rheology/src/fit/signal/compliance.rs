//! The compliance of a rig from the load cell's signal on a stiff surface.
//!
//! A line through forces above the tare takes its zero for that of every press, and the force of a noisy signal for the force
//! of the mean signal. On the lab rig that makes a compliance of 60 um/N wrong by up to 0.6 um/N, the same in every press, where
//! the line states 0.01 to 0.1. Here the signal is predicted, and its slow zero is found where the probe touches nothing.

use super::UnloadedMean;
use super::drift::{Drift, DriftSizes};
use super::zero::ZeroFilter;
use palpate_model::calibration::CalibrationCurve;
use palpate_model::rig::Compliance;
use palpate_model::units::{Newtons, Position, Seconds, Volts};

/// A sample on the way into a stiff surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressedSignal {
    pub t: Seconds,
    /// Commanded position from home.
    pub position: Position,
    pub volts: Volts,
}

/// Each step leaves the square of the error before, and the start is good to a percent.
const STEPS: usize = 4;

/// The zero at times, found from the signal out of contact alone. `None` where there is too little of it.
#[must_use]
pub fn estimate_zero(unloaded: &[UnloadedMean], times: &[Seconds]) -> Option<Vec<Volts>> {
    let all = || unloaded.iter().map(|one| one.t.0).chain(times.iter().map(|t| t.0));
    let (first, last) = (all().fold(f64::MAX, f64::min), all().fold(f64::MIN, f64::max));
    let drift = DriftSizes::of(unloaded, first, last)?.mean()?;
    let mut filter = ZeroFilter::new(drift.nodes(1.0), 1);
    for one in unloaded {
        filter.push(one.t.0, &[one.volts.0], (one.count as f64).sqrt() / drift.noise);
    }
    let zero = filter.finish();
    Some(times.iter().map(|t| Volts(zero.explained(t.0, 0))).collect())
}

/// A compliance found from forces, improved by the signal itself: `signal = curve((position - surface) / compliance) + zero(t) +
/// noise`. Samples and means are in the order of time, on one clock. `None` where too little of the signal is out of contact
/// to know the zero, or where the signal does not tell compliance and surface apart.
#[must_use]
pub fn fit_compliance_to_signal(
    start: &Compliance,
    samples: &[PressedSignal],
    unloaded: &[UnloadedMean],
    curve: &CalibrationCurve,
) -> Option<Compliance> {
    let times = || samples.iter().map(|one| one.t.0).chain(unloaded.iter().map(|one| one.t.0));
    let (first, last) = (times().fold(f64::MAX, f64::min), times().fold(f64::MIN, f64::max));
    let drift = DriftSizes::of(unloaded, first, last)?.mean()?;
    let mut found = *start;
    for _ in 0..STEPS {
        found = step(&found, samples, unloaded, curve, &drift)?;
    }
    Some(found)
}

/// One step of Gauss and Newton in stiffness and surface.
fn step(
    from: &Compliance,
    samples: &[PressedSignal],
    unloaded: &[UnloadedMean],
    curve: &CalibrationCurve,
    drift: &Drift,
) -> Option<Compliance> {
    let stiffness = 1.0 / from.mm_per_newton;
    let weight = 1.0 / drift.noise;
    let unloaded_volts = curve.volts_from_newtons(Newtons(0.0)).0;
    let mut filter = ZeroFilter::new(drift.nodes(1.0), 3);
    let mut waiting = unloaded.iter().peekable();
    let mut push_until = |filter: &mut ZeroFilter, t: f64| {
        while let Some(one) = waiting.next_if(|one| one.t.0 <= t) {
            let zero = one.volts.0 - unloaded_volts;
            filter.push(one.t.0, &[0.0, 0.0, zero], weight * (one.count as f64).sqrt());
        }
    };
    for one in samples {
        push_until(&mut filter, one.t.0);
        let way = one.position.0 - from.surface.0;
        let force = Newtons(stiffness * way);
        let slope = curve.sensitivity_at(force);
        let left = one.volts.0 - curve.volts_from_newtons(force).0;
        filter.push(one.t.0, &[slope * way, -slope * stiffness, left], weight);
    }
    push_until(&mut filter, f64::INFINITY);
    let factor = filter.finish().factor;
    factor.inseparable_columns(2).is_none().then_some(())?;
    let change = factor.solve(2);
    let rows = (samples.len() + unloaded.len()) as f64;
    // Three unknowns of the zero besides the two.
    let variance = factor.residual_sum(2) / (rows - 5.0);
    let [stiffness_error, surface_error] = [[1.0, 0.0], [0.0, 1.0]].map(|of| factor.deviation(&of));
    let next = stiffness + change[0];
    let found = Compliance {
        mm_per_newton: 1.0 / next,
        std_error: stiffness_error * variance.max(1.0).sqrt() / next.powi(2),
        surface: Position(from.surface.0 + change[1]),
        surface_std_error_mm: surface_error * variance.max(1.0).sqrt(),
        ..*from
    };
    (found.mm_per_newton > 0.0 && found.surface.is_finite() && found.std_error.is_finite())
        .then_some(found)
}
