//! Where a calibration comes from: the library, a file, or the source thesis.

use super::super::Failure;
use palpate_model::calibration::{Calibration, CalibrationUse};
use palpate_runner::wall_now;
use palpate_sessions::calibrations::{CalibrationStore, StoredCalibration, read_calibration};
use palpate_sessions::document_store::{self, LibraryError};
use palpate_sessions::library_folder;
use std::path::{Path, PathBuf};

/// What names the table of the source thesis.
const THESIS: &str = "thesis";

pub(crate) struct CalibrationSource {
    pub id: Option<String>,
    pub file: Option<PathBuf>,
    pub calibration: Calibration,
    pub age_days: Option<i64>,
}

impl CalibrationSource {
    /// By a file's path, a name or id of the library, or `thesis`.
    pub fn find(name: &str) -> Result<Self, Failure> {
        let path = Path::new(name);
        if path.is_file() {
            let calibration = read_calibration(path).map_err(failure)?;
            return Ok(Self::new(None, Some(path.into()), calibration));
        }
        let library = library_folder().map_err(Failure::usage)?;
        let shelf = CalibrationStore::open(&library);
        match shelf.find(name) {
            Ok(saved) => Ok(Self::from_library(saved)),
            Err(_) if name == THESIS => Ok(Self::new(None, None, Calibration::thesis())),
            Err(err) => Err(failure(err)),
        }
    }

    /// The one that is named, or else the one of the library that is in force for a rig; and a sentence for each document
    /// that cannot be read, since it might be a newer one of that rig.
    pub fn wanted(name: Option<&str>, rig: &str) -> Result<(Option<Self>, Vec<String>), Failure> {
        if let Some(name) = name {
            return Ok((Some(Self::find(name)?), Vec::new()));
        }
        // A computer without a library has no calibration in it.
        let Ok(library) = library_folder() else { return Ok((None, Vec::new())) };
        let shelf = CalibrationStore::open(&library);
        let unreadable = shelf.unreadable.iter().map(ToString::to_string).collect();
        Ok((shelf.in_force(rig).map(Self::from_library), unreadable))
    }

    pub fn from_library(saved: &StoredCalibration) -> Self {
        let (id, path) = (saved.id.clone(), saved.path.clone());
        Self::new(Some(id), Some(path), saved.document.clone())
    }

    fn new(id: Option<String>, file: Option<PathBuf>, calibration: Calibration) -> Self {
        Self {
            age_days: document_store::age_days(&calibration, wall_now().into()),
            id,
            file,
            calibration,
        }
    }

    /// Reasons against using it on a rig.
    pub fn doubts(&self, rig: &str) -> Vec<String> {
        self.calibration.validity_warnings(&CalibrationUse {
            rig,
            age_days: self.age_days,
            ..CalibrationUse::default()
        })
    }
}

/// Days since one of the library was taken.
pub(super) fn age_days(saved: &StoredCalibration) -> Option<i64> {
    document_store::age_days(&saved.document, wall_now().into())
}

/// A wrong name or document is wrong use, an unreadable disk is a failure.
pub(crate) fn failure(err: LibraryError) -> Failure {
    match err {
        LibraryError::Io { .. } | LibraryError::Changed { .. } => Failure::failed(err),
        _ => Failure::usage(err),
    }
}
