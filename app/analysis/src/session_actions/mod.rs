//! Actions on a recorded session, away from the window's thread: analyses, data quality, corrections.

mod actions;
mod fits;
mod materials;

pub use actions::{
    Attribution, ContactCorrection, FitToStore, MaskResult, RecalibrationResult, SessionAction,
    SessionActionError, correct_contact, mask, recalibrate, set_data_quality, store_fit, withdraw,
};
pub use fits::{FitSettings, SessionFitRequest, fit_without_analysis};
pub use materials::MaterialToStore;

use crate::edited_session;
use crate::progress::Progress;
use crate::report::dossier::{self, FigureFormat, SessionFigure, SessionReading};
use crate::report::figures::{TimeAlignment, TimeWindow};
use palpate_figures::drawing::Drawing;
use palpate_model::calibration::Calibration;
use palpate_model::units::Position;
use palpate_runner::wall_now;
use palpate_sessions::{Analyses, CalibrationStore, DataQuality, contacts};
use std::path::{Path, PathBuf};

/// State of a session before an action on it.
#[derive(Clone, Debug)]
pub struct SessionActionContext {
    pub session: PathBuf,
    pub session_id: String,
    /// Analyses, including withdrawn ones.
    pub analyses: Analyses,
    /// Data quality, its author and reason.
    pub verdict: Option<(DataQuality, String, String)>,
    /// The contacts it found, corrected ones as they are now, from home.
    pub contacts: Vec<Position>,
    /// Calibrations of the library by name, and ids of those of one name.
    pub calibrations: Vec<(String, Calibration)>,
}

/// Reads what is known of a session, and which calibrations there are.
pub fn read(session: &Path, library: Option<&Path>) -> Result<SessionActionContext, String> {
    let passing = edited_session::stream_edited(session).map_err(|err| err.to_string())?;
    let id = passing.outline.manifest.session_id;
    let analyses = Analyses::read(session, &id).map_err(|err| err.to_string())?;
    let shelf = library.map(CalibrationStore::open);
    let stored = shelf.iter().flat_map(|shelf| &shelf.documents);
    let found = contacts::contacts(&passing.outline.entries);
    let verdict = passing.edits.verdict();
    Ok(SessionActionContext {
        session: session.to_path_buf(),
        session_id: id,
        analyses,
        verdict: verdict.map(|(verdict, edit)| (verdict, edit.by.clone(), edit.reason.clone())),
        contacts: found.iter().map(|one| one.position).collect(),
        calibrations: stored.map(|one| (one.id.clone(), one.document.clone())).collect(),
    })
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ActionReport {
    pub sentence: String,
    /// Session that got a new record.
    pub changed: Option<PathBuf>,
    /// Whether that was an edit, so that all who show the session read it again.
    pub is_edit: bool,
    pub created_analysis: Option<String>,
}

/// Reports progress; an error if the work is cancelled.
fn step(progress: &dyn Progress, done: usize, of: usize, what: &str) -> Result<(), String> {
    match progress.report(done, of, what).is_break() {
        true => Err("cancelled; nothing was kept".to_owned()),
        false => Ok(()),
    }
}

#[derive(Clone, Debug, PartialEq)]
pub enum SessionDocument {
    Page(Vec<SessionReading>),
    Figure(SessionReading, SessionFigure, TimeWindow),
    /// A figure that is drawn already.
    Drawing(Box<Drawing>),
}

/// Writes a page or figure as a new file.
pub fn write_document(
    paper: &SessionDocument,
    to: &Path,
    progress: &dyn Progress,
) -> Result<ActionReport, String> {
    if to.exists() {
        return Err(format!("{} exists already; choose another name", to.display()));
    }
    let bytes = match paper {
        SessionDocument::Page(wanted) => {
            let made = dossier::creation_line(wall_now().into());
            let page = dossier::write(wanted, TimeAlignment::default(), &made, progress);
            page.map_err(|err| err.to_string())?.into_bytes()
        }
        SessionDocument::Figure(wanted, figure, window) => {
            let ending = FigureFormat::of(to)?;
            step(progress, 0, 1, "drawing")?;
            let drawing =
                dossier::figure(wanted, *figure, *window).map_err(|err| err.to_string())?;
            ending.bytes(&drawing?)?
        }
        SessionDocument::Drawing(drawing) => FigureFormat::of(to)?.bytes(drawing)?,
    };
    write_new(to, &bytes)?;
    // A name alone does not tell the folder.
    let place = std::path::absolute(to).unwrap_or_else(|_| to.to_owned());
    let sentence = format!("written: {}", place.display());
    Ok(ActionReport { sentence, ..ActionReport::default() })
}

fn write_new(to: &Path, bytes: &[u8]) -> Result<(), String> {
    palpate_sessions::atomic::create(to, bytes).map_err(|err| {
        format!("cannot write {} ({err}); choose a folder that you may write to", to.display())
    })
}
