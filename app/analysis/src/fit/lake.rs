//! Fits of the sessions of a lake, or of one part of them, stored in the lake.

use super::{FitRecipe, SourceFit, SourceFitError};
use crate::compliance::ComplianceCorrection;
use crate::exports::sweep_lake;
use crate::material::MaterialError;
use crate::pool::{WorkEvent, WorkFailure, in_order};
use crate::recordings::recovered_originals_note;
use crate::source;
use palpate_rheology::fit::{FitOptions, FitReport, LogarithmStatistics, SystematicUncertainty};
use palpate_sessions::recover::recovered_id;
use palpate_tables::export::ExportError;
use palpate_tables::lake::{
    FitFile, FitState, LakeError, LakeResult, LakeSession, Shard, find_fit, list_sessions,
    read_session, store_fit,
};
use serde::Serialize;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::io;
use std::path::Path;
use std::sync::atomic::AtomicBool;
use thiserror::Error;

/// The folder of fits of the body that is fitted where no family is named.
const MODEL: &str = "modified-kelvin";
/// Version of the stored form, a setting of each fit: the second has the statistics of the parameters' logarithms.
pub(super) const FIT_VERSION: u32 = 2;

#[derive(Debug)]
pub struct LakeFitRequest<'a> {
    pub lake: &'a Path,
    pub shard: Shard,
    pub recipe: &'a FitRecipe,
    /// Parameters held, as name=value.
    pub fixed: &'a [String],
    /// Parameters found that are held by default.
    pub free: &'a [String],
    /// SHA-256 of the compliance's file, if depths are corrected.
    pub compliance_sha256: Option<String>,
    /// Number of concurrent fits.
    pub jobs: usize,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LakeFitOutcome {
    Fitted,
    AlreadyFitted,
    Rejected,
}

#[derive(Debug, Error)]
pub enum LakeFitError {
    #[error(transparent)]
    Lake(#[from] LakeError),
    #[error(transparent)]
    Keep(#[from] ExportError),
    #[error(transparent)]
    NotFitted(#[from] SourceFitError),
    #[error(transparent)]
    NoModulus(#[from] MaterialError),
    #[error("no thread can be started ({0}); try again")]
    Threads(io::Error),
}

impl From<source::SourceError> for LakeFitError {
    fn from(err: source::SourceError) -> Self {
        Self::NotFitted(err.into())
    }
}

/// An event in the fitting of a lake.
#[derive(Debug)]
pub enum LakeFitEvent<'a> {
    Note(String),
    /// Number of sessions done, and of all.
    Done(usize, usize),
    /// Outcome of a session, in the sessions' order.
    Next(&'a str, Result<LakeFitOutcome, LakeFitError>),
}

/// Counts of outcomes.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct LakeTally {
    pub model: String,
    pub sessions: usize,
    pub made: usize,
    pub were_there: usize,
    pub rejected: usize,
}

/// The stored form of a fit: nothing in it depends on the time or place of the fit.
#[derive(Serialize)]
struct StoredFit<'a> {
    #[serde(flatten)]
    report: &'a FitReport,
    #[serde(skip_serializing_if = "Option::is_none")]
    systematic: Option<&'a SystematicUncertainty>,
    #[serde(skip_serializing_if = "Option::is_none")]
    compliance: Option<&'a ComplianceCorrection>,
    logarithms: &'a LogarithmStatistics,
    notes: &'a [String],
}

/// The key of a family's fits in a lake. Named or not, the modified Kelvin body is one, whose fits are in one folder.
pub(crate) fn lake_model(options: &FitOptions) -> String {
    match options.family().key() {
        key if key == "series-3" => MODEL.to_owned(),
        key => key,
    }
}

/// Fits the sessions. Once `is_ending` is set no fit is begun; asked again it goes on.
pub fn fit_lake(
    request: &LakeFitRequest<'_>,
    is_ending: &AtomicBool,
    hear: impl FnMut(LakeFitEvent<'_>),
) -> Result<LakeTally, LakeFitError> {
    let model = lake_model(&request.recipe.options);
    let settings = request.settings(&model);
    let LakeFitRequest { lake, shard, jobs, .. } = *request;
    let part = LakePart { lake, shard, jobs, model: &model };
    part.fit_each(is_ending, |one| request.fit_one(one, &model, &settings), hear)
}

/// Sessions of a lake to be fitted with a model or a law.
pub(crate) struct LakePart<'a> {
    pub lake: &'a Path,
    pub shard: Shard,
    pub jobs: usize,
    /// Its key.
    pub model: &'a str,
}

impl LakePart<'_> {
    pub fn fit_each(
        &self,
        is_ending: &AtomicBool,
        fit_one: impl Fn(&LakeSession) -> Result<LakeFitOutcome, LakeFitError> + Sync,
        mut hear: impl FnMut(LakeFitEvent<'_>),
    ) -> Result<LakeTally, LakeFitError> {
        let mut found = list_sessions(self.lake)?;
        sweep_lake(self.lake);
        // Before the shards are made, so that all leave out the same.
        let ids: BTreeSet<String> = found.iter().map(|one| one.id.clone()).collect();
        let is_copied = |one: &LakeSession| ids.contains(&recovered_id(&one.id));
        let copied = found.iter().filter(|one| is_copied(one));
        if let Some(note) = recovered_originals_note(copied.map(|one| one.id.clone())) {
            hear(LakeFitEvent::Note(note));
        }
        found.retain(|one| !is_copied(one) && self.shard.has(&one.id));
        let model = self.model.to_owned();
        let mut tally = LakeTally { model, sessions: found.len(), ..LakeTally::default() };
        let mut ids = found.iter().map(|one| one.id.as_str());
        in_order(self.jobs, &found, is_ending, fit_one, |news| match news {
            WorkEvent::Done(count) => hear(LakeFitEvent::Done(count, found.len())),
            WorkEvent::Next(answer) => {
                let came = answer.unwrap_or_else(|failure: WorkFailure| {
                    Err(SourceFitError::from(failure).into())
                });
                match &came {
                    Ok(LakeFitOutcome::Fitted) => tally.made += 1,
                    Ok(LakeFitOutcome::AlreadyFitted) => tally.were_there += 1,
                    Ok(LakeFitOutcome::Rejected) => tally.rejected += 1,
                    Err(_) => {}
                }
                hear(LakeFitEvent::Next(ids.next().unwrap_or_default(), came));
            }
        })
        .map_err(LakeFitError::Threads)?;
        Ok(tally)
    }
}

impl LakeFitRequest<'_> {
    fn fit_one(
        &self,
        one: &LakeSession,
        model: &str,
        settings: &Value,
    ) -> Result<LakeFitOutcome, LakeFitError> {
        let result = LakeResult::Fit;
        let file = FitFile { lake: self.lake, result, model, session_id: &one.id, settings };
        if find_fit(&file)? == FitState::There {
            return Ok(LakeFitOutcome::AlreadyFitted);
        }
        let (session, rejection) = read_session(self.lake, one)?;
        let wanted = self.recipe.selection;
        if rejection.is_some() && !wanted.is_rejected_included {
            return Ok(LakeFitOutcome::Rejected);
        }
        let source = source::of_session(session, wanted.stretch, &[])?;
        let fitted: SourceFit = self.recipe.fit_read(source)?;
        let report = fitted.result.map_err(SourceFitError::Fit)?;
        let stored = StoredFit {
            report: &report,
            systematic: fitted.systematic.as_ref(),
            compliance: fitted.compliance.as_ref(),
            logarithms: &fitted.logarithms,
            notes: &fitted.notes,
        };
        store_fit(&file, &stored)?;
        Ok(LakeFitOutcome::Fitted)
    }

    /// Everything that determines a fit apart from its session.
    fn settings(&self, model: &str) -> Value {
        let sorted = |words: &[String]| {
            let mut words: Vec<&str> = words.iter().map(|word| word.trim()).collect();
            words.sort_unstable();
            json!(words)
        };
        let mut settings = json!({
            "software_version": env!("CARGO_PKG_VERSION"), "fit_version": FIT_VERSION, "model": model,
            "fixed": sorted(self.fixed), "free": sorted(self.free),
            "systematic": self.recipe.is_systematic,
            "compliance_sha256": self.compliance_sha256,
        });
        if self.recipe.selection.stretch == source::RecordStretch::WithUnload {
            settings["unload"] = json!(true);
        }
        settings
    }
}
