//! Moduli of the sessions of a lake, or of one part of them, stored in the lake.

use crate::fit::{LakeFitError, LakeFitEvent, LakeFitOutcome, LakePart, LakeTally};
use crate::material::{ErrorSource, MaterialReport, MaterialRequest, material_of};
use crate::source::{self, RecordStretch};
use palpate_tables::lake::{
    FitFile, FitState, LakeResult, LakeSession, Shard, find_fit, read_session, store_fit,
};
use serde::Serialize;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

/// A request whose source is the lake.
#[derive(Debug)]
pub struct LakeMaterialRequest<'a> {
    pub press: &'a MaterialRequest,
    pub shard: Shard,
    /// SHA-256 of the compliance's file, if depths are corrected.
    pub compliance_sha256: Option<String>,
    /// Number of concurrent fits.
    pub jobs: usize,
}

/// The stored form of a modulus: nothing in it depends on the time or place of the fit.
#[derive(Serialize)]
struct StoredModulus {
    #[serde(flatten)]
    report: MaterialReport,
    notes: Vec<String>,
}

/// Fits the law to the sessions. Once `is_ending` is set no fit is begun; asked again it goes on.
pub fn material_lake(
    request: &LakeMaterialRequest<'_>,
    is_ending: &AtomicBool,
    hear: impl FnMut(LakeFitEvent<'_>),
) -> Result<LakeTally, LakeFitError> {
    let law = json!(request.press.law);
    let law = law.as_str().unwrap_or_default();
    let settings = request.settings();
    let lake = request.press.source.as_path();
    let part = LakePart { lake, shard: request.shard, jobs: request.jobs, model: law };
    part.fit_each(is_ending, |one| request.fit_one(one, law, &settings), hear)
}

impl LakeMaterialRequest<'_> {
    fn fit_one(
        &self,
        one: &LakeSession,
        law: &str,
        settings: &Value,
    ) -> Result<LakeFitOutcome, LakeFitError> {
        let lake = self.press.source.as_path();
        let result = LakeResult::Modulus;
        let file = FitFile { lake, result, model: law, session_id: &one.id, settings };
        if find_fit(&file)? == FitState::There {
            return Ok(LakeFitOutcome::AlreadyFitted);
        }
        let (session, rejection) = read_session(lake, one)?;
        if rejection.is_some() && !self.press.is_rejected_included {
            return Ok(LakeFitOutcome::Rejected);
        }
        let source = source::of_session(session, RecordStretch::default(), &[])?;
        let mut report = material_of(source, self.press)?;
        report.press.source = PathBuf::from(&one.id);
        let notes = std::mem::take(&mut report.press.notes);
        store_fit(&file, &StoredModulus { report, notes })?;
        Ok(LakeFitOutcome::Fitted)
    }

    /// Everything that determines a modulus apart from its session.
    fn settings(&self) -> Value {
        let press = self.press;
        json!({
            "software_version": env!("CARGO_PKG_VERSION"), "law": press.law, "indenter": press.indenter,
            "thickness_mm": press.thickness_mm, "base": press.base,
            "poisson_ratio": press.poisson_ratio, "poisson_basis": press.poisson_basis,
            "depth_max_mm": press.depth_max_mm, "contact": error_setting(press.contact),
            "force_zero": error_setting(press.force_zero),
            "compliance_sha256": self.compliance_sha256,
        })
    }
}

/// The contact as settings have it: a word, or a standard uncertainty in mm.
pub(crate) fn error_setting(contact: ErrorSource) -> Value {
    match contact {
        ErrorSource::Recorded => json!("recorded"),
        ErrorSource::Stated(error_mm) => json!(error_mm),
        ErrorSource::Free => json!("free"),
    }
}
