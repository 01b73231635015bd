//! Labels that a programme gives to its sessions: to all, to those of one specimen, and those of the command line, which
//! override both.

use super::document::Programme;
use crate::study::{Study, StudyError};
use palpate_model::metadata::{ANIMAL_PREFIX, MetadataError, SPECIMEN, SessionLabels};
use palpate_protocols::file::ProtocolProblem;
use palpate_protocols::file::problem::Problems;
use palpate_protocols::file::tree::{DocumentEntry, DocumentTable, DocumentValue};
use std::collections::BTreeMap;

/// A key of [`palpate_model::metadata::METADATA_KEYS`] with its value.
type Pair = (String, String);

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct LabelSettings {
    general: Vec<Pair>,
    /// Of each specimen, with the line where that begins.
    specimens: BTreeMap<u64, (u32, Vec<Pair>)>,
    overrides: Vec<Pair>,
}

impl LabelSettings {
    /// Reads `[about]` and `[specimen.N]` of a programme; `operator` counts as part of `[about]`.
    pub fn read(root: &DocumentTable, operator: &str, problems: &mut Problems) -> Self {
        let mut settings = Self::default();
        if !operator.trim().is_empty() {
            settings.general.push(("operator".into(), operator.to_owned()));
        }
        for entry in &root.entries {
            match (entry.key.as_str(), &entry.node.value) {
                ("about", DocumentValue::Table(table)) => {
                    read_pairs(table, "", &mut settings.general, problems);
                }
                ("about", _) => problems.error(
                    entry.line,
                    "[about] must be a table of labels for every session; write the aim of the programme as purpose = \"...\"",
                ),
                ("specimen", DocumentValue::Table(table)) => {
                    settings.read_specimens(table, problems);
                }
                ("specimen", _) => report_specimen(entry, problems),
                _ => {}
            }
        }
        settings
    }

    fn read_specimens(&mut self, table: &DocumentTable, problems: &mut Problems) {
        for entry in &table.entries {
            let (DocumentValue::Table(own), Ok(number)) = (&entry.node.value, entry.key.parse())
            else {
                report_specimen(entry, problems);
                continue;
            };
            let known = self.specimens.entry(number).or_default();
            known.0 = entry.line;
            read_pairs(own, "specimen.", &mut known.1, problems);
        }
    }

    /// Numbers of the labelled specimens, each with the line of its table.
    pub fn specimens(&self) -> impl Iterator<Item = (u64, u32)> {
        let specimens = self.specimens.iter();
        specimens.map(|(number, (line, _))| (*number, *line))
    }
}

fn report_specimen(entry: &DocumentEntry, problems: &mut Problems) {
    problems.error(
        entry.line,
        format!(
            "'{}' is not a table of labels for one specimen; write labels of, for example, specimen 2 into [specimen.2], and labels of all specimens into [about]",
            entry.key
        ),
    );
}

/// The pairs of a table, `specimen.source = "pig"` like `"specimen.source" = "pig"`.
fn read_pairs(table: &DocumentTable, prefix: &str, found: &mut Vec<Pair>, problems: &mut Problems) {
    for entry in &table.entries {
        let key = match (prefix, entry.key.as_str()) {
            ("specimen.", "name") => SPECIMEN.to_owned(),
            (prefix, key) => format!("{prefix}{key}"),
        };
        let value = match &entry.node.value {
            DocumentValue::Text(value) | DocumentValue::Number(value) => value.clone(),
            DocumentValue::Table(inner) if prefix.is_empty() => {
                read_pairs(inner, &format!("{key}."), found, problems);
                continue;
            }
            _ => {
                let kind = entry.node.kind();
                problems.error(entry.line, format!("{key} is {kind}; give a text in quotes"));
                continue;
            }
        };
        let checked = match found.iter().any(|(known, _)| *known == key) {
            true => Err(format!("{key} is given twice; remove one of them")),
            false => check_label(&key, &value),
        };
        if problems.take(entry.line, checked).is_some() {
            found.push((key, value));
        }
    }
}

fn check_label(key: &str, value: &str) -> Result<(), String> {
    if key.trim().starts_with("series.") {
        return Err(format!("a programme sets the labels of its series itself; remove {key}"));
    }
    SessionLabels::default().set(key, value).map_err(|err| err.to_string())
}

impl Programme {
    /// Sets a label of every session from the command line, which overrides the file.
    pub fn set_label(&mut self, key: &str, value: &str) -> Result<(), String> {
        check_label(key, value)?;
        self.label_settings.overrides.push((key.trim().to_owned(), value.to_owned()));
        Ok(())
    }

    pub fn labels(&self, task: usize, repeat: u32) -> Result<SessionLabels, MetadataError> {
        let number = self.specimen_at(task);
        let own = number.and_then(|number| self.label_settings.specimens.get(&number));
        let own = own.map_or(&[][..], |(_, pairs)| pairs.as_slice());
        let mut labels = self.default_labels.clone();
        let pairs =
            self.label_settings.general.iter().chain(own).chain(&self.label_settings.overrides);
        // Weights are no specimen.
        let is_weighed = self.tasks[task].calibrates;
        let is_of_specimen =
            |key: &str| key.starts_with(SPECIMEN) || key.starts_with(ANIMAL_PREFIX);
        for (key, value) in pairs.filter(|(key, _)| !(is_weighed && is_of_specimen(key))) {
            labels.set(key, value)?;
        }
        let names = |pairs: &[Pair]| pairs.iter().any(|(key, _)| key == SPECIMEN);
        // A common name does not distinguish the specimens.
        if let Some(number) =
            number.filter(|_| names(&self.label_settings.overrides) || !names(own))
        {
            labels.specimen = match labels.specimen.as_str() {
                "" => format!("specimen {number}"),
                all => format!("{all}, specimen {number}"),
            };
        }
        let (index, task) = (task, &self.tasks[task]);
        labels.set("series.id", &format!("{}/{}", self.name, task.name))?;
        // The simulated rig counts its own specimen as 0.
        if let Some(number) = number.filter(|number| *number > 0) {
            labels.set("series.specimen", &number.to_string())?;
        }
        let before: u32 = self.tasks[..index].iter().map(|task| task.repeats).sum();
        labels.set("series.order", &(before + repeat).to_string())?;
        labels.set("series.repeat", &repeat.to_string())?;
        labels.set("series.repeats", &task.repeats.to_string())?;
        Ok(labels)
    }

    /// Labels that protocols ask for and that neither programme nor study sets: a sentence for each task. The meaning of
    /// a label is given once.
    pub fn open_questions(&self, study: &Study) -> Result<Vec<ProtocolProblem>, StudyError> {
        let mut explained: Vec<&str> = Vec::new();
        let mut questions = Vec::new();
        for (index, task) in self.tasks.iter().enumerate() {
            // Labels were checked when they were set.
            let mut labels = self.labels(index, 1).unwrap_or_default();
            study.complete(&mut labels)?;
            let open = task.protocol.open_questions(&labels);
            let words: Vec<String> = open
                .iter()
                .map(|key| {
                    if explained.contains(&key.name) {
                        return key.name.to_owned();
                    }
                    explained.push(key.name);
                    format!("{} ({})", key.name, key.meaning)
                })
                .collect();
            if !words.is_empty() {
                questions.push(ProtocolProblem::warning(
                    task.line,
                    format!("task '{}' asks for {}", task.name, words.join(", ")),
                ));
            }
        }
        Ok(questions)
    }
}
