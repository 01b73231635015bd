//! A session fitted once more, and what of it is kept.

use super::super::fit::Intervals;
use super::step;
use crate::fit::Fitted;
use crate::origin::Origin;
use crate::progress::Progress;
use crate::report::dossier::{Wanted, name_of};
use crate::report::fit_json::{Beside, FitObject, Overlay};
use crate::report::kept;
use crate::source::{self, FitSource, Stretch};
use palpate_rheology::fit::{self, FitOptions, FitReport, FitSample, Parameter, systematic_joint};
use palpate_runner::Stopwatch;
use serde_json::{Value, json};
use std::path::Path;

/// How a session is fitted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FitWanted {
    /// Key of a family; none for the modified Kelvin body.
    pub family: Option<String>,
    /// The way back too, where the family knows it.
    pub with_unload: bool,
    /// Intervals from the profile likelihood as well.
    pub with_profile: bool,
    /// The analysis that the session is read by.
    pub based_on: Option<String>,
    /// Sessions fitted together with it, one body for all.
    pub together_with: Vec<Wanted>,
}

impl FitWanted {
    /// The family, all its parameters free.
    fn options(&self) -> Result<FitOptions, String> {
        match &self.family {
            Some(key) => FitOptions::by_key(key).map_err(|err| err.to_string()),
            None => Ok(FitOptions::default()),
        }
    }

    /// What is kept of the question, in the words of `palpate fit`.
    pub(super) fn settings(&self) -> Value {
        let mut settings = json!({
            "fixed": [], "free": [], "systematic": true, "profile": self.with_profile,
            "bootstrap": null, "seed": null, "compliance": null, "include_rejected": true,
        });
        if let Some(key) = &self.family {
            settings["family"] = json!(key);
            settings["unload"] = json!(self.with_unload);
        }
        if let (false, Ok(options)) = (self.together_with.is_empty(), self.options()) {
            let others = self.together_with.iter();
            let others: Vec<Value> = others
                .map(|one| json!({ "session": name_of(&one.session), "analysis": one.analysis }))
                .collect();
            settings["share"] = json!(options.body_names());
            settings["together_with"] = json!(others);
        }
        settings
    }

    fn read(&self, session: &Path, based_on: Option<&str>) -> Result<FitSource, String> {
        let wanted = source::Wanted {
            stretch: match self.with_unload {
                true => Stretch::WithUnload,
                false => Stretch::RampHold,
            },
            // Whoever works on a session knows what it is worth.
            is_rejected_included: true,
        };
        let source = source::read_analysed(session, None, wanted, based_on);
        source.map_err(|err| format!("{}: {err}", name_of(session)))
    }

    /// Fits a session; what `palpate fit --json` prints.
    pub(super) fn results(&self, session: &Path, progress: &Progress) -> Result<Value, String> {
        step(progress, 0, 4, "reading the session")?;
        let source = self.read(session, self.based_on.as_deref())?;
        step(progress, 1, 4, "fitting")?;
        let options = self.options()?;
        if self.together_with.is_empty() {
            return self.exact(source, &options, progress);
        }
        let mut sources = vec![(name_of(session), source)];
        for one in &self.together_with {
            let name = name_of(&one.session);
            step(progress, 1, 4, &format!("reading {name}"))?;
            let source = self.read(&one.session, one.analysis.as_deref())?;
            sources.push((name, source));
        }
        self.joint(&sources, &options, progress)
    }

    fn exact(
        &self,
        source: FitSource,
        options: &FitOptions,
        progress: &Progress,
    ) -> Result<Value, String> {
        let fitted = Fitted::of(source, options);
        step(progress, 2, 4, "moving the calibration by its errors")?;
        let fitted = fitted.with_systematic(options);
        let report = fitted.result.as_ref().map_err(ToString::to_string)?;
        let mut intervals = Intervals::default();
        if self.with_profile {
            step(progress, 3, 4, "profile likelihood")?;
            let exact = fit::Fitted::of(&fitted.samples, options);
            intervals = exact
                .and_then(|exact| Intervals::of(&exact, 0, true, None, |_| ()))
                .map_err(|err| err.to_string())?;
        }
        step(progress, 4, 4, "keeping it")?;
        let systematic = fitted.systematic.as_ref();
        let told = Told {
            report,
            samples: &fitted.samples,
            intervals: &intervals,
            seconds: fitted.seconds,
        };
        told.object(options, systematic)
    }

    /// The first of several sources, fitted with the others as one body.
    fn joint(
        &self,
        sources: &[(String, FitSource)],
        options: &FitOptions,
        progress: &Progress,
    ) -> Result<Value, String> {
        let records: Vec<(&str, &[FitSample])> = sources
            .iter()
            .map(|(name, source)| (name.as_str(), source.samples.as_slice()))
            .collect();
        step(progress, 2, 4, "fitting all together")?;
        let body = options.body_names();
        let watch = Stopwatch::start();
        let fitted = fit::Fitted::joint(&records, options, &body).map_err(|err| err.to_string())?;
        let mut report = fitted.joint_report();
        let seconds = watch.seconds();
        let intervals = Intervals::of(&fitted, 0, self.with_profile, None, |_| ());
        let intervals = intervals.map_err(|err| err.to_string())?;
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
        let found = is_known.then(|| systematic_joint(&traced, options, &body));
        let found = found.transpose().map_err(|err| err.to_string())?;
        if let Some(found) = &found {
            report = report.with_systematic(found);
        }
        step(progress, 4, 4, "keeping it")?;
        let first = report.records.first().ok_or("there is no record")?;
        let told = Told {
            report: &first.report,
            samples: records[0].1,
            intervals: &intervals,
            seconds,
        };
        let systematic = found.as_ref().and_then(|found| found.first());
        let mut results = told.object(options, systematic)?;
        results["shared"] = json!(report.shared);
        Ok(results)
    }
}

/// A fit of one record, to be told.
struct Told<'a> {
    report: &'a FitReport,
    samples: &'a [FitSample],
    intervals: &'a Intervals,
    seconds: f64,
}

impl Told<'_> {
    fn object(
        &self,
        options: &FitOptions,
        systematic: Option<&fit::Systematic>,
    ) -> Result<Value, String> {
        let overlay = Overlay::of(self.report, self.samples);
        let beside = Beside {
            overlay: &overlay,
            intervals: self.intervals,
            systematic,
            compliance: None,
        };
        let object = FitObject::of(options.family(), self.report, beside, self.seconds);
        serde_json::to_value(&object).map_err(|err| err.to_string())
    }
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
