//! The past positions of an axis, from the courses that were commanded and confirmed.
//!
//! The thread that talks to the axis writes it; samples of a load cell, which arrive later than they were taken, look
//! the past up in it.

use palpate_model::Nanos;
use palpate_model::rig::{AxisStatus, MotionProfile};
use palpate_model::units::Seconds;
use std::collections::VecDeque;

/// Motions and states that are remembered: minutes of them. Samples are looked up a fraction of a second late.
const PIECES_MAX: usize = 256;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct TrackPiece {
    from: Nanos,
    /// Pulses where it begins.
    pulses: f64,
    /// Its course, in pulses from there.
    course: Option<(MotionProfile, f64)>,
    status: AxisStatus,
    /// Counts motions.
    motion: u64,
}

#[derive(Clone, Debug, Default)]
pub struct AxisTrack {
    pieces: VecDeque<TrackPiece>,
    inputs: VecDeque<(Nanos, AxisStatus)>,
    motion: u64,
    /// Something else of the rig has failed: the axis is to stop.
    pub is_stop_wanted: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisState {
    /// Pulses of its own counter.
    pub pulses: f64,
    pub status: AxisStatus,
    pub motion: u64,
}

impl AxisTrack {
    #[must_use]
    pub fn at_rest(pulses: i64) -> Self {
        let mut track = Self::default();
        track.begin_rest(Nanos::ZERO, pulses);
        track
    }

    fn motion_under_way(&self) -> Option<(TrackPiece, MotionProfile, f64)> {
        let last = *self.pieces.back()?;
        let (profile, pulses_per_mm) = last.course?;
        Some((last, profile, pulses_per_mm))
    }

    fn push(&mut self, piece: TrackPiece) {
        if self.pieces.len() >= PIECES_MAX {
            self.pieces.pop_front();
        }
        self.pieces.push_back(piece);
    }

    /// The axis rests from then on.
    pub fn begin_rest(&mut self, from: Nanos, pulses: i64) {
        let (pulses, motion) = (pulses as f64, self.motion);
        self.push(TrackPiece { from, pulses, motion, ..TrackPiece::default() });
    }

    /// Begins a motion with a profile in mm from zero and pulses per mm.
    pub fn begin_motion(
        &mut self,
        from: Nanos,
        pulses: f64,
        profile: MotionProfile,
        pulses_per_mm: f64,
    ) {
        self.motion += 1;
        self.push(TrackPiece {
            from,
            pulses,
            course: Some((profile, pulses_per_mm)),
            status: AxisStatus::MOVING,
            motion: self.motion,
        });
    }

    /// Brakes the motion under way from then on.
    pub fn begin_braking(&mut self, from: Nanos) {
        let Some((last, profile, pulses_per_mm)) = self.motion_under_way() else {
            return;
        };
        let since = seconds(from, last.from);
        let end = profile.stopped_at(since);
        let here = profile.position(since).0 * pulses_per_mm;
        self.push(TrackPiece {
            from,
            // The braking begins where the profile is by then.
            pulses: last.pulses,
            course: Some((end, pulses_per_mm)),
            status: AxisStatus::MOVING | AxisStatus::STOPPING,
            motion: self.motion,
        });
        debug_assert!((end.position(Seconds(0.0)).0 * pulses_per_mm - here).abs() < 1e-6);
    }

    /// The motion under way ends earlier than planned, at the end of this profile, such as when the way behind it was
    /// never given.
    pub fn shorten_motion(&mut self, profile: MotionProfile) {
        if let Some(TrackPiece { course: Some((course, _)), .. }) = self.pieces.back_mut() {
            *course = profile;
        }
    }

    /// The axis is no longer watched: it rests where and when its motion ends.
    pub fn finish_motion(&mut self) {
        let Some((last, profile, pulses_per_mm)) = self.motion_under_way() else {
            return;
        };
        let end = last.pulses + profile.end().0 * pulses_per_mm;
        let after = Nanos((profile.duration().0 * 1e9) as u64);
        self.begin_rest(last.from + after, end.round() as i64);
    }

    pub fn set_inputs(&mut self, from: Nanos, status: AxisStatus) {
        if self.inputs.back().is_some_and(|(_, last)| *last == status) {
            return;
        }
        if self.inputs.len() >= PIECES_MAX {
            self.inputs.pop_front();
        }
        self.inputs.push_back((from, status));
    }

    pub fn at(&self, time: Nanos) -> AxisState {
        let piece = self.pieces.iter().rev().find(|piece| piece.from <= time);
        // Before all that is remembered: as it was first.
        let piece = piece.or(self.pieces.front()).copied().unwrap_or_default();
        let way = piece.course.map_or(0.0, |(profile, pulses_per_mm)| {
            profile.position(seconds(time, piece.from)).0 * pulses_per_mm
        });
        let inputs = self.inputs.iter().rev().find(|(from, _)| *from <= time);
        let inputs = inputs.map_or(AxisStatus(0), |(_, status)| *status);
        AxisState {
            pulses: piece.pulses + way,
            status: piece.status | inputs,
            motion: piece.motion,
        }
    }
}

fn seconds(time: Nanos, from: Nanos) -> Seconds {
    Seconds(time.since(from).0 as f64 * 1e-9)
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::units::{MmPerS, MmPerS2, Position};

    #[test]
    fn position_and_status_are_looked_up_at_any_past_time() {
        let mut track = AxisTrack::at_rest(100);
        let ms = Nanos::from_millis;
        let profile =
            MotionProfile::to_rest(Position(0.0), Position(10.0), MmPerS(2.0), MmPerS2(20.0));
        track.set_inputs(ms(500), AxisStatus::MOTOR_ON);
        track.begin_motion(ms(1_000), 100.0, profile, -400.0);
        track.begin_braking(ms(2_000));
        track.begin_rest(ms(2_500), -700);
        assert_eq!(track.at(ms(400)).pulses, 100.0);
        assert_eq!(track.at(ms(400)).status, AxisStatus(0));
        let moving = track.at(ms(1_500));
        // 0.1 mm while it gains speed, 0.4 s at 2 mm/s.
        assert!((moving.pulses - (100.0 - 400.0 * 0.9)).abs() < 1e-6, "{moving:?}");
        assert_eq!(moving.status, AxisStatus::MOVING | AxisStatus::MOTOR_ON);
        let braking = track.at(ms(2_050));
        assert!(braking.status.has(AxisStatus::STOPPING));
        assert!((braking.pulses - (100.0 - 400.0 * (1.9 + 0.075))).abs() < 1e-6);
        let rest = track.at(ms(3_000));
        assert_eq!((rest.pulses, rest.motion), (-700.0, 1));
        assert!(!rest.status.has(AxisStatus::MOVING));
    }

    #[test]
    fn motion_that_is_no_longer_watched_ends() {
        let mut track = AxisTrack::at_rest(100);
        let ms = Nanos::from_millis;
        let speed = (MmPerS(2.0), MmPerS2(20.0));
        let profile = |to| MotionProfile::to_rest(Position(0.0), Position(to), speed.0, speed.1);
        track.finish_motion();
        assert_eq!(track.at(ms(500)).pulses, 100.0);
        track.begin_motion(ms(1_000), 100.0, profile(10.0), -400.0);
        track.shorten_motion(profile(1.0));
        track.finish_motion();
        assert!(track.at(ms(1_300)).status.has(AxisStatus::MOVING));
        let rest = track.at(ms(2_000));
        assert_eq!((rest.pulses, rest.motion), (-300.0, 1));
        assert!(!rest.status.has(AxisStatus::MOVING));
        // A motion that is being braked ends there.
        track.begin_motion(ms(3_000), -300.0, profile(10.0), 400.0);
        track.begin_braking(ms(4_000));
        track.finish_motion();
        let rest = track.at(ms(9_000));
        assert!(!rest.status.has(AxisStatus::MOVING));
        // 0.1 mm while it gains speed, 0.9 s at 2 mm/s, 0.1 mm while it brakes.
        assert_eq!(rest.pulses, -300.0 + 400.0 * 2.0);
    }
}
