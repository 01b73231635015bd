//! A new member of a population of the library, as tissue to simulate: `population:NAME/ENTRY=VALUE#NUMBER`.

use palpate_drivers::sim::{Random, RandomStream};
use palpate_model::viscoelastic::{BodyError, ModifiedKelvin};
use palpate_population::MemberDistribution;
use palpate_sessions::LibraryError;
use palpate_sessions::folder::{FolderError, library_folder};
use palpate_sessions::populations::{
    PopulationDocument, PopulationEffect, PopulationParameter, PopulationStore,
};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use thiserror::Error;

const PREFIX: &str = "population:";
/// Families whose members are modified Kelvin models, with the number of their elastic coefficients.
const FAMILIES: [(&str, usize); 3] = [("series-1", 1), ("series-2", 2), ("series-3", 3)];

#[derive(Debug, Error)]
pub enum MemberError {
    #[error(
        "'{text}' is no specimen of a population; write population:NAME#NUMBER with a whole number from 0 to 4294967295, or population:NAME/ENTRY=VALUE#NUMBER for a value of an effect"
    )]
    Form { text: String },
    #[error(transparent)]
    Folder(#[from] FolderError),
    #[error(transparent)]
    Library(#[from] LibraryError),
    #[error(
        "population '{name}' is of the family {family}, which cannot be simulated; estimate one of the family series-1, series-2 or series-3"
    )]
    Family { name: String, family: String },
    #[error(
        "population '{name}' has no value of {parameter}, so it cannot be simulated; estimate and save it again"
    )]
    Lacking { name: String, parameter: &'static str },
    #[error("population '{name}' has no effect of {entry}; {known}")]
    Entry { name: String, entry: String, known: String },
    #[error("{entry} is given twice; give it once")]
    Twice { entry: String },
    #[error("population '{name}' has no {entry} '{value}'; give {known}")]
    Value { name: String, entry: String, value: String, known: String },
    #[error(transparent)]
    Body(#[from] BodyError),
}

/// A specimen that a population could have.
#[derive(Clone, Debug, PartialEq)]
pub struct PopulationMember {
    pub body: ModifiedKelvin,
    /// Greatest depth of the sessions that the population is of, in mm.
    pub depth_max_mm: f64,
}

/// Whether a text means a member of a population.
#[must_use]
pub fn is_member(text: &str) -> bool {
    text.starts_with(PREFIX)
}

/// Draws the member that a text means from the library of this computer.
pub fn library_member(text: &str) -> Result<PopulationMember, MemberError> {
    draw_member(&library_folder()?, text)
}

/// Draws the member that a text means, the same whenever text and saved population are: its random numbers are those of
/// [`RandomStream::Member`] under the seed `checksum * 2^32 + number`, with the checksum of the population's file.
pub fn draw_member(library: &Path, text: &str) -> Result<PopulationMember, MemberError> {
    let form = || MemberError::Form { text: text.to_owned() };
    let (described, number) =
        text.strip_prefix(PREFIX).and_then(|rest| rest.rsplit_once('#')).ok_or_else(form)?;
    let number: u32 = number.parse().map_err(|_| form())?;
    let mut values = described.split('/');
    let name = values.next().unwrap_or_default();
    let values = values.map(|one| one.split_once('=').ok_or_else(form));
    let values = values.collect::<Result<Vec<_>, _>>()?;
    let store = PopulationStore::open(library);
    let stored = store.find(name)?;
    let checksum = stored.checksum().and_then(|text| u32::from_str_radix(&text, 16).ok());
    let seed = u64::from(checksum.ok_or_else(form)?) << 32 | u64::from(number);
    let mut random = Random::new(seed, RandomStream::Member);
    let population = &stored.document;
    let drawn = distribution(population, &values)?.draw(|| random.normal());
    Ok(PopulationMember { body: body(population, &drawn)?, depth_max_mm: population.depth_max_mm })
}

fn distribution(
    population: &PopulationDocument,
    values: &[(&str, &str)],
) -> Result<MemberDistribution, MemberError> {
    let columns = columns(population, values)?;
    let parameters = &population.parameters;
    let mean = |one: &PopulationParameter| {
        let effects = one.effects.iter().zip(&columns);
        one.median.ln() + effects.map(|(effect, column)| effect * column).sum::<f64>()
    };
    let level = |k: usize| parameters.iter().map(|one| one.standard_deviations[k]).collect();
    Ok(MemberDistribution {
        means: parameters.iter().map(mean).collect(),
        standard_deviations: (0..population.levels.len()).map(level).collect(),
    })
}

/// What each effect of the population multiplies, where entries have these values; of an entry without one the reference, or the
/// mean of a number.
fn columns(
    population: &PopulationDocument,
    values: &[(&str, &str)],
) -> Result<Vec<f64>, MemberError> {
    let mut columns = vec![0.0; population.effects.len()];
    let mut seen = BTreeSet::new();
    for &(entry, value) in values {
        if !seen.insert(entry) {
            return Err(MemberError::Twice { entry: entry.to_owned() });
        }
        let name = population.name.clone();
        let effects = population.effects.iter().zip(&mut columns);
        let own: Vec<_> = effects.filter(|(effect, _)| effect.entry() == entry).collect();
        if own.is_empty() {
            let known = known_entries(population);
            return Err(MemberError::Entry { name, entry: entry.to_owned(), known });
        }
        if own.iter().all(|(effect, _)| multiplier(effect, value).is_none()) {
            let known: BTreeSet<&str> =
                own.iter().flat_map(|(effect, _)| choices(effect)).collect();
            let known = known.into_iter().collect::<Vec<_>>().join(" or ");
            let (entry, value) = (entry.to_owned(), value.to_owned());
            return Err(MemberError::Value { name, entry, value, known });
        }
        for (effect, column) in own {
            *column = multiplier(effect, value).unwrap_or(0.0);
        }
    }
    Ok(columns)
}

/// What an effect multiplies where its entry has this value; none where the value is not of this effect.
fn multiplier(effect: &PopulationEffect, given: &str) -> Option<f64> {
    match effect {
        PopulationEffect::Value { value, .. } if value == given => Some(1.0),
        PopulationEffect::Value { reference, .. } => (reference == given).then_some(0.0),
        PopulationEffect::Number { mean, .. } => {
            let number = given.parse::<f64>().ok().filter(|number| number.is_finite());
            number.map(|number| number - mean)
        }
    }
}

fn choices(effect: &PopulationEffect) -> Vec<&str> {
    match effect {
        PopulationEffect::Value { value, reference, .. } => vec![value, reference],
        PopulationEffect::Number { .. } => vec!["a number"],
    }
}

fn known_entries(population: &PopulationDocument) -> String {
    let entries: BTreeSet<&str> = population.effects.iter().map(PopulationEffect::entry).collect();
    match entries.is_empty() {
        true => "it has no effects, so leave it out".to_owned(),
        false => format!("give {}", entries.into_iter().collect::<Vec<_>>().join(" or ")),
    }
}

/// Of the values drawn for the population's parameters and its constants.
fn body(population: &PopulationDocument, drawn: &[f64]) -> Result<ModifiedKelvin, MemberError> {
    let PopulationDocument { name, family, .. } = population;
    let Some((_, order)) = FAMILIES.into_iter().find(|(key, _)| key == family) else {
        return Err(MemberError::Family { name: name.clone(), family: family.clone() });
    };
    let drawn =
        population.parameters.iter().map(|one| one.name.as_str()).zip(drawn.iter().copied());
    let constants = population.constants.iter().map(|one| (one.name.as_str(), one.value));
    let values: BTreeMap<&str, f64> = drawn.chain(constants).collect();
    let value = |parameter: &'static str| {
        let value = values.get(parameter).copied();
        value.ok_or_else(|| MemberError::Lacking { name: name.clone(), parameter })
    };
    let mut mu = [0.0; 3];
    for (mu, parameter) in mu.iter_mut().zip(["mu1", "mu2", "mu3"]).take(order) {
        *mu = value(parameter)?;
    }
    let body = ModifiedKelvin { tau_eps: value("tau_eps")?, mu, tau_sig: value("tau_sig")? };
    Ok(body.checked()?)
}
