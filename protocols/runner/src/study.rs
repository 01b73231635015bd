//! The study file of a library: which animal each specimen comes from, and what is known of both, typed once.
//!
//! A session copies the entries when it is recorded or imported, so it can be understood without the file.

use palpate_model::metadata::{
    ANIMAL, ANIMAL_PREFIX, METADATA_KEYS, SPECIMEN, SPECIMEN_PREFIX, SessionLabels,
    SessionMetadata, plain_value,
};
use palpate_protocols::file::ProtocolProblem;
use palpate_protocols::file::problem::{Problems, suggestion};
use palpate_protocols::file::tree::{self, DocumentTable, DocumentValue};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;
use thiserror::Error;

/// Name of the file in the library.
pub const STUDY_FILE: &str = "study.toml";

/// Version of the file that is read.
pub const STUDY_VERSION: u32 = 1;

const KEYS: [&str; 3] = ["palpate-study", "animal", "specimen"];

/// The key of an animal that lists its specimens.
const SPECIMENS: &str = "specimens";

/// Animals with their specimens.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Study {
    animals: BTreeMap<String, StudyEntries>,
    /// With the animal of each.
    specimens: BTreeMap<String, (String, StudyEntries)>,
}

/// Entries of an animal or a specimen.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct StudyEntries {
    /// Of the file, from 1.
    line: u32,
    entries: SessionMetadata,
}

#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum StudyError {
    #[error("{0}")]
    Unreadable(String),
    #[error("{STUDY_FILE}, {}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
    Mistakes(Vec<ProtocolProblem>),
    /// The session and the file say different things.
    #[error(
        "{key} is '{given}', but line {line} of {STUDY_FILE} says '{known}' for {subject}; correct one of them"
    )]
    Contradiction { key: String, given: String, known: String, subject: String, line: u32 },
}

/// Adds to labels what the study of a library says of their specimen and animal; returns what was added.
pub fn complete_labels(
    labels: &mut SessionLabels,
    library: &Path,
) -> Result<SessionMetadata, StudyError> {
    // A mistake in the file must not stop a daily check, which has neither.
    if !labels.is_set(SPECIMEN) && !labels.is_set(ANIMAL) {
        return Ok(SessionMetadata::default());
    }
    Study::of_library(library)?.complete(labels)
}

impl Study {
    /// The study of a library; an empty one where it has no file.
    pub fn of_library(library: &Path) -> Result<Self, StudyError> {
        let path = library.join(STUDY_FILE);
        if !path.exists() {
            return Ok(Self::default());
        }
        let text = palpate_sessions::text::read(&path).map_err(StudyError::Unreadable)?;
        Self::parse(&text)
    }

    /// Reads the text of a study file.
    pub fn parse(text: &str) -> Result<Self, StudyError> {
        let root = tree::read(text).map_err(|problem| StudyError::Mistakes(vec![problem]))?;
        let mut reader = Reader::default();
        reader.root(&root);
        match reader.problems.has_errors() {
            true => Err(StudyError::Mistakes(reader.problems.into_list())),
            false => Ok(reader.study),
        }
    }

    /// The animal of a specimen, and the entries of the specimen.
    pub fn specimen(&self, name: &str) -> Option<(&str, &SessionMetadata)> {
        let (animal, own) = self.specimens.get(name.trim())?;
        Some((animal, &own.entries))
    }

    /// Adds the entries of the specimen and its animal that are not set; returns them.
    ///
    /// What is said of an animal must agree. What is said of a specimen may differ in a session, where it counts.
    pub fn complete(&self, labels: &mut SessionLabels) -> Result<SessionMetadata, StudyError> {
        let mut added = SessionMetadata::default();
        if let Some((animal, own)) = self.specimens.get(labels.specimen.trim()) {
            let subject = || format!("specimen '{}'", labels.specimen.trim());
            let animal = Value::from(animal.as_str());
            add_agreeing(&mut added, labels, (ANIMAL, &animal), own.line, &subject)?;
            let open = own.entries.iter().filter(|(name, _)| !labels.is_set(name));
            open.for_each(|(name, value)| added.put(name, value.clone()));
        }
        let animal = added.get(ANIMAL).cloned().or_else(|| labels.value(ANIMAL));
        let animal = animal.as_ref().map(plain_value).unwrap_or_default();
        if let Some(own) = self.animals.get(&animal) {
            let subject = || format!("animal '{animal}'");
            for entry in own.entries.iter() {
                add_agreeing(&mut added, labels, entry, own.line, &subject)?;
            }
        }
        labels.take(&added);
        Ok(added)
    }
}

fn add_agreeing(
    added: &mut SessionMetadata,
    labels: &SessionLabels,
    (name, known): (&str, &Value),
    line: u32,
    subject: &dyn Fn() -> String,
) -> Result<(), StudyError> {
    match labels.value(name) {
        None => added.put(name, known.clone()),
        Some(given) if given == *known => {}
        Some(given) => {
            return Err(StudyError::Contradiction {
                key: name.to_owned(),
                given: plain_value(&given),
                known: plain_value(known),
                subject: subject(),
                line,
            });
        }
    }
    Ok(())
}

#[derive(Default)]
struct Reader {
    study: Study,
    problems: Problems,
}

impl Reader {
    fn root(&mut self, root: &DocumentTable) {
        let is_known = root.get(KEYS[0]).map(|node| &node.value);
        if is_known != Some(&DocumentValue::Number(STUDY_VERSION.to_string())) {
            self.problems.error(
                root.get(KEYS[0]).map_or(1, |node| node.line),
                format!("a study file says palpate-study = {STUDY_VERSION} on its first line; add that, or use a palpate that reads its version"),
            );
        }
        for entry in &root.entries {
            if !KEYS.contains(&entry.key.as_str()) {
                let hint = suggestion(&entry.key, &KEYS);
                let message = format!("a study has no key '{}'; {hint}", entry.key);
                self.problems.error(entry.line, message);
            }
        }
        // Animals first, because they name the specimens.
        self.tables(root, "animal", Self::animal);
        self.tables(root, "specimen", Self::specimen);
    }

    /// Calls `read` with the name and the table of every animal or specimen.
    fn tables(
        &mut self,
        root: &DocumentTable,
        key: &str,
        read: fn(&mut Self, &str, u32, &DocumentTable),
    ) {
        let Some(node) = root.get(key) else { return };
        let wrong = format!(
            "'{key}' is not a table for each {key}; write its entries under [{key}.NAME], the name in quotes unless it has only letters, digits and hyphens"
        );
        let DocumentValue::Table(all) = &node.value else {
            return self.problems.error(node.line, wrong);
        };
        for entry in &all.entries {
            match &entry.node.value {
                DocumentValue::Table(table) => read(self, entry.key.trim(), entry.line, table),
                _ => self.problems.error(entry.line, wrong.clone()),
            }
        }
    }

    fn animal(&mut self, name: &str, line: u32, table: &DocumentTable) {
        if name.trim().is_empty() {
            self.problems.error(line, "an animal has no name; write for example [animal.pig-3]");
        }
        if let Some(node) = table.get(SPECIMENS) {
            let wrong =
                "specimens is not a list of names; write specimens = [\"liver 1\", \"liver 2\"]";
            match &node.value {
                DocumentValue::List(items) => {
                    for item in items {
                        match &item.value {
                            DocumentValue::Text(specimen) => {
                                self.add_specimen(specimen.trim(), name, item.line);
                            }
                            _ => self.problems.error(item.line, wrong),
                        }
                    }
                }
                _ => self.problems.error(node.line, wrong),
            }
        }
        let entries = self.entries(ANIMAL_PREFIX, table);
        self.study.animals.insert(name.to_owned(), StudyEntries { line, entries });
    }

    fn add_specimen(&mut self, specimen: &str, animal: &str, line: u32) {
        if specimen.is_empty() {
            self.problems
                .error(line, format!("a specimen of animal '{animal}' has no name; name it"));
            return;
        }
        if let Some((other, own)) = self.study.specimens.get(specimen) {
            let first = own.line;
            self.problems.error(line, match other == animal {
                true => format!(
                    "specimen '{specimen}' of animal '{animal}' is on line {first} too; remove one of them"
                ),
                false => format!(
                    "specimen '{specimen}' belongs to animal '{animal}' here and to '{other}' on line {first}; remove it from one of them"
                ),
            });
            return;
        }
        let own = StudyEntries { line, entries: SessionMetadata::default() };
        self.study.specimens.insert(specimen.to_owned(), (animal.to_owned(), own));
    }

    fn specimen(&mut self, name: &str, line: u32, table: &DocumentTable) {
        let entries = self.entries(SPECIMEN_PREFIX, table);
        match self.study.specimens.get_mut(name) {
            Some((_, own)) => own.entries = entries,
            None => self.problems.error(
                line,
                format!("specimen '{name}' belongs to no animal; add it to the specimens of one"),
            ),
        }
    }

    /// The entries of a table, whose keys lack the prefix.
    fn entries(&mut self, prefix: &str, table: &DocumentTable) -> SessionMetadata {
        let known: Vec<&str> = METADATA_KEYS
            .iter()
            .filter(|key| key.name != ANIMAL)
            .filter_map(|key| key.name.strip_prefix(prefix))
            .collect();
        let mut entries = SessionMetadata::default();
        for entry in &table.entries {
            let key = entry.key.as_str();
            if prefix == ANIMAL_PREFIX && key == SPECIMENS {
                continue;
            }
            let value = match &entry.node.value {
                _ if !known.contains(&key) => Err(format!(
                    "'{prefix}{key}' is not a metadata entry; {}",
                    suggestion(key, &known)
                )),
                DocumentValue::Text(value) | DocumentValue::Number(value) => {
                    let name = format!("{prefix}{key}");
                    entries.set(&name, value).map_err(|err| err.to_string())
                }
                _ => Err(format!(
                    "{key} is {}; give a text in quotes or a number",
                    entry.node.kind()
                )),
            };
            self.problems.take(entry.line, value);
        }
        entries
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STUDY: &str = r#"palpate-study = 1

[animal.pig-3]
species = "pig"
sex = "female"
age_days = 180
specimens = ["liver 1", "liver 2"]

[animal."donor 7"]
specimens = ["liver 3"]

[specimen."liver 2"]
site = "left lobe"
thickness_mm = 22
"#;

    fn labels(pairs: &[&str]) -> SessionLabels {
        let mut labels = SessionLabels::default();
        pairs.iter().for_each(|pair| labels.set_pair(pair).unwrap());
        labels
    }

    #[test]
    fn a_specimen_brings_its_animal_and_completing_twice_adds_nothing() {
        let study = Study::parse(STUDY).unwrap();
        let mut session = labels(&["specimen=liver 2", "specimen.thickness_mm=20"]);
        let added = study.complete(&mut session).unwrap();
        assert_eq!(
            added.pairs(),
            "animal.name=pig-3, animal.species=pig, animal.age_days=180.0, animal.sex=female, specimen.site=left lobe"
        );
        // What was measured in the session counts.
        assert_eq!(session.value("specimen.thickness_mm"), Some(20.0.into()));
        let before = session.clone();
        assert!(study.complete(&mut session).unwrap().is_empty());
        assert_eq!(session, before);
        // A specimen that the study does not know takes the entries of the animal that the session names.
        let mut session = labels(&["specimen=other", "animal.name=pig-3"]);
        study.complete(&mut session).unwrap();
        assert_eq!(session.value("animal.sex"), Some("female".into()));
        let mut session = labels(&["specimen=other"]);
        assert!(study.complete(&mut session).unwrap().is_empty());
    }

    #[test]
    fn contradictions_name_both_sides_and_change_nothing() {
        let study = Study::parse(STUDY).unwrap();
        for (pairs, key, line) in [
            (["specimen=liver 2", "animal.name=donor 7"], "animal.name", 7),
            (["specimen=liver 1", "animal.sex=male"], "animal.sex", 3),
            (["animal.name=pig-3", "animal.age_days=181"], "animal.age_days", 3),
        ] {
            let mut session = labels(&pairs);
            let before = session.clone();
            let refusal = study.complete(&mut session).unwrap_err();
            assert!(
                matches!(&refusal, StudyError::Contradiction { key: found, line: at, .. } if (found.as_str(), *at) == (key, line)),
                "{refusal}"
            );
            assert_eq!(session, before);
        }
    }

    #[test]
    fn mistakes_name_their_lines() {
        let mistakes = [
            ("[animal.a]\n", 1),
            ("palpate-study = 2\n", 1),
            ("palpate-study = 1\nanimals = 1\n", 2),
            ("palpate-study = 1\nanimal = 1\n", 2),
            ("palpate-study = 1\n[animal]\na = 1\n", 3),
            ("palpate-study = 1\n[animal.a]\nsex = \"f\"\n", 3),
            ("palpate-study = 1\n[animal.a]\nname = \"b\"\n", 3),
            ("palpate-study = 1\n[animal.a]\nspecimens = \"b\"\n", 3),
            ("palpate-study = 1\n[animal.a]\nspecimens = [1]\n", 3),
            (
                "palpate-study = 1\n[animal.a]\nspecimens = [\"s\"]\n[animal.b]\nspecimens = [\"s\"]\n",
                5,
            ),
            ("palpate-study = 1\n[specimen.s]\nsite = \"x\"\n", 2),
            ("palpate-study = 1\n[animal.a]\nsex = 'male'\nsex = 'female'\n", 4),
        ];
        for (text, line) in mistakes {
            let Err(StudyError::Mistakes(found)) = Study::parse(text) else { panic!("{text}") };
            assert_eq!(found[0].line, line, "{text}: {found:?}");
        }
    }

    #[test]
    fn a_library_without_the_file_has_an_empty_study_and_no_animal_needs_none() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(Study::of_library(folder.path()).unwrap(), Study::default());
        std::fs::write(folder.path().join(STUDY_FILE), "not a study").unwrap();
        assert!(complete_labels(&mut labels(&["operator=Ada"]), folder.path()).is_ok());
        assert!(complete_labels(&mut labels(&["specimen=s"]), folder.path()).is_err());
    }
}
