//! Actions on a recorded session, away from the window's thread: analyses, data quality, corrections.

mod actions;
mod fits;

pub use actions::{
    ContactCorrection, Deed, DeedFailure, KeptFit, MaskResult, RecalibrationResult, Who, correct,
    judge, keep_fit, mask, recalibrate, withdraw,
};
pub use fits::{FitSettings, FitWanted, own};

use crate::edited;
use crate::progress::Progress;
use crate::report::dossier::{self, Ending, Figure, Wanted};
use crate::report::figures::{Align, Window};
use palpate_model::calibration::Calibration;
use palpate_model::units::Position;
use palpate_runner::wall_now;
use palpate_sessions::{Analyses, Shelf, Verdict, contacts};
use std::path::{Path, PathBuf};

/// State of a session before an action on it.
#[derive(Clone, Debug)]
pub struct Known {
    pub session: PathBuf,
    pub session_id: String,
    /// Analyses, including withdrawn ones.
    pub analyses: Analyses,
    /// Data quality, its author and reason.
    pub verdict: Option<(Verdict, String, String)>,
    /// The contacts it found, corrected ones as they are now, from home.
    pub contacts: Vec<Position>,
    /// Calibrations of the library by name, and ids of those of one name.
    pub calibrations: Vec<(String, Calibration)>,
}

/// Reads what is known of a session, and which calibrations there are.
pub fn read(session: &Path, library: Option<&Path>) -> Result<Known, String> {
    let passing = edited::outline(session).map_err(|err| err.to_string())?;
    let id = passing.outline.manifest.session_id;
    let analyses = Analyses::read(session, &id).map_err(|err| err.to_string())?;
    let shelf = library.map(Shelf::open);
    let stored = shelf.iter().flat_map(|shelf| &shelf.kept);
    let found = contacts::contacts(&passing.outline.entries);
    let verdict = passing.edits.verdict();
    Ok(Known {
        session: session.to_path_buf(),
        session_id: id,
        analyses,
        verdict: verdict.map(|(verdict, edit)| (verdict, edit.by.clone(), edit.reason.clone())),
        contacts: found.iter().map(|one| one.position).collect(),
        calibrations: stored.map(|one| (one.id.clone(), one.document.clone())).collect(),
    })
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Done {
    pub sentence: String,
    /// Session that got a new record.
    pub changed: Option<PathBuf>,
    /// Whether that was an edit, so that all who show the session read it again.
    pub is_edit: bool,
    pub made: Option<String>,
}

/// Reports progress; an error if the work is cancelled.
fn step(progress: &dyn Progress, done: usize, of: usize, what: &str) -> Result<(), String> {
    match progress.tell(done, of, what).is_break() {
        true => Err("cancelled; nothing was kept".to_owned()),
        false => Ok(()),
    }
}

#[derive(Clone, Debug, PartialEq)]
pub enum Paper {
    Page(Vec<Wanted>),
    Figure(Wanted, Figure, Window),
}

/// Writes a page or figure as a new file.
pub fn paper(paper: &Paper, to: &Path, progress: &dyn Progress) -> Result<Done, String> {
    if to.exists() {
        return Err(format!("{} exists already; choose another name", to.display()));
    }
    let bytes = match paper {
        Paper::Page(wanted) => {
            let made = dossier::made(wall_now().into());
            let page = dossier::write(wanted, Align::default(), &made, progress);
            page.map_err(|err| err.to_string())?.into_bytes()
        }
        Paper::Figure(wanted, figure, window) => {
            let ending = Ending::of(to)?;
            step(progress, 0, 1, "drawing")?;
            let drawing =
                dossier::figure(wanted, *figure, *window).map_err(|err| err.to_string())?;
            ending.bytes(&drawing?)?
        }
    };
    write_new(to, &bytes)?;
    Ok(Done { sentence: format!("written: {}", to.display()), ..Done::default() })
}

fn write_new(to: &Path, bytes: &[u8]) -> Result<(), String> {
    palpate_sessions::atomic::create(to, bytes).map_err(|err| {
        format!("cannot write {} ({err}); choose a folder that may be written", to.display())
    })
}
