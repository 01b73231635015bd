//! State of the rig and the run as word, glyph and tone, never as colour alone.

use crate::widgets::Glyph;
use palpate_model::rig::AxisStatus;
use palpate_protocols::engine::{EndingKind, PauseView};
use palpate_runner::{RunView, RunnerSnapshot};

/// Urgency of the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StateTone {
    Quiet,
    /// In progress as planned.
    Active,
    /// Waits for the operator.
    Notice,
    Alarm,
}

/// The state badge: one or two words and a glyph, so that it is readable without colour.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Activity {
    pub word: String,
    pub glyph: Glyph,
    pub tone: StateTone,
}

impl Activity {
    fn new(word: impl Into<String>, glyph: Glyph, tone: StateTone) -> Self {
        Self { word: word.into(), glyph, tone }
    }
}

/// A start or a close of the window that is not done yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Intent {
    None,
    Starting,
    /// The window closes as soon as the axis is at rest.
    Closing,
}

/// The run in progress, if there is one.
#[must_use]
pub fn run_in_progress(snapshot: &RunnerSnapshot) -> Option<&RunView> {
    snapshot.run.as_ref().filter(|run| run.outcome.is_none())
}

/// Whether the axis moves or may begin to, in a run or without one.
#[must_use]
pub fn is_motion_possible(snapshot: &RunnerSnapshot) -> bool {
    // The last reading of a lost link is out of date, and must not keep the window open for ever.
    let is_axis_moving = snapshot
        .rig
        .reading
        .filter(|_| snapshot.rig.link_error.is_none())
        .is_some_and(|reading| reading.status.has(AxisStatus::MOVING));
    is_axis_moving || run_in_progress(snapshot).is_some_and(|run| run.is_motion_possible)
}

#[must_use]
pub fn activity(snapshot: &RunnerSnapshot, intent: Intent) -> Activity {
    use palpate_model::rig::Phase;
    if snapshot.rig.link_error.is_some() {
        return Activity::new("LINK LOST", Glyph::Diamond, StateTone::Alarm);
    }
    if intent == Intent::Closing {
        return Activity::new("CLOSING", Glyph::Square, StateTone::Notice);
    }
    let Some(run) = run_in_progress(snapshot) else {
        return if intent == Intent::Starting {
            Activity::new("STARTING", Glyph::Triangle, StateTone::Active)
        } else if is_motion_possible(snapshot) {
            Activity::new("MOVING", Glyph::Triangle, StateTone::Active)
        } else {
            Activity::new("IDLE", Glyph::Ring, StateTone::Quiet)
        };
    };
    match (&run.holding, run.phase) {
        (Some(ending), _) if is_planned(ending.ending) => {
            Activity::new("STOPPED", Glyph::Square, StateTone::Notice)
        }
        (Some(_), _) => Activity::new("STOPPED", Glyph::Diamond, StateTone::Alarm),
        (None, Phase::Stopped) => Activity::new("STOPPING", Glyph::Square, StateTone::Notice),
        (None, _) if matches!(run.pause, PauseView::Paused { .. }) => {
            Activity::new("PAUSED", Glyph::Bars, StateTone::Notice)
        }
        (None, _) if run.prompt.is_some() => {
            Activity::new("YOUR TURN", Glyph::Question, StateTone::Notice)
        }
        (None, phase) => {
            Activity::new(phase.name().to_uppercase(), Glyph::Triangle, StateTone::Active)
        }
    }
}

/// Whether a run ended as a person intended.
#[must_use]
pub fn is_planned(ending: EndingKind) -> bool {
    matches!(ending, EndingKind::Finish | EndingKind::Stop)
}
