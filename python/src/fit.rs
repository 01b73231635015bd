//! Fits of arrays and of sessions, with the report of `palpate fit --json`.

use crate::error::refused;
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use palpate_analysis::compliance::ComplianceCorrections;
use palpate_analysis::edits::author;
use palpate_analysis::fit::{
    BOOTSTRAP_REPEATS_MIN, FitChoice, FitRecipe, IntervalRequest, JointFitRequest, SourceFit,
    fit_together,
};
use palpate_analysis::recordings::{Recording, Recordings};
use palpate_analysis::report::fit_json::{FitObject, FitOverlay};
use palpate_analysis::session_actions::{Attribution, FitSettings, FitToStore, store_fit};
use palpate_analysis::source::{FitSource, RecordStretch, SourceSelection};
use palpate_model::units::{Depth, Newtons, Seconds};
use palpate_rheology::fit::{Bootstrap, FitOptions, FitSample};
use palpate_sessions::library_folder;
use pyo3::prelude::*;
use serde_json::Value;
use std::path::{Path, PathBuf};

/// What every fit can be asked for.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct FitRequest {
    family: Option<String>,
    fixed: Vec<(String, f64)>,
    free: Vec<String>,
    profile: bool,
    bootstrap: Option<usize>,
    seed: u64,
}

impl FitRequest {
    fn options(&self) -> PyResult<FitOptions> {
        let choice = FitChoice {
            family: self.family.clone(),
            fixed: self.fixed.clone(),
            free: self.free.clone(),
        };
        choice.options().map_err(refused)
    }

    fn intervals(&self) -> PyResult<IntervalRequest> {
        if let Some(repeats) = self.bootstrap
            && repeats < BOOTSTRAP_REPEATS_MIN
        {
            return Err(refused(format!(
                "a bootstrap of {repeats} repeats is too few for a 95 % interval; give at least {BOOTSTRAP_REPEATS_MIN} repeats"
            )));
        }
        let bootstrap = self.bootstrap.map(|repeats| Bootstrap { seed: self.seed, repeats });
        Ok(IntervalRequest { with_profile: self.profile, bootstrap })
    }
}

/// A record that was fitted: times in s, forces in N as measured (NaN where one does not count) and as the model has them.
struct FittedCurve {
    t: Vec<f64>,
    measured: Vec<f64>,
    modelled: Vec<f64>,
}

impl FittedCurve {
    fn of(samples: &[FitSample], offset: Seconds, overlay: &FitOverlay) -> Self {
        let measured = |one: &FitSample| if one.is_measured() { one.force.0 } else { f64::NAN };
        Self {
            t: samples.iter().map(|one| offset.0 + one.t.0).collect(),
            measured: samples.iter().map(measured).collect(),
            modelled: overlay.forces.iter().map(|force| force.0).collect(),
        }
    }
}

/// The report in JSON, the curves of its records, and remarks.
struct FitAnswer {
    report: String,
    curves: Vec<FittedCurve>,
    notes: Vec<String>,
}

type Array<'py> = Bound<'py, PyArray1<f64>>;
type FitTuple<'py> = (String, Vec<(Array<'py>, Array<'py>, Array<'py>)>, Vec<String>);

impl FitAnswer {
    fn into_tuple(self, py: Python<'_>) -> FitTuple<'_> {
        let array = |numbers: Vec<f64>| numbers.into_pyarray(py);
        let curves = self.curves.into_iter();
        let curves =
            curves.map(|one| (array(one.t), array(one.measured), array(one.modelled))).collect();
        (self.report, curves, self.notes)
    }
}

/// The answer of one record; its report as a value goes to `keep`.
fn one_answer(
    fitted: SourceFit,
    options: &FitOptions,
    wanted: IntervalRequest,
    keep: impl FnOnce(Value) -> PyResult<()>,
) -> PyResult<FitAnswer> {
    let report = fitted.result.as_ref().map_err(refused)?;
    let overlay = FitOverlay::of(report, &fitted.samples);
    let intervals = fitted.intervals(options, wanted, |_| ()).map_err(refused)?;
    let details = fitted.details(&overlay, &intervals);
    let object = FitObject::of(options.family(), report, details, fitted.seconds);
    keep(serde_json::to_value(&object).map_err(refused)?)?;
    let text = serde_json::to_string(&object).map_err(refused)?;
    let curve = FittedCurve::of(&fitted.samples, fitted.offset, &overlay);
    Ok(FitAnswer { report: text, curves: vec![curve], notes: fitted.notes })
}

/// Several records as one fit.
fn joint_answer(
    records: Vec<Vec<FitSample>>,
    options: &FitOptions,
    shared: &[String],
    intervals: IntervalRequest,
) -> PyResult<FitAnswer> {
    let records = (1..).zip(records).map(|(number, samples)| {
        let source = FitSource { samples, ..FitSource::default() };
        Recording::of(format!("record {number}"), source, None)
    });
    let mut records = Recordings { all: records.collect(), notes: Vec::new() };
    let shared = shared.iter().map(String::as_str).collect();
    let request = JointFitRequest { options, shared, is_systematic: true, intervals };
    let fitted = fit_together(&mut records, &request, |_, _| ()).map_err(refused)?;
    let details = fitted.details(&records);
    let report = serde_json::to_string(&fitted.object(options, &details)).map_err(refused)?;
    let pairs = records.all.iter().zip(&fitted.overlays);
    let curves = pairs.map(|(one, overlay)| FittedCurve::of(&one.samples, Seconds(0.0), overlay));
    Ok(FitAnswer { report, curves: curves.collect(), notes: fitted.notes })
}

type Numbers<'py> = PyReadonlyArray1<'py, f64>;

/// Samples of arrays of one length; without uncertainties every sample has the same weight, as in a table.
fn samples(
    (t, depth, force, sigma): &(Numbers<'_>, Numbers<'_>, Numbers<'_>, Option<Numbers<'_>>),
) -> PyResult<Vec<FitSample>> {
    let (t, depth, force) = (t.as_slice()?, depth.as_slice()?, force.as_slice()?);
    let sigma = sigma.as_ref().map(|sigma| sigma.as_slice()).transpose()?;
    let lengths = [depth.len(), force.len(), sigma.map_or(t.len(), <[f64]>::len)];
    if lengths.iter().any(|length| *length != t.len()) {
        let [depth, force, sigma] = lengths;
        return Err(refused(format!(
            "t has {} samples, depth {depth}, force {force} and sigma {sigma}; give arrays of one length",
            t.len()
        )));
    }
    let sample = |index: usize| FitSample {
        t: Seconds(t[index]),
        depth: Depth(depth[index]),
        force: Newtons(force[index]),
        sigma: Newtons(sigma.map_or(1.0, |sigma| sigma[index])),
    };
    Ok((0..t.len()).map(sample).collect())
}

/// Fits arrays of times in s, depths in mm and forces in N; several records together.
#[pyfunction]
pub fn fit_arrays<'py>(
    py: Python<'py>,
    records: Vec<(Numbers<'py>, Numbers<'py>, Numbers<'py>, Option<Numbers<'py>>)>,
    shared: Vec<String>,
    request: FitRequest,
) -> PyResult<FitTuple<'py>> {
    let (options, intervals) = (request.options()?, request.intervals()?);
    let mut records = records.iter().map(samples).collect::<PyResult<Vec<_>>>()?;
    let answer = py.detach(|| match (records.pop(), records.is_empty()) {
        (None, _) => Err(refused("there is no record to fit; give arrays of t, depth and force")),
        (Some(only), true) => {
            let recipe = FitRecipe::new(options, SourceSelection::default());
            let source = FitSource { samples: only, ..FitSource::default() };
            let fitted = recipe.fit_read(source).map_err(refused)?;
            one_answer(fitted, &recipe.options, intervals, |_| Ok(()))
        }
        (Some(last), false) => {
            records.push(last);
            joint_answer(records, &options, &shared, intervals)
        }
    });
    Ok(answer?.into_tuple(py))
}

/// What a fit of a session can be asked for.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct SessionFitOptions {
    analysis: Option<String>,
    unload: bool,
    systematic: bool,
    include_rejected: bool,
    compliance: Option<String>,
    save: Option<String>,
    by: Option<String>,
    reason: String,
}

/// The machine compliance of this name, as the command line takes it; none without a name.
pub fn corrections(name: Option<&str>) -> PyResult<ComplianceCorrections> {
    let library = library_folder();
    match name {
        None => Ok(ComplianceCorrections::none(library.ok().as_deref())),
        Some(name) => {
            let library = library.map_err(refused)?;
            ComplianceCorrections::named(name, Some(&library)).map_err(refused)
        }
    }
}

impl SessionFitOptions {
    fn recipe(&self, options: FitOptions) -> PyResult<FitRecipe> {
        let corrections = corrections(self.compliance.as_deref())?;
        let selection = SourceSelection {
            stretch: RecordStretch::with_unload(self.unload),
            is_rejected_included: self.include_rejected,
        };
        Ok(FitRecipe {
            is_systematic: self.systematic,
            analysis: self.analysis.clone(),
            corrections,
            ..FitRecipe::new(options, selection)
        })
    }

    /// Saves a report as an analysis of the session, if it has a name.
    fn save(&self, session: &Path, request: &FitRequest, results: Value) -> PyResult<()> {
        let Some(name) = &self.save else { return Ok(()) };
        let settings = FitSettings {
            family: request.family.clone(),
            unload: self.unload,
            fixed: request.fixed.iter().map(|(name, value)| format!("{name}={value}")).collect(),
            free: request.free.clone(),
            systematic: self.systematic,
            profile: request.profile,
            bootstrap: request.bootstrap,
            seed: request.bootstrap.map(|_| request.seed),
            compliance: self.compliance.clone(),
            include_rejected: self.include_rejected,
        };
        let fit = FitToStore {
            based_on: self.analysis.as_deref(),
            together_with: &[],
            settings: serde_json::to_value(settings).map_err(refused)?,
            results,
        };
        let who = Attribution { by: author(self.by.as_deref()), reason: self.reason.clone() };
        store_fit(session, name, fit, &who).map(|_| ()).map_err(refused)
    }
}

/// Fits a session as `palpate fit SESSION` does.
#[pyfunction]
pub fn fit_session(
    py: Python<'_>,
    path: PathBuf,
    request: FitRequest,
    session: SessionFitOptions,
) -> PyResult<FitTuple<'_>> {
    if session.unload && request.family.is_none() {
        return Err(refused(
            "the default model has no unloading; give a family that has, such as unloading-3",
        ));
    }
    let (recipe, intervals) = (session.recipe(request.options()?)?, request.intervals()?);
    let answer = py.detach(|| {
        let fitted = recipe.fit(&path).map_err(refused)?;
        one_answer(fitted, &recipe.options, intervals, |report| {
            session.save(&path, &request, report)
        })
    });
    Ok(answer?.into_tuple(py))
}
