//! The exact fit of a run that has ended, on a thread of its own.

use super::task::BackgroundTask;
use crate::plots::figure::PlacedPlot;
use eframe::egui::Context;
use palpate_analysis::fit::FitRecipe;
use palpate_analysis::report::picture::fit_plots;
use palpate_analysis::source::SourceSelection;
use palpate_figures::figure::{Ink, SeriesShape};
use palpate_model::rig::Phase;
use palpate_rheology::fit::{FitOptions, FitReport};
use palpate_runner::RunView;
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

/// Fits every run exactly when it has ended.
#[derive(Default)]
pub struct Refitter {
    fit: BackgroundTask<ExactFit>,
    /// The session that is or was fitted.
    session: Option<PathBuf>,
}

impl Refitter {
    /// Fetches an answer, and starts when a run has ended.
    pub fn update(&mut self, ctx: &Context, run: Option<&RunView>) {
        self.fit.poll();
        let ended = run.filter(|run| run.outcome.is_some() && has_ramp(run));
        let folder = ended.map(|run| &run.folder);
        if self.fit.is_busy() || self.session.as_ref() == folder {
            return;
        }
        self.fit = BackgroundTask::default();
        self.session = folder.cloned();
        if let Some(folder) = folder.cloned() {
            self.fit.start("fit", ctx, move |_| fit_exactly(&folder));
        }
    }

    /// How far the fit of this run is.
    pub fn of(&self, run: Option<&RunView>) -> Refit<'_> {
        let ended = run.filter(|run| run.outcome.is_some()).map(|run| &run.folder);
        match (self.fit.state(), self.fit.answer()) {
            _ if ended.is_none() || ended != self.session.as_ref() => Refit::NotYet,
            (Some(state), _) => Refit::Busy(state.seconds),
            (None, None) => Refit::Busy(0.0),
            (None, Some(Ok(exact))) => Refit::Done(exact),
            (None, Some(Err(reason))) => Refit::Refused(reason),
        }
    }
}

/// Whether a run indented anything: nothing else can be fitted.
fn has_ramp(run: &RunView) -> bool {
    run.phases.iter().any(|(_, phase)| *phase == Phase::Ramp)
}

fn fit_exactly(folder: &Path) -> Result<ExactFit, String> {
    let recipe = FitRecipe::new(FitOptions::default(), SourceSelection::default());
    let fitted = recipe.fit(folder).map_err(|err| err.to_string())?;
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
