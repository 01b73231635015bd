//! Results of lakes and studies in the tables of a shared library, with what they were computed from and how.

use crate::fit::lake_model;
use crate::population::{Population, PopulationRequest};
use crate::progress::Progress;
use crate::report::text::counted;
use crate::shared_library::{SharedLibraryError, now};
use palpate_model::estimate::FittedParameter;
use palpate_population::{Evidence, StudySession};
use palpate_sessions::text::{sha256, sha256_of_file};
pub use palpate_store::ResultsOutcome;
use palpate_store::{ResultNumber, ResultTable, Store, StoreUrl, StudyResult};
use palpate_tables::lake::{
    LakeError, LakeResult, LakeSession, StoredResult, list_sessions, read_checksums, read_result,
    result_path,
};
use serde::Deserialize;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// Results of sessions of a lake.
#[derive(Clone, Copy, Debug)]
pub struct LakeResults<'a> {
    pub lake: &'a Path,
    pub result: LakeResult,
    /// Key of the model or of the law, as [`LakeTally::model`](crate::fit::LakeTally::model).
    pub model: &'a str,
    /// Sessions that were fitted, now or before with the same settings.
    pub fitted: &'a BTreeSet<String>,
}

impl LakeResults<'_> {
    fn read(&self, session: &LakeSession) -> Result<Option<StudyResult>, LakeError> {
        let Self { lake, result, model, .. } = *self;
        let Some(stored) = read_result(lake, result, model, &session.id)? else { return Ok(None) };
        let StoredResult { text, settings, result: found } = stored;
        let numbers = match result {
            LakeResult::Fit => fit_numbers(&found),
            LakeResult::Modulus => modulus_numbers(&found),
        };
        let numbers = numbers.map_err(|err| LakeError::BadFit {
            path: result_path(lake, result, model, &session.id),
            reason: err.to_string(),
        })?;
        let software_version = settings["software_version"].as_str().unwrap_or_default().to_owned();
        Ok(Some(StudyResult {
            session_id: Some(session.id.clone()),
            model: model.to_owned(),
            software_version,
            settings,
            data: read_checksums(lake, session)?,
            text,
            numbers,
        }))
    }
}

fn store(address: &str) -> Result<Store, SharedLibraryError> {
    Ok(Store::create(&StoreUrl::parse(address)?)?)
}

/// Adds what a lake stores of some sessions to the tables of a store. Once `is_ending` is set nothing more is added; asked again it
/// goes on.
pub fn add_lake_results(
    address: &str,
    results: &LakeResults<'_>,
    is_ending: &AtomicBool,
    progress: &dyn Progress,
) -> Result<ResultsOutcome, SharedLibraryError> {
    let sessions = list_sessions(results.lake)?;
    let sessions = sessions.iter().filter(|one| results.fitted.contains(&one.id));
    let found: Result<Vec<Option<StudyResult>>, LakeError> =
        sessions.map(|one| results.read(one)).collect();
    let found: Vec<StudyResult> = found?.into_iter().flatten().collect();
    let table = match results.result {
        LakeResult::Fit => ResultTable::Fits,
        LakeResult::Modulus => ResultTable::Moduli,
    };
    let mut hear = |done, of| match is_ending.load(Ordering::Relaxed) {
        true => ControlFlow::Break(()),
        false => progress.report(done, of, "adding results"),
    };
    Ok(store(address)?.add_results(table, &found, now, &mut hear)?)
}

/// Adds a population to the tables of a store.
pub fn add_population(
    address: &str,
    request: &PopulationRequest<'_>,
    found: &Population,
) -> Result<ResultsOutcome, SharedLibraryError> {
    let result = population_result(request, found)?;
    let mut hear = |_, _| ControlFlow::Continue(());
    Ok(store(address)?.add_results(ResultTable::Populations, &[result], now, &mut hear)?)
}

fn fit_numbers(fit: &Value) -> serde_json::Result<Vec<ResultNumber>> {
    let parameters = Vec::<FittedParameter>::deserialize(&fit["parameters"])?;
    let number = |one: FittedParameter| ResultNumber {
        term: "value".into(),
        parameter: one.name,
        unit: one.unit,
        value: one.value,
        std_error: one.std_error,
        ci95: ends(one.ci95),
        systematic_error: one.systematic_error,
        total95: ends(one.total95),
        is_fixed: one.is_fixed,
    };
    Ok(parameters.into_iter().map(number).collect())
}

fn ends(interval: Option<[f64; 2]>) -> [Option<f64>; 2] {
    interval.map_or([None; 2], |ends| ends.map(Some))
}

fn modulus_numbers(modulus: &Value) -> serde_json::Result<Vec<ResultNumber>> {
    #[derive(Deserialize)]
    struct Modulus {
        modulus_mpa: f64,
        standard_uncertainty_mpa: f64,
        total95_mpa: [f64; 2],
    }
    let found = Modulus::deserialize(modulus)?;
    Ok(vec![ResultNumber {
        term: "value".into(),
        parameter: "modulus".into(),
        unit: "MPa".into(),
        value: found.modulus_mpa,
        std_error: Some(found.standard_uncertainty_mpa),
        total95: ends(Some(found.total95_mpa)),
        ..ResultNumber::default()
    }])
}

/// Logarithms as the model has them, with their errors; medians, and factors of the effects; deviations of the logarithms.
fn population_numbers(found: &Population) -> Vec<ResultNumber> {
    let logarithm = |parameter: &str| format!("log {parameter}");
    let effects = found.report.effects.iter().flat_map(|one| {
        let factor = match one.is_mean() {
            true => "median".to_owned(),
            false => format!("factor of {}", one.effect),
        };
        [
            ResultNumber {
                term: one.effect.clone(),
                parameter: logarithm(&one.parameter),
                value: one.value,
                std_error: Some(one.std_error),
                ci95: ends(Some(one.interval)),
                ..ResultNumber::default()
            },
            ResultNumber {
                term: factor,
                parameter: one.parameter.clone(),
                unit: one.unit.clone().unwrap_or_default(),
                value: one.factor,
                ci95: ends(Some(one.factor_interval)),
                ..ResultNumber::default()
            },
        ]
    });
    let deviations = found.report.standard_deviations.iter().map(|one| ResultNumber {
        term: format!("standard deviation between {}s", one.estimate.level),
        parameter: logarithm(&one.estimate.parameter),
        value: one.estimate.value,
        ci95: one.estimate.interval,
        ..ResultNumber::default()
    });
    effects.chain(deviations).collect()
}

fn population_result(
    request: &PopulationRequest<'_>,
    found: &Population,
) -> Result<StudyResult, SharedLibraryError> {
    let compliance = request.recipe.corrections.file()?;
    let hash = |path: &Path| {
        sha256_of_file(path).map_err(|source| LakeError::Io { path: path.into(), source })
    };
    let software_version = env!("CARGO_PKG_VERSION");
    // As of the fits.
    let model = lake_model(&request.recipe.options);
    let settings = json!({
        "software_version": software_version, "model": model, "method": request.method.key(),
        "parameters": request.parameters, "levels": request.levels, "effects": request.effects,
        "influence": request.is_influence_wanted, "wanted_percent": request.wanted_percent,
        "compliance_sha256": compliance.map(hash).transpose()?,
    });
    let evidence = |one: &StudySession| match &one.evidence {
        Evidence::Exact => Vec::new(),
        Evidence::Information(information) => information.iter().copied().collect(),
    };
    // The folder's path is of this computer alone.
    let name = |one: &StudySession| {
        Path::new(&one.name).file_name().map(|name| name.to_string_lossy().into_owned())
    };
    let sessions: Vec<Value> = found.study.sessions.iter().map(|one| {
        json!({ "session": name(one), "groups": one.groups, "design": one.design, "logarithms": one.values,
            "information": evidence(one) })
    }).collect();
    let data = json!({ "sessions_sha256": sha256(json!(sessions).to_string().as_bytes()) });
    let text = json!({ "settings": settings, "sessions": sessions, "population": found.report });
    Ok(StudyResult {
        session_id: None,
        model,
        software_version: software_version.into(),
        settings,
        data,
        text: text.to_string() + "\n",
        numbers: population_numbers(found),
    })
}

/// What was added, in words.
#[must_use]
pub fn results_words(outcome: &ResultsOutcome) -> String {
    let ResultsOutcome { added, known } = outcome;
    match known {
        0 => format!("{} added to the store", counted(*added, "result")),
        known => {
            format!("{} added to the store, which had {known}", counted(*added, "result"))
        }
    }
}
