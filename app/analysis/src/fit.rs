//! From a source on disk to a fit.

use crate::compliance::Correction;
use crate::origin::Origin;
use crate::source::{self, FitSource, SourceError, Wanted};
use palpate_model::calibration::Calibration;
use palpate_model::units::Seconds;
use palpate_rheology::fit::{
    self, Bootstrap, BootstrapInterval, FitError, FitOptions, FitReport, FitSample,
    ProfileInterval, Systematic, systematic,
};
use palpate_runner::Stopwatch;
use palpate_tables::import::ColumnNames;
use serde::Serialize;
use std::path::Path;

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

/// Intervals that take more than one pass, as far as they were asked for.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Intervals {
    /// From the profile likelihood; ends are null where they are open.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub profile: Vec<ProfileInterval>,
    /// Seed of the bootstrap.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bootstrap_seed: Option<u64>,
    /// From fits to residuals shuffled in blocks.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub bootstrap: Vec<BootstrapInterval>,
}

impl Intervals {
    /// Those of one record of a fit; `progress` hears how many fits of the bootstrap are done.
    pub fn of(
        fitted: &fit::Fitted<'_>,
        record: usize,
        with_profile: bool,
        bootstrap: Option<Bootstrap>,
        progress: impl FnMut(usize),
    ) -> Result<Self, FitError> {
        Ok(Self {
            profile: match with_profile {
                true => fitted.profile(record)?,
                false => Vec::new(),
            },
            bootstrap_seed: bootstrap.map(|choice| choice.seed),
            bootstrap: match bootstrap {
                Some(choice) => fitted.bootstrap(record, choice, progress)?,
                None => Vec::new(),
            },
        })
    }
}

impl Fitted {
    /// Fits what was read.
    #[must_use]
    pub fn of(source: FitSource, options: &FitOptions) -> Self {
        let watch = Stopwatch::start();
        let result = fit::fit(&source.samples, options);
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
    let source = source::read_stretch(path, columns, wanted)?;
    Ok(Fitted::of(source, options))
}
