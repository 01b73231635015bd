//! Reading, assessing and storing the library's calibrations, away from the window's thread.

use crate::report::calibration::{CalibrationDetails, CalibrationEntry};
use crate::report::calibration_plot::plots;
use palpate_figures::figure::Plot;
use palpate_model::assessment::QualityRank;
use palpate_model::calibration::{Calibration, CalibrationError, CalibrationUse};
use palpate_runner::programme::calibration_from_session;
use palpate_runner::wall_now;
use palpate_sessions::{CalibrationStore, Session, age_days, save_document, supersede_document};
use std::path::Path;
use thiserror::Error;

/// Calibrations of the library with their assessment, and the one just stored.
pub struct CalibrationOverview {
    /// The rig's own first, where it was opened with that, then those of the library by identifier.
    pub calibrations: Vec<CalibrationView>,
    /// Reasons for each calibration that cannot be read.
    pub unreadable: Vec<String>,
    /// Identifier of the one just stored, or the reason it was not.
    pub stored: Option<Result<String, String>>,
}

/// One calibration with its details.
pub struct CalibrationView {
    pub entry: CalibrationEntry,
    pub calibration: Calibration,
    /// Details and plots, or the reason there are none.
    pub details: Result<(CalibrationDetails, [Plot; 4]), String>,
    /// Reasons against using it on its rig.
    pub doubts: Vec<String>,
    /// It is not from the library.
    pub comes_with_rig: bool,
}

impl CalibrationView {
    fn of(entry: CalibrationEntry, calibration: Calibration, rig: &str) -> Self {
        let details = CalibrationDetails::of(&calibration).and_then(|details| {
            let mut plots = plots(&calibration, &details)?;
            // A name would be cut off where its stretch is narrow: the legend has it.
            for plot in &mut plots {
                plot.stretches.iter_mut().for_each(|one| one.name.clear());
            }
            Ok((details, plots))
        });
        Self {
            details: details.map_err(|err| err.to_string()),
            doubts: calibration.validity_warnings(&CalibrationUse {
                rig,
                age_days: entry.age_days,
                ..CalibrationUse::default()
            }),
            entry,
            calibration,
            comes_with_rig: false,
        }
    }
}

/// Reads the library. `own` are the calibrations with which the rig was opened, its own or one of the library, and which
/// comes with it; and the rig's name.
pub fn read(
    library: &Path,
    own: (Vec<Calibration>, String),
    kept: Option<Result<String, String>>,
) -> CalibrationOverview {
    let (own, rig) = own;
    let now = wall_now();
    let shelf = CalibrationStore::open(library);
    let mut shown: Vec<CalibrationView> = Vec::new();
    for own in own {
        let is_kept = shelf.documents.iter().any(|stored| stored.document == own);
        if is_kept || shown.iter().any(|one| one.calibration == own) {
            continue;
        }
        let entry = CalibrationEntry::built_in(&own);
        shown.push(CalibrationView {
            // The calibration that comes with the rig needs no date.
            doubts: Vec::new(),
            comes_with_rig: true,
            ..CalibrationView::of(entry, own, &rig)
        });
    }
    shown.extend(shelf.documents.iter().map(|stored| {
        let age = age_days(&stored.document, now.into());
        CalibrationView::of(
            CalibrationEntry::of(&shelf, stored, age),
            stored.document.clone(),
            &rig,
        )
    }));
    CalibrationOverview {
        calibrations: shown,
        unreadable: shelf.unreadable.iter().map(ToString::to_string).collect(),
        stored: kept,
    }
}

/// A calibration cannot be kept.
#[derive(Debug, Error)]
pub enum UnacceptedCalibration {
    #[error(transparent)]
    Unreadable(#[from] CalibrationError),
    #[error(
        "this calibration is not good enough to be kept: {}; to keep it all the same, give a reason with 'palpate calibration import --despite'",
        .0.join("; ")
    )]
    Bad(Vec<String>),
}

/// The calibration that is kept: itself if no check of it is bad, and with the reason among its sources if somebody keeps it
/// despite its checks.
pub fn accepted(
    calibration: Calibration,
    despite: Option<&str>,
) -> Result<Calibration, UnacceptedCalibration> {
    calibration.check_rise()?;
    let assessed = calibration.assess(None)?;
    let bad = assessed.checks.iter().filter(|check| check.rank == QualityRank::Bad);
    let bad: Vec<String> = bad.map(|check| check.sentence.clone()).collect();
    match (bad.is_empty(), despite.map(str::trim).filter(|reason| !reason.is_empty())) {
        (true, _) => Ok(calibration),
        (false, Some(reason)) => {
            let source = format!("{}; kept despite its checks: {reason}", calibration.source);
            Ok(Calibration { source, ..calibration })
        }
        (false, None) => Err(UnacceptedCalibration::Bad(bad)),
    }
}

/// Stores the calibration a session measured, in the place of the one in force for its rig; tells its id.
pub fn store_calibration(library: &Path, session: &Path, name: &str) -> Result<String, String> {
    let session = Session::open(session).map_err(|err| err.to_string())?;
    let calibration = calibration_from_session(&session, name).map_err(|err| err.to_string())?;
    let calibration = accepted(calibration, None).map_err(|err| err.to_string())?;
    let shelf = CalibrationStore::open(library);
    let stored = match shelf.in_force(&calibration.rig) {
        Some(old) => supersede_document(library, &old.id, &calibration),
        None => save_document(library, &calibration),
    };
    stored.map(|stored| stored.id).map_err(|err| err.to_string())
}
