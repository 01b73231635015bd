//! Any plan on any rig, in memory: the engine without disk or threads, with an operator who may interfere.

use palpate_drivers::{Rig, RigEventBody};
use palpate_model::Nanos;
use palpate_model::calibration::CalibrationCurve;
use palpate_model::rig::{Limits, Phase, Reading, RigCommand};
use palpate_model::units::Seconds;
use palpate_protocols::engine::{
    DerivedValues, Effect, EngineConfig, EngineInput, EngineState, Operator, Record, RunOutcome,
    step,
};
use palpate_protocols::plans::{FindContact, LEAVE_TISSUE, Plan, Step, approach_steps};
use std::sync::Arc;

/// Grid of the watchdog, as the runner has it.
const TICK: Nanos = Nanos::from_millis(10);

/// A sample with what the engine made of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LabSample {
    pub reading: Reading,
    pub derived: DerivedValues,
    pub phase: Phase,
    pub cycle: u32,
    pub step_index: usize,
}

/// The usual first steps of a plan: self-test, home, tare, contact.
#[must_use]
pub fn set_up(tare: Seconds, contact: FindContact) -> Vec<Step> {
    approach_steps(tare, contact)
}

/// The usual last step of a plan.
#[must_use]
pub fn retract() -> Step {
    LEAVE_TISSUE
}

/// A run of the engine without a runner.
pub struct Lab<R: Rig> {
    pub rig: R,
    pub state: Option<EngineState>,
    /// Time of the newest input.
    pub now: Nanos,
    next_tick: Nanos,
    is_sample_seen: bool,
    /// Every command with its time.
    pub commands: Vec<(Nanos, RigCommand)>,
    /// Every record with its time.
    pub records: Vec<(Nanos, Record)>,
    /// Every sample, if they are kept.
    pub seen: Vec<LabSample>,
    is_keeping: bool,
    /// Whether prompts are answered at once.
    pub is_answering: bool,
    pub outcome: Option<RunOutcome>,
}

impl<R: Rig> Lab<R> {
    /// A rig with a plan that has not started.
    #[must_use]
    pub fn new(rig: R, curve: CalibrationCurve, plan: Plan) -> Self {
        let limits = plan.limits.tighten(Limits::for_travel(rig.description().travel));
        let config =
            EngineConfig { rig: rig.description().clone(), limits, curve, plan, is_homed: false };
        Self {
            rig,
            state: Some(EngineState::new(Arc::new(config))),
            now: Nanos::ZERO,
            next_tick: TICK,
            is_sample_seen: false,
            commands: Vec::new(),
            records: Vec::new(),
            seen: Vec::new(),
            is_keeping: true,
            is_answering: true,
            outcome: None,
        }
    }

    /// With other limits than the rig's usual ones.
    #[must_use]
    pub fn within(mut self, limits: Limits) -> Self {
        let mut config = self.state().config().clone();
        config.limits = config.plan.limits.tighten(limits);
        self.state = Some(EngineState::new(Arc::new(config)));
        self
    }

    /// Forgets samples as they come: for long runs.
    #[must_use]
    pub fn forgetful(mut self) -> Self {
        self.is_keeping = false;
        self
    }

    /// The engine's state.
    ///
    /// # Panics
    /// Never between calls.
    #[must_use]
    pub fn state(&self) -> &EngineState {
        self.state.as_ref().expect("a state between inputs")
    }

    /// Gives the engine one input and does what it asks.
    pub fn give(&mut self, input: EngineInput) {
        let reading = match &input {
            EngineInput::Reading(reading) => Some(*reading),
            _ => None,
        };
        let Some(state) = self.state.take() else {
            return;
        };
        let (state, effects) = step(state, self.now, input);
        for effect in effects {
            match effect {
                Effect::Command(command) => {
                    self.commands.push((self.now, command));
                    self.rig.send(command);
                }
                Effect::ByHand(action) => self.rig.apply_hand_action(action),
                Effect::Record(record) => self.records.push((self.now, record)),
                Effect::Finished(outcome) => self.outcome = Some(outcome),
            }
        }
        if let (Some(reading), true) = (reading, self.is_keeping) {
            self.seen.push(LabSample {
                reading,
                derived: *state.derived(),
                phase: state.phase(),
                cycle: state.cycle(),
                step_index: state.step_progress().0,
            });
        }
        let is_asked = self.is_answering && state.prompt().is_some();
        self.state = Some(state);
        if is_asked {
            self.operator(Operator::Confirm);
        }
    }

    pub fn operator(&mut self, choice: Operator) {
        self.give(EngineInput::Operator { choice });
    }

    /// The next event of the rig, or a tick of the watchdog where none came.
    pub fn advance(&mut self) {
        if let Some(event) = self.rig.next_event(self.next_tick) {
            self.now = event.at;
            let input = match event.body {
                RigEventBody::Reading(reading) => {
                    self.is_sample_seen = true;
                    EngineInput::Reading(reading)
                }
                RigEventBody::Ack(ack) => EngineInput::Ack(ack),
                RigEventBody::Fault(fault) => EngineInput::Fault(fault),
            };
            self.give(input);
            for value in self.rig.take_sensors() {
                self.give(EngineInput::Sensor { value });
            }
        } else {
            self.now = self.next_tick;
            self.next_tick = self.next_tick + TICK;
            if !std::mem::take(&mut self.is_sample_seen) {
                self.give(EngineInput::Tick);
            }
        }
    }

    /// Goes on until the run ends, holds after a stop, or `is_reached` says so. False if `most` passed first.
    pub fn run_until(&mut self, most: Seconds, is_reached: impl Fn(&EngineState) -> bool) -> bool {
        let end = self.now + Nanos::from_seconds(most);
        while self.now < end {
            let state = self.state();
            if self.outcome.is_some() || state.holding().is_some() || is_reached(state) {
                return true;
            }
            self.advance();
        }
        false
    }

    /// Starts the plan and runs it to its end or until it holds after a stop.
    ///
    /// # Panics
    /// If that takes more than a day of session time.
    pub fn run(&mut self) {
        self.operator(Operator::Start);
        let has_ended = self.run_until(Seconds(86_400.0), |_| false);
        assert!(has_ended, "the run does not end");
    }

    /// The first and the last sample of a step, if it had any.
    #[must_use]
    pub fn ticks_of(&self, step_index: usize) -> Option<(u64, u64)> {
        let mut own = self.seen.iter().filter(|seen| seen.step_index == step_index);
        let first = own.next()?.reading.tick;
        Some((first, own.next_back().map_or(first, |seen| seen.reading.tick)))
    }
}
