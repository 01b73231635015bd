//! The population of a study, with the report of `palpate population --json`, and agreement with that of `palpate agreement`.

use crate::error::refused;
use crate::fit::corrections;
use palpate_analysis::population::{
    AgreementRequest, PopulationMethod, PopulationRequest, agreements, population, study_recipe,
    write_results,
};
use palpate_analysis::progress::NoProgress;
use pyo3::prelude::*;
use serde::Serialize;
use std::path::PathBuf;

/// What a population is asked for.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct PopulationOptions {
    family: Option<String>,
    parameters: Vec<String>,
    levels: Vec<String>,
    effects: Vec<String>,
    two_stage: bool,
    stored: bool,
    influence: bool,
    wanted: Option<f64>,
    compliance: Option<String>,
    out: Option<PathBuf>,
    jobs: usize,
}

fn answer(report: &impl Serialize, text: String) -> PyResult<(String, String)> {
    Ok((serde_json::to_string(report).map_err(refused)?, text))
}

/// The report in JSON and in words.
#[pyfunction]
pub fn find_population(
    py: Python<'_>,
    sources: Vec<PathBuf>,
    options: PopulationOptions,
) -> PyResult<(String, String)> {
    if let Some(folder) = options.out.as_ref().filter(|folder| folder.exists()) {
        let folder = folder.display();
        return Err(refused(format!("{folder} exists already; give out another name")));
    }
    if let Some(wanted) = options.wanted.filter(|wanted| !(*wanted > 0.0 && wanted.is_finite())) {
        return Err(refused(format!("wanted cannot be {wanted}; give a percentage above 0")));
    }
    let corrections = corrections(options.compliance.as_deref())?;
    let recipe = study_recipe(options.family, corrections).map_err(refused)?;
    let request = PopulationRequest {
        paths: &sources,
        recipe: &recipe,
        parameters: &options.parameters,
        levels: &options.levels,
        effects: &options.effects,
        method: match (options.stored, options.two_stage) {
            (true, _) => PopulationMethod::Stored,
            (false, true) => PopulationMethod::TwoStage,
            (false, false) => PopulationMethod::Curves,
        },
        is_drawn: options.out.is_some(),
        is_influence_wanted: options.influence,
        wanted_percent: options.wanted,
        jobs: options.jobs,
    };
    let found = py.detach(|| population(&request, &NoProgress)).map_err(refused)?;
    if let Some(folder) = &options.out {
        write_results(&found, folder).map_err(|err| {
            let folder = folder.display();
            refused(format!("the results cannot be written into {folder} ({err}); choose a folder that you may write to"))
        })?;
    }
    answer(&found.report, found.report.text())
}

/// What is compared.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct AgreementOptions {
    between: String,
    family: Option<String>,
    parameters: Vec<String>,
    compliance: Option<String>,
    jobs: usize,
}

/// The report in JSON and in words.
#[pyfunction]
pub fn find_agreement(
    py: Python<'_>,
    sources: Vec<PathBuf>,
    options: AgreementOptions,
) -> PyResult<(String, String)> {
    let corrections = corrections(options.compliance.as_deref())?;
    let recipe = study_recipe(options.family, corrections).map_err(refused)?;
    let request = AgreementRequest {
        paths: &sources,
        recipe: &recipe,
        parameters: &options.parameters,
        between: &options.between,
        jobs: options.jobs,
    };
    let found = py.detach(|| agreements(&request, &NoProgress)).map_err(refused)?;
    answer(&found, found.text())
}
