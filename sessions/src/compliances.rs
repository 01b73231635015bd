//! The machine compliances of a library, in `compliances/`.

use crate::document_store::{self, Document};
use palpate_model::rig::RigCompliance;

pub type StoredCompliance = document_store::StoredDocument<RigCompliance>;

pub type ComplianceStore = document_store::DocumentStore<RigCompliance>;

impl Document for RigCompliance {
    const KIND: &'static str = "compliance";
    const FOLDER: &'static str = "compliances";
    const RENEW: &'static str = "measure and save it again";

    /// A rig has one compliance in force, so the rig's name identifies it.
    fn name(&self) -> &str {
        &self.rig
    }

    fn rig(&self) -> &str {
        &self.rig
    }

    fn taken_at(&self) -> Option<&str> {
        Some(&self.taken_at)
    }

    fn supersedes(&self) -> Option<&str> {
        self.supersedes.as_deref()
    }

    fn superseding(self, id: String) -> Self {
        Self { supersedes: Some(id), ..self }
    }

    fn check(&self) -> Result<(), String> {
        Self::check(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document_store::{LibraryError, read_document, save_document, supersede_document};

    fn taken(day: &str, mm_per_n: f64) -> RigCompliance {
        RigCompliance {
            format: 1,
            rig: "bench".into(),
            taken_at: format!("{day}T10:00:00Z"),
            mm_per_n,
            std_error_mm_per_n: 1e-4,
            ..RigCompliance::default()
        }
    }

    #[test]
    fn compliance_is_stored_superseded_and_not_read_as_calibration() {
        let home = tempfile::tempdir().unwrap();
        let first = save_document(home.path(), &taken("2026-03-05", 0.06)).unwrap();
        assert!(first.id.starts_with("20260305-bench-"), "{}", first.id);
        let second =
            supersede_document(home.path(), &first.id, &taken("2026-03-01", 0.05)).unwrap();
        let shelf = ComplianceStore::open(home.path());
        assert_eq!(shelf.in_force("bench"), Some(&second));
        let wrong =
            read_document::<palpate_model::calibration::Calibration>(&first.path).unwrap_err();
        assert!(matches!(wrong, LibraryError::NotOne { .. }), "{wrong}");
        assert!(crate::CalibrationStore::open(home.path()).documents.is_empty());
        let nothing = save_document(home.path(), &taken("2026-03-05", 0.0)).unwrap_err();
        assert!(matches!(nothing, LibraryError::Unsound { .. }), "{nothing}");
    }
}
