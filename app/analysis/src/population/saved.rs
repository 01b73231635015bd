//! A population in the library.

use super::curves::Curve;
use super::design::{Design, MEAN};
use super::{Population, PopulationReport};
use crate::study_table::StudyTable;
use palpate_model::estimate::FittedParameter;
use palpate_rheology::fit::FitSolution;
use palpate_runner::wall_now;
use palpate_sessions::journal::format_time;
use palpate_sessions::populations::{
    POPULATION_FORMAT, PopulationConstant, PopulationDocument, PopulationEffect,
    PopulationParameter, PopulationStore, StoredPopulation, check_population_name,
};
use palpate_sessions::{LibraryError, save_document};
use std::path::Path;
use thiserror::Error;

/// What a population was found from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PopulationOrigin {
    pub sessions: Vec<String>,
    /// What moves the medians.
    pub effects: Vec<PopulationEffect>,
    /// Parameters of the specimen that are not of the population.
    pub constants: Vec<PopulationConstant>,
    /// Greatest depth of the sessions in mm.
    pub depth_max_mm: f64,
}

impl PopulationOrigin {
    /// `known` are the parameters of a specimen, `names` those of them that are of the population.
    pub(super) fn of(
        design: &Design,
        table: &StudyTable,
        (known, names): (&[FittedParameter], &[String]),
        curves: &[&Curve],
        fits: &[FitSolution<'_>],
    ) -> Self {
        let values: Vec<Vec<f64>> = fits.iter().map(|fit| fit.values()).collect();
        let others = known.iter().enumerate().filter(|(_, one)| !names.contains(&one.name));
        let constants = others.map(|(k, one)| PopulationConstant {
            name: one.name.clone(),
            unit: one.unit.clone(),
            value: median(values.iter().map(|all| all[k]).collect()),
        });
        Self {
            sessions: table.rows.iter().map(|row| row.session_id.clone()).collect(),
            effects: design.described(),
            constants: constants.collect(),
            depth_max_mm: curves.iter().map(|one| one.depth_max_mm()).fold(0.0, f64::max),
        }
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let middle = |index: usize| values.get(index).copied().unwrap_or(f64::NAN);
    0.5 * (middle(values.len().saturating_sub(1) / 2) + middle(values.len() / 2))
}

#[derive(Debug, Error)]
pub enum SavePopulationError {
    #[error("{0}")]
    Name(String),
    #[error("the library already has a population '{name}' ({id}); choose another name")]
    Taken { name: String, id: String },
    #[error(
        "stored fits have neither depths nor the other parameters of a specimen; find the population without --stored to save it"
    )]
    Stored,
    #[error(transparent)]
    Library(#[from] LibraryError),
}

/// Refuses before a population is estimated a name that it could not be saved under.
pub fn check_new_name(library: &Path, name: &str) -> Result<(), SavePopulationError> {
    check_population_name(name).map_err(SavePopulationError::Name)?;
    let store = PopulationStore::open(library);
    match store.documents.iter().find(|one| one.document.name == name || one.id == name) {
        Some(one) => Err(SavePopulationError::Taken { name: name.to_owned(), id: one.id.clone() }),
        None => Ok(()),
    }
}

pub fn save_population(
    library: &Path,
    name: &str,
    found: &Population,
) -> Result<StoredPopulation, SavePopulationError> {
    check_new_name(library, name)?;
    let origin = found.origin.as_ref().ok_or(SavePopulationError::Stored)?;
    Ok(save_document(library, &document(name, &found.report, origin))?)
}

fn document(
    name: &str,
    report: &PopulationReport,
    origin: &PopulationOrigin,
) -> PopulationDocument {
    let means = report.effects.iter().filter(|row| row.effect == MEAN);
    let parameters = means.map(|mean| {
        let effects = report.effects.iter();
        let effects = effects.filter(|row| row.effect != MEAN && row.parameter == mean.parameter);
        let deviations = report.standard_deviations.iter().map(|row| &row.estimate);
        let deviations = deviations.filter(|one| one.parameter == mean.parameter);
        PopulationParameter {
            name: mean.parameter.clone(),
            unit: mean.unit.clone().unwrap_or_default(),
            median: mean.factor,
            effects: effects.map(|row| row.value).collect(),
            standard_deviations: deviations.map(|one| one.value).collect(),
        }
    });
    PopulationDocument {
        format: POPULATION_FORMAT,
        name: name.to_owned(),
        estimated_at: format_time(wall_now()),
        software_version: env!("CARGO_PKG_VERSION").to_owned(),
        family: report.model.clone(),
        method: report.method.key().to_owned(),
        levels: report.levels.iter().map(|one| one.level.clone()).collect(),
        effects: origin.effects.clone(),
        parameters: parameters.collect(),
        constants: origin.constants.clone(),
        depth_max_mm: origin.depth_max_mm,
        sessions: origin.sessions.clone(),
        supersedes: None,
    }
}
