//! A further fit of a session, and its stored form.

use super::step;
use crate::fit::{IntervalRequest, JointFitRequest, SourceFit, fit_together};
use crate::progress::Progress;
use crate::recordings::{Recording, Recordings, check_once};
use crate::report::dossier::{SessionReading, folder_name};
use crate::report::fit_json::{FitDetails, FitObject, FitOverlay};
use crate::report::stored_analysis;
use crate::source::{self, FitSource, RecordStretch};
use palpate_rheology::fit::{FitOptions, FittedParameter};
use serde::Serialize;
use serde_json::{Value, json};
use std::path::Path;

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SessionFitRequest {
    /// Key of a model family; `None` is the modified Kelvin model.
    pub family: Option<String>,
    /// Fit the unloading too, where the family describes it.
    pub with_unload: bool,
    pub is_rejected_included: bool,
    pub with_profile: bool,
    /// Analysis through which the session is read.
    pub based_on: Option<String>,
    /// Sessions fitted together with it, with one body for all.
    pub together_with: Vec<SessionReading>,
}

/// The stored request of a fit, so that it can be repeated.
#[derive(Clone, Debug, Default, Serialize)]
pub struct FitSettings {
    /// Key of a model family; `None` is the modified Kelvin model.
    pub family: Option<String>,
    pub unload: bool,
    /// Parameters held, as name=value.
    pub fixed: Vec<String>,
    /// Parameters found that are held by default.
    pub free: Vec<String>,
    /// Whether the systematic uncertainty was estimated.
    pub systematic: bool,
    /// Whether intervals from the profile likelihood were found.
    pub profile: bool,
    /// Number of bootstrap fits.
    pub bootstrap: Option<usize>,
    pub seed: Option<u64>,
    /// Identifier of the compliance that was subtracted from the depths.
    pub compliance: Option<String>,
    pub include_rejected: bool,
}

impl SessionFitRequest {
    fn options(&self) -> Result<FitOptions, String> {
        match &self.family {
            Some(key) => FitOptions::by_key(key).map_err(|err| err.to_string()),
            None => Ok(FitOptions::default()),
        }
    }

    /// Settings that are stored with the fit.
    pub(super) fn settings(&self) -> Value {
        let settings = FitSettings {
            family: self.family.clone(),
            unload: self.with_unload,
            systematic: true,
            profile: self.with_profile,
            include_rejected: self.is_rejected_included,
            ..FitSettings::default()
        };
        let mut settings = json!(settings);
        if let (false, Ok(options)) = (self.together_with.is_empty(), self.options()) {
            let others = self.together_with.iter();
            let others: Vec<Value> = others
                .map(
                    |one| json!({ "session": folder_name(&one.session), "analysis": one.analysis }),
                )
                .collect();
            settings["share"] = json!(options.body_names());
            settings["together_with"] = json!(others);
        }
        settings
    }

    fn read(&self, session: &Path, based_on: Option<&str>) -> Result<FitSource, String> {
        let wanted = source::SourceSelection {
            stretch: RecordStretch::with_unload(self.with_unload),
            is_rejected_included: self.is_rejected_included,
        };
        let source = source::read_analysed(session, None, wanted, based_on);
        source.map_err(|err| format!("{}: {err}", folder_name(session)))
    }

    /// Fits a session; what `palpate fit --json` prints.
    pub(super) fn results(&self, session: &Path, progress: &dyn Progress) -> Result<Value, String> {
        let session = session.to_path_buf();
        let others = self.together_with.iter().map(|one| &one.session);
        check_once(others.chain([&session])).map_err(|err| err.to_string())?;
        step(progress, 0, 4, "reading the session")?;
        let source = self.read(&session, self.based_on.as_deref())?;
        step(progress, 1, 4, "fitting")?;
        let options = self.options()?;
        if self.together_with.is_empty() {
            return self.exact(source, &options, progress);
        }
        let mut all = vec![Recording::of(folder_name(&session), source, None)];
        for one in &self.together_with {
            let name = folder_name(&one.session);
            step(progress, 1, 4, &format!("reading {name}"))?;
            let source = self.read(&one.session, one.analysis.as_deref())?;
            all.push(Recording::of(name, source, None));
        }
        let mut records = Recordings { all, notes: Vec::new() };
        self.joint(&mut records, &options, progress)
    }

    fn intervals(&self) -> IntervalRequest {
        IntervalRequest { with_profile: self.with_profile, bootstrap: None }
    }

    fn exact(
        &self,
        source: FitSource,
        options: &FitOptions,
        progress: &dyn Progress,
    ) -> Result<Value, String> {
        let fitted = SourceFit::with_systematic(source, None, options);
        let report = fitted.result.as_ref().map_err(ToString::to_string)?;
        if self.with_profile {
            step(progress, 3, 4, "profile likelihood")?;
        }
        let intervals = fitted.intervals(options, self.intervals(), |_| ());
        let intervals = intervals.map_err(|err| err.to_string())?;
        step(progress, 4, 4, "storing the analysis")?;
        let overlay = FitOverlay::of(report, &fitted.samples);
        let details = fitted.details(&overlay, &intervals);
        let object = FitObject::of(options.family(), report, details, fitted.seconds);
        serde_json::to_value(&object).map_err(|err| err.to_string())
    }

    /// The first of several recordings, fitted with the others as one body.
    fn joint(
        &self,
        records: &mut Recordings,
        options: &FitOptions,
        progress: &dyn Progress,
    ) -> Result<Value, String> {
        step(progress, 2, 4, "fitting all together")?;
        let request = JointFitRequest {
            options,
            shared: options.body_names(),
            is_systematic: true,
            intervals: self.intervals(),
        };
        let mut fitted =
            fit_together(records, &request, |_, _| ()).map_err(|err| err.to_string())?;
        if let Some(reason) = fitted.notes.pop() {
            return Err(reason);
        }
        step(progress, 4, 4, "storing the analysis")?;
        let details = FitDetails {
            systematic: fitted.systematic.as_ref().and_then(|found| found.first()),
            ..fitted.details(records).remove(0)
        };
        let report = &fitted.report.records[0].report;
        let object = FitObject::of(options.family(), report, details, fitted.seconds);
        let mut results = serde_json::to_value(&object).map_err(|err| err.to_string())?;
        results["shared"] = json!(fitted.report.shared);
        Ok(results)
    }
}

/// The session's own fit, as its edits leave it, to be compared with: parameters and sentences.
pub fn fit_without_analysis(
    session: &Path,
    is_rejected_included: bool,
    progress: &dyn Progress,
) -> Result<(Vec<FittedParameter>, Vec<String>), String> {
    let wanted = SessionFitRequest { is_rejected_included, ..SessionFitRequest::default() };
    let results = wanted.results(session, progress)?;
    Ok((stored_analysis::parameters(&results), stored_analysis::sentences(&results)))
}
