//! From a source on disk to a fit, as the command line and the window both make it; and the
//! window's refit of a run that has ended, on a thread of its own.

use super::Job;
use crate::report::thin::thin;
use eframe::egui::Context;
use egui_plot::PlotPoint;
use palpate_model::calibration::Calibration;
use palpate_model::fit::{FitError, FitOptions, FitReport, FitSample, Systematic, fit, systematic};
use palpate_model::rig::Phase;
use palpate_model::units::Seconds;
use palpate_protocols::analysis::{self, FitSource, SourceError, Wanted};
use palpate_protocols::compliance::Correction;
use palpate_protocols::origin::Origin;
use palpate_protocols::runner::{RunView, Stopwatch};
use palpate_sessions::import::ColumnNames;
use std::path::{Path, PathBuf};

/// What came of a source that could be read.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// The samples fitted.
    pub samples: Vec<FitSample>,
    /// Session time of the first sample.
    pub start: Seconds,
    /// What the reader of the source remarked.
    pub notes: Vec<String>,
    /// The fit, or why there is none.
    pub result: Result<FitReport, FitError>,
    /// Wall seconds of the fit alone.
    pub seconds: f64,
    /// The calibration its forces were read with; `None` for a table.
    pub calibration: Option<Calibration>,
    /// What the calibration adds to the uncertainty, once asked for.
    pub systematic: Option<Systematic>,
    /// What the rig's compliance does to the depths, or would, once asked for.
    pub compliance: Option<Correction>,
}

impl Fitted {
    /// Fits what was read.
    #[must_use]
    pub fn of(source: FitSource, options: &FitOptions) -> Self {
        let watch = Stopwatch::start();
        let result = fit(&source.samples, options);
        Self {
            seconds: watch.seconds(),
            samples: source.samples,
            start: source.start,
            notes: source.notes,
            calibration: source.calibration,
            systematic: None,
            compliance: None,
            result,
        }
    }

    /// Adds what the errors of calibration and compliance do to the parameters; a table has none, and a refusal is
    /// a note. `options` are those of the fit.
    #[must_use]
    pub fn with_systematic(mut self, options: &FitOptions) -> Self {
        let Ok(report) = &self.result else {
            return self;
        };
        let origin = Origin::of(self.calibration.as_ref(), self.compliance.as_ref());
        let found = origin.map_err(|err| err.to_string()).and_then(|origin| {
            let record = origin.traced("", &self.samples);
            let found = origin.is_known().then(|| systematic(record, options));
            found.transpose().map_err(|err| err.to_string())
        });
        match found {
            Ok(Some(found)) => {
                self.result = Ok(report.clone().with_systematic(&found));
                self.systematic = Some(found);
            }
            Ok(None) => {}
            Err(reason) => self.notes.push(no_systematic(&reason)),
        }
        self
    }
}

/// That systematic errors are not told, and why.
#[must_use]
pub fn no_systematic(reason: &str) -> String {
    format!("what calibration and compliance add to the uncertainty cannot be told: {reason}")
}

/// Reads what is wanted of a session or a table and fits it. `columns` names the columns of a table without header.
pub fn fit_source(
    path: &Path,
    columns: Option<&ColumnNames>,
    wanted: Wanted,
    options: &FitOptions,
) -> Result<Fitted, SourceError> {
    let source = analysis::read_stretch(path, columns, wanted)?;
    Ok(Fitted::of(source, options))
}

/// Columns for which the curves of a plot are thinned: more than a screen is wide.
const COLUMNS: usize = 2000;

/// An exact fit as the window shows it.
#[derive(Clone, Debug)]
pub struct ExactFit {
    /// What the fit found.
    pub report: FitReport,
    /// Modelled force in N over session time in s, thinned.
    pub curve: Vec<PlotPoint>,
    /// Measured minus modelled force in mN over session time in s, thinned.
    pub residual: Vec<PlotPoint>,
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
            let started = self.job.start(
                "fit",
                move || exact(&folder),
                move || wake.request_repaint(),
            );
            if let Err(err) = started {
                self.answer = Some(Err(format!("the exact fit cannot be started: {err}")));
            }
        }
    }

    /// Whether a fit is under way.
    #[must_use]
    pub fn is_busy(&self) -> bool {
        self.job.is_busy()
    }

    /// Where the fit of this run stands.
    #[must_use]
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
    let options = FitOptions::default();
    // Whoever looks at a run sees its fit, whatever the run is worth.
    let wanted = Wanted::whatever_it_is_worth();
    let fitted = fit_source(folder, None, wanted, &options).map_err(|err| err.to_string())?;
    let fitted = fitted.with_systematic(&options);
    let report = fitted.result.map_err(|err| err.to_string())?;
    let modelled = report.predict(&fitted.samples);
    let start = fitted.start.0;
    let pairs = || fitted.samples.iter().zip(&modelled);
    let curve = pairs().map(|(sample, fit)| [start + sample.t.0, fit.0]);
    let known = pairs().filter(|(sample, _)| sample.is_measured());
    let residual = known.map(|(sample, fit)| [start + sample.t.0, (sample.force.0 - fit.0) * 1e3]);
    Ok(ExactFit {
        curve: points(&thin(curve, COLUMNS)),
        residual: points(&thin(residual, COLUMNS)),
        report,
    })
}

fn points(thinned: &[[f64; 2]]) -> Vec<PlotPoint> {
    thinned.iter().map(|&point| point.into()).collect()
}
