//! The slider and its controller axis: profiles, switches, pulses.
//!
//! Two scales meet here. The *counted* position is what the controller believes: pulses times
//! mm per pulse, from wherever its counter was last defined. The *true* position is measured from
//! the edge of the home switch. They differ by an offset the host cannot know; the slider powers
//! up anywhere, so the switch's edge falls at a random place between two pulses.
//!
//! A microstepping drive and the carriage's inertia smooth the pulse stairs, so the probe follows
//! the profile itself while the controller reports whole pulses. At rest it stands on the pulse.

use super::random::Random;
use crate::rig::axis_status;
use palpate_model::rig::command::position_from_pulses;
use palpate_model::rig::{
    Ack, AxisStatus, Course, Fault, MotionProfile, MoveTo, Oscillation, RigCommand, RigDescription,
    SinePath,
};
use palpate_model::{MmPerS, MmPerS2, Position, Seconds};

/// Accelerations are whole multiples of this: 1024 counts/s^2 of 0.015 mm, the resolution of `AC`
/// in Galil's DMC command reference.
pub const ACCELERATION_QUANTUM: MmPerS2 = MmPerS2(1024.0 * 0.015);

/// The limit switches close this far beyond home and beyond the travel, in mm. Behind them the
/// slide runs free for longer than the longest stop (20 mm/s at 61.44 mm/s^2: 3.3 mm).
pub const SWITCH_MARGIN_MM: f64 = 2.0;

/// Targets and counts fit the controller's 32-bit position register.
const PULSES_MAX: u64 = 1 << 31;

#[derive(Clone, Copy, Debug)]
struct Motion {
    course: Course,
    start_tick: u64,
    /// Pulse at which the motion ends, or `None` when it ends early.
    target_pulses: Option<i64>,
    /// At least one sample has shown this motion.
    is_reported: bool,
}

/// State of the axis at one tick.
#[derive(Clone, Copy, Debug)]
pub struct AxisSample {
    /// Reported position: whole pulses at or below the commanded position.
    pub pulses: i64,
    pub status: AxisStatus,
    pub position: Position,
}

#[derive(Clone, Debug)]
pub struct Slider {
    mm_per_pulse: f64,
    tick: Seconds,
    speed_quantum: f64,
    speed_max: f64,
    /// True position at which the pulse counter reads zero.
    counter_zero: Position,
    reverse_limit: f64,
    forward_limit: f64,
    is_motor_on: bool,
    position: Position,
    motion: Option<Motion>,
    /// A move ended at this very tick, so the axis was still moving when last reported.
    is_just_ended: bool,
    /// A halt took effect at this very tick.
    is_just_halted: bool,
}

impl Slider {
    /// The slide at power-on: 5 to 15 mm from home, counter at zero, motor off.
    pub fn new(rig: &RigDescription, random: &mut Random) -> Self {
        Self {
            mm_per_pulse: rig.mm_per_pulse,
            tick: rig.tick(),
            speed_quantum: rig.speed_quantum.0,
            speed_max: rig.speed_max.0,
            counter_zero: Position(random.between(5.0, 15.0)),
            reverse_limit: -SWITCH_MARGIN_MM,
            forward_limit: rig.travel.0 + SWITCH_MARGIN_MM,
            is_motor_on: false,
            position: Position(0.0),
            motion: None,
            is_just_ended: false,
            is_just_halted: false,
        }
    }

    /// True position at which the pulse counter reads zero.
    pub fn counter_zero(&self) -> Position {
        self.counter_zero
    }

    /// Starts a tick: a motion that is over leaves the axis at rest. Commands come after this.
    pub fn begin_tick(&mut self, tick: u64) {
        self.is_just_halted = false;
        self.is_just_ended = false;
        let Some(motion) = self.motion else { return };
        if self.since(motion, tick).0 >= motion.course.duration().0 {
            self.position = match motion.target_pulses {
                Some(target) => position_from_pulses(target, self.mm_per_pulse),
                None => self.whole_pulse_at(motion.course.end()),
            };
            self.motion = None;
            self.is_just_ended = true;
        }
    }

    /// Executes one command at a tick. The acknowledgement carries what was really set.
    pub fn execute(&mut self, tick: u64, command: RigCommand) -> Result<Ack, Fault> {
        let mut made = command;
        match command {
            RigCommand::EnableMotor => self.is_motor_on = true,
            RigCommand::MoveTo(wanted) => made = RigCommand::MoveTo(self.start_move(tick, wanted)?),
            RigCommand::Track(_) => {
                return Err(refusal(
                    "the simulated axis takes no target on the way; move it from rest",
                ));
            }
            RigCommand::Oscillate(wanted) => {
                made = RigCommand::Oscillate(self.start_oscillation(tick, wanted)?);
            }
            RigCommand::Stop => self.stop(tick),
            RigCommand::Halt => self.halt(tick),
            RigCommand::DefinePosition { pulses } => self.define(pulses)?,
        }
        Ok(Ack { command: made })
    }

    /// Ends a tick: moves the probe, looks at the switches and reports.
    pub fn end_tick(&mut self, tick: u64) -> AxisSample {
        if let Some(motion) = self.motion {
            self.motion = Some(Motion { is_reported: true, ..motion });
            let since = self.since(motion, tick);
            self.position = motion.course.position(since);
            if self.is_blocked(motion.course.velocity(since).0) {
                self.stop(tick);
            }
        }
        AxisSample {
            pulses: self.pulses_at(self.position),
            status: self.status(),
            position: self.true_position(),
        }
    }

    /// Whether a motion may begin, or why it may not.
    fn check_begin(&self) -> Result<(), Fault> {
        if !self.is_motor_on {
            return Err(refusal(
                "the axis cannot start while the motor is off; enable the motor first",
            ));
        }
        if self.motion.is_some() || self.is_just_ended {
            return Err(refusal("the axis cannot start while it moves; wait until it is at rest"));
        }
        Ok(())
    }

    /// Whether the limit switch in a direction is closed.
    fn is_blocked(&self, way: f64) -> bool {
        (way > 0.0 && self.is_forward_limit_closed())
            || (way < 0.0 && self.is_reverse_limit_closed())
    }

    fn check_direction(&self, way: f64) -> Result<(), Fault> {
        if self.is_blocked(way) {
            return Err(refusal(
                "the axis cannot move towards a closed limit switch; move it the other way",
            ));
        }
        Ok(())
    }

    fn start_move(&mut self, tick: u64, wanted: MoveTo) -> Result<MoveTo, Fault> {
        self.check_begin()?;
        if wanted.target_pulses.unsigned_abs() > PULSES_MAX {
            return Err(refusal(format!(
                "the target of {} pulses is out of range; stay within {PULSES_MAX}",
                wanted.target_pulses
            )));
        }
        let speed = round_down(wanted.speed.0, self.speed_quantum);
        if !(speed > 0.0 && speed <= self.speed_max * (1.0 + 1e-12)) {
            return Err(refusal(format!(
                "the speed of {} is out of range; choose from {} to {} mm/s",
                wanted.speed, self.speed_quantum, self.speed_max
            )));
        }
        let acceleration = achievable_acceleration(wanted.acceleration)?;
        let speed = MmPerS(speed);
        let target = position_from_pulses(wanted.target_pulses, self.mm_per_pulse);
        self.check_direction(target.distance_from(self.position))?;
        let made = MoveTo { target_pulses: wanted.target_pulses, speed, acceleration };
        let profile = MotionProfile::to_rest(self.position, target, speed, acceleration);
        self.begin(tick, Course::Move(profile), wanted.target_pulses);
        Ok(made)
    }

    fn start_oscillation(&mut self, tick: u64, wanted: Oscillation) -> Result<Oscillation, Fault> {
        self.check_begin()?;
        let made =
            Oscillation { acceleration: achievable_acceleration(wanted.acceleration)?, ..wanted };
        let start = self.pulses_at(self.position);
        let far = made.amplitude_pulses.saturating_mul(2);
        if start.saturating_add(far).unsigned_abs() > PULSES_MAX {
            return Err(refusal(format!(
                "an amplitude of {} pulses from {start} is out of range; stay within {PULSES_MAX}",
                made.amplitude_pulses
            )));
        }
        let sine = SinePath::new(self.position, &made, self.mm_per_pulse, self.tick);
        sine.check(MmPerS(self.speed_max), made.acceleration).map_err(refusal)?;
        self.check_direction(made.amplitude_pulses as f64)?;
        self.begin(tick, Course::Sine(sine), start);
        Ok(made)
    }

    fn begin(&mut self, tick: u64, course: Course, target: i64) {
        let target_pulses = Some(target);
        self.motion = Some(Motion { course, start_tick: tick, target_pulses, is_reported: false });
    }

    /// Replaces the motion by its deceleration; a move already ending early goes on as it is.
    fn stop(&mut self, tick: u64) {
        let Some(motion) = self.motion else { return };
        if motion.target_pulses.is_some() {
            self.motion = Some(Motion {
                course: motion.course.stopped_at(self.since(motion, tick)),
                start_tick: tick,
                target_pulses: None,
                is_reported: motion.is_reported,
            });
        }
    }

    /// Velocity zero at once, on the whole pulse reported at this tick.
    fn halt(&mut self, tick: u64) {
        let Some(motion) = self.motion else { return };
        if !motion.is_reported {
            // It began at this tick and has no speed yet: as a stop it keeps the one sample in
            // motion by which the host sees this move begin and end.
            self.stop(tick);
            return;
        }
        let here = motion.course.position(self.since(motion, tick));
        self.position = self.whole_pulse_at(here);
        self.motion = None;
        self.is_just_ended = true;
        self.is_just_halted = true;
    }

    fn define(&mut self, pulses: i64) -> Result<(), Fault> {
        if self.motion.is_some() {
            return Err(refusal(
                "the position cannot be defined while the axis moves; stop the axis first",
            ));
        }
        if pulses.unsigned_abs() > PULSES_MAX {
            return Err(refusal(format!(
                "the position of {pulses} pulses is out of range; stay within {PULSES_MAX}"
            )));
        }
        let here = self.true_position();
        self.position = position_from_pulses(pulses, self.mm_per_pulse);
        self.counter_zero = Position(here.0 - self.position.0);
        Ok(())
    }

    fn status(&self) -> AxisStatus {
        axis_status([
            (self.motion.is_some(), AxisStatus::MOVING),
            (
                self.is_just_halted || self.motion.is_some_and(|m| m.target_pulses.is_none()),
                AxisStatus::STOPPING,
            ),
            (self.true_position().0 <= 0.0, AxisStatus::HOME),
            (self.is_forward_limit_closed(), AxisStatus::FORWARD_LIMIT),
            (self.is_reverse_limit_closed(), AxisStatus::REVERSE_LIMIT),
            (self.is_motor_on, AxisStatus::MOTOR_ON),
        ])
    }

    fn true_position(&self) -> Position {
        Position(self.counter_zero.0 + self.position.0)
    }

    fn is_forward_limit_closed(&self) -> bool {
        self.true_position().0 >= self.forward_limit
    }

    fn is_reverse_limit_closed(&self) -> bool {
        self.true_position().0 <= self.reverse_limit
    }

    fn since(&self, motion: Motion, tick: u64) -> Seconds {
        Seconds((tick - motion.start_tick) as f64 * self.tick.0)
    }

    /// Whole pulses at or below a counted position; 1e-6 pulse forgives rounding.
    fn pulses_at(&self, position: Position) -> i64 {
        (position.0 / self.mm_per_pulse + 1e-6).floor() as i64
    }

    fn whole_pulse_at(&self, position: Position) -> Position {
        position_from_pulses(self.pulses_at(position), self.mm_per_pulse)
    }
}

/// The acceleration that the controller sets for a wish.
fn achievable_acceleration(wanted: MmPerS2) -> Result<MmPerS2, Fault> {
    let made = round_down(wanted.0, ACCELERATION_QUANTUM.0);
    if made > 0.0 && made.is_finite() {
        Ok(MmPerS2(made))
    } else {
        Err(refusal(format!(
            "the acceleration of {wanted} is out of range; choose at least {ACCELERATION_QUANTUM}"
        )))
    }
}

/// The largest multiple of a quantum not above a wish. A wish that misses a multiple only by
/// decimal rounding (1e-6 of a quantum) gets that multiple.
fn round_down(wanted: f64, quantum: f64) -> f64 {
    (wanted / quantum + 1e-6).floor() * quantum
}

fn refusal(detail: impl Into<String>) -> Fault {
    Fault::CommandRefused { detail: detail.into() }
}
