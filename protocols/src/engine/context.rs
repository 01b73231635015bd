//! What a step may do while it runs: ask for motion, write records. Arithmetic-free plumbing.

use super::input::{Effect, Record};
use super::state::{MoveInFlight, Power, State};
use palpate_model::Nanos;
use palpate_model::rig::command::pulses_from_position;
use palpate_model::rig::{MoveTo, Oscillation, Phase, Profile, RigCommand, Sine};
use palpate_model::units::{MmPerS, Position, Seconds};

/// How a step stands after an input.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Progress {
    Continue,
    Done,
    /// The step cannot be done; the reason is for the operator.
    Fail(String),
    /// The run is to stop, whatever the plan says of failures.
    Stop(String),
}

/// The state, the time and the effects of one call of `step`.
pub(super) struct Context<'a> {
    pub state: &'a mut State,
    pub now: Nanos,
    pub effects: &'a mut Vec<Effect>,
}

/// Time a move may overrun its profile before the axis counts as stuck.
const MOVE_GRACE: Seconds = Seconds(1.0);

/// Why a move does not begin that would end beyond the travel.
pub(crate) fn outside_travel(what: &str, end: Position, travel: Position) -> String {
    format!(
        "a {what} to {:.3} mm is outside the travel of 0 to {:.1} mm",
        end.0, travel.0
    )
}

impl Context<'_> {
    pub fn command(&mut self, command: RigCommand) {
        self.state.unacknowledged.push_back((self.now, command));
        self.effects.push(Effect::Command(command));
    }

    pub fn record(&mut self, record: Record) {
        self.effects.push(Effect::Record(record));
    }

    pub fn enter_phase(&mut self, phase: Phase) {
        self.state.phase = phase;
        let step_index = self.state.step_index;
        self.record(Record::PhaseStarted { phase, step_index });
    }

    /// Sends the axis to the whole pulse nearest to a position, within the travel.
    pub fn move_to(&mut self, target: Position, speed: MmPerS) -> Result<(), String> {
        let rig = &self.state.config.rig;
        let travel = self.state.config.limits.travel_max;
        if self.state.is_homed && !(0.0..=travel.0).contains(&target.0) {
            return Err(outside_travel("move", target, travel));
        }
        self.move_to_pulses(pulses_from_position(target, rig.mm_per_pulse), speed)
    }

    /// Sends the axis to a pulse count. Only homing and jogging use this directly.
    pub fn move_to_pulses(&mut self, target_pulses: i64, speed: MmPerS) -> Result<(), String> {
        let rig = &self.state.config.rig;
        rig.check_speed(speed)?;
        if self.state.power != Power::Enabled {
            return Err("motion is not enabled".into());
        }
        if target_pulses == self.state.pulses && self.state.path.is_at_rest() {
            return Ok(());
        }
        let command = MoveTo {
            target_pulses,
            speed,
            acceleration: rig.acceleration,
        };
        let from = self.state.derived.position;
        let to = palpate_model::rig::command::position_from_pulses(target_pulses, rig.mm_per_pulse);
        let duration = Profile::to_rest(from, to, speed, rig.acceleration).duration();
        let deadline = self.now + Nanos::from_seconds(duration + MOVE_GRACE);
        let is_forward = target_pulses > self.state.pulses;
        self.state.in_flight = Some(MoveInFlight {
            deadline,
            speed,
            is_forward,
        });
        self.state.path.on_move(command);
        self.command(RigCommand::MoveTo(command));
        Ok(())
    }

    /// Lets the axis follow a sine, deeper and back.
    pub fn oscillate(&mut self, command: Oscillation) -> Result<(), String> {
        let rig = &self.state.config.rig;
        rig.check_oscillation(&command)?;
        if self.state.power != Power::Enabled {
            return Err("motion is not enabled".into());
        }
        let from = self.state.derived.position;
        let sine = Sine::new(from, &command, rig.mm_per_pulse, rig.tick());
        let deepest = 2.0 * command.amplitude_pulses as f64 * rig.mm_per_pulse;
        let travel = self.state.config.limits.travel_max;
        if from.moved_by(deepest) > travel {
            return Err(outside_travel("sine", from.moved_by(deepest), travel));
        }
        let deadline = self.now + Nanos::from_seconds(sine.duration() + MOVE_GRACE);
        let speed = sine.speed_max();
        self.state.in_flight = Some(MoveInFlight {
            deadline,
            speed,
            is_forward: true,
        });
        self.state.path.on_oscillate(command);
        self.command(RigCommand::Oscillate(command));
        Ok(())
    }

    /// Decelerates a move that has served its purpose.
    pub fn stop_move(&mut self) {
        self.command(RigCommand::Stop);
    }

    /// Whether the axis rests; a move past its time limit is an error.
    pub fn at_rest(&mut self) -> Result<bool, String> {
        if self.state.path.is_at_rest() {
            self.state.in_flight = None;
            return Ok(true);
        }
        match self.state.in_flight {
            Some(flight) if self.now > flight.deadline => Err(
                "the axis did not finish its move in time; check the motor and its supply".into(),
            ),
            _ => Ok(false),
        }
    }
}
