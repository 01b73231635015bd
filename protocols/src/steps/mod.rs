//! The kinds of steps, one file each.
//!
//! A file holds everything of its step: what a plan says of it, its words in the protocol language, what must hold
//! before it and holds behind it, how it begins and reacts to inputs, what pausing means for it, what a preview
//! expects of it, and what a finished run is held to. [`table`] is the one list of them: engine, language, preview and
//! fidelity reach a step through [`StepKind`], [`Executable`] and [`RunningStep`] and know no step by name.
//!
//! A step sees the run through [`Context`], which judges every interlock before a step gets a sample and has no way
//! to skip one.

mod check_home;
mod find_base;
mod find_contact;
mod follow;
mod hold;
mod hold_force;
mod home;
mod jog;
mod load_to;
mod preconditions;
mod prompt;
mod ramp;
mod rest;
mod retract;
mod self_test;
mod sine;
mod stats;
mod table;
mod tare;
mod target;
mod unload;
mod wait_until;
mod weigh;

pub(crate) use preconditions::{Need, Preconditions};
pub use table::*;
pub(crate) use target::{FORCE_FLOOR, StepResult};
pub use target::{MeterSample, StepMeter, StepTarget};

use crate::engine::{Context, PromptAnswer};
use crate::file::{Args, Key};
use crate::preview::{DurationEstimate, Walk};
use palpate_model::rig::{Phase, Reading, RigDescription};
use palpate_model::units::Depth;

/// What the file of a step works with.
mod prelude {
    pub(super) use super::preconditions::{FROM_SURFACE, Need, Preconditions};
    pub(super) use super::{
        Executable, MeterSample, MoveRun, PauseBehaviour, Progress, RunningStep, Step, StepEvent,
        StepFacts, StepKind, StepResult,
    };
    pub(super) use crate::engine::{BlockMean, Context, Record};
    pub(super) use crate::file::{Args, Key, QuantityKind};
    pub(super) use crate::preview::{DurationEstimate, Reach, Walk};
    pub(super) use palpate_model::rig::{Phase, Reading};
    pub(super) use palpate_model::signal::MovingMean;
    pub(super) use palpate_model::units::{Depth, MmPerS, Newtons, Position, Seconds, Volts};
    pub(super) use serde::{Deserialize, Serialize};
}

pub(crate) type BuildStep = fn(&Args) -> Result<Step, String>;

#[derive(Clone, Copy)]
pub(crate) struct StepFacts {
    /// Its word in a protocol, one sentence about it, and its keys.
    pub word: &'static str,
    pub about: &'static str,
    pub keys: &'static [Key],
    /// None where no protocol can ask for it.
    pub build: Option<BuildStep>,
    /// What the reference of the language adds below the keys.
    pub note: Option<fn() -> String>,
    pub phase: Phase,
    pub pausing: PauseBehaviour,
    pub needs: &'static [Need],
    /// What holds behind it, where it differs from before.
    pub gives: &'static [Need],
    /// See [`StepKind::may_touch`].
    pub may_touch: bool,
    /// Whether it is the measurement itself, which indents or leaves tissue while it is recorded.
    pub is_measuring: bool,
    /// What stands before the reason where it fails while it runs.
    pub label: &'static str,
}

impl StepFacts {
    /// Of a step that needs nothing and may touch.
    pub const fn of(word: &'static str, phase: Phase, pausing: PauseBehaviour) -> Self {
        Self {
            word,
            about: "",
            keys: &[],
            build: None,
            note: None,
            phase,
            pausing,
            needs: &[],
            gives: &[],
            may_touch: true,
            is_measuring: false,
            label: "",
        }
    }
}

/// The `FACTS` of a step's file, which [`table`] gives to it.
pub(crate) trait HasFacts {
    fn facts(&self) -> &'static StepFacts;
}

/// What is known of a step before it runs and judged behind it.
pub(crate) trait StepKind: HasFacts {
    /// Preconditions, in the order of [`Need`].
    fn needs(&self) -> &'static [Need] {
        self.facts().needs
    }

    /// What holds behind it, where it differs from before.
    fn pass(&self, known: &mut Preconditions) {
        self.facts().gives.iter().for_each(|need| known.assume(*need));
    }

    /// Whether it may move the probe towards the tissue, where it can touch. Homing and leaving cannot.
    fn may_touch(&self) -> bool {
        self.facts().may_touch
    }

    /// The deepest place it is meant to reach in a measurement; none where that is not its purpose.
    fn deepest(&self) -> Option<Depth> {
        None
    }

    /// What to try where the force rate tripped in it, as the end of a sentence.
    fn rate_advice(&self) -> &'static str {
        ""
    }

    fn warning(&self, _known: &Preconditions) -> Option<&'static str> {
        None
    }

    /// Duration, end and refusals of the step in a preview.
    fn expect(&self, walk: &mut Walk<'_>) -> DurationEstimate;

    /// Whether the axis surely goes at the step's full speed at a sample; `begun` is the depth at which it began and
    /// `way` the length of an acceleration from rest.
    fn is_cruising(&self, _begun: f64, _sample: &MeterSample, _way: &dyn Fn(f64) -> f64) -> bool {
        false
    }

    /// Samples in the mean of the force whose lowest value counts; none where no force is averaged so.
    fn force_mean_samples(&self, _rig: &RigDescription) -> Option<usize> {
        None
    }

    /// The time in s from its beginning after which its force counts; none where no force is to be kept.
    fn force_counts_from(&self) -> Option<f64> {
        None
    }

    /// Compares the result with the targets.
    fn judge(&self, _done: &mut StepResult<'_>) {}

    /// A doubt that remains although every target is met.
    fn doubt(&self, _done: &StepResult<'_>) -> Option<String> {
        None
    }
}

pub(crate) trait Executable: StepKind {
    type Run: RunningStep;

    /// Whether there is nothing to do, so that the next step follows at once.
    fn is_done_already(&self, _cx: &Context<'_>) -> bool {
        false
    }

    fn begin(&self, cx: &mut Context<'_>) -> Result<Self::Run, String>;
}

pub(crate) trait RunningStep {
    /// A sample came. An error is a step that cannot be done: the plan says what follows.
    fn on_reading(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Result<Progress, String>;

    /// Another event; `None` where the step ignores it.
    fn on_event(&mut self, _cx: &mut Context<'_>, _event: &StepEvent) -> Option<Progress> {
        None
    }
}

impl<T: RunningStep> RunningStep for Box<T> {
    fn on_reading(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Result<Progress, String> {
        (**self).on_reading(cx, reading)
    }

    fn on_event(&mut self, cx: &mut Context<'_>, event: &StepEvent) -> Option<Progress> {
        (**self).on_event(cx, event)
    }
}

/// How a step stands after an input.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Progress {
    Continue,
    Done,
    /// The run is to stop, whatever the plan says of failures.
    Stop(String),
}

impl Progress {
    fn done_if(is_done: bool) -> Self {
        if is_done { Self::Done } else { Self::Continue }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum StepEvent {
    /// The live fit has a new answer, which [`Context::live`] holds.
    LiveFit,
    /// Where a step that follows is to go; none where what leads gave no number.
    Lead(Option<Depth>),
    Answer(PromptAnswer),
}

/// What pausing means for a step in progress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum PauseBehaviour {
    /// It only waits, and waits longer.
    Wait,
    /// It waits longer, and goes on correcting the axis.
    Control,
    /// It is short and does not move the probe: it is completed.
    Complete,
    /// It moves outside the measurement to a fixed target, and can begin again anywhere.
    Repeat,
    /// It can begin again from its start only: a search would touch the tissue at once, a jog would go too far.
    RepeatFromStart,
    /// It is the measurement and cannot go on; with the reason.
    Measure(&'static str),
}

/// A move to rest, which is all that many steps are.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MoveRun;

impl RunningStep for MoveRun {
    fn on_reading(&mut self, cx: &mut Context<'_>, _reading: &Reading) -> Result<Progress, String> {
        cx.at_rest().map(Progress::done_if)
    }
}

impl Step {
    pub fn word(&self) -> &'static str {
        self.kind().facts().word
    }

    pub fn phase(&self) -> Phase {
        self.kind().facts().phase
    }

    /// Whether it is the measurement itself, which indents or leaves tissue while it is recorded.
    pub fn is_measuring(&self) -> bool {
        self.kind().facts().is_measuring
    }

    /// Whether it may move the probe towards the tissue, where it can touch. Homing and leaving cannot.
    pub fn may_touch(&self) -> bool {
        self.kind().may_touch()
    }

    /// Whether it moves the probe by a known position, which needs a homed axis.
    pub fn needs_homed_axis(&self) -> bool {
        self.kind().needs().contains(&Need::Home)
    }

    /// The deepest place it is meant to reach in a measurement; none where that is not its purpose.
    pub fn deepest(&self) -> Option<Depth> {
        self.kind().deepest()
    }
}
