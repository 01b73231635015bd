//! A session fitted once more, and what of it is kept.

use super::super::fit::{Fitted, no_systematic};
use super::super::task::Progress;
use super::step;
use crate::report::dossier::{Wanted, name_of};
use crate::report::family::FittedRecord;
use crate::report::family_json::{FamilyOutput, fitted, forces};
use crate::report::kept;
use palpate_model::families::by_key;
use palpate_model::fit::{
    FamilyOptions, FitOptions, FitSample, Fitted as ExactFitted, Parameter, fit_family, fit_joint,
    systematic_family, systematic_joint,
};
use palpate_protocols::analysis::{self, FitSource, Stretch};
use palpate_protocols::origin::Origin;
use palpate_protocols::runner::Stopwatch;
use serde_json::{Value, json};
use std::path::Path;

/// The model that has no key: the modified Kelvin body.
pub const OWN_MODEL: &str = "modified Kelvin";

/// How a session is fitted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FitWanted {
    /// Key of a family; none for the modified Kelvin body.
    pub family: Option<String>,
    /// The way back too, where the family knows it.
    pub with_unload: bool,
    /// Intervals from the profile likelihood as well, for the modified Kelvin body.
    pub with_profile: bool,
    /// The analysis that the session is read by.
    pub based_on: Option<String>,
    /// Sessions fitted together with it, one body for all, for the modified Kelvin body.
    pub together_with: Vec<Wanted>,
}

/// The parameters of the tissue: what sessions fitted together have in common.
const BODY: [&str; 5] = ["tau_eps", "mu1", "mu2", "mu3", "tau_sig"];

impl FitWanted {
    /// What is kept of the question, in the words of `palpate fit`.
    pub(super) fn settings(&self) -> Value {
        match &self.family {
            Some(key) => json!({
                "family": key, "unload": self.with_unload, "systematic": true,
                "include_rejected": true,
            }),
            None => {
                let mut settings = json!({
                    "fixed": [], "free": [], "systematic": true, "profile": self.with_profile,
                    "bootstrap": null, "seed": null, "compliance": null, "include_rejected": true,
                });
                if !self.together_with.is_empty() {
                    let others = self.together_with.iter();
                    let others: Vec<Value> = others
                        .map(|one| json!({ "session": name_of(&one.session), "analysis": one.analysis }))
                        .collect();
                    settings["share"] = json!(BODY);
                    settings["together_with"] = json!(others);
                }
                settings
            }
        }
    }

    fn read(&self, session: &Path, based_on: Option<&str>) -> Result<FitSource, String> {
        let wanted = analysis::Wanted {
            stretch: match self.with_unload {
                true => Stretch::WithUnload,
                false => Stretch::RampHold,
            },
            // Whoever works on a session knows what it is worth.
            is_rejected_included: true,
        };
        let source = analysis::read_analysed(session, None, wanted, based_on);
        source.map_err(|err| format!("{}: {err}", name_of(session)))
    }

    /// Fits a session; what `palpate fit --json` prints.
    pub(super) fn results(&self, session: &Path, progress: &Progress) -> Result<Value, String> {
        step(progress, 0, 4, "reading the session")?;
        let source = self.read(session, self.based_on.as_deref())?;
        step(progress, 1, 4, "fitting")?;
        match &self.family {
            Some(key) => family(key, source, progress),
            None if !self.together_with.is_empty() => {
                let mut sources = vec![(name_of(session), source)];
                for one in &self.together_with {
                    let name = name_of(&one.session);
                    step(progress, 1, 4, &format!("reading {name}"))?;
                    let source = self.read(&one.session, one.analysis.as_deref())?;
                    sources.push((name, source));
                }
                joint(&sources, progress)
            }
            None => exact(source, self.with_profile, progress),
        }
    }
}

fn exact(source: FitSource, with_profile: bool, progress: &Progress) -> Result<Value, String> {
    let options = FitOptions::default();
    let fitted = Fitted::of(source, &options);
    step(progress, 2, 4, "moving the calibration by its errors")?;
    let fitted = fitted.with_systematic(&options);
    let report = fitted.result.as_ref().map_err(ToString::to_string)?;
    let mut results = serde_json::to_value(report).map_err(|err| err.to_string())?;
    if with_profile {
        step(progress, 3, 4, "profile likelihood")?;
        let exact = ExactFitted::of(&fitted.samples, &options).map_err(|err| err.to_string())?;
        let profile = exact.profile(0).map_err(|err| err.to_string())?;
        results["profile"] = json!(profile);
    }
    if let Some(systematic) = &fitted.systematic {
        results["systematic"] = json!(systematic);
    }
    results["seconds"] = json!(fitted.seconds);
    step(progress, 4, 4, "keeping it")?;
    Ok(results)
}

/// The first of several sources, fitted with the others as one body.
fn joint(sources: &[(String, FitSource)], progress: &Progress) -> Result<Value, String> {
    let options = FitOptions::default();
    let records: Vec<(&str, &[FitSample])> = sources
        .iter()
        .map(|(name, source)| (name.as_str(), source.samples.as_slice()))
        .collect();
    step(progress, 2, 4, "fitting all together")?;
    let watch = Stopwatch::start();
    let report = fit_joint(&records, &options, &BODY).map_err(|err| err.to_string())?;
    let seconds = watch.seconds();
    step(progress, 3, 4, "moving the calibrations by their errors")?;
    let origins: Result<Vec<Origin>, _> = sources
        .iter()
        .map(|(_, source)| Origin::of(source.calibration.as_ref(), None))
        .collect();
    let origins = origins.map_err(|err| err.to_string())?;
    let traced: Vec<_> = records
        .iter()
        .zip(&origins)
        .map(|((name, samples), origin)| origin.traced(name, samples))
        .collect();
    let is_known = origins.iter().any(Origin::is_known);
    let found = is_known.then(|| systematic_joint(&traced, &options, &BODY));
    let found = found.transpose().map_err(|err| err.to_string())?;
    let report = match &found {
        Some(found) => report.with_systematic(found),
        None => report,
    };
    let own = report.records.first().map(|one| &one.report);
    let mut results = serde_json::to_value(own).map_err(|err| err.to_string())?;
    if let Some(own) = found.as_ref().and_then(|found| found.first()) {
        results["systematic"] = json!(own);
    }
    results["shared"] = json!(report.shared);
    results["seconds"] = json!(seconds);
    step(progress, 4, 4, "keeping it")?;
    Ok(results)
}

fn family(key: &str, source: FitSource, progress: &Progress) -> Result<Value, String> {
    let family = by_key(key).map_err(|err| err.to_string())?;
    let records: [(&str, &[FitSample]); 1] = [("session", &source.samples)];
    let options = FamilyOptions::default();
    let watch = Stopwatch::start();
    let fit = fit_family(&*family, &records, options).map_err(|err| err.to_string())?;
    let seconds = watch.seconds();
    step(progress, 2, 4, "moving the calibration by its errors")?;
    let origin = Origin::of(source.calibration.as_ref(), None).map_err(|err| err.to_string());
    let found = origin.and_then(|origin| {
        let traced = origin.traced("session", &source.samples);
        let found = origin
            .is_known()
            .then(|| systematic_family(&fit, &*family, &[traced], options));
        found.transpose().map_err(|err| err.to_string())
    });
    let mut fit = fit;
    let systematic = match found {
        Ok(found) => found,
        Err(reason) => {
            fit.warnings.push(no_systematic(&reason));
            None
        }
    };
    if let Some(systematic) = &systematic {
        fit = fit.with_systematic(systematic);
    }
    let modelled = forces(&fit, &records).map_err(|err| err.to_string())?;
    let own: Vec<FittedRecord<'_>> = fit
        .records
        .iter()
        .zip(&modelled)
        .map(|(one, forces)| fitted(&source.samples, forces, one.r2(&source.samples)))
        .collect();
    let output = FamilyOutput::of(&*family, &fit, &own, &[None], systematic.as_ref(), seconds);
    step(progress, 4, 4, "keeping it")?;
    serde_json::to_value(&output).map_err(|err| err.to_string())
}

/// The session's own fit, as its edits leave it, to be compared with: parameters and sentences.
pub fn own(session: &Path, progress: &Progress) -> Result<(Vec<Parameter>, Vec<String>), String> {
    let wanted = FitWanted {
        family: None,
        with_unload: false,
        with_profile: false,
        based_on: None,
        together_with: Vec::new(),
    };
    let results = wanted.results(session, progress)?;
    Ok((kept::parameters(&results), kept::sentences(&results)))
}
