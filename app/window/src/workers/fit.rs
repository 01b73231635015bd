//! The refit of a run that has ended, on a thread of its own.

use super::Job;
use crate::plots::figure::PlacedPlot;
use eframe::egui::Context;
use palpate_analysis::fit::Recipe;
use palpate_analysis::report::picture::fit_plots;
use palpate_analysis::source::Wanted;
use palpate_figures::figure::{Ink, Shape};
use palpate_model::rig::Phase;
use palpate_rheology::fit::{FitOptions, FitReport};
use palpate_runner::{RunView, Stopwatch};
use std::path::{Path, PathBuf};

/// Columns for which the curves of a plot are thinned: more than a screen is wide.
const COLUMNS: usize = 2000;

/// An exact fit as the window shows it.
#[derive(Clone, Debug)]
pub struct ExactFit {
    /// What the fit found.
    pub report: FitReport,
    /// Modelled force in N over session time in s, to be drawn over the measured.
    pub fitted: PlacedPlot,
    /// Measured minus modelled force in mN over session time in s.
    pub residual: PlacedPlot,
}

/// Where the exact fit of the run on the screen stands.
#[derive(Clone, Copy, Debug)]
pub enum Refit<'a> {
    /// The run goes on, or there is none.
    NotYet,
    /// Under way for so many seconds.
    Busy(f64),
    /// Made.
    Done(&'a ExactFit),
    /// Not made, for this reason.
    Refused(&'a str),
}

/// Refits every run exactly when it has ended.
#[derive(Default)]
pub struct Refitter {
    job: Job<Result<ExactFit, String>>,
    /// The session asked for and since when.
    asked: Option<(PathBuf, Stopwatch)>,
    answer: Option<Result<ExactFit, String>>,
}

impl Refitter {
    /// Fetches an answer, and starts when a run has ended.
    pub fn update(&mut self, ctx: &Context, run: Option<&RunView>) {
        let ended = run.filter(|run| run.outcome.is_some() && has_ramp(run));
        let folder = ended.map(|run| &run.folder);
        let is_asked = self.asked.as_ref().map(|(asked, _)| asked) == folder;
        if self.job.is_busy() {
            let answer = self.job.poll();
            if self.job.is_busy() {
                return;
            }
            let gone = "the exact fit ended unexpectedly; 'palpate fit' on the session tells more";
            // An answer about a run that is no longer shown is of no use.
            self.answer = is_asked.then(|| answer.unwrap_or_else(|| Err(gone.into())));
        }
        if is_asked {
            return;
        }
        self.answer = None;
        self.asked = folder.map(|folder| (folder.clone(), Stopwatch::start()));
        if let Some(folder) = folder.cloned() {
            let wake = ctx.clone();
            let started =
                self.job.start("fit", move || exact(&folder), move || wake.request_repaint());
            if let Err(err) = started {
                self.answer = Some(Err(format!("the exact fit cannot be started: {err}")));
            }
        }
    }

    /// Whether a fit is under way.
    pub fn is_busy(&self) -> bool {
        self.job.is_busy()
    }

    /// Where the fit of this run stands.
    pub fn of(&self, run: Option<&RunView>) -> Refit<'_> {
        let Some((folder, since)) = &self.asked else {
            return Refit::NotYet;
        };
        if !run.is_some_and(|run| run.outcome.is_some() && run.folder == *folder) {
            return Refit::NotYet;
        }
        match &self.answer {
            None => Refit::Busy(since.seconds()),
            Some(Ok(exact)) => Refit::Done(exact),
            Some(Err(reason)) => Refit::Refused(reason),
        }
    }
}

/// Whether a run indented anything: nothing else can be fitted.
fn has_ramp(run: &RunView) -> bool {
    run.phases.iter().any(|(_, phase)| *phase == Phase::Ramp)
}

fn exact(folder: &Path) -> Result<ExactFit, String> {
    let recipe = Recipe::new(FitOptions::default(), Wanted::default());
    let fitted = recipe.fit(folder).map_err(|err| err.to_string())?;
    let report = fitted.result.map_err(|err| err.to_string())?;
    let [mut force, mut residual] =
        fit_plots(&fitted.samples, &report, None, fitted.start.0, COLUMNS);
    force.series.retain(|one| one.ink == Ink::Limit);
    for one in &mut force.series {
        // Dashed, so that the measured force shows through where both agree.
        one.shape = Shape::Line { width: 2.0, dash: 8.0 };
    }
    // It stands under the force, over the same time.
    residual.x.name.clear();
    Ok(ExactFit { fitted: force.into(), residual: residual.into(), report })
}
