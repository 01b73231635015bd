//! Limits of rig and specimen: speeds, forces, turning points.

use super::information::ExpectedError;
use super::protocol::ProtocolPath;
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds};
use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
use serde::Serialize;

/// From one speed to the next.
const SPEED_RATIO: f64 = 0.8;
/// Down to a hundredth of the fastest.
const SPEEDS_MAX: usize = 21;
/// Steps in which the peak of a ramp is looked for.
const PEAK_STEPS: u32 = 256;
/// Where cycles turn back, as shares of the depth.
pub(super) const TURNS: [f64; 4] = [0.0, 0.25, 0.5, 0.75];
/// Limits of rig and specimen, and the sampling rate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DesignLimits {
    /// Speeds are multiples of this.
    pub speed_quantum: MmPerS,
    pub speed_max: MmPerS,
    /// Depth of every protocol, in mm.
    pub depth: Depth,
    /// Ceiling of the force along the path, in N.
    pub force_max: Newtons,
    /// Longest protocol, in s.
    pub duration_max: Seconds,
    /// Samples per second.
    pub sample_rate_hz: f64,
}

/// The speeds that are tried, fastest first.
pub(super) fn allowed_speeds(
    body: &ModifiedKelvin,
    rig: &DesignLimits,
) -> Result<Vec<MmPerS>, ExpectedError> {
    let checked = [
        ("speed quantum in mm/s", rig.speed_quantum.0),
        ("fastest speed in mm/s", rig.speed_max.0),
        ("depth in mm", rig.depth.0),
        ("force ceiling in N", rig.force_max.0),
        ("longest duration in s", rig.duration_max.0),
        ("sampling rate in Hz", rig.sample_rate_hz),
    ];
    if let Some((what, value)) =
        checked.into_iter().find(|(_, value)| !(*value > 0.0 && value.is_finite()))
    {
        return Err(ExpectedError::BadNumber { what, value });
    }
    let speed = |multiple: f64| MmPerS(multiple * rig.speed_quantum.0);
    // A ramp may take half the time at most; the other half is for what is learned from it.
    let slowest = (2.0 * rig.depth.0 / rig.duration_max.0 / rig.speed_quantum.0).ceil().max(1.0);
    let fastest = (rig.speed_max.0 / rig.speed_quantum.0 * (1.0 + 1e-9)).floor();
    if slowest > fastest {
        return Err(ExpectedError::TooLittleTime {
            depth_mm: rig.depth.0,
            speed_mm_per_s: rig.speed_max.0,
            allowed_s: rig.duration_max.0,
        });
    }
    let is_gentle = |multiple: f64| peak(body, rig.depth, speed(multiple)) <= rig.force_max.0;
    if !is_gentle(slowest) {
        return Err(ExpectedError::TooForceful {
            depth_mm: rig.depth.0,
            force_n: peak(body, rig.depth, speed(slowest)),
            speed_mm_per_s: speed(slowest).0,
            allowed_n: rig.force_max.0,
        });
    }
    let (mut low, mut high) = (slowest, fastest + 1.0);
    while high - low > 1.0 {
        let middle = (0.5 * (low + high)).floor();
        if is_gentle(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    let mut multiples = vec![low];
    let mut wanted = low;
    while multiples.len() < SPEEDS_MAX && wanted > slowest {
        wanted *= SPEED_RATIO;
        let multiple = wanted.round().max(slowest);
        if multiples.last() != Some(&multiple) {
            multiples.push(multiple);
        }
    }
    Ok(multiples.into_iter().map(speed).collect())
}

/// Highest force in N of a ramp and the hold behind it.
fn peak(body: &ModifiedKelvin, depth: Depth, speed: MmPerS) -> f64 {
    let mut state = KelvinState::at_rest();
    let dt = Seconds(depth.0 / speed.0 / f64::from(PEAK_STEPS));
    let ramp = (1..=PEAK_STEPS).map(|i| {
        let to = Depth(depth.0 * f64::from(i) / f64::from(PEAK_STEPS));
        state.step(body, to, dt).0
    });
    // During the hold the force goes straight to its elastic part.
    ramp.fold(body.elastic(depth).0, f64::max)
}

/// Whether the force of one press falls below zero anywhere.
pub(super) fn has_tension(body: &ModifiedKelvin, protocol: &ProtocolPath) -> bool {
    let mut state = KelvinState::at_rest();
    let mut depth = 0.0;
    protocol.presses[0].iter().any(|piece| {
        let from = std::mem::replace(&mut depth, piece.to.0);
        let dt = Seconds(piece.duration.0 / f64::from(PEAK_STEPS));
        (1..=PEAK_STEPS).any(|i| {
            let share = f64::from(i) / f64::from(PEAK_STEPS);
            state.step(body, Depth(from + (depth - from) * share), dt).0 < 0.0
        })
    })
}

/// Where cycles at a speed can turn back with the probe still in contact.
pub(super) fn shallowest_turn(body: &ModifiedKelvin, rig: &DesignLimits, speed: MmPerS) -> Depth {
    let turns = TURNS.map(|share| Depth(share * rig.depth.0));
    let presses = |turn: &Depth| {
        // The second cycle does what all later ones do.
        let twice = ProtocolPath::cycles(speed, [*turn, rig.depth], 2, rig.sample_rate_hz);
        !has_tension(body, &twice)
    };
    turns.into_iter().find(presses).unwrap_or(turns[TURNS.len() - 1])
}
