//! Protocols as commanded paths: straight pieces of depth over time.

use super::ExpectedError;
use palpate_model::units::{Depth, MmPerS, Seconds};
use serde::Serialize;

/// A stretch in which the depth changes at constant speed, or not at all.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PathPiece {
    /// Depth at its end, in mm.
    pub to: Depth,
    /// How long it takes, in s.
    pub duration: Seconds,
}

/// One or more presses into a body at rest, sampled at one rate.
///
/// The corners are sharp. A rig rounds them over speed / acceleration, which matters when that is
/// not short beside the relaxation time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ProtocolPath {
    /// Each press begins at depth 0 in a body at rest and is a list of pieces.
    pub presses: Vec<Vec<PathPiece>>,
    /// Rest before every press but the first, in s: counts as time, not as measurement.
    pub rest: Seconds,
    /// Samples per second.
    pub sample_rate_hz: f64,
}

impl ProtocolPath {
    /// One ramp at `speed` to `depth` and `hold` seconds there (none for a hold of 0).
    #[must_use]
    pub fn ramp_hold(speed: MmPerS, depth: Depth, hold: Seconds, sample_rate_hz: f64) -> Self {
        Self { presses: vec![press(speed, depth, hold)], rest: Seconds(0.0), sample_rate_hz }
    }

    /// Two ramps and holds, one at each speed, the second after `rest` seconds out of the tissue.
    #[must_use]
    pub fn two_speeds(
        speeds: [MmPerS; 2],
        depth: Depth,
        hold: Seconds,
        rest: Seconds,
        sample_rate_hz: f64,
    ) -> Self {
        Self {
            presses: speeds.map(|speed| press(speed, depth, hold)).to_vec(),
            rest,
            sample_rate_hz,
        }
    }

    /// Down to the second depth, then back to the first: `count` times, all at `speed`. A
    /// shallower turning point above 0 keeps the probe in contact.
    #[must_use]
    pub fn cycles(speed: MmPerS, between: [Depth; 2], count: usize, sample_rate_hz: f64) -> Self {
        let [top, bottom] = between;
        let mut at = Depth(0.0);
        let mut pieces = Vec::with_capacity(2 * count);
        for turn in (0..count).flat_map(|_| [bottom, top]) {
            pieces.push(PathPiece { to: turn, duration: Seconds((turn - at).abs().0 / speed.0) });
            at = turn;
        }
        Self { presses: vec![pieces], rest: Seconds(0.0), sample_rate_hz }
    }

    /// Time in tissue and rests between presses, in s; without what a rig does before (homing,
    /// finding contact) and after (leaving the tissue).
    pub fn duration(&self) -> Seconds {
        let pieces: f64 = self.presses.iter().map(|press| duration_of(press)).sum();
        Seconds(pieces + self.rest.0 * self.presses.len().saturating_sub(1) as f64)
    }

    pub(super) fn check(&self) -> Result<(), ExpectedError> {
        let bad = |what, value| Err(ExpectedError::BadNumber { what, value });
        if !(self.sample_rate_hz > 0.0 && self.sample_rate_hz.is_finite()) {
            return bad("sampling rate in Hz", self.sample_rate_hz);
        }
        if !(self.rest.0 >= 0.0 && self.rest.is_finite()) {
            return bad("rest in s", self.rest.0);
        }
        let pieces = || self.presses.iter().flatten();
        if self.presses.iter().any(Vec::is_empty) || self.presses.is_empty() {
            return bad("number of pieces of a press", 0.0);
        }
        // A thousand kilometres and thirty years: their squares and cubes still have all digits.
        let is_size = |value: f64| (0.0..=1e9).contains(&value);
        if let Some(piece) = pieces().find(|piece| !is_size(piece.to.0)) {
            return bad("depth in mm", piece.to.0);
        }
        match pieces().find(|piece| !is_size(piece.duration.0) || piece.duration.0 == 0.0) {
            Some(piece) => bad("duration of a piece in s", piece.duration.0),
            None => Ok(()),
        }
    }
}

fn press(speed: MmPerS, depth: Depth, hold: Seconds) -> Vec<PathPiece> {
    let ramp = PathPiece { to: depth, duration: Seconds(depth.0 / speed.0) };
    let hold = PathPiece { to: depth, duration: hold };
    if hold.duration.0 > 0.0 { vec![ramp, hold] } else { vec![ramp] }
}

/// Time of one press, in s.
pub(super) fn duration_of(press: &[PathPiece]) -> f64 {
    press.iter().map(|piece| piece.duration.0).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_count_rests_between_presses_only() {
        let depth = Depth(30.0);
        let one = ProtocolPath::ramp_hold(MmPerS(0.75), depth, Seconds(50.0), 1e3);
        assert_eq!(one.duration(), Seconds(90.0));
        let speeds = [MmPerS(0.75), MmPerS(1.5)];
        let two = ProtocolPath::two_speeds(speeds, depth, Seconds(50.0), Seconds(10.0), 1e3);
        assert_eq!(two.duration(), Seconds(170.0));
        let cycles = ProtocolPath::cycles(MmPerS(2.0), [Depth(20.0), depth], 3, 1e3);
        assert_eq!(cycles.duration(), Seconds(15.0 + 5.0 * 5.0));
        assert!([one, two, cycles].iter().all(|one| one.check().is_ok()));
    }

    #[test]
    fn impossible_paths_are_refused_in_words() {
        let of = |speed, depth, rate| {
            let protocol = ProtocolPath::ramp_hold(MmPerS(speed), Depth(depth), Seconds(1.0), rate);
            protocol.check().unwrap_err()
        };
        let is_number = |refused, number: &str| matches!(refused, ExpectedError::BadNumber { what, .. } if what.contains(number));
        assert!(is_number(of(0.0, 30.0, 1e3), "duration"));
        assert!(is_number(of(1.0, -1.0, 1e3), "depth"));
        assert!(is_number(of(1.0, 1.0, 0.0), "sampling rate"));
    }
}
