//! What the runner shows the world: one immutable value, swapped as a whole.

use crate::base::FoundBase;
use palpate_model::Nanos;
use palpate_model::calibration::SettlingNow;
use palpate_model::estimate::LiveEstimate;
use palpate_model::rig::{Phase, Reading, RigDescription};
use palpate_model::signal::LiveTrace;
use palpate_model::units::{Newtons, Position, Seconds};
use palpate_protocols::engine::{Contact, Derived, Outcome, PauseView, Power, UnloadedSignal};
use palpate_protocols::preview::StepPreview;
use palpate_protocols::weighed::Weighed;
use palpate_sessions::edits::Verdict;
use std::path::PathBuf;
use std::sync::Arc;

/// Everything a window or a progress bar may draw.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// The rig and its newest sample.
    pub rig: RigView,
    /// The run in progress or the last one; `None` before the first.
    pub run: Option<RunView>,
    /// Why the last request to run was refused, until the next request.
    pub refusal: Option<String>,
    /// Counts published snapshots.
    pub sequence: u64,
}

/// The rig as it is now.
#[derive(Clone, Debug)]
pub struct RigView {
    /// What it is.
    pub description: Arc<RigDescription>,
    /// Newest sample, if any arrived.
    pub reading: Option<Reading>,
    /// Whether position zero is known.
    pub is_homed: bool,
    /// How fast it was when it was opened, in words; none on a simulated rig.
    pub link: Option<String>,
    /// Why the link is down, if it is.
    pub link_error: Option<String>,
}

/// How a run kept pace with the wall.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Lateness {
    /// The furthest that session time was behind.
    pub worst: Seconds,
    /// All that was given up where it was too far behind to catch up.
    pub given_up: Seconds,
}

/// A run as it stands.
#[derive(Clone, Debug)]
pub struct RunView {
    /// Name of the plan.
    pub plan_name: String,
    /// Session folder.
    pub folder: PathBuf,
    /// What it is doing.
    pub phase: Phase,
    /// Whether motion is possible.
    pub power: Power,
    /// Every step with its expected duration.
    pub steps: Arc<Vec<StepPreview>>,
    /// Index of the step in progress.
    pub step_index: usize,
    /// Session time of the newest input.
    pub now: Nanos,
    /// Expected time left.
    pub time_left: Seconds,
    /// Share done, 0 to 1.
    pub fraction: f64,
    /// Newest derived values.
    pub derived: Derived,
    /// The unloaded signal.
    pub tare: Option<UnloadedSignal>,
    /// Where the tissue begins.
    pub contact: Option<Contact>,
    /// The base behind it and the thickness between, once found.
    pub base: FoundBase,
    /// Highest force so far.
    pub force_peak: Option<Newtons>,
    /// Newest live fit.
    pub live: Option<LiveEstimate>,
    /// Bounded history for plots.
    pub trace: Arc<LiveTrace>,
    /// Times at which phases began, in seconds of session time.
    pub phases: Arc<Vec<(f64, Phase)>>,
    /// Samples received.
    pub samples: u64,
    /// Session time through which everything is on disk.
    pub saved_through: Nanos,
    /// How it keeps pace with the wall; `None` where it has none to keep.
    pub lateness: Option<Lateness>,
    /// Whether the axis may be moving.
    pub is_motion_possible: bool,
    /// Whether it is paused or will be.
    pub pause: PauseView,
    /// What a person is asked for.
    pub prompt: Option<PromptView>,
    /// Index and name of the next step behind which a pause spoils nothing.
    pub next_checkpoint: Option<(usize, String)>,
    /// Repeat of the measurement, from 1; 0 where nothing is measured.
    pub cycle: u32,
    /// Repeats the plan measures; 0 or 1 where it is no series.
    pub cycles: u32,
    /// Session time in s at which each repeat began, with its number.
    pub cycle_starts: Arc<Vec<(f64, u32)>>,
    /// Every reading under a known mass that the plan has.
    pub to_weigh: Arc<Vec<ToWeigh>>,
    /// Readings under known masses so far.
    pub weighed: Arc<Vec<Weighed>>,
    /// How far the signal under the mass on the cell has come to rest; `None` where nothing is weighed.
    pub settling: Option<SettlingNow>,
    /// Whether the last weight can be read again now, or why not.
    pub can_redo: Result<(), String>,
    /// Force over machine position (as its depth) of the last search for the surface.
    pub approach: Arc<LiveTrace>,
    /// What that search felt.
    pub touches: Arc<Vec<Touch>>,
    /// Set while the run waits for retract or close after a stop.
    pub holding: Option<Outcome>,
    /// Whether a retract is possible now, or why not.
    pub can_retract: Result<(), String>,
    /// How it ended, once it has and the log is closed.
    pub outcome: Option<Outcome>,
    /// The first verdict on the session, with its reason, once the run has ended.
    pub verdict: Option<(Verdict, String)>,
    /// What the log said when it could not be closed.
    pub log_error: Option<String>,
    /// Why the first verdict could not be written beside the log.
    pub verdict_error: Option<String>,
    /// What happened, newest last; the oldest lines fall out past [`RunView::EVENTS_MAX`].
    pub events: Arc<Vec<LogLine>>,
}

impl RunView {
    /// Most lines of the event log kept for the screen. The session log keeps them all.
    pub const EVENTS_MAX: usize = 500;
}

/// A reading under a known mass as the plan has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToWeigh {
    /// Its step of the plan.
    pub step_index: usize,
    /// The mass in g, platform included.
    pub mass_g: f64,
    /// Whether the masses go up.
    pub is_loading: bool,
    /// Which pass through the masses, from 1.
    pub repeat: u32,
}

/// Where a search for the surface felt something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// 1 for the approach, 2 for the slow pass.
    pub pass: u8,
    /// Where, from home.
    pub position: Position,
    /// The filtered force above tare there.
    pub force: Newtons,
}

/// A question to a person.
#[derive(Clone, Debug, PartialEq)]
pub struct PromptView {
    /// What to do.
    pub message: String,
    /// How long the run still waits.
    pub time_left: Seconds,
}

/// One line of the event log.
#[derive(Clone, Debug, PartialEq)]
pub struct LogLine {
    /// When, in session time.
    pub at: Nanos,
    /// What, in words.
    pub text: String,
    /// Whether it needs attention.
    pub is_alarm: bool,
}
