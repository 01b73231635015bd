//! How long moves and waits take, and where a move may begin and end.

use super::walk::{DurationEstimate, Walk};
use palpate_model::rig::MotionProfile;
use palpate_model::units::{Depth, MmPerS, Position, Seconds};

/// Milliseconds from the sample that begins a move to the first tick of its motion, and from its last tick to the sample
/// that shows rest: with a tick in each, report 1.0 to 1.5 ms and command 0.5 ms make one, the tick that shows rest the
/// other. With more ticks a move takes up to half a millisecond less, by chance.
const MOVE_MS: u64 = 2;

/// Depths this near to a whole pulse, as a share of one, are whole: decimal rounding of the request and no more.
const WHOLE: f64 = 1e-6;

/// The depths between which the probe surely is, in mm; both ends the same where its depth is known to the pulse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Reach {
    pub low: f64,
    pub high: f64,
}

impl Reach {
    pub fn at(depth: f64) -> Self {
        Self { low: depth, high: depth }
    }

    pub fn is_known(self) -> bool {
        self.low == self.high
    }

    /// Where a move to a depth ends. Contact is not at a whole pulse, so a depth that is no whole number of pulses
    /// ends on either neighbour.
    pub fn to(depth: f64, pulse: f64) -> Self {
        let pulses = depth / pulse;
        if (pulses - pulses.round()).abs() < WHOLE {
            Self::at(pulses.round() * pulse)
        } else {
            Self { low: pulses.floor() * pulse, high: pulses.ceil() * pulse }
        }
    }

    pub fn moved_by(self, distance: f64) -> Self {
        Self { low: self.low + distance, high: self.high + distance }
    }
}

impl Walk<'_> {
    pub fn go(&mut self, depth: Depth, speed: MmPerS) -> DurationEstimate {
        let end = Reach::to(depth.0, self.rig.mm_per_pulse);
        self.go_within(depth.0, end, speed)
    }

    /// A retract, which never goes deeper.
    pub fn leave(&mut self, clearance_mm: f64, speed: MmPerS) -> DurationEstimate {
        let to = Reach::to(-clearance_mm, self.rig.mm_per_pulse);
        let end = Reach { low: to.low.min(self.reach.low), high: to.high.min(self.reach.high) };
        let depth = (-clearance_mm).min(self.expected.depth());
        self.go_within(depth, end, speed)
    }

    fn go_within(&mut self, depth_mm: f64, end: Reach, speed: MmPerS) -> DurationEstimate {
        if self.is_refused() {
            return DurationEstimate(0.0, 0.0, true);
        }
        let (from, is_exact) =
            (self.reach, self.reach.is_known() && end.is_known() && self.is_answer_exact());
        let expected = self.secs(self.move_ticks(depth_mm - self.expected.depth(), speed));
        let furthest = (end.high - from.low).abs().max((end.low - from.high).abs());
        let longest = self.secs(self.move_ticks(furthest, speed));
        self.expected.go(self.phase, depth_mm, expected);
        self.reach = end;
        DurationEstimate(expected, longest.max(expected), is_exact)
    }

    pub fn wait(&mut self, duration: Seconds) -> DurationEstimate {
        let secs = self.secs(self.ticks(duration.0));
        self.expected.stay(self.phase, secs);
        DurationEstimate(secs, secs, true)
    }

    /// Something whose duration only the rig or a person knows.
    pub fn unknown(&mut self, expected: f64, longest: f64) -> DurationEstimate {
        self.expected.stay(self.phase, expected);
        DurationEstimate(expected, longest, false)
    }

    pub fn move_ticks(&self, distance_mm: f64, speed: MmPerS) -> u64 {
        match self.ticks(self.move_secs(distance_mm, speed)) {
            0 => 0,
            ticks => ticks + self.answer_ticks(),
        }
    }

    /// Ticks beyond those of the motion itself that a move takes, at most.
    pub fn answer_ticks(&self) -> u64 {
        MOVE_MS * u64::from(self.rig.samples_per_ms())
    }

    /// Whether a move takes just as many ticks more: those are long enough to hide when a report arrives.
    pub fn is_answer_exact(&self) -> bool {
        self.rig.samples_per_ms() == 1
    }

    /// As the engine counts: rounded up, a millionth of a tick forgiven.
    pub fn ticks(&self, secs: f64) -> u64 {
        (secs / self.rig.tick().0 - 1e-6).ceil().max(0.0) as u64
    }

    pub fn secs(&self, ticks: u64) -> f64 {
        ticks as f64 * self.rig.tick().0
    }

    pub fn move_secs(&self, distance_mm: f64, speed: MmPerS) -> f64 {
        if !(distance_mm.is_finite() && speed.0 > 0.0) {
            return 0.0;
        }
        // The axis ends on whole pulses.
        let pulse = self.rig.mm_per_pulse;
        let distance_mm = (distance_mm / pulse).round() * pulse;
        MotionProfile::to_rest(Position(0.0), Position(distance_mm), speed, self.rig.acceleration)
            .duration()
            .0
    }
}
