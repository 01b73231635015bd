//! The populations of a library, in `populations/`: what was found of the specimens of a study, to draw new ones from.

use crate::document_store::{self, Document};
use serde::{Deserialize, Serialize};

/// Version of the document. A reader refuses a higher one.
pub const POPULATION_FORMAT: u32 = 1;

/// How the specimens of a population begin where they are written: `population:NAME#7`.
pub const MEMBER_PREFIX: &str = "population:";

/// Whether a text means a specimen of a population.
#[must_use]
pub fn is_member(text: &str) -> bool {
    text.starts_with(MEMBER_PREFIX)
}

/// Letters that end a name where a specimen of a population is written.
const ENDS_OF_NAME: [char; 2] = ['/', '#'];

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PopulationDocument {
    pub format: u32,
    pub name: String,
    /// RFC 3339.
    pub estimated_at: String,
    /// Version of the program that estimated it.
    pub software_version: String,
    /// Key of the model family.
    pub family: String,
    /// How the sessions entered: `curves` or `two-stage`.
    pub method: String,
    /// Levels of groups, the outermost first, the session last.
    pub levels: Vec<String>,
    /// What moves the medians.
    pub effects: Vec<PopulationEffect>,
    pub parameters: Vec<PopulationParameter>,
    /// The other parameters of the family, which do not vary in the population.
    pub constants: Vec<PopulationConstant>,
    /// Greatest depth of the sessions in mm.
    pub depth_max_mm: f64,
    /// Ids of the sessions.
    pub sessions: Vec<String>,
    /// Id of the document that this one supersedes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub supersedes: Option<String>,
}

/// What an effect multiplies.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum PopulationEffect {
    /// One where an entry of the session is `value`, zero where it is another; the medians are of `reference`.
    Value { entry: String, value: String, reference: String },
    /// The entry, a number, from its mean over the sessions.
    Number { entry: String, mean: f64 },
}

impl PopulationEffect {
    pub fn entry(&self) -> &str {
        match self {
            Self::Value { entry, .. } | Self::Number { entry, .. } => entry,
        }
    }
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PopulationParameter {
    pub name: String,
    pub unit: String,
    /// In its unit.
    pub median: f64,
    /// Of each of the document's effects, on the natural logarithm of the parameter.
    pub effects: Vec<f64>,
    /// Of the natural logarithm, between the groups of each of the document's levels.
    pub standard_deviations: Vec<f64>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PopulationConstant {
    pub name: String,
    pub unit: String,
    /// Median over the sessions of their best values, in its unit.
    pub value: f64,
}

pub type StoredPopulation = document_store::StoredDocument<PopulationDocument>;

pub type PopulationStore = document_store::DocumentStore<PopulationDocument>;

impl Document for PopulationDocument {
    const KIND: &'static str = "population";
    const FOLDER: &'static str = "populations";
    const RENEW: &'static str = "estimate and save it again";

    fn name(&self) -> &str {
        &self.name
    }

    /// It belongs to no rig.
    fn rig(&self) -> &str {
        ""
    }

    fn taken_at(&self) -> Option<&str> {
        Some(&self.estimated_at)
    }

    fn supersedes(&self) -> Option<&str> {
        self.supersedes.as_deref()
    }

    fn superseding(self, id: String) -> Self {
        Self { supersedes: Some(id), ..self }
    }

    fn check(&self) -> Result<(), String> {
        if self.format > POPULATION_FORMAT {
            return Err("a later palpate saved it; update palpate to use it".into());
        }
        check_population_name(&self.name)?;
        let is_sound = |one: &PopulationParameter| {
            one.median > 0.0
                && one.median.is_finite()
                && one.effects.len() == self.effects.len()
                && one.effects.iter().all(|effect| effect.is_finite())
                && one.standard_deviations.len() == self.levels.len()
                && one.standard_deviations.iter().all(|value| *value >= 0.0 && value.is_finite())
        };
        match self.parameters.iter().find(|one| !is_sound(one)) {
            Some(one) => Err(format!(
                "{} needs a median above zero, a finite number for each effect and a standard deviation for each level",
                one.name
            )),
            None => Ok(()),
        }
    }
}

/// Whether a population may have this name; the error says why not.
pub fn check_population_name(name: &str) -> Result<(), String> {
    match name.trim().is_empty() || name.contains(ENDS_OF_NAME) {
        true => Err(format!(
            "'{name}' cannot be the name of a population; give one with letters and without / and #"
        )),
        false => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document_store::{LibraryError, read_document, save_document};

    fn population() -> PopulationDocument {
        PopulationDocument {
            format: POPULATION_FORMAT,
            name: "pig stomach".into(),
            estimated_at: "2026-03-05T10:00:00Z".into(),
            software_version: "0".into(),
            family: "series-1".into(),
            method: "curves".into(),
            levels: vec!["animal".into(), "session".into()],
            effects: vec![
                PopulationEffect::Value {
                    entry: "animal.treatment".into(),
                    value: "enzyme".into(),
                    reference: "control".into(),
                },
                PopulationEffect::Number { entry: "animal.age_days".into(), mean: 112.5 },
            ],
            parameters: vec![PopulationParameter {
                name: "mu1".into(),
                unit: "N/mm".into(),
                median: 0.05,
                effects: vec![0.3, -0.01],
                standard_deviations: vec![0.2, 0.0],
            }],
            constants: Vec::new(),
            depth_max_mm: 20.0,
            sessions: vec!["one".into()],
            supersedes: None,
        }
    }

    #[test]
    fn population_is_stored_and_read_back() {
        let home = tempfile::tempdir().unwrap();
        let stored = save_document(home.path(), &population()).unwrap();
        assert!(stored.id.starts_with("20260305-pig-stomach-"), "{}", stored.id);
        assert_eq!(read_document::<PopulationDocument>(&stored.path).unwrap(), population());
        let store = PopulationStore::open(home.path());
        assert_eq!(store.find("pig stomach").unwrap(), &stored);
    }

    #[test]
    fn population_that_nothing_can_be_drawn_from_is_refused() {
        let home = tempfile::tempdir().unwrap();
        let refused = |change: &dyn Fn(&mut PopulationDocument), says: &str| {
            let mut wrong = population();
            change(&mut wrong);
            let err = save_document(home.path(), &wrong).unwrap_err();
            assert!(matches!(err, LibraryError::Unsound { .. }), "{err}");
            assert!(err.to_string().contains(says), "{err}");
        };
        refused(&|one| one.format = POPULATION_FORMAT + 1, "update palpate");
        refused(&|one| one.name = "pig/1".into(), "without / and #");
        refused(&|one| one.name = " ".into(), "with letters");
        refused(&|one| one.parameters[0].median = 0.0, "mu1 needs");
        refused(&|one| one.parameters[0].effects.clear(), "mu1 needs");
        refused(&|one| one.parameters[0].standard_deviations[0] = -0.1, "mu1 needs");
    }
}
