//! What can be made of a session: fits, other calibrations, stretches left out, each a named analysis beside the others.

mod form;
mod list;
mod quality;
mod report;

use super::Looked;
use crate::command::CommandQueue;
use crate::widgets::fact_row::section_ui;
use crate::widgets::remark::{alarm_ui, quiet_ui};
use crate::widgets::task_bar::task_ui;
use crate::widgets::text_row::text_row;
use crate::workers::Job;
use crate::workers::task::BackgroundTask;
use eframe::egui::{Context, Ui};
use form::AnalysisForm;
use palpate_analysis::analyses::{Deed, Done, Known, Who, own, read};
use palpate_analysis::edits::author;
use palpate_analysis::report::dossier::Wanted;
use palpate_rheology::fit::Parameter;
use quality::QualityForm;
use report::ReportPanel;
use std::path::{Path, PathBuf};

/// The session's own fit: whose it is, its parameters and its sentences.
struct OwnFit {
    session: PathBuf,
    parameters: Vec<Parameter>,
    sentences: Vec<String>,
}

/// The panel of analyses.
pub struct AnalysesPanel {
    library: Result<PathBuf, String>,
    /// What is known, or why not, of the session asked for.
    known: Option<Result<Known, String>>,
    asked: Option<PathBuf>,
    reading: Job<(PathBuf, Result<Known, String>)>,
    work: BackgroundTask<Done>,
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
    shown: Vec<Looked>,
}

impl std::fmt::Debug for AnalysesPanel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("AnalysesPanel").field("asked", &self.asked).finish_non_exhaustive()
    }
}

impl AnalysesPanel {
    /// A panel for sessions and calibrations of the library in this folder.
    #[must_use]
    pub fn new(library: Result<PathBuf, String>) -> Self {
        Self {
            library,
            known: None,
            asked: None,
            reading: Job::default(),
            work: BackgroundTask::default(),
            is_working: false,
            own: BackgroundTask::default(),
            form: AnalysisForm::default(),
            quality: QualityForm::default(),
            report: ReportPanel::default(),
            by: author(None),
            reason: String::new(),
            made: None,
            changed: None,
            shown: Vec::new(),
        }
    }

    /// Fetches what threads have answered.
    pub fn poll(&mut self, ctx: &Context) {
        self.own.poll();
        self.report.poll();
        self.work.poll();
        if self.is_working && self.work.state().is_none() {
            self.is_working = false;
            if let Some(Ok(done)) = self.work.answer() {
                self.made.clone_from(&done.made);
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
            if self.asked.as_ref() == Some(&session) {
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
    pub fn set_shown(&mut self, shown: &[Looked]) {
        self.shown.clear();
        self.shown.extend_from_slice(shown);
    }

    /// Where the two cursors stand on the session, in s since its first sample, once both are set.
    pub fn set_cursors(&mut self, cursors: Option<[f64; 2]>) {
        self.form.cursors = cursors;
        self.report.span = cursors.map(|[a, b]| [a.min(b), a.max(b)]);
    }

    /// Puts a stretch of time, in s since the first sample, into the form that leaves stretches out.
    pub fn propose_span(&mut self, from: f64, until: f64) {
        self.form.propose_span(from, until);
    }

    fn read_again(&mut self, ctx: &Context) {
        let Some(session) = self.asked.clone() else {
            return;
        };
        let library = self.library.clone().ok();
        let wake = ctx.clone();
        let started = self.reading.start(
            "analyses",
            move || {
                let known = read(&session, library.as_deref());
                (session, known)
            },
            move || wake.request_repaint(),
        );
        if let Err(err) = started {
            self.known = Some(Err(format!("the session cannot be read: {err}")));
        }
    }

    /// Draws the analyses of a session; which of them it is read by can be chosen.
    pub fn ui(&mut self, ui: &mut Ui, looked: &mut Looked, _commands: &mut CommandQueue) {
        if self.asked.as_ref() != Some(&looked.session) {
            self.asked = Some(looked.session.clone());
            self.known = None;
            self.made = None;
            self.own = BackgroundTask::default();
            self.read_again(ui.ctx());
        }
        section_ui(ui, "Analyses");
        let Some(known) = self.known.take() else {
            quiet_ui(ui, "reading what is kept beside the session");
            return;
        };
        match &known {
            Err(reason) => alarm_ui(ui, reason),
            Ok(known) => self.known_ui(ui, known, looked),
        }
        self.known = Some(known);
    }

    fn known_ui(&mut self, ui: &mut Ui, known: &Known, looked: &mut Looked) {
        // What was made is chosen once it is among what is known.
        let is_known = |made: &mut String| known.analyses.all.iter().any(|one| one.name == *made);
        if let Some(made) = self.made.take_if(is_known) {
            looked.analysis = Some(made);
        }
        let is_gone = |name: &String| known.analyses.get(name).is_err();
        if looked.analysis.as_ref().is_some_and(is_gone) {
            looked.analysis = None;
        }
        let own = self.own.answer().and_then(|own| own.as_ref().ok());
        let own = own.filter(|own| own.session == known.session);
        if list::list_ui(ui, known, looked, own) {
            self.fit_own(ui.ctx(), &known.session);
        }
        self.own_ui(ui);
        section_ui(ui, "Make another");
        let others = self.shown.iter().filter(|one| one.session != known.session);
        let others: Vec<Wanted> = others
            .map(|one| Wanted { session: one.session.clone(), analysis: one.analysis.clone() })
            .collect();
        let read_by = looked.analysis.as_deref();
        let name = self.form.ui(ui, known, read_by, &others);
        self.who_ui(ui);
        let verdict = self.free().and(name.clone().map(|_| ()));
        if task_ui(ui, "Make analysis", &self.work, &verdict)
            && let Ok(deed) = name
        {
            self.start(ui.ctx(), &known.session, deed);
        }
        self.answer_ui(ui);
        let taken = list::withdraw_ui(ui, known, looked, &self.reason_verdict());
        let said = self.quality.ui(ui, known, &self.reason_verdict());
        if let Some(deed) = taken.or(said) {
            self.start(ui.ctx(), &known.session, deed);
        }
        self.report.ui(ui, looked, &self.shown);
    }

    /// By whom and why: one pair of fields for all that is done to a session.
    fn who_ui(&mut self, ui: &mut Ui) {
        text_row(ui, "reason", "why, in a few words", &mut self.reason);
        text_row(ui, "by", "your name", &mut self.by);
    }

    fn free(&self) -> Result<(), String> {
        if self.work.state().is_some() {
            return Err("other work is under way".to_owned());
        }
        match self.by.trim() {
            "" => Err("say by whom it is made".to_owned()),
            _ => Ok(()),
        }
    }

    /// Whether something can be done that needs a reason.
    fn reason_verdict(&self) -> Result<(), String> {
        self.free()?;
        match self.reason.trim() {
            "" => Err("this needs a reason: write one above".to_owned()),
            _ => Ok(()),
        }
    }

    fn start(&mut self, ctx: &Context, session: &Path, deed: Deed) {
        let who = Who { by: self.by.trim().to_owned(), reason: self.reason.trim().to_owned() };
        let session = session.to_path_buf();
        self.is_working = true;
        self.work.start("analysis", ctx, move |progress| {
            deed.run(&session, &who, progress).map_err(|err| err.to_string())
        });
    }

    fn fit_own(&mut self, ctx: &Context, session: &Path) {
        let session = session.to_path_buf();
        let is_rejected_included = self.form.is_rejected_included();
        self.own.start("own-fit", ctx, move |progress| {
            let (parameters, sentences) = own(&session, is_rejected_included, progress)?;
            Ok(OwnFit { session, parameters, sentences })
        });
    }

    /// How far the session's own fit is, or why there is none.
    fn own_ui(&self, ui: &mut Ui) {
        if let Some(state) = self.own.state() {
            quiet_ui(ui, &format!("the session's own fit: {}", state.what));
        } else if let Some(Err(reason)) = self.own.answer() {
            quiet_ui(ui, &format!("no fit of its own was made: {reason}"));
        }
    }

    /// The last answer, in one sentence.
    fn answer_ui(&self, ui: &mut Ui) {
        match self.work.answer() {
            _ if self.work.state().is_some() => {}
            None => {}
            Some(Ok(done)) => quiet_ui(ui, &done.sentence),
            Some(Err(reason)) => alarm_ui(ui, reason),
        }
    }
}
