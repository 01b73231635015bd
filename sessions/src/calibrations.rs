//! The calibrations of a library, in `calibrations/`.

use crate::document_store::{self, Document, LibraryError};
use palpate_model::calibration::Calibration;
use std::path::Path;

pub type StoredCalibration = document_store::StoredDocument<Calibration>;

pub type CalibrationStore = document_store::DocumentStore<Calibration>;

impl Document for Calibration {
    const KIND: &'static str = "calibration";
    const FOLDER: &'static str = "calibrations";
    const RENEW: &'static str = "import it again";

    fn name(&self) -> &str {
        &self.name
    }

    fn rig(&self) -> &str {
        &self.rig
    }

    fn taken_at(&self) -> Option<&str> {
        self.taken_at.as_deref()
    }

    fn supersedes(&self) -> Option<&str> {
        self.supersedes.as_deref()
    }

    fn superseding(self, id: String) -> Self {
        Self { supersedes: Some(id), ..self }
    }

    /// The signal must rise with the mass, and a curve must fit.
    fn check(&self) -> Result<(), String> {
        let curve = self.check_rise().and_then(|()| self.curve());
        curve.map(|_| ()).map_err(|err| err.to_string())
    }
}

/// Reads a file of the library, or a bare document without checksum.
pub fn read_calibration(path: &Path) -> Result<Calibration, LibraryError> {
    document_store::read_document(path)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document_store::{age_days, save_document, supersede_document};
    use chrono::{TimeZone, Utc};
    use palpate_model::units::Volts;
    use std::fs;

    fn taken(name: &str, day: &str) -> Calibration {
        Calibration {
            name: name.into(),
            rig: "bench".into(),
            taken_at: Some(format!("{day}T10:00:00+08:00")),
            ..Calibration::thesis()
        }
    }

    #[test]
    fn stored_calibration_reads_back_and_is_never_overwritten() {
        let home = tempfile::tempdir().unwrap();
        let first = taken("Cell 4711 (new)", "2026-03-05");
        let stored = save_document(home.path(), &first).unwrap();
        assert!(stored.id.starts_with("20260305-cell-4711-new-"), "{}", stored.id);
        assert_eq!(read_calibration(&stored.path).unwrap(), first);
        let duplicate = save_document(home.path(), &first).unwrap_err();
        assert!(duplicate.to_string().contains(&stored.id), "{duplicate}");
        let names: Vec<_> = fs::read_dir(home.path().join("calibrations")).unwrap().collect();
        assert_eq!(names.len(), 1, "no temporary file is left");
        let mut broken = first.clone();
        broken.steps.truncate(1);
        assert!(save_document(home.path(), &broken).is_err());
        broken = first.clone();
        broken.curve = palpate_model::calibration::CurveKind::Polynomial { degree: 1 };
        broken.steps[1].volts = Volts(1.2);
        for refusal in [
            save_document(home.path(), &broken),
            supersede_document(home.path(), &stored.id, &broken),
        ] {
            let refusal = refusal.unwrap_err().to_string();
            assert!(refusal.contains("140 g"), "{refusal}");
        }
        broken = Calibration { taken_at: Some("yesterday".into()), ..first };
        let refusal = save_document(home.path(), &broken).unwrap_err();
        assert!(refusal.to_string().contains("not an RFC 3339 time"), "{refusal}");
    }

    #[test]
    fn a_changed_file_is_refused() {
        let home = tempfile::tempdir().unwrap();
        let stored = save_document(home.path(), &taken("c", "2026-03-05")).unwrap();
        let text = fs::read_to_string(&stored.path).unwrap();
        fs::write(&stored.path, text.replace("1.73", "1.74")).unwrap();
        let refusal = read_calibration(&stored.path).unwrap_err();
        assert!(refusal.to_string().contains("was changed after"), "{refusal}");
        let shelf = CalibrationStore::open(home.path());
        assert!(shelf.documents.is_empty() && shelf.unreadable.len() == 1);
        // A bare document carries no checksum and is taken as it is.
        let bare = home.path().join("bare.json");
        fs::write(&bare, serde_json::to_string(&Calibration::thesis()).unwrap()).unwrap();
        assert_eq!(read_calibration(&bare).unwrap(), Calibration::thesis());
        fs::write(&bare, "{\"checksum\": 1}").unwrap();
        assert!(matches!(read_calibration(&bare), Err(LibraryError::NotOne { .. })));
    }

    #[test]
    fn latest_calibration_that_is_not_superseded_is_in_force() {
        let home = tempfile::tempdir().unwrap();
        let old = save_document(home.path(), &taken("a", "2026-03-05")).unwrap();
        let later = save_document(home.path(), &taken("b", "2026-06-05")).unwrap();
        let mut other = taken("c", "2026-09-05");
        other.rig = "elsewhere".into();
        save_document(home.path(), &other).unwrap();
        let shelf = CalibrationStore::open(home.path());
        assert_eq!(shelf.in_force("bench"), Some(&later));
        assert_eq!(shelf.in_force("nowhere"), None);
        // Superseding the later one by a document of an earlier date: that date counts.
        let mut correction = taken("b", "2026-06-05");
        correction.steps[3].volts = Volts(1.785);
        let new = supersede_document(home.path(), "b", &correction).unwrap();
        assert_eq!(new.document.supersedes.as_ref(), Some(&later.id));
        let shelf = CalibrationStore::open(home.path());
        assert_eq!(shelf.in_force("bench"), Some(&new));
        assert_eq!(shelf.find("b").unwrap(), &new);
        assert_eq!(shelf.find(&later.id).unwrap(), &later);
        assert_eq!(shelf.successor(&old.id), None);
        let twice = supersede_document(home.path(), &later.id, &correction).unwrap_err();
        assert!(twice.to_string().contains(&new.id), "{twice}");
        assert!(matches!(shelf.find("z"), Err(LibraryError::Unknown { .. })));
        save_document(home.path(), &taken("a", "2026-03-06")).unwrap();
        let shelf = CalibrationStore::open(home.path());
        assert!(matches!(shelf.find("a"), Err(LibraryError::Ambiguous { .. })));
    }

    #[test]
    fn age_is_in_whole_days() {
        let now = Utc.with_ymd_and_hms(2026, 3, 15, 3, 0, 0).unwrap();
        // 10:00 at +08:00 is 02:00 UTC.
        assert_eq!(age_days(&taken("a", "2026-03-05"), now), Some(10));
        assert_eq!(age_days(&Calibration::thesis(), now), None);
    }
}
