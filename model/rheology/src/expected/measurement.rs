//! What is known of a measurement before it is made, and the intervals that follow.

use super::information::{ExpectedError, ExpectedPrecision, check_resolved, intervals};
use super::noise::{FreeOffsets, MeasurementNoise};
use super::protocol::{PathPiece, ProtocolPath, duration_of};
use crate::fit::{ExpectedSignal, FitSample};
use palpate_model::estimate::student_t975;
use palpate_model::units::{Depth, Newtons, Seconds};
use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};

/// Samples at which a press is evaluated: with them, intervals are within 1 % of those from all samples (the test below).
const SAMPLES: f64 = 2048.0;
/// But at least so many in a relaxation time.
const SAMPLES_PER_TAU: f64 = 16.0;

#[derive(Clone, Copy, Debug)]
pub enum Measurement<'a> {
    /// Forces with noise, fitted with these offsets.
    Forces { noise: MeasurementNoise, unknowns: FreeOffsets },
    /// The signal of a load cell, fitted with its zero and its contact position.
    Signal(&'a ExpectedSignal),
}

impl Measurement<'_> {
    pub(super) fn check(&self) -> Result<(), ExpectedError> {
        match self {
            Self::Forces { noise, .. } => noise.check(),
            Self::Signal(_) => Ok(()),
        }
    }

    /// The intervals that a fit of a protocol's record is expected to have.
    pub fn precision(
        &self,
        body: &ModifiedKelvin,
        protocol: &ProtocolPath,
    ) -> Result<ExpectedPrecision, ExpectedError> {
        match self {
            Self::Forces { noise, unknowns } => intervals(body, protocol, noise, *unknowns),
            Self::Signal(signal) => of_signal(body, protocol, signal, SAMPLES),
        }
    }
}

fn of_signal(
    body: &ModifiedKelvin,
    protocol: &ProtocolPath,
    signal: &ExpectedSignal,
    samples_wanted: f64,
) -> Result<ExpectedPrecision, ExpectedError> {
    protocol.check()?;
    body.checked()?;
    let rate = protocol.sample_rate_hz;
    let longest = protocol.presses.iter().map(|press| duration_of(press)).fold(0.0, f64::max);
    check_resolved(body.tau_eps, rate, longest)?;
    let wanted = samples_wanted.max(SAMPLES_PER_TAU * longest / body.tau_eps) / longest;
    let taken_rate = rate.min(wanted);
    let mut forces = [f64::INFINITY, f64::NEG_INFINITY];
    let presses =
        protocol.presses.iter().map(|press| samples(body, press, taken_rate, &mut forces));
    let presses: Vec<Vec<FitSample>> = presses.collect();
    let errors = signal.std_errors(body, &presses, rate, taken_rate);
    let errors =
        errors.ok_or_else(|| ExpectedError::Inseparable { names: "the parameters".into() })?;
    let errors = errors.map(|(error, freedom)| (error, student_t975(freedom)));
    Ok(ExpectedPrecision::of(body, errors, forces, protocol))
}

/// A press at a sampling rate, without noise; `forces` takes in the lowest and highest.
fn samples(
    body: &ModifiedKelvin,
    press: &[PathPiece],
    rate: f64,
    forces: &mut [f64; 2],
) -> Vec<FitSample> {
    let count = (duration_of(press) * rate).floor() as usize;
    let mut pieces = press.iter();
    let mut piece = pieces.next();
    let (mut state, mut now, mut depth) = (KelvinState::at_rest(), 0.0, 0.0);
    let mut piece_end = piece.map_or(0.0, |piece| piece.duration.0);
    let mut step_to =
        |state: &mut KelvinState, to: f64, at: f64, depth: &mut f64, now: &mut f64| {
            let force = state.step(body, Depth(to), Seconds(at - *now));
            (*depth, *now) = (to, at);
            *forces = [forces[0].min(force.0), forces[1].max(force.0)];
            force
        };
    let mut found = Vec::with_capacity(count + 1);
    for k in 0..=count {
        let t = k as f64 / rate;
        // Corners are stepped to of their own: between them the path is straight.
        while let Some(one) = piece.filter(|_| t > piece_end) {
            step_to(&mut state, one.to.0, piece_end, &mut depth, &mut now);
            piece = pieces.next();
            piece_end += piece.map_or(f64::INFINITY, |piece| piece.duration.0);
        }
        let to = piece.map_or(depth, |one| {
            let left = piece_end - now;
            if left > 0.0 { depth + (one.to.0 - depth) * (t - now) / left } else { one.to.0 }
        });
        let force = step_to(&mut state, to, t, &mut depth, &mut now);
        found.push(FitSample { t: Seconds(t), depth: Depth(to), force, sigma: Newtons(1.0) });
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::{FitOptions, FitSolution, Signal, SignalRecord, UnloadedMean};
    use palpate_model::calibration::Calibration;
    use palpate_model::units::{MmPerS, Volts};

    /// White noise of one sample in V.
    const NOISE_V: f64 = 1e-3;

    /// What a run on a straight cell of 0.15 V/N tells of the next one; the zero is seen for half a minute before and after.
    fn known_signal() -> ExpectedSignal {
        let calibration = Calibration::linear("straight", Volts(1.28), 0.15, Newtons(10.0));
        let curve = calibration.curve().unwrap();
        // Digits of the golden ratio's multiples, as even as random ones and the same each time.
        let mut place = 0.0f64;
        let mut noise = move || {
            place = (place + 0.618_033_988_749_895).fract();
            // As wide as a standard deviation of one.
            (place - 0.5) * 12.0f64.sqrt()
        };
        let press = ProtocolPath::ramp_hold(MmPerS(0.75), Depth(30.0), Seconds(20.0), 100.0);
        let mut forces = [f64::INFINITY, f64::NEG_INFINITY];
        let samples = samples(&ModifiedKelvin::THESIS, &press.presses[0], 100.0, &mut forces);
        let volts = samples.iter().map(|one| curve.volts_from_newtons(one.force).0);
        let volts = volts.map(|volts| volts + NOISE_V * noise()).collect();
        let end = samples[samples.len() - 1].t.0;
        let times = (0..120).map(|k| 0.25 * f64::from(k));
        let times = times.clone().map(|t| t - 30.0).chain(times.map(|t| end + 1.0 + t));
        let unloaded = times.map(|t| UnloadedMean {
            t: Seconds(t),
            volts: Volts(1.28 + 0.2 * NOISE_V * noise()),
            count: 25,
        });
        let unloaded = unloaded.collect();
        let signal = Signal {
            volts,
            unloaded,
            curve,
            hysteresis: None,
            contact_shift_mm: 0.0,
            contact_error_mm: 1e-3,
            search_secs: 20.0,
        };
        let record = SignalRecord { name: "known", samples: &samples, signal: Some(&signal) };
        let fitted = FitSolution::fit_signals(&[record], &FitOptions::default(), &[]).unwrap();
        fitted.expected_signal().unwrap()
    }

    #[test]
    fn thinned_presses_expect_what_all_samples_expect() {
        let signal = known_signal();
        let body = ModifiedKelvin::THESIS;
        for (speed, hold) in [(0.75, 20.0), (0.75, 50.0), (0.69, 1.33), (0.2, 600.0)] {
            let press = ProtocolPath::ramp_hold(MmPerS(speed), Depth(30.0), Seconds(hold), 1e3);
            let [thinned, all] =
                [SAMPLES, 1e9].map(|samples| of_signal(&body, &press, &signal, samples).unwrap());
            for (thinned, all) in thinned.parameters.iter().zip(&all.parameters) {
                let ratio = thinned.std_error / all.std_error;
                assert!((ratio - 1.0).abs() < 0.01, "{speed} {hold} {}: {ratio}", all.name);
            }
        }
    }
}
