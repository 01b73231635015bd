//! The review screen: one session closely, several beside each other.

pub mod analyses;
mod cycles;
mod deviation;
mod figure;
mod group_rows;
mod groups;
mod keys;
mod left;
mod middle;
mod parameters;
mod prediction;
mod readout;
mod right;
mod session_list;
mod side_by_side;
mod subject;
mod tiles;

use subject::ReviewSubject;

use super::screen::{Commands, Reaction, Screen, ScreenEntry, UiCommand, Workbench};
use crate::plots::navigate::AxisRange;
use crate::plots::over_depth::DepthLines;
use crate::widgets::ModelChoice;
use crate::workers::BackgroundTask;
use crate::workers::review::fit::{FitAnswer, SessionPrediction};
use crate::workers::review::{Quantity, TimeOrigin};
use analyses::AnalysesPanel;
use eframe::egui::{Context, Key, Ui};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::path::PathBuf;

pub const SCREEN: ScreenEntry = ScreenEntry {
    name: "Review",
    icon: lucide_icons::Icon::ChartLine,
    purpose: "one session in detail, or several side by side",
    key: Some(Key::Num5),
    open: |workbench| Box::new(ReviewScreen::new(workbench.library.clone())),
};

/// A session, and the analysis by which it is read: none for the session as it was measured.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ReviewSource {
    pub session: PathBuf,
    pub analysis: Option<String>,
}

palpate_model::named! {
    /// A view of the sessions shown.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
    pub enum View {
        #[default]
        OverTime = "Over time",
        OverDepth = "Over depth",
        /// A small plot of each session.
        SideBySide = "Side by side",
        /// Hysteresis loops of all cycles, and their peaks.
        Cycles = "Cycles",
        Parameters = "Parameters",
        /// The fit of one session applied to another.
        Prediction = "Prediction",
    }
}

impl View {
    /// Whether it shows a part of axes, which can be moved.
    const fn has_axes(self) -> bool {
        matches!(self, Self::OverTime | Self::OverDepth | Self::SideBySide | Self::Cycles)
    }
}

/// Share of the time after contact or ramp that is shown before it.
const BEFORE_ORIGIN: f64 = 0.05;
/// Sessions that are read at once: the disk and two cores are busy with them.
const READING_MAX: usize = 2;

/// The sessions that are shown, and how.
#[derive(Default)]
pub struct ReviewScreen {
    /// The one in front comes first.
    subjects: Vec<ReviewSubject>,
    /// Changes of that list, the last one at the end.
    changes: Vec<session_list::ListChange>,
    analyses: AnalysesPanel,
    tiles: tiles::ViewTiles,
    /// The one that keys, tools and figures are of.
    view: View,
    grouping: groups::Grouping,
    /// None: it follows from how many sessions and groups there are.
    chosen_coloring: Option<groups::Coloring>,
    /// Plots have the width of the panels beside them too.
    is_wide: bool,
    side: side_by_side::SideBySide,
    parameter_table: parameters::ParameterTable,
    figure: figure::FigureExport,
    time_origin: TimeOrigin,
    quantities: Vec<Quantity>,
    has_residuals: bool,
    time: AxisRange,
    depth: AxisRange,
    force: AxisRange,
    cursors: [Option<f64>; 2],
    depth_lines: DepthLines,
    loop_lines: DepthLines,
    fits: BackgroundTask<Vec<FitAnswer>>,
    model: ModelChoice,
    /// The answer of the fits under way is not handed to their sessions yet.
    has_new_fits: bool,
    prediction: BackgroundTask<SessionPrediction>,
    prediction_of: Option<[String; 2]>,
    prediction_lines: [crate::plots::stretches::Stretches; 2],
    cycle_rows: cycles::CycleRows,
    /// Only the first and the last loop are drawn.
    has_ends_only: bool,
    path: String,
    /// What was entered as a path and leads to no folder.
    wrong_path: Option<String>,
    next_id: u64,
    /// The most samples that share a lowest and a highest one in the plots over time.
    thinned: usize,
}

impl ReviewScreen {
    /// A screen without a session.
    #[must_use]
    pub fn new(library: Result<PathBuf, String>) -> Self {
        Self {
            analyses: AnalysesPanel::new(library),
            quantities: vec![Quantity::Force, Quantity::Depth, Quantity::Volts],
            ..Self::default()
        }
    }

    /// Shows these sessions instead of those there.
    pub fn open(&mut self, sessions: Vec<PathBuf>, ctx: &Context) {
        self.clear();
        self.cursors = [None; 2];
        self.time.show_all();
        self.depth.show_all();
        self.force.show_all();
        // Searches for contact take their own time each: ramps stand over each other from their starts.
        self.time_origin = if sessions.len() > 1 { TimeOrigin::Ramp } else { TimeOrigin::Start };
        sessions.into_iter().for_each(|session| self.add(session, ctx));
    }

    /// Adds a session to the view; one that is shown already is not shown twice.
    pub fn add(&mut self, session: PathBuf, ctx: &Context) {
        if self.subjects.iter().any(|one| one.source.session == session) {
            return;
        }
        let source = ReviewSource { session, analysis: None };
        self.subjects.push(ReviewSubject::new(source, self.next_id));
        self.next_id += 1;
        self.fetch(ctx);
    }

    pub fn show(&mut self, view: View) {
        self.tiles.bring(view);
        self.view = view;
    }

    /// Whether samples of any session have arrived.
    pub fn has_samples(&self) -> bool {
        self.subjects.iter().any(|one| !one.recording.track.is_empty())
    }

    /// Whether nothing is being read, fitted or searched for.
    pub fn is_settled(&self) -> bool {
        let is_working = self.fits.is_busy() || self.prediction.is_busy();
        let is_read = self.subjects.iter().all(ReviewSubject::is_settled);
        is_read
            && !is_working
            && !self.depth_lines.is_busy()
            && !self.loop_lines.is_busy()
            && !self.side.is_busy()
    }

    /// Fetches what threads have answered.
    pub fn fetch(&mut self, ctx: &Context) {
        self.analyses.poll(ctx);
        self.figure.poll(ctx);
        if let Some(changed) = self.analyses.take_changed() {
            let is_it = |one: &&mut ReviewSubject| one.source.session == changed;
            if let Some(subject) = self.subjects.iter_mut().find(is_it) {
                subject.fit = None;
                subject.read_again();
            }
        }
        self.fits.poll();
        self.prediction.poll();
        self.take_fits();
        self.subjects.iter_mut().for_each(ReviewSubject::poll);
        let mut reading = self.subjects.iter().filter(|one| one.recording.is_reading()).count();
        for subject in &mut self.subjects {
            if reading < READING_MAX && subject.begin(ctx) {
                reading += 1;
            }
        }
        distinguish(&mut self.subjects);
        self.set_colors();
        self.set_wholes();
    }

    /// Hands the fits that were made to their sessions, where these are still read in the same way.
    fn take_fits(&mut self) {
        if self.fits.is_busy() || !std::mem::take(&mut self.has_new_fits) {
            return;
        }
        let Some(Ok(answers)) = self.fits.answer() else { return };
        for (of, answer) in answers {
            let is_own = |one: &&mut ReviewSubject| {
                one.source.session == of.path && one.source.analysis == of.analysis
            };
            if let Some(subject) = self.subjects.iter_mut().find(is_own) {
                subject.set_fit(answer.clone());
            }
        }
    }

    /// Begins to fit every session shown.
    fn start_fits(&mut self, ctx: &Context) {
        let subjects: Vec<_> = self.subjects.iter().map(|one| one.for_fit(&self.model)).collect();
        self.has_new_fits = true;
        self.fits.start("review-fit", ctx, move |progress| {
            crate::workers::review::fit::fit_sessions(&subjects, progress)
        });
    }

    /// Whether the sessions shown can be fitted now, or why not.
    fn fit_verdict(&self) -> Result<(), String> {
        match self.subjects.iter().find(|one| !one.is_settled()) {
            _ if self.subjects.is_empty() => Err("show a session first".into()),
            Some(one) => Err(format!("{} is still being read", one.name)),
            None => Ok(()),
        }
    }

    /// How far each axis reaches.
    fn set_wholes(&mut self) {
        let join = |a: [f64; 2], b: [f64; 2]| [a[0].min(b[0]), a[1].max(b[1])];
        let times = self.subjects.iter().map(|one| {
            let shift = one.shift(self.time_origin);
            one.recording.span().map(|end| end - shift)
        });
        if let Some([low, high]) = times.reduce(join) {
            // What came before contact or ramp is seen from the start of the session.
            let low = match self.time_origin {
                TimeOrigin::Start => low,
                _ => low.max(-BEFORE_ORIGIN * high),
            };
            let room = 0.01 * (high - low);
            self.time.set_whole([low - room, high + room]);
        }
        for (span, quantity) in
            [(&mut self.depth, Quantity::Depth), (&mut self.force, Quantity::Force)]
        {
            let ends = self.subjects.iter().filter_map(|one| one.extremes(quantity));
            if let Some([low, high]) = ends.reduce(join) {
                let room = 0.04 * (high - low).max(1e-6);
                span.set_whole([low - room, high + room]);
            }
        }
    }

    /// The session in front.
    fn front(&self) -> Option<&ReviewSubject> {
        self.subjects.first()
    }
}

/// Numbers the sessions that have one name, in the order in which they were added: whichever is in front.
fn distinguish(subjects: &mut [ReviewSubject]) {
    let mut order: Vec<usize> = (0..subjects.len()).collect();
    order.sort_by_key(|index| subjects[*index].id);
    for (place, index) in order.iter().enumerate() {
        let before = &order[..place];
        let is_taken = |name: &str| before.iter().any(|one| subjects[*one].name == name);
        let first = &subjects[*index].name;
        let numbered = (2..).map(|number| format!("{first} ({number})"));
        let name = std::iter::once(first.clone()).chain(numbered).find(|name| !is_taken(name));
        subjects[*index].name = name.unwrap_or_default();
    }
}

impl Screen for ReviewScreen {
    fn left_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, commands: &mut Commands) {
        self.draw_left(ui, commands);
    }

    fn middle_ui(&mut self, ui: &mut Ui, _workbench: &mut Workbench, _commands: &mut Commands) {
        self.draw_middle(ui);
    }

    fn right_ui(&mut self, ui: &mut Ui, workbench: &mut Workbench, commands: &mut Commands) {
        self.analyses.offer_author(workbench.form.label_text("operator"));
        self.draw_right(ui);
        let shown: Vec<ReviewSource> = self.subjects.iter().map(|one| one.source.clone()).collect();
        self.analyses.set_shown(&shown);
        let shift = self.front().map_or(0.0, |one| one.shift(self.time_origin));
        let cursors = match self.cursors {
            [Some(a), Some(b)] => Some([a + shift, b + shift]),
            _ => None,
        };
        self.analyses.set_cursors(cursors);
        if let Some(front) = self.subjects.first_mut() {
            self.analyses.ui(ui, &mut front.source, commands);
        }
    }

    fn has_left(&self) -> bool {
        !self.is_wide
    }

    fn has_right(&self) -> bool {
        !self.is_wide
    }

    fn layout(&self) -> Option<Value> {
        self.tiles.kept()
    }

    fn take_layout(&mut self, kept: &Value) {
        self.tiles = tiles::ViewTiles::from_kept(kept);
    }

    fn poll(&mut self, ctx: &Context, workbench: &mut Workbench) {
        self.fetch(ctx);
        let front = self.front().map(|one| &one.source.session);
        if workbench.front.review.as_ref() != front {
            workbench.front.review = front.cloned();
        }
    }

    fn act(&mut self, ctx: &Context, command: &UiCommand, _workbench: &mut Workbench) -> Reaction {
        match command {
            UiCommand::Review(sessions) => self.open(sessions.clone(), ctx),
            _ => return Reaction::NotMine,
        }
        Reaction::Show
    }

    fn work(&mut self, ctx: &Context, _workbench: &mut Workbench) {
        if !self.fits.is_busy() && self.fit_verdict().is_ok() {
            self.start_fits(ctx);
        }
    }

    fn cancel(&mut self) {
        self.fits.cancel();
    }
}
