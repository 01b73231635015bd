//! What can be made of a session: fits, other calibrations, stretches left out, each a named analysis beside the others.

mod form;
mod list;
mod quality;
mod report;

use super::ReviewSource;
use crate::command::Commands;
use crate::widgets::{alarm_ui, quiet_ui, require, section_ui, task_ui, text_row};
use crate::workers::{BackgroundTask, Job};
use eframe::egui::{Context, Ui};
use form::AnalysisForm;
use palpate_analysis::edits::author;
use palpate_analysis::report::dossier::SessionReading;
use palpate_analysis::session_actions::{
    ActionReport, Attribution, SessionAction, SessionActionContext, fit_without_analysis, read,
};
use palpate_rheology::fit::FittedParameter;
use quality::QualityForm;
use report::ReportPanel;
use std::path::{Path, PathBuf};

/// The session's own fit: whose it is, its parameters and its sentences.
struct OwnFit {
    session: PathBuf,
    parameters: Vec<FittedParameter>,
    sentences: Vec<String>,
}

/// The panel of analyses.
#[derive(Default)]
pub struct AnalysesPanel {
    library: Option<PathBuf>,
    /// Of the session in front, or why it cannot be read.
    known: Option<Result<SessionActionContext, String>>,
    /// The session in front.
    front: Option<PathBuf>,
    reading: Job<(PathBuf, Result<SessionActionContext, String>)>,
    work: BackgroundTask<ActionReport>,
    is_working: bool,
    own: BackgroundTask<OwnFit>,
    form: AnalysisForm,
    quality: QualityForm,
    report: ReportPanel,
    by: String,
    reason: String,
    /// An analysis just made: the session is read by it once it is known.
    made: Option<String>,
    /// A session that is not as it was.
    changed: Option<PathBuf>,
    shown: Vec<ReviewSource>,
}

impl AnalysesPanel {
    /// A panel for sessions and calibrations of the library in this folder.
    #[must_use]
    pub fn new(library: Result<PathBuf, String>) -> Self {
        Self { library: library.ok(), by: author(None), ..Self::default() }
    }

    /// Takes the operator of Run for the author, until another name is typed.
    pub fn offer_author(&mut self, operator: &str) {
        if !operator.is_empty() && self.by == author(None) {
            operator.clone_into(&mut self.by);
        }
    }

    /// Fetches what threads have answered.
    pub fn poll(&mut self, ctx: &Context) {
        self.own.poll();
        self.report.poll();
        self.work.poll();
        if self.is_working && !self.work.is_busy() {
            self.is_working = false;
            if let Some(Ok(done)) = self.work.answer() {
                self.made.clone_from(&done.created_analysis);
                if done.changed.is_some() {
                    if done.is_edit {
                        self.changed.clone_from(&done.changed);
                    }
                    self.form.forget();
                    self.reason.clear();
                    self.read_again(ctx);
                }
            }
        }
        if let Some((session, known)) = self.reading.poll() {
            // An answer about a session that is no longer in front is of no use.
            if self.front.as_ref() == Some(&session) {
                self.known = Some(known);
            } else {
                self.read_again(ctx);
            }
        }
    }

    /// A session whose edits have changed since this was last asked.
    pub fn take_changed(&mut self) -> Option<PathBuf> {
        self.changed.take()
    }

    /// Which sessions are shown: what a report may be about.
    pub fn set_shown(&mut self, shown: &[ReviewSource]) {
        self.shown.clear();
        self.shown.extend_from_slice(shown);
    }

    /// Where the two cursors stand on the session, in s since its first sample, once both are set.
    pub fn set_cursors(&mut self, cursors: Option<[f64; 2]>) {
        self.form.cursors = cursors;
        self.report.span = cursors.map(|[a, b]| [a.min(b), a.max(b)]);
    }

    fn read_again(&mut self, ctx: &Context) {
        let Some(session) = self.front.clone() else { return };
        let library = self.library.clone();
        let work = move || {
            let known = read(&session, library.as_deref());
            (session, known)
        };
        if let Err(err) = self.reading.start("analyses", ctx, work) {
            self.known = Some(Err(format!("the session cannot be read: {err}")));
        }
    }

    /// Draws the analyses of a session; which of them it is read by can be chosen.
    pub fn ui(&mut self, ui: &mut Ui, source: &mut ReviewSource, _commands: &mut Commands) {
        if self.front.as_ref() != Some(&source.session) {
            self.front = Some(source.session.clone());
            self.known = None;
            self.made = None;
            self.own = BackgroundTask::default();
            self.read_again(ui.ctx());
        }
        section_ui(ui, "Analyses");
        let Some(known) = self.known.take() else {
            quiet_ui(ui, "reading the analyses of the session");
            return;
        };
        match &known {
            Err(reason) => alarm_ui(ui, reason),
            Ok(known) => self.known_ui(ui, known, source),
        }
        self.known = Some(known);
    }

    fn known_ui(&mut self, ui: &mut Ui, known: &SessionActionContext, source: &mut ReviewSource) {
        // What was made is chosen once it is among what is known.
        let is_known = |made: &mut String| known.analyses.all.iter().any(|one| one.name == *made);
        if let Some(made) = self.made.take_if(is_known) {
            source.analysis = Some(made);
        }
        let is_gone = |name: &String| known.analyses.get(name).is_err();
        if source.analysis.as_ref().is_some_and(is_gone) {
            source.analysis = None;
        }
        let own = self.own.answer().and_then(|own| own.as_ref().ok());
        let own = own.filter(|own| own.session == known.session);
        if list::list_ui(ui, known, source, own) {
            self.fit_own(ui.ctx(), &known.session);
        }
        self.own_ui(ui);
        section_ui(ui, "New analysis");
        let others = self.shown.iter().filter(|one| one.session != known.session);
        let others: Vec<SessionReading> = others.map(report::report_source).collect();
        let name = self.form.ui(ui, known, source.analysis.as_deref(), &others);
        // One pair of fields for all that is done to a session.
        text_row(ui, "reason", "why, in a few words", &mut self.reason);
        text_row(ui, "by", "your name", &mut self.by);
        let verdict = self.free().and(name.clone().map(|_| ()));
        if task_ui(ui, "Make analysis", &self.work, &verdict)
            && let Ok(action) = name
        {
            self.start(ui.ctx(), &known.session, action);
        }
        report::done_ui(ui, &self.work);
        let withdrawal = list::withdraw_ui(ui, known, source, &self.reason_verdict());
        let edit = self.quality.ui(ui, known, &self.reason_verdict());
        if let Some(action) = withdrawal.or(edit) {
            self.start(ui.ctx(), &known.session, action);
        }
        self.report.ui(ui, source, &self.shown);
    }

    fn free(&self) -> Result<(), String> {
        require(!self.work.is_busy(), "other work is in progress")?;
        require(!self.by.trim().is_empty(), "type your name into the field 'by'")
    }

    /// Whether something can be done that needs a reason.
    fn reason_verdict(&self) -> Result<(), String> {
        self.free()?;
        require(!self.reason.trim().is_empty(), "type a reason above")
    }

    fn start(&mut self, ctx: &Context, session: &Path, action: SessionAction) {
        let who =
            Attribution { by: self.by.trim().to_owned(), reason: self.reason.trim().to_owned() };
        let session = session.to_path_buf();
        self.is_working = true;
        self.work.start("analysis", ctx, move |progress| {
            action.run(&session, &who, progress).map_err(|err| err.to_string())
        });
    }

    fn fit_own(&mut self, ctx: &Context, session: &Path) {
        let session = session.to_path_buf();
        let is_rejected_included = self.form.is_rejected_included();
        self.own.start("own-fit", ctx, move |progress| {
            let (parameters, sentences) =
                fit_without_analysis(&session, is_rejected_included, progress)?;
            Ok(OwnFit { session, parameters, sentences })
        });
    }

    /// How far the session's own fit is, or why there is none.
    fn own_ui(&self, ui: &mut Ui) {
        if let Some(state) = self.own.state() {
            quiet_ui(ui, format!("the session's own fit: {}", state.what));
        } else if let Some(Err(reason)) = self.own.answer() {
            quiet_ui(ui, format!("the session has no fit of its own: {reason}"));
        }
    }
}
