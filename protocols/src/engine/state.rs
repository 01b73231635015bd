//! The engine's state: a plain value, cloneable, comparable, printable.

use super::interlock::InterlockWatch;
use super::monitor::MonitorState;
use super::record::{EndingKind, RunOutcome};
use crate::plans::Plan;
use crate::steps::{ActiveStep, Step};
use palpate_model::Nanos;
use palpate_model::calibration::CalibrationCurve;
use palpate_model::estimate::LiveEstimate;
use palpate_model::rig::{
    AxisStatus, Limits, PathTracker, Phase, RigCommand, RigDescription, SensorValues,
};
use palpate_model::units::{Depth, MmPerS, Newtons, Position, Seconds, Volts};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::sync::Arc;

#[derive(Clone, Debug, PartialEq)]
pub struct EngineConfig {
    pub rig: RigDescription,
    /// Interlock thresholds.
    pub limits: Limits,
    /// Volts to newtons and back.
    pub curve: CalibrationCurve,
    pub plan: Plan,
    /// Whether the axis was homed earlier on this connection.
    pub is_homed: bool,
}

/// Whether motion is possible. Any fault or stop goes straight to `Stopped`, and the way back
/// leads through `Reset`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Power {
    Stopped,
    /// The motor is being energised and the rig checked.
    Reset,
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

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drift {
    /// Slope of a straight line through the samples, in V/s.
    pub volts_per_s: f64,
    /// Its standard error under white noise.
    pub std_error: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactPosition {
    /// Estimated contact position from home.
    pub position: Position,
    /// Its standard error in mm.
    pub std_error_mm: f64,
}

/// What was derived from the newest sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DerivedValues {
    /// Commanded position; from home once the axis is homed.
    pub position: Position,
    pub velocity: MmPerS,
    /// Force above tare, once tared.
    pub force: Option<Newtons>,
    /// Standard uncertainty of that force from signal noise and the curve's sensitivity.
    pub force_sigma: Option<Newtons>,
    /// Depth from contact, once contact is known.
    pub depth: Option<Depth>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PauseView {
    #[default]
    None,
    Pending {
        step_index: usize,
    },
    Paused {
        /// Why it cannot go on from here; none if it can.
        no_resume: Option<&'static str>,
    },
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Activity {
    Waiting,
    /// Started; the plan begins with the first sample, which tells clock and position.
    Starting,
    Step(ActiveStep),
    Between {
        then: FollowUp,
        deadline: Nanos,
    },
    /// At rest until the operator goes on; with the next step, or why there is none.
    Paused {
        next: Result<usize, &'static str>,
    },
    /// Decelerating because of `ending`.
    Braking {
        ending: RunOutcome,
        deadline: Nanos,
    },
    /// At rest after a stop; the operator may retract or close.
    Holding {
        ending: RunOutcome,
    },
    /// Leaving the tissue after a stop, at the operator's request.
    Retracting {
        ending: RunOutcome,
    },
    Ended(RunOutcome),
}

impl Activity {
    /// Whether the plan has begun and nothing has ended it.
    pub fn is_in_plan(&self) -> bool {
        use Activity::{Between, Paused, Starting, Step};
        matches!(self, Starting | Step(_) | Between { .. } | Paused { .. })
    }
}

/// What follows once the axis rests between two steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum FollowUp {
    Begin(usize),
    /// Back to where the step began, then it begins again.
    Return(usize),
    Pause(Result<usize, &'static str>),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pause {
    After(usize),
    /// The waiting in progress goes on until the operator resumes.
    Extended,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MoveInFlight {
    pub deadline: Nanos,
    pub speed: MmPerS,
    pub is_forward: bool,
}

/// Everything the engine remembers between inputs.
#[derive(Clone, Debug, PartialEq)]
pub struct EngineState {
    pub(super) config: Arc<EngineConfig>,
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
    pub(super) contact: Option<ContactPosition>,
    pub(super) derived: DerivedValues,
    pub(super) watch: InterlockWatch,
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
    pub(super) monitors: Vec<MonitorState>,
    /// Whether the probe leaves the tissue by itself once the axis rests after a stop.
    pub(super) leaves_after_stop: bool,
    pub(super) is_finished_early: bool,
}

impl EngineState {
    #[must_use]
    pub fn new(config: Arc<EngineConfig>) -> Self {
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
            derived: DerivedValues::default(),
            watch: InterlockWatch::new(&config.rig),
            unacknowledged: VecDeque::new(),
            in_flight: None,
            live: None,
            sensors: SensorValues::default(),
            pause: None,
            is_paused_by_operator: false,
            step_from: 0,
            retries: 0,
            monitors: vec![MonitorState::default(); config.plan.monitors.len()],
            leaves_after_stop: false,
            is_finished_early: false,
            config,
        }
    }

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

    pub fn pause(&self) -> PauseView {
        match (&self.activity, self.pause) {
            (Activity::Paused { next }, _)
            | (Activity::Between { then: FollowUp::Pause(next), .. }, _) => {
                PauseView::Paused { no_resume: next.err() }
            }
            (_, Some(Pause::Extended)) => PauseView::Paused { no_resume: None },
            (_, Some(Pause::After(step_index))) => PauseView::Pending { step_index },
            (_, None) => PauseView::None,
        }
    }

    pub(crate) fn active(&self) -> Option<&ActiveStep> {
        match &self.activity {
            Activity::Step(active) => Some(active),
            _ => None,
        }
    }

    pub fn step_progress(&self) -> (usize, Nanos) {
        (self.step_index, self.step_started)
    }

    /// Values derived from the newest sample.
    pub fn derived(&self) -> &DerivedValues {
        &self.derived
    }

    pub fn power(&self) -> Power {
        self.power
    }

    pub fn is_homed(&self) -> bool {
        self.is_homed
    }

    pub fn is_homed_for_next(&self) -> bool {
        self.is_homed && !self.is_path_lost
    }

    /// Where the tissue begins, once found.
    pub fn contact(&self) -> Option<ContactPosition> {
        self.contact
    }

    /// The unloaded signal, once measured.
    pub fn tare(&self) -> Option<UnloadedSignal> {
        self.tare
    }

    /// The newest value of each sensor beside load cell and axis.
    pub fn sensors(&self) -> &SensorValues {
        &self.sensors
    }

    pub fn live(&self) -> Option<&LiveEstimate> {
        self.live.as_ref()
    }

    /// Whether a plan runs that never energised the motor, such as a calibration: no command can move the axis.
    pub fn is_unpowered(&self) -> bool {
        self.power == Power::Stopped && self.activity.is_in_plan()
    }

    /// Whether the axis may be moving or about to move.
    pub fn is_motion_possible(&self) -> bool {
        self.activity.is_in_plan()
            || matches!(self.activity, Activity::Braking { .. } | Activity::Retracting { .. })
    }

    /// Set while the run has stopped and awaits the operator's choice to retract or close.
    pub fn holding(&self) -> Option<&RunOutcome> {
        match &self.activity {
            // A monitor has requested a retract, which comes first.
            Activity::Holding { ending } if !self.leaves_after_stop => Some(ending),
            _ => None,
        }
    }

    pub fn can_retract(&self) -> Result<(), &'static str> {
        match &self.activity {
            Activity::Holding { ending } if ending.ending == EndingKind::Halt || !self.is_homed => {
                Err("the position is no longer known; move the probe by hand, then home the axis")
            }
            Activity::Holding { .. } => Ok(()),
            _ => Err("a retract is possible only after a stop"),
        }
    }

    /// How the run ended, once it has.
    pub fn outcome(&self) -> Option<&RunOutcome> {
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

    pub fn config(&self) -> &EngineConfig {
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
        self.config.curve.newtons_above_tare(volts, tare)
    }
}
