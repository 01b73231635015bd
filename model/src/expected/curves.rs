//! Expected intervals against what can be chosen: hold, number of cycles, sampling rate.

use super::information::{ExpectedError, intervals};
use super::noise::{Noise, Unknowns};
use super::protocol::Protocol;
use super::search::{Rig, allowed_speeds};
use crate::units::{Depth, MmPerS, Seconds};
use crate::viscoelastic::ModifiedKelvin;
use serde::Serialize;

/// Points of a curve over hold or rate.
const POINTS: usize = 33;
/// Holds go from this to that many relaxation times.
const HOLD_TAUS: [f64; 2] = [0.1, 100.0];
/// Most cycles drawn.
const CYCLES: usize = 12;
/// Rates go from this to that many samples per second.
const RATES_HZ: [f64; 2] = [10.0, 10_000.0];
/// From the fastest allowed speed to the next one drawn.
const SPEED_RATIO: usize = 3;
/// Speeds drawn.
const SPEEDS: usize = 4;

/// Half-widths of 95 % intervals along one choice.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curve {
    /// Speed of the ramp or of the cycles.
    pub speed: MmPerS,
    /// Hold in s, number of cycles, or samples per second.
    pub x: Vec<f64>,
    /// At each `x` in percent, in the order of [`super::PARAMETER_NAMES`]; `None` where nothing can
    /// be told.
    pub percent: Vec<[Option<f64>; 5]>,
}

/// Expected intervals against what can be chosen.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Curves {
    /// Ramp and hold: against the hold in s, at several speeds.
    pub hold: Vec<Curve>,
    /// Cycles between half the depth and the depth: against their number, at several speeds.
    pub cycles: Vec<Curve>,
    /// The ramp and hold asked about: against samples per second.
    pub rate: Curve,
}

/// Curves for a body on a rig; those over the sampling rate for a ramp and hold of this speed and
/// hold.
pub fn curves(
    body: &ModifiedKelvin,
    noise: &Noise,
    unknowns: Unknowns,
    rig: &Rig,
    (speed, hold): (MmPerS, Seconds),
) -> Result<Curves, ExpectedError> {
    noise.check()?;
    let tau = body.checked()?.tau_eps;
    let speeds = allowed_speeds(body, rig)?;
    let drawn = || speeds.iter().copied().step_by(SPEED_RATIO).take(SPEEDS);
    let at = |protocol: Protocol| match intervals(body, &protocol, noise, unknowns) {
        Ok(expected) => expected.parameters.map(|parameter| parameter.percent),
        Err(_) => [None; 5],
    };
    let curve = |speed: MmPerS, x: Vec<f64>, protocol: &dyn Fn(f64) -> Protocol| Curve {
        speed,
        percent: x.iter().map(|&x| at(protocol(x))).collect(),
        x,
    };
    let (depth, rate) = (rig.depth, rig.sample_rate_hz);
    let counts: Vec<f64> = (1..=CYCLES).map(|count| count as f64).collect();
    let between = [Depth(0.5 * depth.0), depth];
    Ok(Curves {
        hold: drawn()
            .map(|speed| {
                curve(speed, spaced(HOLD_TAUS.map(|taus| taus * tau)), &|hold| {
                    Protocol::ramp_hold(speed, depth, Seconds(hold), rate)
                })
            })
            .collect(),
        cycles: drawn()
            .map(|speed| {
                curve(speed, counts.clone(), &|count| {
                    Protocol::cycles(speed, between, count as usize, rate)
                })
            })
            .collect(),
        rate: curve(speed, spaced(RATES_HZ), &|rate| {
            Protocol::ramp_hold(speed, depth, hold, rate)
        }),
    })
}

/// Equal ratios from one number to another, both included.
fn spaced([from, to]: [f64; 2]) -> Vec<f64> {
    (0..POINTS)
        .map(|i| from * (to / from).powf(i as f64 / (POINTS - 1) as f64))
        .collect()
}
