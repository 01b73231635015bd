//! A motion cut into jogs, none of which is sent before it is needed.

use palpate_model::Nanos;
use palpate_model::rig::{MotionProfile, MoveTo};
use palpate_model::units::{MmPerS, MmPerS2, Position, Seconds};

/// Longest time that the axis may go on at full speed with the jogs it has, without the way of braking: 60 ms for
/// segments that Grbl makes ahead (five of 10 ms, and one that is being made), a chunk, and the rest for links that
/// are slow.
const AHEAD: Seconds = Seconds(0.3);
const CHUNK: Seconds = Seconds(0.08);
/// Chunks that are in the planner at once at most; it takes 15 (planner.h).
const CHUNKS_MAX: f64 = 8.0;
/// Uncertainty of the position as a time: the start is known to 20 ms, and a clock that is off by half a percent is
/// followed to 30.
const KNOWN: Seconds = Seconds(0.05);

#[derive(Clone, Debug)]
pub struct JogMotion {
    pub wanted: MoveTo,
    pub owed: Option<u64>,
    /// Steps of the board where it begins and ends.
    pub from: i64,
    pub to: i64,
    /// mm/min of the board.
    pub feed: f64,
    /// From 0 on, in mm.
    pub profile: MotionProfile,
    pub started: Option<Nanos>,
    /// When its early end was commanded.
    pub cancelled: Option<Nanos>,
    pub repeated: Nanos,
    /// The track knows its end.
    pub is_braking: bool,
    /// Whether the board has taken its newest jog is not known, so a report of rest may come before it.
    pub is_doubtful: bool,
    /// Steps to which jogs were sent.
    sent: i64,
}

impl JogMotion {
    /// Over steps of the board.
    #[must_use]
    pub fn new(
        number: u64,
        wanted: MoveTo,
        from: i64,
        to: i64,
        feed: f64,
        mm_per_pulse: f64,
    ) -> Self {
        Self {
            wanted,
            owed: Some(number),
            from,
            to,
            feed,
            profile: Self::profile((to - from).abs() as f64 * mm_per_pulse, &wanted),
            started: None,
            cancelled: None,
            repeated: Nanos::ZERO,
            is_braking: false,
            is_doubtful: false,
            sent: from,
        }
    }

    /// A profile over a way in mm, from 0 on.
    #[must_use]
    pub fn profile(way: f64, wanted: &MoveTo) -> MotionProfile {
        MotionProfile::to_rest(Position(0.0), Position(way), wanted.speed, wanted.acceleration)
    }

    /// 1 or -1 in steps of the board.
    pub fn direction(&self) -> f64 {
        if self.to < self.from { -1.0 } else { 1.0 }
    }

    pub const fn is_all_sent(&self) -> bool {
        self.sent == self.to
    }

    /// The part of the profile for which jogs were sent: what becomes of it when no more come.
    pub fn given_profile(&self, mm_per_pulse: f64) -> MotionProfile {
        let way = (self.sent - self.from).abs() as f64 * mm_per_pulse;
        Self::profile(way, &self.wanted)
    }

    /// Lead over the profile at these steps, while the axis goes at full speed.
    pub fn lead(&self, at: Nanos, steps: i64, mm_per_pulse: f64) -> Option<Seconds> {
        let (speed, acceleration) = (self.wanted.speed.0, self.wanted.acceleration.0);
        // A step is reported as soon as it begins, and lasts until the next.
        let way = ((steps - self.from) as f64 * self.direction() + 0.5) * mm_per_pulse;
        let ramp = speed / acceleration;
        let phase = ramp + (way - 0.5 * speed * ramp) / speed;
        let since = at.since(self.started?).0 as f64 * 1e-9;
        let is_cruising = phase > ramp && phase < self.profile.duration().0 - ramp;
        is_cruising.then_some(Seconds(phase - since))
    }

    pub fn duration(&self) -> Nanos {
        Nanos((self.profile.duration().0 * 1e9) as u64)
    }

    /// Where the next jog ends, if it is time for one.
    pub fn next_chunk(&mut self, now: Nanos, mm_per_pulse: f64) -> Option<i64> {
        if self.is_all_sent() {
            return None;
        }
        let (speed, acceleration) = (self.wanted.speed.0, self.wanted.acceleration.0);
        let window = ahead_mm(self.wanted.speed, self.wanted.acceleration);
        let least = (speed * CHUNK.0).max(window / CHUNKS_MAX);
        let usual = ((least / mm_per_pulse).ceil() as i64).max(1);
        let done = match self.started {
            Some(started) => {
                let since = Seconds(now.since(started).0 as f64 * 1e-9);
                self.profile.position(since).0
            }
            // The first must be acknowledged before the second is sent, so that the start is known.
            None if self.sent != self.from => return None,
            None => 0.0,
        };
        let sent = (self.sent - self.from).abs() as f64 * mm_per_pulse;
        // The first one may be as long as all that may be ahead: from rest it takes longer anyway.
        let is_first = self.sent == self.from;
        let chunk = if is_first { usual.max((window / mm_per_pulse) as i64) } else { usual };
        let is_due = is_first
            || sent - done + chunk as f64 * mm_per_pulse
                <= window.max(2.0 * chunk as f64 * mm_per_pulse);
        debug_assert!(acceleration > 0.0);
        if !is_due {
            return None;
        }
        let left = (self.to - self.sent).abs();
        // A last piece that is less than half a chunk goes with the one before it.
        let next = if left <= chunk + usual / 2 { left } else { chunk };
        self.sent += next * if self.to < self.from { -1 } else { 1 };
        Some(self.sent)
    }
}

/// The most way that Grbl is given beyond where the axis is, in mm.
fn ahead_mm(speed: MmPerS, acceleration: MmPerS2) -> f64 {
    speed.0 * AHEAD.0 + speed.0 * speed.0 / (2.0 * acceleration.0)
}

/// Longest way of the axis, in mm, after the link is lost at full speed: all that was sent, half a chunk that went
/// with the last one, and what its place is uncertain by.
#[must_use]
pub fn worst_case_mm(speed: MmPerS, acceleration: MmPerS2) -> f64 {
    let ahead = ahead_mm(speed, acceleration);
    let half_chunk = 0.5 * (speed.0 * CHUNK.0).max(ahead / CHUNKS_MAX);
    ahead + half_chunk + speed.0 * KNOWN.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_keep_braking_ahead_and_never_more_than_stated() {
        let long = [(0.02, 1_000), (0.75, 20_000), (9.0, 40_000), (20.0, -40_000)];
        // And ways of one to two windows, of which the first jog may be all.
        let short = [0.02, 0.75, 9.0, 20.0].into_iter().flat_map(|speed| {
            let window = ahead_mm(MmPerS(speed), MmPerS2(60.0)) / 0.0025;
            (10..20).map(move |tenths| (speed, (window * f64::from(tenths) / 10.0) as i64))
        });
        for (speed, way) in long.into_iter().chain(short) {
            let wanted =
                MoveTo { target_pulses: way, speed: MmPerS(speed), acceleration: MmPerS2(60.0) };
            let mut motion = JogMotion::new(1, wanted, 0, way, speed * 60.0, 0.0025);
            let worst = worst_case_mm(wanted.speed, wanted.acceleration);
            let mut sent = motion.next_chunk(Nanos::ZERO, 0.0025).unwrap();
            assert!(sent.abs() as f64 * 0.0025 <= worst, "{speed}: {sent} first");
            assert_eq!(motion.next_chunk(Nanos::ZERO, 0.0025), None);
            motion.started = Some(Nanos::ZERO);
            for ms in 0..motion.duration().0 / 1_000_000 {
                let now = Nanos::from_millis(ms);
                let done = motion.profile.position(Seconds(ms as f64 * 1e-3)).0;
                while let Some(end) = motion.next_chunk(now, 0.0025) {
                    sent = end;
                }
                let ahead = sent.abs() as f64 * 0.0025 - done;
                assert!(ahead <= worst, "{speed}: {ahead} of {worst}");
                let braking = speed * speed / 120.0;
                if !motion.is_all_sent() {
                    // 60 ms of segments, and 50 ms for the link, before the braking would have to begin.
                    assert!(ahead >= braking + 0.11 * speed, "{speed}: {ahead} at {ms}");
                }
            }
            assert_eq!(sent, way);
        }
    }
}
