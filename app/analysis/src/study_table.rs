//! The sessions of a study as a table: which animal, specimen, site and repeat each is, what is known of them, and what
//! keeps the table from saying anything of a population.

use crate::daily::needs_daily_check;
use crate::recordings::{RecordingsError, find_sessions};
use crate::report::text::{counted, table};
use crate::source::SourceError;
use palpate_model::metadata::{
    ANIMAL, ANIMAL_PREFIX, METADATA_KEYS, SPECIMEN, SessionLabels, plain_value,
};
use palpate_protocols::plans::Plan;
use palpate_sessions::{DataQuality, Edits, Manifest, SessionSummary};
use palpate_tables::lake::{LakeError, is_lake, list_sessions, read_manifest};
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};
use serde::Serialize;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use thiserror::Error;

const SITE: &str = "specimen.site";
const REPEAT: &str = "series.repeat";

/// Entries that may explain differences between sessions.
pub const COVARIATES: [&str; 8] = [
    "animal.species",
    "animal.age_days",
    "animal.sex",
    "animal.treatment",
    "specimen.time_since_death_h",
    "specimen.temperature_c",
    "specimen.thickness_mm",
    "series.order",
];

/// Who measured, or with what, and what parts of one animal may differ in: a population takes them as effects too, and two of
/// them are compared in one place.
pub const WITHIN: [&str; 4] = ["operator", RIG, SITE, "specimen.storage"];
const RIG: &str = "rig";

/// Most names in a sentence. More would hide what it says.
const NAMES_MAX: usize = 5;

/// A session with its place in the nesting.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StudyRow {
    /// Path of the session, or its name in a lake.
    pub session: String,
    pub session_id: String,
    /// UTC, RFC 3339; of an imported session the time of the import.
    pub started_at: String,
    /// Name of the protocol; empty of an imported session.
    pub protocol: String,
    pub animal: Option<String>,
    pub specimen: Option<String>,
    pub site: Option<String>,
    pub series: Option<String>,
    /// From 1.
    pub repeat: Option<u64>,
    /// Of all [`COVARIATES`] and [`WITHIN`]; null where the session lacks one.
    pub covariates: BTreeMap<&'static str, Value>,
}

/// The rows of a study, by animal, specimen, site, repeat and start.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct StudyTable {
    pub rows: Vec<StudyRow>,
    pub problems: Vec<StudyProblem>,
    /// Sessions that do not count: rejected ones, and those that press no specimen.
    pub left_out: Vec<String>,
}

/// A value and a session that has it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct StudyOccurrence {
    pub value: String,
    pub session: String,
}

#[derive(Clone, Debug, PartialEq, Eq, Error, Serialize)]
#[serde(tag = "problem", rename_all = "kebab-case")]
pub enum StudyProblem {
    #[error("specimen '{specimen}' belongs to animal '{}' in {} and to '{}' in {}; correct one of them, or give the specimens different names", first.value, first.session, second.value, second.session)]
    SpecimenOfTwoAnimals { specimen: String, first: StudyOccurrence, second: StudyOccurrence },
    #[error("{entry} of animal '{animal}' is '{}' in {} and '{}' in {}; correct one of them", first.value, first.session, second.value, second.session)]
    AnimalWithTwoValues {
        entry: &'static str,
        animal: String,
        first: StudyOccurrence,
        second: StudyOccurrence,
    },
    #[error(
        "{first} and {second} are both repeat {repeat} of specimen '{specimen}'; number the repeats of one series and site from 1"
    )]
    RepeatTwice { specimen: String, repeat: u64, first: String, second: String },
    #[error("{entry} is missing in {} of {of} sessions: {}; add it there", sessions.len(), names(sessions))]
    Missing { entry: &'static str, sessions: Vec<String>, of: usize },
    #[error(
        "all sessions are of animal '{animal}', so they say nothing of other animals; add sessions of others"
    )]
    OneAnimal { animal: String },
    #[error(
        "no {group} has two {members}, so differences between {members} cannot be separated from those between {group}s; measure several {members} of each {group}"
    )]
    NothingNested { group: &'static str, members: &'static str },
    #[error(
        "{entry} is '{value}' in all sessions, so its influence cannot be seen; leave it out of the analysis"
    )]
    Constant { entry: &'static str, value: String },
}

impl StudyProblem {
    /// Whether the sessions contradict each other, so that no table of them is right.
    pub fn is_contradiction(&self) -> bool {
        matches!(self, Self::SpecimenOfTwoAnimals { .. } | Self::AnimalWithTwoValues { .. })
    }
}

fn names(sessions: &[String]) -> String {
    let shown = &sessions[..sessions.len().min(NAMES_MAX)];
    match sessions.len() - shown.len() {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

/// How many sessions do not count and why; none where all do.
#[must_use]
pub(crate) fn left_out_words(count: usize) -> Option<String> {
    let sessions = counted(count, "session");
    (count > 0).then(|| format!("{sessions} left out: rejected, or a calibration or daily check"))
}

#[derive(Debug, Error)]
pub enum StudyReadError {
    #[error(transparent)]
    Recordings(#[from] RecordingsError),
    #[error(transparent)]
    Lake(#[from] LakeError),
}

/// Reads the table of sessions and folders of sessions, or of one lake.
pub fn read_study(paths: &[PathBuf]) -> Result<StudyTable, StudyReadError> {
    let (mut sessions, mut left_out) = (Vec::new(), Vec::new());
    let mut take = |session: String, manifest: Manifest, is_rejected: bool| match is_rejected
        || presses_nothing(&manifest)
    {
        true => left_out.push(session),
        false => sessions.push((session, manifest)),
    };
    match paths {
        [lake] if is_lake(lake) => {
            let listed = list_sessions(lake)?;
            let read: Vec<_> = listed.par_iter().map(|one| read_manifest(lake, one)).collect();
            for (one, read) in listed.into_iter().zip(read) {
                let (manifest, rejection) = read?;
                take(one.id, manifest, rejection.is_some());
            }
        }
        paths => {
            for path in find_sessions(paths)?.paths {
                let (manifest, is_rejected) = read_edited(&path).map_err(|reason| {
                    RecordingsError::Source { path: path.clone(), reason: Box::new(reason) }
                })?;
                take(path.display().to_string(), manifest, is_rejected);
            }
        }
    }
    Ok(StudyTable { left_out, ..StudyTable::of(&sessions) })
}

/// The manifest of a session with its edits made, and whether it is rejected.
fn read_edited(path: &Path) -> Result<(Manifest, bool), SourceError> {
    let mut manifest = SessionSummary::read(path)?.manifest;
    let edits = Edits::read(path, &manifest.session_id)?;
    let mut labels = manifest.labels();
    edits.apply_to_labels(&mut labels);
    manifest.set_labels(labels);
    Ok((manifest, edits.verdict().is_some_and(|(verdict, _)| verdict == DataQuality::Rejected)))
}

/// Whether a session is a calibration or a daily check. An imported session has no plan and is none.
fn presses_nothing(manifest: &Manifest) -> bool {
    let plan = serde_json::from_value::<Plan>(manifest.plan.clone());
    plan.is_ok_and(|plan| !needs_daily_check(&plan))
}

impl StudyTable {
    /// The table of sessions, each with its name.
    #[must_use]
    pub fn of(sessions: &[(String, Manifest)]) -> Self {
        let mut rows: Vec<(StudyRow, SessionLabels)> = sessions
            .iter()
            .map(|(session, manifest)| (StudyRow::of(session, manifest), manifest.labels()))
            .collect();
        rows.sort_by(|(a, _), (b, _)| a.order().cmp(&b.order()));
        let mut problems = contradictions(&rows);
        problems.extend(repeats_twice(&rows));
        problems.extend(missing(&rows));
        problems.extend(empty_levels(&rows));
        problems.extend(constants(&rows));
        let rows = rows.into_iter().map(|(row, _)| row).collect();
        Self { rows, problems, left_out: Vec::new() }
    }

    /// A line a session, then a sentence for each problem.
    #[must_use]
    pub fn text(&self) -> String {
        let known: Vec<&str> = COVARIATES
            .into_iter()
            .filter(|entry| self.rows.iter().any(|row| !row.covariates[entry].is_null()))
            .collect();
        let head = ["animal", "specimen", "site", "repeat"];
        let head = head.into_iter().chain(known.iter().copied()).chain(["session"]);
        let head = head.collect::<Vec<_>>().join(" | ");
        let mut text = table(&head, self.rows.iter().map(|row| row.cells(&known)));
        text += &format!("\n{}", counted(self.rows.len(), "session"));
        if let Some(words) = left_out_words(self.left_out.len()) {
            text += &format!("; {words}");
        }
        for problem in &self.problems {
            text += &format!("\n{problem}");
        }
        text
    }
}

impl StudyRow {
    fn of(session: &str, manifest: &Manifest) -> Self {
        let labels = manifest.labels();
        let words = |name: &str| labels.value(name).as_ref().map(plain_value);
        let rig = || manifest.rig.as_ref().map(|rig| Value::from(rig.name.as_str()));
        let covariate = |name| match name {
            RIG => (name, rig().unwrap_or_default()),
            name => (name, labels.value(name).unwrap_or_default()),
        };
        Self {
            session: session.to_owned(),
            session_id: manifest.session_id.clone(),
            started_at: manifest.started_at_text(),
            protocol: manifest.plan["name"].as_str().unwrap_or_default().to_owned(),
            animal: words(ANIMAL),
            specimen: words(SPECIMEN),
            site: words(SITE),
            series: words("series.id"),
            repeat: labels.value(REPEAT).as_ref().and_then(Value::as_u64),
            covariates: COVARIATES.into_iter().chain(WITHIN).map(covariate).collect(),
        }
    }

    fn order(&self) -> impl Ord + '_ {
        (&self.animal, &self.specimen, &self.site, self.repeat, &self.started_at, &self.session)
    }

    fn cells(&self, covariates: &[&str]) -> Vec<String> {
        let or_dash = |text: &Option<String>| text.clone().unwrap_or_else(|| "-".into());
        let covariates = covariates.iter().map(|name| match &self.covariates[name] {
            Value::Null => "-".into(),
            value => plain_value(value),
        });
        let repeat = self.repeat.map(|repeat| repeat.to_string());
        [&self.animal, &self.specimen, &self.site, &repeat]
            .map(or_dash)
            .into_iter()
            .chain(covariates)
            .chain([self.session.clone()])
            .collect()
    }
}

type LabelledRow = (StudyRow, SessionLabels);

/// The first session that disagrees with one before it, for each specimen and each entry of an animal.
fn contradictions(rows: &[LabelledRow]) -> Vec<StudyProblem> {
    let mut problems = Vec::new();
    let groups = rows.iter().filter_map(|one| Some((one.0.specimen.as_ref()?, one)));
    for (specimen, first, second) in disagreements(groups, ANIMAL) {
        let specimen = specimen.to_owned();
        problems.push(StudyProblem::SpecimenOfTwoAnimals { specimen, first, second });
    }
    let of_animal = METADATA_KEYS.iter().map(|key| key.name);
    for entry in of_animal.filter(|name| name.starts_with(ANIMAL_PREFIX) && *name != ANIMAL) {
        let groups = rows.iter().filter_map(|one| Some((one.0.animal.as_ref()?, one)));
        for (animal, first, second) in disagreements(groups, entry) {
            let animal = animal.to_owned();
            problems.push(StudyProblem::AnimalWithTwoValues { entry, animal, first, second });
        }
    }
    problems
}

/// Groups in which an entry has two values, each with two sessions that differ.
fn disagreements<'a>(
    rows: impl Iterator<Item = (&'a String, &'a LabelledRow)>,
    entry: &str,
) -> Vec<(&'a str, StudyOccurrence, StudyOccurrence)> {
    let mut first: BTreeMap<&str, StudyOccurrence> = BTreeMap::new();
    let mut second = BTreeMap::new();
    for (group, (row, labels)) in rows {
        let Some(value) = labels.value(entry) else { continue };
        let own = StudyOccurrence { value: plain_value(&value), session: row.session.clone() };
        match first.get(group.as_str()) {
            None => drop(first.insert(group, own)),
            Some(known) if known.value == own.value => {}
            Some(known) => drop(second.entry(group.as_str()).or_insert((known.clone(), own))),
        }
    }
    second.into_iter().map(|(group, (first, second))| (group, first, second)).collect()
}

fn repeats_twice(rows: &[LabelledRow]) -> Vec<StudyProblem> {
    let mut seen = BTreeMap::new();
    let twice = rows.iter().filter_map(|(row, _)| {
        let (specimen, repeat) = (row.specimen.clone()?, row.repeat?);
        let place = (&row.animal, &row.specimen, &row.site, &row.series, &row.protocol, repeat);
        let first: String = seen.insert(place, row.session.clone())?;
        let second = row.session.clone();
        Some(StudyProblem::RepeatTwice { specimen, repeat, first, second })
    });
    twice.collect()
}

/// Animal and specimen are always needed; the others where some sessions have them.
fn missing(rows: &[LabelledRow]) -> Vec<StudyProblem> {
    let entries = [ANIMAL, SPECIMEN, SITE, REPEAT].into_iter().chain(COVARIATES);
    let of = rows.len();
    let missing = entries.filter_map(|entry| {
        let lacking = rows.iter().filter(|(_, labels)| !labels.is_set(entry));
        let sessions: Vec<String> = lacking.map(|(row, _)| row.session.clone()).collect();
        let is_needed = entry == ANIMAL || entry == SPECIMEN || sessions.len() < of;
        (is_needed && !sessions.is_empty()).then_some(StudyProblem::Missing { entry, sessions, of })
    });
    missing.collect()
}

/// Levels whose groups have one member each.
fn empty_levels(rows: &[LabelledRow]) -> Vec<StudyProblem> {
    let nested: Vec<&StudyRow> = rows
        .iter()
        .map(|(row, _)| row)
        .filter(|row| row.animal.is_some() && row.specimen.is_some())
        .collect();
    let Some(first) = nested.first() else { return Vec::new() };
    let mut problems = Vec::new();
    if nested.iter().all(|row| row.animal == first.animal) {
        let animal = first.animal.clone().unwrap_or_default();
        problems.push(StudyProblem::OneAnimal { animal });
    }
    let has_sites = nested.iter().any(|row| row.site.is_some());
    let place = |row: &StudyRow, depth: usize| {
        let names = [&row.animal, &row.specimen, &row.site].map(Clone::clone);
        names[..depth].to_vec()
    };
    let is_empty = |group: usize, member: &dyn Fn(&StudyRow) -> Vec<Option<String>>| {
        let members: BTreeSet<_> =
            nested.iter().map(|row| (place(row, group), member(row))).collect();
        let groups: BTreeSet<_> = members.iter().map(|(group, _)| group).collect();
        groups.len() == members.len()
    };
    let session = |row: &StudyRow| vec![Some(row.session.clone())];
    let mut check = |group, members, is_empty: bool| {
        if is_empty {
            problems.push(StudyProblem::NothingNested { group, members });
        }
    };
    check("animal", "specimens", is_empty(1, &|row| place(row, 2)));
    if has_sites {
        check("specimen", "sites", is_empty(2, &|row| place(row, 3)));
        check("site", "sessions", is_empty(3, &session));
    } else {
        check("specimen", "sessions", is_empty(2, &session));
    }
    problems
}

fn constants(rows: &[LabelledRow]) -> Vec<StudyProblem> {
    let [(first, _), _, ..] = rows else { return Vec::new() };
    let constant = COVARIATES.into_iter().filter_map(|entry| {
        let value = &first.covariates[entry];
        let is_constant = rows.iter().all(|(row, _)| row.covariates[entry] == *value);
        (is_constant && !value.is_null())
            .then(|| StudyProblem::Constant { entry, value: plain_value(value) })
    });
    constant.collect()
}

#[cfg(test)]
mod tests;
