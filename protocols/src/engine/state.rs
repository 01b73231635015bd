//! The engine's state: a plain value, cloneable, comparable, printable.

use super::interlock::Watch;
use super::monitor::Condition;
use super::record::{EndingKind, Outcome};
use crate::plans::Plan;
use crate::steps::{Active, Step};
use palpate_model::Nanos;
use palpate_model::calibration::Curve;
use palpate_model::estimate::LiveEstimate;
use palpate_model::rig::{
    AxisStatus, Limits, PathTracker, Phase, RigCommand, RigDescription, SensorValues,
};
use palpate_model::units::{Depth, MmPerS, Newtons, Position, Seconds, Volts};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::sync::Arc;

/// What does not change during a run.
#[derive(Clone, Debug, PartialEq)]
pub struct Config {
    /// The rig as it described itself.
    pub rig: RigDescription,
    /// Interlock thresholds.
    pub limits: Limits,
    /// Volts to newtons and back.
    pub curve: Curve,
    /// What to do.
    pub plan: Plan,
    /// Whether the axis was homed earlier on this connection.
    pub is_homed: bool,
}

/// Whether motion is possible. Any fault or stop goes straight to `Stopped`, and the way back
/// leads through `Reset`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Power {
    /// No motion.
    Stopped,
    /// The motor is being energised and the rig checked.
    Reset,
    /// Motion is allowed.
    Enabled,
}

/// The unloaded signal, as a tare averaged it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnloadedSignal {
    /// Mean signal without load.
    pub volts: Volts,
    /// Standard deviation of one sample, quantisation included.
    pub noise: Volts,
    /// How the signal drifted meanwhile; `None` where the tare was too short to tell.
    pub drift: Option<Drift>,
}

/// A steady change of the unloaded signal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drift {
    /// Slope of a straight line through the samples, in V/s.
    pub volts_per_s: f64,
    /// Its standard error under white noise.
    pub std_error: f64,
}

/// Where the tissue begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Estimated contact position from home.
    pub position: Position,
    /// Its standard error in mm.
    pub std_error_mm: f64,
}

/// What was derived from the newest sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Derived {
    /// Commanded position; from home once the axis is homed.
    pub position: Position,
    /// Commanded velocity.
    pub velocity: MmPerS,
    /// Force above tare, once tared.
    pub force: Option<Newtons>,
    /// Standard uncertainty of that force from signal noise and the curve's sensitivity.
    pub force_sigma: Option<Newtons>,
    /// Depth from contact, once contact is known.
    pub depth: Option<Depth>,
}

/// How the run is paused, for whoever shows it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PauseView {
    /// It is not.
    #[default]
    None,
    /// It will be, behind this step.
    Pending {
        /// Index of the step.
        step_index: usize,
    },
    /// It is.
    Paused {
        /// Why it cannot go on from here; none if it can.
        no_resume: Option<&'static str>,
    },
}

/// What the run as a whole is doing.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Activity {
    /// Not started.
    Waiting,
    /// Started; the plan begins with the first sample, which tells clock and position.
    Starting,
    /// Running the plan.
    Step(Active),
    /// Coming to rest between two steps.
    Between { then: Then, deadline: Nanos },
    /// At rest until the operator goes on; with the step to go on with, if that is sound.
    Paused { next: Result<usize, &'static str> },
    /// Decelerating because of `ending`.
    Braking { ending: Outcome, deadline: Nanos },
    /// At rest after a stop; the operator may retract or close.
    Holding { ending: Outcome },
    /// Leaving the tissue after a stop, at the operator's request.
    Retracting { ending: Outcome },
    /// Over.
    Ended(Outcome),
}

/// What follows once the axis rests between two steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Then {
    /// This step begins.
    Begin(usize),
    /// Back to where the step began, then it begins again.
    Return(usize),
    /// The run pauses.
    Pause(Result<usize, &'static str>),
}

/// A pause that was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pause {
    /// Behind this step.
    After(usize),
    /// The waiting in progress goes on until the operator resumes.
    Extended,
}

/// A move under way, for its time limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MoveInFlight {
    pub deadline: Nanos,
    pub speed: MmPerS,
    pub is_forward: bool,
}

/// Everything the engine remembers between inputs.
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    pub(super) config: Arc<Config>,
    pub(super) activity: Activity,
    pub(super) power: Power,
    pub(super) is_homed: bool,
    /// Steps were lost, or the axis was moved by hand.
    pub(super) is_path_lost: bool,
    pub(super) is_halted: bool,
    pub(super) phase: Phase,
    pub(super) step_index: usize,
    pub(super) step_started: Nanos,
    pub(super) path: PathTracker,
    pub(super) tick: u64,
    pub(super) pulses: i64,
    /// Axis status of the newest sample.
    pub(super) status: AxisStatus,
    pub(super) tare: Option<UnloadedSignal>,
    pub(super) contact: Option<Contact>,
    pub(super) derived: Derived,
    pub(super) watch: Watch,
    pub(super) unacknowledged: VecDeque<(Nanos, RigCommand)>,
    pub(super) in_flight: Option<MoveInFlight>,
    pub(super) live: Option<LiveEstimate>,
    pub(super) sensors: SensorValues,
    pub(super) pause: Option<Pause>,
    /// Whether a person asked for the pause: only a person ends it then.
    pub(super) is_paused_by_operator: bool,
    /// Where the step in progress began, and how often it was tried again.
    pub(super) step_from: i64,
    pub(super) retries: u32,
    pub(super) monitors: Vec<Condition>,
    /// Whether the probe leaves the tissue by itself once the axis rests after a stop.
    pub(super) leaves_after_stop: bool,
    pub(super) is_finished_early: bool,
}

impl State {
    /// A run that has not started.
    #[must_use]
    pub fn new(config: Arc<Config>) -> Self {
        Self {
            activity: Activity::Waiting,
            power: Power::Stopped,
            is_homed: config.is_homed,
            is_path_lost: false,
            is_halted: false,
            phase: Phase::Idle,
            step_index: 0,
            step_started: Nanos::ZERO,
            path: PathTracker::new(&config.rig),
            tick: 0,
            pulses: 0,
            status: AxisStatus::default(),
            tare: None,
            contact: None,
            derived: Derived::default(),
            watch: Watch::new(&config.rig),
            unacknowledged: VecDeque::new(),
            in_flight: None,
            live: None,
            sensors: SensorValues::default(),
            pause: None,
            is_paused_by_operator: false,
            step_from: 0,
            retries: 0,
            monitors: vec![Condition::default(); config.plan.monitors.len()],
            leaves_after_stop: false,
            is_finished_early: false,
            config,
        }
    }

    /// What the run is doing now.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// Repeat of the measurement, from 1; 0 where nothing is measured. A ramp and hold has one cycle.
    pub fn cycle(&self) -> u32 {
        let planned = self.config.plan.steps.get(self.step_index);
        let cycle = planned.map_or(0, |planned| planned.cycle);
        match self.phase {
            Phase::Ramp
            | Phase::Hold
            | Phase::Unload
            | Phase::Creep
            | Phase::Sine
            | Phase::Follow => cycle.max(1),
            Phase::Rest | Phase::Weigh => cycle,
            _ => 0,
        }
    }

    /// Whether and how the run is paused or about to.
    pub fn pause(&self) -> PauseView {
        match (&self.activity, self.pause) {
            (Activity::Paused { next }, _)
            | (Activity::Between { then: Then::Pause(next), .. }, _) => {
                PauseView::Paused { no_resume: next.err() }
            }
            (_, Some(Pause::Extended)) => PauseView::Paused { no_resume: None },
            (_, Some(Pause::After(step_index))) => PauseView::Pending { step_index },
            (_, None) => PauseView::None,
        }
    }

    /// The step in progress.
    pub(crate) fn active(&self) -> Option<&Active> {
        match &self.activity {
            Activity::Step(active) => Some(active),
            _ => None,
        }
    }

    /// Index of the step in progress, and since when.
    pub fn step_progress(&self) -> (usize, Nanos) {
        (self.step_index, self.step_started)
    }

    /// Values derived from the newest sample.
    pub fn derived(&self) -> &Derived {
        &self.derived
    }

    /// Whether motion is possible.
    pub fn power(&self) -> Power {
        self.power
    }

    /// Whether position zero is known.
    pub fn is_homed(&self) -> bool {
        self.is_homed
    }

    /// Whether the next run may trust position zero.
    pub fn is_homed_for_next(&self) -> bool {
        self.is_homed && !self.is_path_lost
    }

    /// Where the tissue begins, once found.
    pub fn contact(&self) -> Option<Contact> {
        self.contact
    }

    /// The unloaded signal, once measured.
    pub fn tare(&self) -> Option<UnloadedSignal> {
        self.tare
    }

    /// Newest answer of the live fit, as it came in.
    pub fn live(&self) -> Option<&LiveEstimate> {
        self.live.as_ref()
    }

    /// Whether a plan runs that never energised the motor, such as a calibration: no command can move the axis.
    pub fn is_unpowered(&self) -> bool {
        self.power == Power::Stopped
            && matches!(
                self.activity,
                Activity::Starting
                    | Activity::Step(_)
                    | Activity::Between { .. }
                    | Activity::Paused { .. }
            )
    }

    /// Whether the axis may be moving or about to move.
    pub fn is_motion_possible(&self) -> bool {
        matches!(
            self.activity,
            Activity::Starting
                | Activity::Step(_)
                | Activity::Between { .. }
                | Activity::Paused { .. }
                | Activity::Braking { .. }
                | Activity::Retracting { .. }
        )
    }

    /// Set while the run has stopped and awaits the operator's choice to retract or close.
    pub fn holding(&self) -> Option<&Outcome> {
        match &self.activity {
            // A monitor wanted the probe out: it leaves first.
            Activity::Holding { ending } if !self.leaves_after_stop => Some(ending),
            _ => None,
        }
    }

    /// Why the operator cannot retract now, if so.
    pub fn can_retract(&self) -> Result<(), &'static str> {
        match &self.activity {
            Activity::Holding { ending } if ending.ending == EndingKind::Halt || !self.is_homed => {
                Err("the position is no longer known; move the probe by hand, then home")
            }
            Activity::Holding { .. } => Ok(()),
            _ => Err("retract follows a stop"),
        }
    }

    /// How the run ended, once it has.
    pub fn outcome(&self) -> Option<&Outcome> {
        match &self.activity {
            Activity::Ended(outcome) => Some(outcome),
            _ => None,
        }
    }

    /// The plan's step in progress, if any.
    pub fn current_step(&self) -> Option<&Step> {
        let planned = self.config.plan.steps.get(self.step_index)?;
        Some(&planned.step)
    }

    /// What does not change during the run.
    pub fn config(&self) -> &Config {
        &self.config
    }

    /// Whether commanded path and newest sample both say that the axis rests.
    pub(super) fn is_at_rest(&self) -> bool {
        self.path.is_at_rest() && !self.status.has(AxisStatus::MOVING)
    }

    /// Controller ticks of a span, rounded up.
    pub(super) fn ticks(&self, span: Seconds) -> u64 {
        // 1e-6 of a tick forgives the rounding of span / tick, so 50 s is 50 000 ticks, not one more.
        (span.0 / self.config.rig.tick().0 - 1e-6).ceil().max(0.0) as u64
    }

    /// Force above tare of a signal; before tare, above the calibration's own zero.
    pub(super) fn force_from_volts(&self, volts: Volts) -> Newtons {
        let tare = self.tare.map(|tare| tare.volts);
        self.config.curve.newtons_above(volts, tare)
    }
}
