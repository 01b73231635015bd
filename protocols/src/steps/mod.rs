//! What a run can do, one file a kind of step.
//!
//! A file holds everything of its step: what a plan says of it, its words in the protocol language, what must hold
//! before it and holds behind it, how it begins and reacts to inputs, what pausing means for it, what a preview
//! expects of it, and what a finished run is held to. [`table`] is the one list of them: engine, language, preview and
//! fidelity reach a step through [`StepKind`], [`Executable`] and [`InProgress`] and know no step by name.
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
mod known;
mod load_to;
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

pub(crate) use known::{Known, Need};
pub use table::*;
pub(crate) use target::{Done, FORCE_FLOOR};
pub use target::{MeterSample, StepMeter, Target};

use crate::engine::{Answer, Context};
use crate::file::{Args, Key};
use crate::preview::{Span, Walk};
use palpate_model::rig::{Phase, Reading, RigDescription};
use palpate_model::units::Depth;

/// Makes a step of its keys in a protocol.
pub(crate) type Build = fn(&Args) -> Result<Step, String>;

/// What is the same for every step of a kind.
#[derive(Clone, Copy)]
pub(crate) struct Facts {
    /// Its word in a protocol, one sentence about it, and its keys.
    pub word: &'static str,
    pub about: &'static str,
    pub keys: &'static [Key],
    /// None where no protocol can ask for it.
    pub build: Option<Build>,
    /// What the reference of the language adds below the keys.
    pub note: Option<fn() -> String>,
    /// The phase it begins with.
    pub phase: Phase,
    /// What a pause does to it.
    pub pausing: Pausing,
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

impl Facts {
    /// Of a step that needs nothing and may touch.
    pub const fn of(word: &'static str, phase: Phase, pausing: Pausing) -> Self {
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
pub(crate) trait OfKind {
    /// What is the same for every step of its kind.
    fn facts(&self) -> &'static Facts;
}

/// What is known of a step before it runs and judged behind it.
pub(crate) trait StepKind: OfKind {
    /// What must hold before it, in the order of [`Need`].
    fn needs(&self) -> &'static [Need] {
        self.facts().needs
    }

    /// What holds behind it, where it differs from before.
    fn pass(&self, known: &mut Known) {
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

    /// What a writer of protocols should look at.
    fn warning(&self, _known: &Known) -> Option<&'static str> {
        None
    }

    /// How long it takes, where it ends and what refuses it.
    fn expect(&self, walk: &mut Walk<'_>) -> Span;

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

    /// The targets it is held to, against what was done.
    fn judge(&self, _done: &mut Done<'_>) {}

    /// What speaks against it although every target may be met.
    fn doubt(&self, _done: &Done<'_>) -> Option<String> {
        None
    }
}

/// What a step does.
pub(crate) trait Executable: StepKind {
    /// What it remembers while it runs.
    type Run: InProgress;

    /// Whether there is nothing to do, so that the next step follows at once.
    fn is_done_already(&self, _cx: &Context<'_>) -> bool {
        false
    }

    /// Begins it.
    fn begin(&self, cx: &mut Context<'_>) -> Result<Self::Run, String>;
}

/// A step that runs.
pub(crate) trait InProgress {
    /// A sample came. An error is a step that cannot be done: the plan says what follows.
    fn on_reading(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Result<Progress, String>;

    /// Something else came; none where the step takes no notice of such.
    fn on_event(&mut self, _cx: &mut Context<'_>, _event: &StepEvent) -> Option<Progress> {
        None
    }
}

impl<T: InProgress> InProgress for Box<T> {
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

/// What reaches a step beside samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum StepEvent {
    /// The live fit has a new answer, which [`Context::live`] holds.
    LiveFit,
    /// Where a step that follows is to go; none where what leads gave no number.
    Lead(Option<Depth>),
    /// A person answered.
    Answer(Answer),
}

/// What pausing means for a step in progress.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Pausing {
    /// It only waits, and waits longer.
    Wait,
    /// So too, with corrections of the axis meanwhile.
    Control,
    /// It is short and does not move the probe: it is completed.
    Complete,
    /// It moves outside the measurement, to a place from wherever, and can begin again.
    Repeat,
    /// It can begin again, from where it began: a search would feel the tissue at once, a jog would go too far.
    RepeatFromStart,
    /// It is the measurement and cannot go on; with the reason.
    Measure(&'static str),
}

/// A move to rest, which is all that many steps are.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Moving;

impl InProgress for Moving {
    fn on_reading(&mut self, cx: &mut Context<'_>, _reading: &Reading) -> Result<Progress, String> {
        Ok(match cx.at_rest()? {
            true => Progress::Done,
            false => Progress::Continue,
        })
    }
}

impl Step {
    /// Its word in a protocol.
    pub fn word(&self) -> &'static str {
        self.kind().facts().word
    }

    /// The phase it begins with.
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
