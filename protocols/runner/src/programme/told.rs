//! What a programme tells of its sessions, so that nobody need be asked: of all of them, of each specimen, and over
//! both what the command line says.

use super::document::Programme;
use palpate_model::about::{AboutError, Labels};
use palpate_protocols::file::Problem;
use palpate_protocols::file::problem::Problems;
use palpate_protocols::file::tree::{Entry, Table, Value};
use std::collections::BTreeMap;

/// A key of [`palpate_model::about::KEYS`] with its value.
type Pair = (String, String);

/// The label that says what is indented.
const SPECIMEN: &str = "specimen";

/// What is told, as it was written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Told {
    all: Vec<Pair>,
    /// Of each specimen, with the line where that begins.
    specimens: BTreeMap<u64, (u32, Vec<Pair>)>,
    over: Vec<Pair>,
}

impl Told {
    /// Reads `[about]` and `[specimen.N]` of a programme; `operator` is told as if it stood in `[about]`.
    pub fn read(root: &Table, operator: &str, problems: &mut Problems) -> Self {
        let mut told = Self::default();
        if !operator.trim().is_empty() {
            told.all.push(("operator".into(), operator.to_owned()));
        }
        for entry in &root.entries {
            match (entry.key.as_str(), &entry.node.value) {
                ("about", Value::Table(table)) => pairs(table, "", &mut told.all, problems),
                ("about", _) => problems.push(Problem::error(
                    entry.line,
                    "[about] is a table of what is told of every session; say what the programme is for with purpose = \"...\"",
                )),
                ("specimen", Value::Table(table)) => told.read_specimens(table, problems),
                ("specimen", _) => problems.push(not_numbered(entry)),
                _ => {}
            }
        }
        told
    }

    fn read_specimens(&mut self, table: &Table, problems: &mut Problems) {
        for entry in &table.entries {
            let Value::Table(own) = &entry.node.value else {
                problems.push(not_numbered(entry));
                continue;
            };
            let Ok(number) = entry.key.parse() else {
                problems.push(not_numbered(entry));
                continue;
            };
            let known = self.specimens.entry(number).or_default();
            known.0 = entry.line;
            pairs(own, "specimen.", &mut known.1, problems);
        }
    }

    /// Numbers of the specimens of which something is told, and the line where that begins.
    pub fn specimens(&self) -> impl Iterator<Item = (u64, u32)> {
        let specimens = self.specimens.iter();
        specimens.map(|(number, (line, _))| (*number, *line))
    }
}

fn not_numbered(entry: &Entry) -> Problem {
    Problem::error(
        entry.line,
        format!(
            "'{}' is no table of a specimen; write [specimen.2] for the one that a task with specimen = 2 clips in, and what holds for all into [about]",
            entry.key
        ),
    )
}

/// The pairs of a table, `specimen.source = "pig"` like `"specimen.source" = "pig"`.
fn pairs(table: &Table, prefix: &str, found: &mut Vec<Pair>, problems: &mut Problems) {
    for entry in &table.entries {
        let key = match (prefix, entry.key.as_str()) {
            ("specimen.", "name") => SPECIMEN.to_owned(),
            (prefix, key) => format!("{prefix}{key}"),
        };
        let value = match &entry.node.value {
            Value::Text(value) | Value::Number(value) => value.clone(),
            Value::Table(inner) if prefix.is_empty() => {
                pairs(inner, &format!("{key}."), found, problems);
                continue;
            }
            Value::Flag(_) | Value::List(_) | Value::Table(_) => {
                let message = format!("{key} is {}; give it a text", entry.node.kind());
                problems.push(Problem::error(entry.line, message));
                continue;
            }
        };
        if found.iter().any(|(known, _)| *known == key) {
            let message = format!("{key} is told twice; keep one");
            problems.push(Problem::error(entry.line, message));
        } else if let Err(message) = check(&key, &value) {
            problems.push(Problem::error(entry.line, message));
        } else {
            found.push((key, value));
        }
    }
}

/// Whether a thing can be told by a programme.
fn check(key: &str, value: &str) -> Result<(), String> {
    if key.trim().starts_with("series.") {
        return Err(format!("a programme counts its series itself; leave out {key}"));
    }
    Labels::default().tell(key, value).map_err(|err| err.to_string())
}

impl Programme {
    /// Tells of every session what the command line says; it holds over the file.
    pub fn tell(&mut self, key: &str, value: &str) -> Result<(), String> {
        check(key, value)?;
        self.told.over.push((key.trim().to_owned(), value.to_owned()));
        Ok(())
    }

    /// Who and what a repeat of a task is about, with its place in the programme.
    pub fn labels(&self, task: usize, repeat: u32) -> Result<Labels, AboutError> {
        let number = self.specimen_at(task);
        let own = number.and_then(|number| self.told.specimens.get(&number));
        let own = own.map_or(&[][..], |(_, pairs)| pairs.as_slice());
        let mut labels = self.usual.clone();
        let told = self.told.all.iter().chain(own).chain(&self.told.over);
        // Weights are no specimen.
        let is_weighed = self.tasks[task].calibrates;
        for (key, value) in told.filter(|(key, _)| !(is_weighed && key.starts_with(SPECIMEN))) {
            labels.tell(key, value)?;
        }
        let names = |pairs: &[Pair]| pairs.iter().any(|(key, _)| key == SPECIMEN);
        // A name for all does not tell one from the other.
        if let Some(number) = number.filter(|_| names(&self.told.over) || !names(own)) {
            labels.specimen = match labels.specimen.as_str() {
                "" => format!("specimen {number}"),
                all => format!("{all}, specimen {number}"),
            };
        }
        let task = &self.tasks[task];
        labels.tell("series.id", &format!("{}/{}", self.name, task.name))?;
        // The simulated rig counts its own specimen as 0.
        if let Some(number) = number.filter(|number| *number > 0) {
            labels.tell("series.specimen", &number.to_string())?;
        }
        labels.tell("series.repeat", &repeat.to_string())?;
        labels.tell("series.repeats", &task.repeats.to_string())?;
        Ok(labels)
    }

    /// What protocols ask for and nobody tells: a sentence for each task, at its line. What a word means is said once.
    pub fn questions(&self) -> Vec<Problem> {
        let mut explained: Vec<&str> = Vec::new();
        let mut questions = Vec::new();
        for (index, task) in self.tasks.iter().enumerate() {
            // What the file and the command line tell was checked when it was told.
            let labels = self.labels(index, 1).unwrap_or_default();
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
                questions.push(Problem::warning(
                    task.line,
                    format!("task '{}' asks for {}", task.name, words.join(", ")),
                ));
            }
        }
        questions
    }
}
