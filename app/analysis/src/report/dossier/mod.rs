//! The report on one session or several: everything that is known of them, on one page that says by hashes which files
//! it describes.

mod comparison;
mod files;
mod history;
mod html;

pub use files::{FileClaim, FileComparison, SEAL, claims, compare};

use super::calibration::CalibrationDetails;
use super::calibration_plot;
use super::cycles::{CycleReport, CycleSettings, cycles_text, picture as cycles_picture};
use super::figures::{TimeAlignment, TimeWindow, Traces};
use super::picture;
use crate::analysed_session::{self, AnalysedSession};
use crate::cycles::of_session as cycles_of;
use crate::fidelity;
use crate::fit::SourceFit;
use crate::progress::Progress;
use crate::source::{self, RecordStretch, SourceError};
use palpate_figures::drawing::Drawing;
use palpate_model::calibration::{Calibration, ForceUncertainty};
use palpate_rheology::fit::{FitOptions, FitReport};
use palpate_runner::base::FoundBase;
use palpate_runner::fidelity::Fidelity;
use palpate_sessions::analyses::{Analyses, AnalysisInput, read_session_inputs};
use palpate_sessions::{
    AuxiliaryData, EDITS_FILE, Edits, EndRecord, LogEntry, Manifest, Review, Session,
};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A session, and the analysis through which it is read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SessionReading {
    pub session: PathBuf,
    /// `None` reads the session with its edits only.
    pub analysis: Option<String>,
}

/// One session with all that a page tells of it. Its samples are not in memory any more.
pub struct ReportSubject {
    /// The name of its folder. The path is private and stays out of the page.
    pub name: String,
    pub(super) analysis: Option<String>,
    pub(super) manifest: Manifest,
    pub(super) samples: usize,
    pub(super) duration_s: f64,
    pub(super) notes: Vec<String>,
    pub(super) entries: Vec<LogEntry>,
    pub(super) end: Option<EndRecord>,
    pub(super) auxiliary: AuxiliaryData,
    pub(super) edits: Edits,
    pub(super) analyses: Analyses,
    pub(super) review: Option<Review>,
    pub(super) base: FoundBase,
    pub(super) fidelity: Result<Fidelity, String>,
    pub(super) calibration: Option<(Calibration, Result<CalibrationDetails, String>)>,
    pub(super) traces: Traces,
    pub(super) cycles: Option<CyclePart>,
    pub(super) fit: Result<FitPart, String>,
    /// Every file of the session with its SHA-256.
    pub(super) files: Vec<AnalysisInput>,
}

pub(super) struct CyclePart {
    pub text: String,
    pub figure: String,
}

pub(super) struct FitPart {
    pub report: FitReport,
    pub figure: Drawing,
    /// Sentences beside those of the report.
    pub remarks: Vec<String>,
}

impl ReportSubject {
    pub fn of(wanted: &SessionReading) -> Result<Self, SourceError> {
        let path = &wanted.session;
        let files = read_session_inputs(path)?;
        let opened = analysed_session::open(path, wanted.analysis.as_deref())?;
        let AnalysedSession { edited, analyses, left_out_s } = opened;
        let (session, edits) = (edited.session, edited.edits);
        // The review itself is among the edits; their order shows what came after it.
        let seen = files.iter().filter(|one| one.what != EDITS_FILE).cloned();
        let seen: Vec<AnalysisInput> = seen.chain(analyses.input()).collect();
        let name = folder_name(path);
        let calibration = source::calibration_of(&session).ok().map(|calibration| {
            let details = CalibrationDetails::of(&calibration).map_err(|err| err.to_string());
            (calibration, details)
        });
        let traces = Traces::of(&name, &session, TimeWindow::WHOLE).leaving_out(&left_out_s);
        Ok(Self {
            manifest: session.manifest.clone(),
            samples: session.rows.len(),
            duration_s: session.rows.last().map_or(0.0, |row| row.host.seconds().0),
            notes: session.notes.clone(),
            entries: session.entries.clone(),
            end: session.end.clone(),
            auxiliary: session.auxiliary.clone(),
            review: edits.review(&seen),
            base: FoundBase::of_session(&session),
            fidelity: fidelity::of_session(&session).map_err(|err| err.to_string()),
            cycles: cycles(&name, &session),
            files: files.into_iter().chain(analyses.input()).collect(),
            analysis: wanted.analysis.clone(),
            calibration,
            traces,
            edits,
            analyses,
            fit: fit(&name, session, &left_out_s),
            name,
        })
    }
}

/// The name of a session's folder, or of its file.
#[must_use]
pub fn folder_name(path: &Path) -> String {
    let named = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    named.file_name().unwrap_or(named.as_os_str()).to_string_lossy().into_owned()
}

/// The cycles of a session that has several, or sines.
fn cycles(name: &str, session: &Session) -> Option<CyclePart> {
    let source = cycles_of(session).ok()?;
    let report = CycleReport::of(name.to_owned(), source, &CycleSettings::default());
    (report.cycles.len() > 1 || !report.sines.is_empty())
        .then(|| CyclePart { text: cycles_text(&report), figure: cycles_picture(&report) })
}

/// The fit of a session, whatever the session is worth, with what its calibration adds.
fn fit(name: &str, session: Session, left_out_s: &[[f64; 2]]) -> Result<FitPart, String> {
    let source = source::of_session(session, RecordStretch::RampHold, left_out_s);
    let mut source = source.map_err(|err| err.to_string())?;
    // The page has the notes of the reader beside the session.
    source.notes.clear();
    let options = FitOptions::default();
    let fitted = SourceFit::with_systematic(source, None, &options);
    let report = fitted.result.map_err(|err| err.to_string())?;
    let uncertainty = fitted.calibration.as_ref().map(ForceUncertainty::of).and_then(Result::ok);
    Ok(FitPart {
        figure: picture::of_fit(name, &fitted.samples, &report, uncertainty.as_ref()),
        remarks: fitted.notes,
        report,
    })
}

palpate_model::named! {
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum SessionFigure {
        #[default]
        ForceTime = "force-time",
        ForceDepth = "force-depth",
        /// The fit and its residual.
        Residual = "residual",
        Calibration = "calibration",
    }
}

/// One figure of a session, of a stretch of it where it is over time or depth; or why it cannot be drawn, though the
/// session could be read.
pub fn figure(
    wanted: &SessionReading,
    figure: SessionFigure,
    window: TimeWindow,
) -> Result<Result<Drawing, String>, SourceError> {
    let opened = analysed_session::open(&wanted.session, wanted.analysis.as_deref())?;
    let (session, left_out_s) = (opened.edited.session, opened.left_out_s);
    let name = folder_name(&wanted.session);
    let traces = || Traces::of(&name, &session, window).leaving_out(&left_out_s);
    Ok(match figure {
        SessionFigure::ForceTime => Ok(super::figures::force_time(&traces())),
        SessionFigure::ForceDepth => Ok(super::figures::force_depth(&traces())),
        SessionFigure::Residual => fit(&name, session, &left_out_s).map(|part| part.figure),
        SessionFigure::Calibration => {
            let calibration = source::calibration_of(&session)?;
            match CalibrationDetails::of(&calibration) {
                Ok(details) => Ok(calibration_plot::drawing(&calibration, &details)),
                Err(err) => Err(err.to_string()),
            }
        }
    })
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FigureFormat {
    Svg,
    Png,
}

impl FigureFormat {
    pub fn of(file: &Path) -> Result<Self, String> {
        let ending = file.extension().map(|ending| ending.to_ascii_lowercase());
        match ending.as_deref().and_then(|ending| ending.to_str()) {
            Some("svg") => Ok(Self::Svg),
            Some("png") => Ok(Self::Png),
            _ => Err(format!(
                "the figure {} has no known file type; end its name in .svg or .png",
                file.display()
            )),
        }
    }

    pub fn bytes(self, drawing: &Drawing) -> Result<Vec<u8>, String> {
        match self {
            Self::Svg => Ok(drawing.svg().into_bytes()),
            Self::Png => palpate_figures::raster::png(drawing).map_err(|err| err.to_string()),
        }
    }
}

/// Date and program version of a page.
#[must_use]
pub fn creation_line(now: chrono::DateTime<chrono::Utc>) -> String {
    let version = env!("CARGO_PKG_VERSION");
    format!("Made {} by palpate {version}", super::session_text::format_utc(&now))
}

#[derive(Debug, Error)]
pub enum ReportError {
    #[error("the report was cancelled")]
    Cancelled,
    #[error("{}: {}", .0.display(), .1)]
    Source(PathBuf, Box<SourceError>),
}

/// Reads every session and makes the page. `made` is when and with which version, in words; `progress` hears
/// which session is read next.
pub fn write(
    wanted: &[SessionReading],
    align: TimeAlignment,
    made: &str,
    progress: &dyn Progress,
) -> Result<String, ReportError> {
    let mut subjects = Vec::new();
    for (index, one) in wanted.iter().enumerate() {
        if progress.report(index, wanted.len(), &folder_name(&one.session)).is_break() {
            return Err(ReportError::Cancelled);
        }
        let failed = |err| ReportError::Source(one.session.clone(), Box::new(err));
        subjects.push(ReportSubject::of(one).map_err(failed)?);
    }
    Ok(html::page(&subjects, align, made))
}
