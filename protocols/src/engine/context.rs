//! What a step may see and do while it runs: request motion, write records.

use super::input::Effect;
use super::pause;
use super::record::Record;
use super::state::{
    ContactPosition, DerivedValues, EngineState, MoveInFlight, Pause, Power, UnloadedSignal,
};
use palpate_model::Nanos;
use palpate_model::calibration::CalibrationCurve;
use palpate_model::estimate::LiveEstimate;
use palpate_model::rig::command::{position_from_pulses, pulses_from_position};
use palpate_model::rig::{
    AxisStatus, HandAction, Limits, MotionProfile, MoveTo, Oscillation, Phase, RigCommand,
    RigDescription, SensorValues, SinePath,
};
use palpate_model::units::{Depth, MmPerS, Position, Seconds};

/// The state, the time and the effects of one call of `step`. A step sees the state only through
/// these methods: they change no interlock, no limit and no plan.
pub(crate) struct Context<'a> {
    pub(super) state: &'a mut EngineState,
    pub now: Nanos,
    pub(super) effects: &'a mut Vec<Effect>,
}

pub(crate) const NOT_TARED: &str = "the load cell is not tared; tare it first";

/// Time a move may overrun its profile before the axis counts as stuck.
const MOVE_GRACE: Seconds = Seconds(1.0);

/// The error of a move beyond the travel.
pub(crate) fn outside_travel(what: &str, end: Position, travel: Position) -> String {
    format!("a {what} to {:.3} mm is outside the travel of 0 to {:.1} mm", end.0, travel.0)
}

impl Context<'_> {
    pub fn rig(&self) -> &RigDescription {
        &self.state.config.rig
    }

    pub fn limits(&self) -> &Limits {
        &self.state.config.limits
    }

    pub fn curve(&self) -> &CalibrationCurve {
        &self.state.config.curve
    }

    /// A step of the converter; 0 without one.
    pub fn volts_per_count(&self) -> f64 {
        self.rig().adc.map_or(0.0, |adc| adc.volts_per_count)
    }

    /// What was derived from the newest sample.
    pub fn derived(&self) -> &DerivedValues {
        &self.state.derived
    }

    pub fn status(&self) -> AxisStatus {
        self.state.status
    }

    pub fn pulses(&self) -> i64 {
        self.state.pulses
    }

    /// Whole pulses of a distance in mm.
    pub fn pulses_of(&self, distance_mm: f64) -> i64 {
        (distance_mm / self.rig().mm_per_pulse).round() as i64
    }

    /// Controller tick of the newest sample.
    pub fn tick(&self) -> u64 {
        self.state.tick
    }

    pub fn ticks(&self, span: Seconds) -> u64 {
        self.state.ticks(span)
    }

    pub fn tick_after(&self, span: Seconds) -> u64 {
        self.state.tick + self.state.ticks(span)
    }

    pub fn live(&self) -> Option<&LiveEstimate> {
        self.state.live.as_ref()
    }

    /// The newest values of the sensors beside load cell and axis.
    pub fn sensors(&self) -> &SensorValues {
        &self.state.sensors
    }

    pub fn is_homed(&self) -> bool {
        self.state.is_homed
    }

    pub fn set_homed(&mut self, is_homed: bool) {
        self.state.is_homed = is_homed;
    }

    pub fn unloaded(&self) -> Option<UnloadedSignal> {
        self.state.tare
    }

    pub fn set_unloaded(&mut self, signal: Option<UnloadedSignal>) {
        self.state.tare = signal;
    }

    pub fn known_contact(&self) -> Option<ContactPosition> {
        self.state.contact
    }

    pub fn contact(&self) -> Result<ContactPosition, String> {
        let unknown = "the contact point is not known; run find-contact first";
        self.state.contact.ok_or_else(|| unknown.to_owned())
    }

    pub fn set_contact(&mut self, contact: Option<ContactPosition>) {
        self.state.contact = contact;
    }

    /// Where a depth from contact is, within the travel.
    pub fn position_of(&self, depth: Depth) -> Result<Position, String> {
        let contact = self.contact()?;
        let target = depth.position_from(contact.position);
        let travel = self.limits().travel_max;
        if target > travel {
            return Err(format!(
                "a depth of {depth} from the contact point at {:.3} mm ends at a position of {:.3} mm, beyond the travel of {:.1} mm",
                contact.position.0, target.0, travel.0
            ));
        }
        Ok(target)
    }

    pub fn is_acknowledged(&self) -> bool {
        self.state.unacknowledged.is_empty()
    }

    /// Whether the step is paused, and goes on waiting until the run is resumed.
    pub fn is_extended(&self) -> bool {
        self.state.pause == Some(Pause::Extended)
    }

    pub fn end_pause(&mut self) {
        if self.is_extended() {
            pause::resume(self);
        }
    }

    /// The zero of the signal has moved: forces before and after are not comparable.
    pub fn forget_force_rate(&mut self) {
        self.state.watch.forget_rate();
    }

    pub fn energise(&mut self) {
        self.state.power = Power::Reset;
        self.command(RigCommand::EnableMotor);
        self.command(RigCommand::Stop);
    }

    /// The rig was checked: motion is possible from now on.
    pub fn allow_motion(&mut self) {
        self.state.power = Power::Enabled;
    }

    pub fn by_hand(&mut self, action: Option<HandAction>) {
        self.effects.extend(action.map(Effect::ByHand));
    }

    /// Sends the axis out of the tissue, never deeper.
    pub fn leave(&mut self, clearance_mm: f64, speed: MmPerS) -> Result<(), String> {
        let target = self.position_of(Depth(-clearance_mm))?;
        let out = target.0.clamp(0.0, self.state.derived.position.0.max(0.0));
        self.move_to(Position(out), speed)
    }

    pub fn command(&mut self, command: RigCommand) {
        self.state.unacknowledged.push_back((self.now, command));
        self.effects.push(Effect::Command(command));
    }

    pub fn record(&mut self, record: Record) {
        self.effects.push(Effect::Record(record));
    }

    /// What was asked for cannot be done now.
    pub fn refuse(&mut self, reason: impl Into<String>) {
        self.record(Record::Refused { reason: reason.into() });
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
        let command = MoveTo { target_pulses, speed, acceleration: rig.acceleration };
        let from = self.state.derived.position;
        let to = position_from_pulses(target_pulses, rig.mm_per_pulse);
        let duration = MotionProfile::to_rest(from, to, speed, rig.acceleration).duration();
        let deadline = self.now + Nanos::from_seconds(duration + MOVE_GRACE);
        let is_forward = target_pulses > self.state.pulses;
        self.state.in_flight = Some(MoveInFlight { deadline, speed, is_forward });
        self.state.path.on_move(command);
        self.command(RigCommand::MoveTo(command));
        Ok(())
    }

    /// Sends the axis to a pulse count, at rest or on the way to another one, on a rig that takes targets on the way.
    pub fn track_to_pulses(&mut self, target_pulses: i64, speed: MmPerS) -> Result<(), String> {
        let rig = &self.state.config.rig;
        rig.check_speed(speed)?;
        if self.state.power != Power::Enabled {
            return Err("motion is not enabled".into());
        }
        let command = MoveTo { target_pulses, speed, acceleration: rig.acceleration };
        let from = self.state.derived.position;
        let to = position_from_pulses(target_pulses, rig.mm_per_pulse);
        let move_secs = MotionProfile::to_rest(from, to, speed, rig.acceleration).duration();
        // It may have to brake and come back.
        let turn_secs = Seconds(2.0 * speed.0 / rig.acceleration.0);
        let deadline = self.now + Nanos::from_seconds(move_secs + turn_secs + MOVE_GRACE);
        // Until it has braked it goes on towards the tissue.
        let is_forward =
            target_pulses > self.state.pulses || self.state.path.velocity() > MmPerS(0.0);
        self.state.in_flight = Some(MoveInFlight { deadline, speed, is_forward });
        self.state.path.on_track(command);
        self.command(RigCommand::Track(command));
        Ok(())
    }

    pub fn oscillate(&mut self, command: Oscillation) -> Result<(), String> {
        let rig = &self.state.config.rig;
        rig.check_oscillation(&command)?;
        if self.state.power != Power::Enabled {
            return Err("motion is not enabled".into());
        }
        let from = self.state.derived.position;
        let sine = SinePath::new(from, &command, rig.mm_per_pulse, rig.tick());
        let deepest = 2.0 * command.amplitude_pulses as f64 * rig.mm_per_pulse;
        let travel = self.state.config.limits.travel_max;
        if from.moved_by(deepest) > travel {
            return Err(outside_travel("sine", from.moved_by(deepest), travel));
        }
        let deadline = self.now + Nanos::from_seconds(sine.duration() + MOVE_GRACE);
        let speed = sine.speed_max();
        self.state.in_flight = Some(MoveInFlight { deadline, speed, is_forward: true });
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
            Some(flight) if self.now > flight.deadline => {
                Err("the axis did not finish its move in time; check the motor and its supply"
                    .into())
            }
            _ => Ok(false),
        }
    }
}
