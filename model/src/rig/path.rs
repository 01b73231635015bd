//! Follows the commanded path sample by sample and checks it against the reported pulses.
//!
//! Reported pulses are 15-micrometre stairs; the path between them is known, because every
//! course is. The tracker starts a course at the tick at which the axis first reports motion
//! and refuses the path when it is more than one pulse away from what the controller reports.

use super::command::{MoveTo, Oscillation, position_from_pulses, pulses_from_position};
use super::course::Course;
use super::description::RigDescription;
use super::oscillation::SinePath;
use super::profile::MotionProfile;
use super::reading::{AxisStatus, Reading};
use crate::units::{MmPerS, Position, Seconds};
use thiserror::Error;

/// The path and the pulses do not agree.
#[derive(Clone, Debug, PartialEq, Error)]
#[error(
    "the controller reports {reported_pulses} pulses instead of the commanded {expected_pulses:.2}: steps were lost or the axis was moved by hand; home it again"
)]
pub struct PathError {
    pub expected_pulses: f64,
    pub reported_pulses: i64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Motion {
    Rest,
    Moving {
        course: Course,
        start_tick: u64,
        is_stopping: bool,
    },
    /// Targets change on the way, at times that are known to a few samples only. So its place is what is reported, as
    /// far as the axis can have come there.
    Tracking(TrackedSpan),
}

/// Where an axis can be whose target changes on the way.
#[derive(Clone, Copy, Debug, PartialEq)]
struct TrackedSpan {
    /// Pulses from which it set out and to which it was sent, the least and the most.
    low: i64,
    high: i64,
    speed: MmPerS,
    /// Way of the brake from full speed, in pulses: so far it may overshoot a target that came nearer.
    braking_pulses: f64,
    newest_tick: u64,
    newest_pulses: i64,
}

impl TrackedSpan {
    fn from(pulses: i64, tick: u64) -> Self {
        Self {
            low: pulses,
            high: pulses,
            speed: MmPerS(0.0),
            braking_pulses: 0.0,
            newest_tick: tick,
            newest_pulses: pulses,
        }
    }

    fn add(&mut self, command: &MoveTo, mm_per_pulse: f64) {
        self.low = self.low.min(command.target_pulses);
        self.high = self.high.max(command.target_pulses);
        self.speed = MmPerS(self.speed.0.max(command.speed.0));
        let braking = self.speed.0 * self.speed.0 / (2.0 * command.acceleration.0);
        self.braking_pulses = self.braking_pulses.max(braking / mm_per_pulse);
    }

    /// Takes a sample; the place it should have where it cannot be, in pulses.
    fn take(&mut self, reading: &Reading, tick: Seconds, mm_per_pulse: f64) -> Result<(), f64> {
        // The pulses may be of the sample before or after the clock's.
        let ticks = reading.tick.saturating_sub(self.newest_tick).saturating_add(2);
        let way = 1.0 + self.speed.0 * ticks as f64 * tick.0 / mm_per_pulse;
        let (before, pulses) = (self.newest_pulses as f64, reading.pulses as f64);
        let least = (self.low as f64 - self.braking_pulses - 1.0).max(before - way);
        let most = (self.high as f64 + self.braking_pulses + 1.0).min(before + way);
        (self.newest_tick, self.newest_pulses) = (reading.tick, reading.pulses);
        // 1e-6 of a pulse is rounding.
        if (least - 1e-6..=most + 1e-6).contains(&pulses) {
            Ok(())
        } else {
            Err(pulses.max(least).min(most))
        }
    }
}

/// Time over which a speed is averaged that is known from whole pulses only: 20 ms at 1 mm/s are more than a pulse.
const SPEED_OVER: Seconds = Seconds(0.02);

/// A motion that was sent and has not begun.
#[derive(Clone, Copy, Debug, PartialEq)]
enum PendingMotion {
    Move(MoveTo),
    Sine(Oscillation),
    Track(MoveTo),
}

/// Commanded position as a function of the samples and commands seen so far.
#[derive(Clone, Debug, PartialEq)]
pub struct PathTracker {
    mm_per_pulse: f64,
    tick: Seconds,
    pulse_lag: Seconds,
    position: Option<Position>,
    velocity: MmPerS,
    /// Speed at which the motion under way was cut short: what its place is uncertain by then stays so to the end.
    speed_at_stop: MmPerS,
    pending: Option<PendingMotion>,
    /// A stop was accepted behind the motion that has not begun.
    is_pending_stopped: bool,
    motion: Motion,
}

impl PathTracker {
    /// A tracker that takes its first position from the first sample.
    #[must_use]
    pub fn new(rig: &RigDescription) -> Self {
        Self {
            mm_per_pulse: rig.mm_per_pulse,
            tick: rig.tick(),
            pulse_lag: rig.pulse_lag,
            position: None,
            velocity: MmPerS(0.0),
            speed_at_stop: MmPerS(0.0),
            pending: None,
            is_pending_stopped: false,
            motion: Motion::Rest,
        }
    }

    /// A move was sent; it starts when the axis reports motion.
    pub fn on_move(&mut self, command: MoveTo) {
        self.await_motion(PendingMotion::Move(command));
    }

    /// An oscillation was sent; it starts when the axis reports motion.
    pub fn on_oscillate(&mut self, command: Oscillation) {
        self.await_motion(PendingMotion::Sine(command));
    }

    /// A target was sent that may replace that of the motion under way.
    pub fn on_track(&mut self, command: MoveTo) {
        match &mut self.motion {
            Motion::Tracking(span) => span.add(&command, self.mm_per_pulse),
            _ => self.await_motion(PendingMotion::Track(command)),
        }
    }

    fn await_motion(&mut self, motion: PendingMotion) {
        self.pending = Some(motion);
        self.is_pending_stopped = false;
    }

    /// The motion that was sent last will not begin.
    pub fn on_not_begun(&mut self) {
        self.pending = None;
    }

    /// A stop was accepted. Where the next sample shows no motion, the one sent before is over: it was shorter than a sample.
    pub fn on_stop_accepted(&mut self) {
        self.is_pending_stopped = true;
    }

    /// The present position was given a new count.
    pub fn on_define(&mut self, pulses: i64) {
        self.position = Some(position_from_pulses(pulses, self.mm_per_pulse));
        self.motion = Motion::Rest;
        self.pending = None;
    }

    /// Commanded velocity at the newest sample.
    pub fn velocity(&self) -> MmPerS {
        self.velocity
    }

    /// Whether the axis is at rest with no motion under way or awaited.
    pub fn is_at_rest(&self) -> bool {
        self.pending.is_none() && matches!(self.motion, Motion::Rest)
    }

    /// Takes one sample and returns the commanded position at its tick.
    pub fn on_reading(&mut self, reading: &Reading) -> Result<Position, PathError> {
        if let Motion::Tracking(span) = self.motion {
            return self.on_tracked(span, reading);
        }
        let reported = position_from_pulses(reading.pulses, self.mm_per_pulse);
        let at_rest = self.position.unwrap_or(reported);
        let is_moving = reading.status.has(AxisStatus::MOVING);
        let mut lag_mm = 0.0_f64;
        if is_moving
            && matches!(self.motion, Motion::Rest)
            && let Some(pending) = self.pending.take()
        {
            if let PendingMotion::Track(command) = pending {
                // At rest the place is that of a whole pulse.
                let from = pulses_from_position(at_rest, self.mm_per_pulse);
                let before = reading.tick.saturating_sub(1);
                let mut span = TrackedSpan::from(from, before);
                span.add(&command, self.mm_per_pulse);
                return self.on_tracked(span, reading);
            }
            self.motion = Motion::Moving {
                course: self.course_from(at_rest, pending),
                start_tick: reading.tick,
                is_stopping: false,
            };
        }
        let is_over = !is_moving && self.is_pending_stopped;
        let position = match &mut self.motion {
            Motion::Rest if is_over && self.pending.take().is_some() => reported,
            // What is tracked was taken above.
            Motion::Rest | Motion::Tracking(_) => at_rest,
            Motion::Moving { course, start_tick, is_stopping } => {
                let mut since =
                    Seconds(reading.tick.saturating_sub(*start_tick) as f64 * self.tick.0);
                if reading.status.has(AxisStatus::STOPPING) && !*is_stopping {
                    self.speed_at_stop = MmPerS(course.velocity(since).0.abs());
                    *course = course.stopped_at(since);
                    *start_tick = reading.tick;
                    *is_stopping = true;
                    since = Seconds(0.0);
                }
                self.velocity = course.velocity(since);
                let here = course.position(since);
                for other in [since.0 - self.pulse_lag.0, since.0 + self.pulse_lag.0] {
                    let way = course.position(Seconds(other)).distance_from(here);
                    lag_mm = lag_mm.max(way.abs());
                }
                if is_moving { here } else { self.rest_at(here, since, reading) }
            }
        };
        if !is_moving && matches!(self.motion, Motion::Rest) {
            self.velocity = MmPerS(0.0);
        }
        self.position = Some(position);
        let expected_pulses = position.0 / self.mm_per_pulse;
        let lag_mm = lag_mm.max(self.speed_at_stop.0 * self.pulse_lag.0);
        let lag_pulses = lag_mm / self.mm_per_pulse;
        // One pulse, plus rounding of a position of up to 1e5 pulses in double precision.
        if (expected_pulses - reading.pulses as f64).abs() > 1.0 + lag_pulses + 1e-6 {
            return Err(PathError { expected_pulses, reported_pulses: reading.pulses });
        }
        Ok(position)
    }

    /// A sample of a motion whose target changes on the way; it ends where the axis rests.
    fn on_tracked(
        &mut self,
        mut span: TrackedSpan,
        reading: &Reading,
    ) -> Result<Position, PathError> {
        let (before, newest) = (span.newest_pulses, span.newest_tick);
        let taken = span.take(reading, self.tick, self.mm_per_pulse);
        let passed = reading.tick.saturating_sub(newest) as f64 * self.tick.0;
        let position = position_from_pulses(reading.pulses, self.mm_per_pulse);
        if reading.status.has(AxisStatus::MOVING) {
            let way = (reading.pulses - before) as f64 * self.mm_per_pulse;
            if passed > 0.0 {
                let share = passed / (passed + SPEED_OVER.0);
                self.velocity.0 += share * (way / passed - self.velocity.0);
            }
            self.motion = Motion::Tracking(span);
        } else {
            self.velocity = MmPerS(0.0);
            self.motion = Motion::Rest;
        }
        self.position = Some(position);
        taken.map(|()| position).map_err(|expected_pulses| PathError {
            expected_pulses,
            reported_pulses: reading.pulses,
        })
    }

    fn course_from(&self, from: Position, pending: PendingMotion) -> Course {
        match pending {
            PendingMotion::Move(command) | PendingMotion::Track(command) => {
                let target = position_from_pulses(command.target_pulses, self.mm_per_pulse);
                let (speed, acceleration) = (command.speed, command.acceleration);
                Course::Move(MotionProfile::to_rest(from, target, speed, acceleration))
            }
            PendingMotion::Sine(command) => {
                Course::Sine(SinePath::new(from, &command, self.mm_per_pulse, self.tick))
            }
        }
    }

    /// The axis no longer moves: the course's end, or the whole pulse where it was cut short.
    fn rest_at(&mut self, here: Position, since: Seconds, reading: &Reading) -> Position {
        let Motion::Moving { course, is_stopping, .. } = self.motion else {
            return here;
        };
        self.motion = Motion::Rest;
        self.speed_at_stop = MmPerS(0.0);
        // A stepper rests on a whole pulse: its target, or the pulse at which it was cut short.
        if !is_stopping && since.0 + self.tick.0 >= course.duration().0 {
            course.end()
        } else {
            position_from_pulses(reading.pulses, self.mm_per_pulse)
        }
    }
}
