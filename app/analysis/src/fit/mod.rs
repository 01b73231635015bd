//! From recordings on disk to fits: one, many each by itself, several together, or those of a lake.

mod choice;
mod depths;
mod lake;
pub(crate) mod last;
mod stored;
mod together;

pub use choice::{FitChoice, FitChoiceError};
pub use lake::{LakeFitError, LakeFitEvent, LakeFitOutcome, LakeFitRequest, LakeTally, fit_lake};
pub(crate) use lake::{LakePart, lake_model};
pub use last::{KnownFit, KnownFitError, is_poorly_identified, remember};
pub use stored::{StoredFitError, StoredFits};
pub use together::{JointFit, JointFitRequest, fit_together};

use crate::compliance::{ComplianceCorrection, ComplianceCorrections};
use crate::pool::{WorkEvent, WorkFailure, in_order};
use crate::report::fit_json::{FitDetails, FitOverlay};
use crate::source::{self, FitSource, SourceError, SourceSelection};
use depths::{CorrectedRecord, settle};
use palpate_model::calibration::{Calibration, CalibrationError, ForceUncertainty};
use palpate_model::units::Seconds;
use palpate_rheology::fit::{
    self, Bootstrap, BootstrapInterval, FitError, FitOptions, FitReport, FitSample, FitSolution,
    LogarithmStatistics, ProfileInterval, Signal, SignalRecord, SystematicUncertainty,
    TracedRecord,
};
use palpate_runner::Stopwatch;
use palpate_tables::import::ColumnNames;
use serde::Serialize;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use thiserror::Error;

/// Options for reading and fitting sources.
#[derive(Debug)]
pub struct FitRecipe {
    /// The family, and which of its parameters are found.
    pub options: FitOptions,
    /// Names of the columns of tables without a header.
    pub columns: Option<ColumnNames>,
    /// Whether the systematic uncertainty from calibration and compliance is estimated.
    pub is_systematic: bool,
    /// Which part of a source, and whether rejected ones are taken.
    pub selection: SourceSelection,
    /// The analysis that a session is read by.
    pub analysis: Option<String>,
    pub corrections: ComplianceCorrections,
}

impl FitRecipe {
    /// With systematic uncertainty and uncorrected depths.
    #[must_use]
    pub fn new(options: FitOptions, wanted: SourceSelection) -> Self {
        Self {
            options,
            columns: None,
            is_systematic: true,
            selection: wanted,
            analysis: None,
            corrections: ComplianceCorrections::none(None),
        }
    }

    pub fn fit(&self, path: &Path) -> Result<SourceFit, SourceError> {
        let (columns, name) = (self.columns.as_ref(), self.analysis.as_deref());
        self.fit_read(source::read_analysed(path, columns, self.selection, name)?)
    }

    pub fn fit_read(&self, mut source: FitSource) -> Result<SourceFit, SourceError> {
        let compliance = self.corrections.apply(&mut source)?;
        Ok(SourceFit::found(source, compliance, &self.options, self.is_systematic))
    }
}

#[derive(Debug, Error)]
pub enum SourceFitError {
    #[error(transparent)]
    Source(#[from] SourceError),
    #[error(transparent)]
    Fit(#[from] FitError),
    #[error("the fit was not started, because the batch was cancelled")]
    NotBegun,
    #[error("the fit ended unexpectedly; report this with the session or table that was fitted")]
    Died,
}

impl From<WorkFailure> for SourceFitError {
    fn from(failure: WorkFailure) -> Self {
        match failure {
            WorkFailure::NotBegun => Self::NotBegun,
            WorkFailure::Died => Self::Died,
        }
    }
}

/// Fits every source with `jobs` threads and tells `hear` every answer, in order. Once `is_ending` is set no fit is begun.
pub fn fit_each(
    sources: &[PathBuf],
    jobs: usize,
    recipe: &FitRecipe,
    is_ending: &AtomicBool,
    hear: impl FnMut(WorkEvent<Result<SourceFit, SourceError>>),
) -> io::Result<()> {
    in_order(jobs, sources, is_ending, |source| recipe.fit(source), hear)
}

/// Result for a source that could be read.
#[derive(Clone, Debug)]
pub struct SourceFit {
    pub samples: Vec<FitSample>,
    /// Session time of the first sample.
    pub start: Seconds,
    /// Time from the first sample of the session to that one, by the controller's clock.
    pub offset: Seconds,
    pub notes: Vec<String>,
    pub result: Result<FitReport, FitError>,
    /// What a population needs of it; empty without a result.
    pub logarithms: LogarithmStatistics,
    /// Wall seconds of the fit alone.
    pub seconds: f64,
    /// The calibration its forces were read with; `None` for a table.
    pub calibration: Option<Calibration>,
    /// What the load cell reported, where it was recorded.
    pub signal: Option<Signal>,
    pub systematic: Option<SystematicUncertainty>,
    /// Effect of the machine compliance on the depths, applied or not.
    pub compliance: Option<ComplianceCorrection>,
}

impl SourceFit {
    /// Without what calibration and compliance add to the uncertainty.
    #[must_use]
    pub fn of(source: FitSource, options: &FitOptions) -> Self {
        Self::found(source, None, options, false)
    }

    /// With what the errors of calibration and compliance do to the parameters; a table has none, and a refusal is a note.
    #[must_use]
    pub fn with_systematic(
        source: FitSource,
        compliance: Option<ComplianceCorrection>,
        options: &FitOptions,
    ) -> Self {
        Self::found(source, compliance, options, true)
    }

    fn found(
        source: FitSource,
        compliance: Option<ComplianceCorrection>,
        options: &FitOptions,
        is_systematic: bool,
    ) -> Self {
        let watch = Stopwatch::start();
        let FitSource { samples, signal, calibration, start, offset, mut notes, .. } =
            settled(source, options);
        let record =
            SignalRecord { name: "the record", samples: &samples, signal: signal.as_ref() };
        let solution = FitSolution::fit_signals(&[record], options, &[]);
        let mut result = solution.as_ref().map(FitSolution::report).map_err(Clone::clone);
        let seconds = watch.seconds();
        if let (Ok(solution), Ok(report)) = (&solution, &mut result) {
            let richer = solution.richer_words(0, report);
            report.warnings.extend(richer);
        }
        let logarithms = solution.as_ref().map(|one| LogarithmStatistics::of(one, 0));
        let logarithms = logarithms.unwrap_or_default();
        let mut systematic = None;
        if let (Ok(solution), Ok(report), true) = (&solution, &mut result, is_systematic) {
            let origin = Origin::of(calibration.as_ref(), compliance.as_ref());
            let found = origin.map_err(|err| err.to_string()).and_then(|origin| {
                let traced = origin.traced("", &samples);
                let found = origin.is_known().then(|| solution.systematic(&[traced]));
                found.transpose().map_err(|err| err.to_string())
            });
            match found {
                Ok(found) => systematic = found.and_then(|mut found| found.pop()),
                Err(reason) => notes.push(no_systematic(&reason)),
            }
            if let Some(found) = &systematic {
                *report = std::mem::take(report).with_systematic(found);
            }
        }
        drop(solution);
        Self {
            samples,
            start,
            offset,
            notes,
            result,
            logarithms,
            seconds,
            calibration,
            signal,
            systematic,
            compliance,
        }
    }

    #[must_use]
    pub fn details<'a>(
        &'a self,
        overlay: &'a FitOverlay,
        intervals: &'a FitIntervals,
    ) -> FitDetails<'a> {
        FitDetails {
            overlay,
            intervals,
            systematic: self.systematic.as_ref(),
            compliance: self.compliance.as_ref(),
        }
    }

    /// Finds intervals that take more than one pass.
    pub fn intervals(
        &self,
        options: &FitOptions,
        wanted: IntervalRequest,
        progress: impl FnMut(usize),
    ) -> Result<FitIntervals, FitError> {
        if wanted == IntervalRequest::default() {
            return Ok(FitIntervals::default());
        }
        let signal = self.signal.as_ref();
        let record = SignalRecord { name: "the record", samples: &self.samples, signal };
        let exact = FitSolution::fit_signals(&[record], options, &[])?;
        wanted.find(&exact, 0, progress)
    }
}

/// The source with depths that were corrected for machine compliance corrected by the modelled force.
pub(crate) fn settled(mut source: FitSource, options: &FitOptions) -> FitSource {
    let FitSource { samples, signal, notes, raw, .. } = &mut source;
    let corrected = CorrectedRecord { samples, raw: raw.as_ref() };
    let kept = settle(&mut [corrected], |samples| {
        let record =
            SignalRecord { name: "the record", samples: samples[0], signal: signal.as_ref() };
        let solution = FitSolution::fit_signals(&[record], options, &[])?;
        Ok(vec![solution.report()])
    });
    notes.extend(kept.map(str::to_owned));
    source
}

#[must_use]
pub fn no_systematic(reason: &str) -> String {
    format!("the systematic uncertainty from calibration and compliance is unknown: {reason}")
}

/// Fewer repeats of a bootstrap do not determine the ends of a 95 % interval.
pub const BOOTSTRAP_REPEATS_MIN: usize = 40;

/// Request for intervals that take more than one pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct IntervalRequest {
    pub with_profile: bool,
    /// From fits to residuals shuffled in blocks.
    pub bootstrap: Option<Bootstrap>,
}

impl IntervalRequest {
    /// Finds those of one record of a fit; `progress` hears how many fits of the bootstrap are done.
    pub fn find(
        self,
        fitted: &fit::FitSolution<'_>,
        record: usize,
        progress: impl FnMut(usize),
    ) -> Result<FitIntervals, FitError> {
        Ok(FitIntervals {
            profile: if self.with_profile { fitted.profile(record)? } else { Vec::new() },
            bootstrap_seed: self.bootstrap.map(|choice| choice.seed),
            bootstrap: match self.bootstrap {
                Some(choice) => fitted.bootstrap(record, choice, progress)?,
                None => Vec::new(),
            },
        })
    }
}

/// Intervals that take more than one pass, as far as they were asked for.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FitIntervals {
    /// From the profile likelihood; ends are null where they are open.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub profile: Vec<ProfileInterval>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bootstrap_seed: Option<u64>,
    /// From fits to residuals shuffled in blocks.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub bootstrap: Vec<BootstrapInterval>,
}

/// Calibration and compliance of one source, both by name and with their uncertainty.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Origin {
    calibration: Option<(String, ForceUncertainty)>,
    /// Uncertainty in mm/N.
    compliance: Option<(String, f64)>,
}

impl Origin {
    /// Of forces read with this calibration, if with any, and depths from which this was taken, if anything was.
    pub fn of(
        calibration: Option<&Calibration>,
        compliance: Option<&ComplianceCorrection>,
    ) -> Result<Self, CalibrationError> {
        let stated = |one: &Calibration| {
            ForceUncertainty::of(one).map(|uncertainty| (one.name.clone(), uncertainty))
        };
        let applied = compliance.filter(|one| one.is_applied);
        Ok(Self {
            calibration: calibration.map(stated).transpose()?,
            compliance: applied.map(|one| (one.id.clone(), one.std_error_mm_per_n)),
        })
    }

    pub fn is_known(&self) -> bool {
        self.calibration.is_some() || self.compliance.is_some()
    }

    #[must_use]
    pub fn traced<'a>(&'a self, name: &'a str, samples: &'a [FitSample]) -> TracedRecord<'a> {
        let calibration = self.calibration.as_ref();
        let compliance = self.compliance.as_ref();
        TracedRecord {
            name,
            samples,
            calibration: calibration.map(|(name, uncertainty)| (name.as_str(), uncertainty)),
            compliance: compliance.map(|(name, error)| (name.as_str(), *error)),
        }
    }
}
