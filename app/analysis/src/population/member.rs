//! A new member of a population of the library, as tissue to simulate: `population:NAME/ENTRY=VALUE#NUMBER`.

use palpate_drivers::sim::{Random, RandomStream};
use palpate_model::viscoelastic::{BodyError, ModifiedKelvin};
use palpate_population::MemberDistribution;
use palpate_sessions::LibraryError;
use palpate_sessions::folder::{FolderError, library_folder};
use palpate_sessions::populations::{
    MEMBER_PREFIX, PopulationDocument, PopulationEffect, PopulationParameter, PopulationStore,
};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use thiserror::Error;

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

/// Draws the member that a text means from the library of this computer.
pub fn library_member(text: &str) -> Result<PopulationMember, MemberError> {
    draw_member(&library_folder()?, text)
}

/// Draws the member that a text means, the same whenever text and saved population are: its random numbers are those of
/// [`RandomStream::Member`] under the seed `checksum * 2^32 + number`, with the checksum of the population's file.
pub fn draw_member(library: &Path, text: &str) -> Result<PopulationMember, MemberError> {
    let form = || MemberError::Form { text: text.to_owned() };
    let (described, number) =
        text.strip_prefix(MEMBER_PREFIX).and_then(|rest| rest.rsplit_once('#')).ok_or_else(form)?;
    let number: u32 = number.parse().map_err(|_| form())?;
    let (name, values) = described.split_once('/').unwrap_or((described, ""));
    let mut pairs: Vec<String> = Vec::new();
    for part in values.split('/').filter(|_| !values.is_empty()) {
        match pairs.last_mut() {
            // A value may have a slash, as in 5 mg/kg.
            Some(before) if !part.contains('=') => *before += &format!("/{part}"),
            _ => pairs.push(part.to_owned()),
        }
    }
    let values = pairs.iter().map(|one| one.split_once('=').ok_or_else(form));
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

/// What each effect of the population multiplies, where entries have these values; an entry without one has the reference, or
/// the mean of a number.
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

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_sessions::populations::{POPULATION_FORMAT, PopulationConstant};
    use palpate_sessions::save_document;
    use tempfile::TempDir;

    const MEMBERS: u32 = 2000;

    fn parameter(name: &str, median: f64, deviations: [f64; 2]) -> PopulationParameter {
        PopulationParameter {
            name: name.into(),
            unit: "unit".into(),
            median,
            effects: vec![0.4, -0.7, 0.02],
            standard_deviations: deviations.to_vec(),
        }
    }

    fn population() -> PopulationDocument {
        let treated = |value: &str| PopulationEffect::Value {
            entry: "animal.treatment".into(),
            value: value.into(),
            reference: "control".into(),
        };
        PopulationDocument {
            format: POPULATION_FORMAT,
            name: "liver".into(),
            estimated_at: "2026-03-05T10:00:00Z".into(),
            software_version: "0".into(),
            family: "series-2".into(),
            method: "curves".into(),
            levels: vec!["animal".into(), "session".into()],
            effects: vec![
                treated("enzyme"),
                treated("heat"),
                PopulationEffect::Number { entry: "animal.age_days".into(), mean: 100.0 },
            ],
            parameters: vec![
                parameter("tau_eps", 1.2, [0.1, 0.2]),
                parameter("mu1", 0.05, [0.3, 0.1]),
                parameter("tau_sig", 0.06, [0.0, 0.05]),
            ],
            constants: vec![PopulationConstant {
                name: "mu2".into(),
                unit: "N/mm^2".into(),
                value: -0.001,
            }],
            depth_max_mm: 12.0,
            sessions: Vec::new(),
            supersedes: None,
        }
    }

    fn library(population: &PopulationDocument) -> TempDir {
        let library = tempfile::tempdir().unwrap();
        save_document(library.path(), population).unwrap();
        library
    }

    #[test]
    fn two_thousand_members_have_the_medians_and_the_standard_deviations_of_their_population() {
        let population = population();
        let library = library(&population);
        let count = f64::from(MEMBERS);
        let mut scores = vec![Vec::new(); 3];
        for number in 0..MEMBERS {
            let text = format!("population:liver#{number}");
            let member = draw_member(library.path(), &text).unwrap();
            let ModifiedKelvin { tau_eps, mu: [mu1, mu2, mu3], tau_sig } = member.body;
            assert_eq!((mu2, mu3, member.depth_max_mm), (-0.001, 0.0, 12.0));
            for ((scores, value), one) in
                scores.iter_mut().zip([tau_eps, mu1, tau_sig]).zip(&population.parameters)
            {
                let variance: f64 = one.standard_deviations.iter().map(|sd| sd * sd).sum();
                scores.push((value / one.median).ln() / variance.sqrt());
            }
        }
        let mean = |values: &[f64]| values.iter().sum::<f64>() / count;
        let product =
            |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / count;
        // Each bound is 4.5 standard errors of so many independent standard normal numbers: 1 / sqrt(n) of their mean and of
        // the product of two, sqrt(2 / n) of the square.
        let bound = 4.5 / count.sqrt();
        for (k, one) in scores.iter().enumerate() {
            assert!(mean(one).abs() < bound, "mean of {k}: {}", mean(one));
            let square = product(one, one);
            assert!((square - 1.0).abs() < bound * 2f64.sqrt(), "variance of {k}: {square}");
            // A twentieth of normal numbers is beyond 1.96; the standard error of that share is sqrt(0.05 * 0.95 / n).
            let beyond = one.iter().filter(|score| score.abs() > 1.96).count();
            let beyond = beyond as f64 / count - 0.05;
            assert!(beyond.abs() < bound * 0.0475f64.sqrt(), "beyond 1.96 of {k}: {beyond}");
            let next = &scores[(k + 1) % 3];
            assert!(product(one, next).abs() < bound, "{k} with the next: {}", product(one, next));
            // Neighbouring numbers are unrelated.
            assert!(product(&one[1..], one).abs() < bound, "{k}: neighbours");
        }
    }

    /// A change of these numbers would make another specimen of every `population:NAME#NUMBER` that somebody has used.
    #[test]
    fn a_member_is_the_same_on_every_computer_and_follows_text_and_content_alone() {
        let library_of = library(&population());
        let drawn = |text: &str| draw_member(library_of.path(), text).unwrap().body;
        let seventh = drawn("population:liver#7");
        let known = [0.9033950437934045, 0.056990244208851217, -0.001, 0.0, 0.05816031062029877];
        for ((name, value), known) in seventh.named().into_iter().zip(known) {
            // The logarithm and the exponential of another system may round otherwise.
            assert!((value - known).abs() <= 1e-12 * known.abs(), "{name}: {seventh:?}");
        }
        assert_eq!(drawn("population:liver#7"), seventh);
        assert_ne!(drawn("population:liver#8"), seventh);
        let mut other = population();
        other.depth_max_mm = 13.0;
        let other = library(&other);
        assert_ne!(draw_member(other.path(), "population:liver#7").unwrap().body, seventh);
    }

    #[test]
    fn values_of_effects_move_a_member_by_their_factors() {
        let library = library(&population());
        let drawn = |values: &str| {
            draw_member(library.path(), &format!("population:liver{values}#7")).unwrap().body
        };
        let plain = drawn("");
        for (values, effect) in [
            ("/animal.treatment=control", 0f64),
            ("/animal.treatment=enzyme", 0.4),
            ("/animal.treatment=heat", -0.7),
            ("/animal.age_days=110", 0.2),
            ("/animal.age_days=90/animal.treatment=enzyme", 0.2),
        ] {
            let moved = drawn(values);
            for (moved, plain) in [
                (moved.tau_eps, plain.tau_eps),
                (moved.mu[0], plain.mu[0]),
                (moved.tau_sig, plain.tau_sig),
            ] {
                // A few roundings of a double.
                assert!((moved / plain / effect.exp() - 1.0).abs() < 1e-13, "{values}: {moved}");
            }
            assert_eq!(moved.mu[1..], plain.mu[1..]);
        }
    }

    #[test]
    fn what_cannot_be_drawn_is_refused_in_one_sentence() {
        let mut maxwell = population();
        (maxwell.name, maxwell.family) = ("gel".into(), "maxwell".into());
        let mut lacking = population();
        lacking.name = "thin".into();
        lacking.constants.clear();
        lacking.effects.clear();
        lacking.parameters.iter_mut().for_each(|one| one.effects.clear());
        let library = library(&population());
        for other in [maxwell, lacking] {
            save_document(library.path(), &other).unwrap();
        }
        for (text, says) in [
            ("population:liver", "is no specimen of a population; write"),
            ("population:liver#", "whole number from 0"),
            ("population:liver#-1", "whole number from 0"),
            ("population:liver#4294967296", "whole number from 0"),
            ("population:liver/enzyme#1", "ENTRY=VALUE"),
            ("population:kidney#1", "the library has no population \"kidney\" among its 3"),
            (
                "population:liver/animal.sex=m#1",
                "no effect of animal.sex; give animal.age_days or animal.treatment",
            ),
            (
                "population:thin/animal.sex=m#1",
                "no effect of animal.sex; it has no effects, so leave it out",
            ),
            (
                "population:liver/animal.treatment=cold#1",
                "no animal.treatment 'cold'; give control or enzyme or heat",
            ),
            ("population:liver/animal.age_days=old#1", "no animal.age_days 'old'; give a number"),
            (
                "population:liver/animal.age_days=1/animal.age_days=2#1",
                "animal.age_days is given twice",
            ),
            (
                "population:gel#1",
                "family maxwell, which cannot be simulated; estimate one of the family series-1, series-2",
            ),
            ("population:thin#1", "no value of mu2"),
        ] {
            let err = draw_member(library.path(), text).unwrap_err().to_string();
            assert!(err.contains(says), "{text}: {err}");
        }
    }
}
