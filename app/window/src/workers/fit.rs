//! The exact fit of a run that has ended, on a thread of its own.

use super::task::BackgroundTask;
use crate::plots::figure::PlacedPlot;
use eframe::egui::Context;
use palpate_analysis::daily::{is_daily_check_run, keep_daily_check};
use palpate_analysis::fit::{FitRecipe, SourceFit};
use palpate_analysis::report::picture::fit_plots;
use palpate_analysis::run_quality::assess_folder;
use palpate_analysis::source::SourceSelection;
use palpate_figures::figure::{Ink, SeriesShape};
use palpate_model::assessment::Assessment;
use palpate_model::rig::Phase;
use palpate_rheology::fit::{FitOptions, FitReport};
use palpate_runner::{RunView, wall_now};
use palpate_sessions::checks::DailyCheck;
use std::path::{Path, PathBuf};

/// Columns for which the curves of a plot are thinned: more than a screen is wide.
const COLUMNS: usize = 2000;

/// An exact fit as the window shows it.
#[derive(Clone, Debug)]
pub struct ExactFit {
    pub report: FitReport,
    /// Modelled force in N over session time in s.
    pub fitted: PlacedPlot,
    /// Measured minus modelled force in mN over session time in s.
    pub residual: PlacedPlot,
}

/// What becomes of a run that has ended.
struct RunAnswer {
    quality: Assessment,
    fit: Result<ExactFit, String>,
    /// Where the run was a daily check.
    check: Option<Result<DailyCheck, String>>,
    /// What must be acknowledged from then on.
    gate: Option<Vec<String>>,
}

/// How far the exact fit of the run on the screen is.
#[derive(Clone, Copy, Debug)]
pub enum Refit<'a> {
    /// The run goes on, or there is none.
    NotYet,
    /// In progress for so many seconds.
    Busy(f64),
    Done(&'a ExactFit),
    /// With the reason.
    Refused(&'a str),
}

/// Checks every run when it has ended, and fits it exactly where it pressed.
#[derive(Default)]
pub struct Refitter {
    answer: BackgroundTask<RunAnswer>,
    /// The session that is or was fitted.
    session: Option<PathBuf>,
    /// What a daily check says of the runs to come, until it is taken.
    gate: Option<Vec<String>>,
    /// A daily check is being judged.
    is_judging: bool,
}

impl Refitter {
    /// Fetches an answer, and starts when a run has ended. `library` has the daily checks of the rig.
    pub fn update(&mut self, ctx: &Context, run: Option<&RunView>, library: Option<&PathBuf>) {
        if self.answer.poll() {
            let answer = self.answer.answer().and_then(|answer| answer.as_ref().ok());
            self.gate = answer.and_then(|answer| answer.gate.clone());
        }
        self.is_judging &= self.answer.is_busy();
        let ended = run.filter(|run| run.outcome.is_some() && has_result(run));
        let folder = ended.map(|run| &run.folder);
        if self.answer.is_busy() || self.session.as_ref() == folder {
            return;
        }
        self.answer = BackgroundTask::default();
        self.session = folder.cloned();
        self.is_judging = ended.is_some_and(is_daily_check_run);
        if let Some(folder) = folder.cloned() {
            let library = library.cloned();
            self.answer.start("fit", ctx, move |_| assess(&folder, library.as_deref()));
        }
    }

    /// What must be acknowledged after a daily check that has just been judged, once.
    pub fn take_gate(&mut self) -> Option<Vec<String>> {
        self.gate.take()
    }

    /// Whether a daily check is being judged: nothing starts before it is.
    pub fn is_judging(&self) -> bool {
        self.is_judging
    }

    /// The daily check that this run was, judged; or why it could not be kept.
    pub fn daily_check(&self, run: Option<&RunView>) -> Option<&Result<DailyCheck, String>> {
        self.answer_of(run)?.check.as_ref()
    }

    fn is_of(&self, run: Option<&RunView>) -> bool {
        let ended = run.filter(|run| run.outcome.is_some()).map(|run| &run.folder);
        ended.is_some() && ended == self.session.as_ref()
    }

    /// How far the fit of this run is.
    pub fn of(&self, run: Option<&RunView>) -> Refit<'_> {
        match (self.answer.state(), self.answer.answer()) {
            _ if !self.is_of(run) || !run.is_some_and(has_ramp) => Refit::NotYet,
            (Some(state), _) => Refit::Busy(state.seconds),
            (None, None) => Refit::Busy(0.0),
            (None, Some(Ok(RunAnswer { fit: Ok(exact), .. }))) => Refit::Done(exact),
            (None, Some(Ok(RunAnswer { fit: Err(reason), .. }) | Err(reason))) => {
                Refit::Refused(reason)
            }
        }
    }

    fn answer_of(&self, run: Option<&RunView>) -> Option<&RunAnswer> {
        self.answer.answer().filter(|_| self.is_of(run))?.as_ref().ok()
    }

    /// Why the checks of this run could not be made.
    pub fn failure(&self, run: Option<&RunView>) -> Option<&str> {
        self.answer.answer().filter(|_| self.is_of(run))?.as_ref().err().map(String::as_str)
    }

    /// The checks of this run, once they are made.
    pub fn quality(&self, run: Option<&RunView>) -> Option<&Assessment> {
        self.answer_of(run).map(|answer| &answer.quality)
    }

    /// Session of this run, once its checks are made.
    pub fn assessed(&self, run: Option<&RunView>) -> Option<&Path> {
        self.answer_of(run).and(self.session.as_deref())
    }
}

/// Whether a run pressed or weighed anything, and so has something to be judged.
pub fn has_result(run: &RunView) -> bool {
    has_ramp(run) || has_weighed(run) || is_daily_check_run(run)
}

/// Whether a run indented anything: nothing else can be fitted.
fn has_ramp(run: &RunView) -> bool {
    run.phases.iter().any(|(_, phase)| *phase == Phase::Ramp)
}

/// Whether a run weighed anything: it may have measured a calibration.
fn has_weighed(run: &RunView) -> bool {
    run.phases.iter().any(|(_, phase)| *phase == Phase::Weigh)
}

fn assess(folder: &Path, library: Option<&Path>) -> Result<RunAnswer, String> {
    let recipe = FitRecipe::new(FitOptions::default(), SourceSelection::default());
    let found = assess_folder(folder, library, &recipe).map_err(|err| err.to_string())?;
    let fit = found.fitted.map_err(|err| err.to_string()).and_then(exact_fit);
    let (check, gate) = match keep_daily_check(library, folder, wall_now()) {
        Ok(None) => (None, None),
        Ok(Some((check, gate))) => (Some(Ok(check)), Some(gate)),
        Err(reason) => (Some(Err(reason)), None),
    };
    Ok(RunAnswer { quality: found.quality, fit, check, gate })
}

fn exact_fit(fitted: SourceFit) -> Result<ExactFit, String> {
    let report = fitted.result.map_err(|err| err.to_string())?;
    let [mut force, mut residual] =
        fit_plots(&fitted.samples, &report, None, fitted.start.0, COLUMNS);
    force.series.retain(|one| one.ink == Ink::Limit);
    for one in &mut force.series {
        // Dashed, so that the measured force shows through where both agree.
        one.shape = SeriesShape::Line { width: 2.0, dash: 8.0 };
    }
    // It stands under the force, over the same time.
    residual.x.name.clear();
    Ok(ExactFit { fitted: force.into(), residual: residual.into(), report })
}
