//! What the rig and the run are doing, as word, shape and tone. Never colour alone.

use palpate_model::rig::AxisStatus;
use palpate_protocols::engine::{EndingKind, PauseView};
use palpate_runner::{RunView, Snapshot};

/// Drawn beside the word, so that the state is read without colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Nothing goes on.
    Ring,
    /// Something moves or may move.
    Triangle,
    /// Stopped.
    Square,
    /// Something is wrong.
    Diamond,
    /// Paused.
    Bars,
    /// A person is asked for something.
    Question,
}

/// How loud the state is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StateTone {
    /// Nothing to look at.
    Quiet,
    /// Under way as planned.
    Active,
    /// Waits for the operator.
    Notice,
    /// Something went wrong.
    Alarm,
}

/// The state badge.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Activity {
    /// One or two words.
    pub word: String,
    /// Its shape.
    pub shape: Shape,
    /// Its tone.
    pub tone: StateTone,
}

impl Activity {
    fn new(word: impl Into<String>, shape: Shape, tone: StateTone) -> Self {
        Self { word: word.into(), shape, tone }
    }
}

/// What the window itself is in the middle of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Intent {
    /// Nothing of its own.
    None,
    /// A start was asked for and not answered yet.
    Starting,
    /// The window closes as soon as the axis rests.
    Closing,
}

/// The run in progress, if there is one.
#[must_use]
pub fn run_in_progress(snapshot: &Snapshot) -> Option<&RunView> {
    snapshot.run.as_ref().filter(|run| run.outcome.is_none())
}

/// Whether the axis moves or may begin to, in a run or without one.
#[must_use]
pub fn is_motion_possible(snapshot: &Snapshot) -> bool {
    // What a lost link last said is no longer known; it must not hold the window open for ever.
    let is_axis_moving = snapshot
        .rig
        .reading
        .filter(|_| snapshot.rig.link_error.is_none())
        .is_some_and(|reading| reading.status.has(AxisStatus::MOVING));
    is_axis_moving || run_in_progress(snapshot).is_some_and(|run| run.is_motion_possible)
}

/// What to show in the badge.
#[must_use]
pub fn activity(snapshot: &Snapshot, intent: Intent) -> Activity {
    use palpate_model::rig::Phase;
    if snapshot.rig.link_error.is_some() {
        return Activity::new("LINK LOST", Shape::Diamond, StateTone::Alarm);
    }
    if intent == Intent::Closing {
        return Activity::new("CLOSING", Shape::Square, StateTone::Notice);
    }
    let Some(run) = run_in_progress(snapshot) else {
        return if intent == Intent::Starting {
            Activity::new("STARTING", Shape::Triangle, StateTone::Active)
        } else if is_motion_possible(snapshot) {
            Activity::new("MOVING", Shape::Triangle, StateTone::Active)
        } else {
            Activity::new("IDLE", Shape::Ring, StateTone::Quiet)
        };
    };
    match (&run.holding, run.phase) {
        (Some(ending), _) if is_planned(ending.ending) => {
            Activity::new("STOPPED", Shape::Square, StateTone::Notice)
        }
        (Some(_), _) => Activity::new("STOPPED", Shape::Diamond, StateTone::Alarm),
        (None, Phase::Stopped) => Activity::new("STOPPING", Shape::Square, StateTone::Notice),
        (None, _) if matches!(run.pause, PauseView::Paused { .. }) => {
            Activity::new("PAUSED", Shape::Bars, StateTone::Notice)
        }
        (None, _) if run.prompt.is_some() => {
            Activity::new("YOUR TURN", Shape::Question, StateTone::Notice)
        }
        (None, phase) => {
            Activity::new(phase.name().to_uppercase(), Shape::Triangle, StateTone::Active)
        }
    }
}

/// Whether a run ended the way somebody wanted.
#[must_use]
pub fn is_planned(ending: EndingKind) -> bool {
    matches!(ending, EndingKind::Finish | EndingKind::Stop)
}
