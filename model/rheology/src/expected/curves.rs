//! Expected intervals against what can be chosen: hold, number of cycles, sampling rate.

use super::information::ExpectedError;
use super::measurement::Measurement;
use super::protocol::ProtocolPath;
use super::rig::{DesignLimits, allowed_speeds, shallowest_turn};
use palpate_model::units::{Depth, MmPerS, Seconds};
use palpate_model::viscoelastic::ModifiedKelvin;
use serde::Serialize;

/// Ten numbers a decade that are easy to read (Renard's series R10, ISO 3).
const DECADE: [f64; 10] = [1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0, 5.0, 6.3, 8.0];
/// Decades of a curve over hold or rate.
const DECADES: i32 = 3;
/// Holds begin at the decade of so many relaxation times.
const HOLD_TAUS: f64 = 0.1;
const CYCLES: usize = 12;
/// Rates begin at so many samples per second.
const RATE_HZ: f64 = 10.0;
/// From the fastest allowed speed to the next one drawn.
const SPEED_RATIO: usize = 3;
const SPEEDS: usize = 4;

/// Half-widths of 95 % intervals along one choice.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PrecisionCurve {
    /// Speed of the ramp or of the cycles.
    pub speed: MmPerS,
    /// Hold in s, number of cycles, or samples per second.
    pub x: Vec<f64>,
    /// At each `x` in percent, in the order of [`super::PARAMETER_NAMES`]; `None` where the
    /// protocol does not separate the parameters.
    pub percent: Vec<[Option<f64>; 5]>,
}

/// Expected intervals against what can be chosen.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PrecisionCurves {
    /// Ramp and hold: against the hold in s, at several speeds.
    pub hold: Vec<PrecisionCurve>,
    /// Cycles: against their number, at several speeds.
    pub cycles: Vec<PrecisionCurve>,
    /// Their turning points: the shallowest that keep the probe in contact at all these speeds.
    pub between: [Depth; 2],
    /// The ramp and hold asked about: against samples per second.
    pub rate: PrecisionCurve,
    /// Its hold in s.
    pub rate_hold: Seconds,
}

/// Curves for a body on a rig; those over the sampling rate for a ramp and hold of this speed and
/// hold.
pub fn compute_precision_curves(
    body: &ModifiedKelvin,
    measurement: Measurement<'_>,
    rig: &DesignLimits,
    (speed, hold): (MmPerS, Seconds),
) -> Result<PrecisionCurves, ExpectedError> {
    measurement.check()?;
    let tau = body.checked()?.tau_eps;
    let speeds = allowed_speeds(body, rig)?;
    let drawn = || speeds.iter().copied().step_by(SPEED_RATIO).take(SPEEDS);
    let at = |protocol: ProtocolPath| match measurement.precision(body, &protocol) {
        Ok(expected) => expected.parameters.map(|parameter| parameter.percent),
        Err(_) => [None; 5],
    };
    let curve = |speed: MmPerS, x: Vec<f64>, protocol: &dyn Fn(f64) -> ProtocolPath| {
        PrecisionCurve { speed, percent: x.iter().map(|&x| at(protocol(x))).collect(), x }
    };
    let (depth, rate) = (rig.depth, rig.sample_rate_hz);
    let counts: Vec<f64> = (1..=CYCLES).map(|count| count as f64).collect();
    let between = [shallowest_turn(body, rig, speeds[0]), depth];
    Ok(PrecisionCurves {
        hold: drawn()
            .map(|speed| {
                curve(speed, decades(HOLD_TAUS * tau), &|hold| {
                    ProtocolPath::ramp_hold(speed, depth, Seconds(hold), rate)
                })
            })
            .collect(),
        cycles: drawn()
            .map(|speed| {
                curve(speed, counts.clone(), &|count| {
                    ProtocolPath::cycles(speed, between, count as usize, rate)
                })
            })
            .collect(),
        between,
        rate: curve(speed, decades(RATE_HZ), &|rate| {
            ProtocolPath::ramp_hold(speed, depth, hold, rate)
        }),
        rate_hold: hold,
    })
}

/// Easy numbers from the decade of `from` on, the last a whole decade.
fn decades(from: f64) -> Vec<f64> {
    // Rounding must not cost a decade.
    let first = (from.log10() + 1e-9).floor() as i32;
    let values = (first..first + DECADES).flat_map(|decade| {
        // Negative powers of ten have no exact number; quotients by positive ones are the nearest.
        DECADE.map(|value| {
            if decade < 0 { value / 10f64.powi(-decade) } else { value * 10f64.powi(decade) }
        })
    });
    let last = 10f64.powi(first + DECADES);
    values.chain([last]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decades_are_easy_numbers() {
        let values = decades(0.1023);
        assert_eq!(values.len(), 31);
        assert_eq!((values[0], values[3], values[30]), (0.1, 0.2, 100.0));
        assert_eq!(decades(10.0)[0], 10.0);
    }
}
