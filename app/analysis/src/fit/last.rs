//! The last fit, remembered from one run of the program to the next: a plan assumes its body.
//!
//! The file is `{"last_fit_version": 2, "checksum": CRC-32 of the compact JSON of the fit with its keys in alphabetical
//! order, "fit": ...}`. Before version 2 it was the fit alone; the next fit puts the new form in its place.

use super::SourceFit;
use crate::source::{self, RecordStretch, SourceError};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_rheology::fit::{
    ExpectedSignal, FitError, FitOptions, FitReport, FitSample, FitSolution, FittedParameter,
    Signal, SignalRecord,
};
use palpate_sessions::atomic;
use palpate_sessions::text::checksum;
use palpate_tables::import::ColumnNames;
use serde::Deserialize;
use serde_json::{Value, json};
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::{fs, io};
use thiserror::Error;

const FILE: &str = "last-fit.json";
pub(crate) const VERSION: u64 = 2;

const DEFAULT_FAMILY: &str = "series-3";

#[derive(Debug, Error)]
pub enum KnownFitError {
    #[error("{} is not a fit ({reason})", path.display())]
    NotAFit { path: PathBuf, reason: String },
    #[error("the remembered fit {} was changed after it was written; fit again", .0.display())]
    Changed(PathBuf),
    #[error("the fit has no parameter {0}")]
    Parameter(&'static str),
    #[error(transparent)]
    Source(#[from] SourceError),
    #[error("{} cannot be fitted: {reason}", path.display())]
    Fit { path: PathBuf, reason: FitError },
}

/// The required part of a fit in JSON, remembered or printed by a command.
#[derive(Debug, Deserialize)]
pub struct KnownFit {
    pub source: Option<String>,
    /// Root mean square of the residuals in N.
    pub rmse_n: f64,
    pub parameters: Vec<FittedParameter>,
    /// What the load cell is expected to report in the next run, where the source is a session whose signal was fitted.
    #[serde(skip)]
    pub signal: Option<ExpectedSignal>,
}

impl KnownFit {
    /// The last fit; `None` if there was none.
    pub fn last() -> Result<Option<Self>, KnownFitError> {
        match state_file() {
            Some(file) if file.exists() => Self::read(&file).map(Some),
            _ => Ok(None),
        }
    }

    /// A fit in a file, remembered or as the answer of a command.
    pub fn read(file: &Path) -> Result<Self, KnownFitError> {
        let bad = |err: &dyn std::fmt::Display| KnownFitError::NotAFit {
            path: file.to_owned(),
            reason: err.to_string(),
        };
        let text = fs::read_to_string(file).map_err(|err| bad(&err))?;
        let mut found: Value = serde_json::from_str(&text).map_err(|err| bad(&err))?;
        match found["last_fit_version"].as_u64() {
            None => {}
            Some(VERSION) => {
                let fit = found["fit"].take();
                if found["checksum"] != checksum(&fit.to_string()) {
                    return Err(KnownFitError::Changed(file.to_owned()));
                }
                found = fit;
            }
            Some(_) => {
                return Err(bad(&"a newer version of palpate wrote the file; update palpate"));
            }
        }
        serde_json::from_value(found).map_err(|err| bad(&err))
    }

    /// Of a file of a fit, or of a recording, fitted now; with what its reader remarked.
    pub fn of(
        path: &Path,
        columns: Option<&ColumnNames>,
    ) -> Result<(Self, Vec<String>), KnownFitError> {
        if path.extension().is_some_and(|ending| ending == "json") {
            return Ok((Self::read(path)?, Vec::new()));
        }
        let source = source::read_stretch(path, columns, RecordStretch::RampHold)?;
        let fitted = SourceFit::of(source, &FitOptions::default());
        let report =
            fitted.result.map_err(|reason| KnownFitError::Fit { path: path.to_owned(), reason })?;
        let known = Self {
            source: Some(path.display().to_string()),
            rmse_n: report.rmse_n,
            parameters: report.parameters,
            signal: expected_signal(&fitted.samples, fitted.signal.as_ref()),
        };
        Ok((known, fitted.notes))
    }

    /// The same with the signal of its source, if that is a session which is still where it was.
    #[must_use]
    pub fn with_signal(mut self) -> Self {
        let source = self.source.as_deref().map(Path::new).filter(|path| path.is_dir());
        let read = source.map(|path| source::read_stretch(path, None, RecordStretch::RampHold));
        if let Some(Ok(source)) = read {
            self.signal = expected_signal(&source.samples, source.signal.as_ref());
        }
        self
    }

    /// The modified Kelvin body; an error names a missing parameter.
    pub fn body(&self) -> Result<ModifiedKelvin, KnownFitError> {
        let value = |name: &'static str| {
            let mut all = self.parameters.iter();
            all.find(|parameter| parameter.name == name)
                .map(|parameter| parameter.value)
                .ok_or(KnownFitError::Parameter(name))
        };
        Ok(ModifiedKelvin {
            tau_eps: value("tau_eps")?,
            mu: [value("mu1")?, value("mu2")?, value("mu3")?],
            tau_sig: value("tau_sig")?,
        })
    }
}

fn expected_signal(samples: &[FitSample], signal: Option<&Signal>) -> Option<ExpectedSignal> {
    signal?;
    let record = SignalRecord { name: "the known run", samples, signal };
    let fitted = FitSolution::fit_signals(&[record], &FitOptions::default(), &[]);
    fitted.ok()?.expected_signal()
}

/// Whether a fit is a poor ground for a plan, because it hardly knows how fast the tissue relaxes.
#[must_use]
pub fn is_poorly_identified(parameters: &[FittedParameter]) -> bool {
    let mut all = parameters.iter();
    let tau = all.find(|parameter| parameter.name == "tau_eps");
    tau.is_some_and(|tau| match tau.std_error {
        Some(error) => error >= 0.5 * tau.value,
        None => !tau.is_fixed,
    })
}

/// Keeps a fit for later; or the file that cannot be written, and why.
pub fn remember(report: &FitReport, source: &Path) -> Result<(), (PathBuf, io::Error)> {
    // A plan assumes the modified Kelvin body of third order.
    let (Some(file), DEFAULT_FAMILY) = (state_file(), report.body.family.as_str()) else {
        return Ok(());
    };
    let source = source.canonicalize().unwrap_or_else(|_| source.to_owned());
    write(&file, report, &source).map_err(|err| (file, err))
}

fn write(file: &Path, report: &FitReport, source: &Path) -> io::Result<()> {
    if is_newer(file) {
        return Err(io::Error::other("a newer version of palpate wrote it; update palpate"));
    }
    if let Some(folder) = file.parent() {
        fs::create_dir_all(folder)?;
    }
    let mut fit = serde_json::to_value(report)?;
    fit["source"] = json!(source.display().to_string());
    let checksum = checksum(&fit.to_string());
    let object = json!({ "last_fit_version": VERSION, "checksum": checksum, "fit": fit });
    atomic::replace(file, object.to_string().as_bytes())
}

/// Whether a newer version of palpate wrote the file.
fn is_newer(file: &Path) -> bool {
    let text = fs::read_to_string(file).unwrap_or_default();
    let found: Value = serde_json::from_str(&text).unwrap_or_default();
    found["last_fit_version"].as_u64().is_some_and(|version| version > VERSION)
}

pub(crate) fn state_file() -> Option<PathBuf> {
    state_file_from(|name| std::env::var_os(name), std::env::home_dir())
}

/// Beside the sessions where `PALPATE_HOME` says where those are; else where the system keeps what
/// programs remember (XDG Base Directory Specification, `XDG_STATE_HOME`).
fn state_file_from(
    variable: impl Fn(&str) -> Option<OsString>,
    home: Option<PathBuf>,
) -> Option<PathBuf> {
    let folder =
        |name: &str| variable(name).map(PathBuf::from).filter(|path| !path.as_os_str().is_empty());
    if let Some(library) = folder("PALPATE_HOME") {
        return Some(library.join(FILE));
    }
    let state = if cfg!(windows) {
        folder("LOCALAPPDATA")
    } else {
        // The specification has relative paths ignored.
        folder("XDG_STATE_HOME")
            .filter(|path| path.is_absolute())
            .or_else(|| home.map(|home| home.join(".local/state")))
    };
    Some(state?.join("palpate").join(FILE))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_relaxation_time_that_is_hardly_known_is_doubted() {
        let tau = |std_error, is_fixed| FittedParameter {
            name: "tau_eps".into(),
            value: 1.0,
            unit: "s".into(),
            std_error,
            ci95: None,
            is_fixed,
            systematic_error: None,
            total95: None,
            budget: Vec::new(),
        };
        assert!(!is_poorly_identified(&[tau(Some(0.01), false)]));
        assert!(!is_poorly_identified(&[tau(None, true)]));
        for poor in [tau(Some(2.0), false), tau(None, false)] {
            assert!(is_poorly_identified(&[poor]));
        }
    }

    #[cfg(not(windows))]
    #[test]
    fn the_place_follows_the_environment() {
        let with = |set: &[(&str, &str)]| {
            let set: Vec<(String, OsString)> = set
                .iter()
                .map(|(name, value)| ((*name).to_owned(), OsString::from(value)))
                .collect();
            let get = move |name: &str| {
                let mut all = set.iter();
                all.find(|one| one.0 == name).map(|one| one.1.clone())
            };
            state_file_from(get, Some(PathBuf::from("/home/me")))
        };
        let path = |text: &str| Some(PathBuf::from(text));
        let default = path("/home/me/.local/state/palpate/last-fit.json");
        assert_eq!(with(&[]), default);
        assert_eq!(with(&[("XDG_STATE_HOME", "not/absolute")]), default);
        let state = ("XDG_STATE_HOME", "/state");
        assert_eq!(with(&[state]), path("/state/palpate/last-fit.json"));
        let library = ("PALPATE_HOME", "/library");
        assert_eq!(with(&[state, library]), path("/library/last-fit.json"));
    }

    #[test]
    fn only_a_higher_version_is_newer() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(FILE);
        assert!(!is_newer(&file));
        for (text, expected) in [
            ("{\"rmse_n\": 0.1}".to_owned(), false),
            ("not JSON".to_owned(), false),
            (json!({ "last_fit_version": VERSION }).to_string(), false),
            (json!({ "last_fit_version": VERSION + 1 }).to_string(), true),
        ] {
            fs::write(&file, &text).unwrap();
            assert_eq!(is_newer(&file), expected, "{text}");
        }
    }
}
