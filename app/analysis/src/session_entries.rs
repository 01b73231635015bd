//! Metadata entries of sessions after the run: as given, and as the study of the library has them.

use crate::edits::{EditFailure, EditTarget};
use crate::session_actions::Attribution;
use crate::study_table::{StudyProblem, StudyTable};
use palpate_model::metadata::{
    ANIMAL, ANIMAL_PREFIX, METADATA_KEYS, MetadataError, SPECIMEN, SessionLabels, SessionMetadata,
};
use palpate_runner::study::{Study, StudyError};
use palpate_sessions::{EditChange, Manifest, SessionSummary};
use serde::Serialize;
use serde_json::Value;
use std::path::{Path, PathBuf};
use thiserror::Error;

#[derive(Debug, Error)]
pub enum SessionEntriesError {
    #[error(transparent)]
    Edit(#[from] EditFailure),
    #[error(transparent)]
    Study(#[from] StudyError),
    #[error("{}: {reason}", session.display())]
    Session { session: PathBuf, reason: String },
    #[error(transparent)]
    Contradiction(Box<StudyProblem>),
}

/// What was written beside a session: nothing where it had all entries.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EnteredSession {
    pub session: PathBuf,
    pub entries: SessionMetadata,
}

/// Sets entries of all sessions, completed by the study of the library. A contradiction changes none of them; where a session
/// cannot be written, those before it have their edit.
pub fn enter(
    sessions: &[PathBuf],
    entries: &SessionMetadata,
    library: Option<&Path>,
    who: &Attribution,
) -> Result<Vec<EnteredSession>, SessionEntriesError> {
    let study = library.map_or(Ok(Study::default()), Study::of_library)?;
    let mut planned = Vec::new();
    for session in sessions {
        let target = EditTarget::read(session)?;
        let mut manifest = SessionSummary::read(session).map_err(EditFailure::from)?.manifest;
        let is_same = |(_, other, _): &(EditTarget, Manifest, SessionMetadata)| {
            other.session_id == manifest.session_id
        };
        if planned.iter().any(is_same) {
            let reason = "the session is given twice; give it once".to_owned();
            return Err(SessionEntriesError::Session { session: session.clone(), reason });
        }
        let mut before = manifest.labels();
        target.edits.apply_to_labels(&mut before);
        let after = completed(&before, entries, &study)
            .map_err(|reason| SessionEntriesError::Session { session: session.clone(), reason })?;
        manifest.set_labels(after.clone());
        planned.push((target, manifest, changes(&before, &after)));
    }
    let named = |(target, manifest, _): &(EditTarget, Manifest, SessionMetadata)| {
        (target.folder.display().to_string(), manifest.clone())
    };
    let table = StudyTable::of(&planned.iter().map(named).collect::<Vec<_>>());
    if let Some(problem) = table.problems.into_iter().find(StudyProblem::is_contradiction) {
        return Err(SessionEntriesError::Contradiction(Box::new(problem)));
    }
    let mut entered = Vec::new();
    for (target, _, entries) in planned {
        if !entries.is_empty() {
            let change = EditChange::About { entries: entries.clone() };
            target.add_edit(&who.by, &who.reason, change)?;
        }
        entered.push(EnteredSession { session: target.folder, entries });
    }
    Ok(entered)
}

fn completed(
    before: &SessionLabels,
    entries: &SessionMetadata,
    study: &Study,
) -> Result<SessionLabels, String> {
    let mut after = before.clone();
    after.take(&outdated(before, entries, study));
    after.take(entries);
    study.complete(&mut after).map_err(|err| err.to_string())?;
    after.check().map_err(|err: MetadataError| err.to_string())?;
    Ok(after)
}

/// Entries to remove, because they describe another animal or specimen than the session is of now: all of an animal,
/// and what the study says of a specimen.
fn outdated(before: &SessionLabels, entries: &SessionMetadata, study: &Study) -> SessionMetadata {
    let mut outdated = SessionMetadata::default();
    let specimen = entries.get(SPECIMEN).and_then(Value::as_str);
    let specimen = specimen.filter(|name| *name != before.specimen);
    if let (Some(_), Some((_, of_study))) = (specimen, study.specimen(&before.specimen)) {
        let is_copied =
            |(name, value): &(&str, &Value)| before.value(name).as_ref() == Some(*value);
        of_study.iter().filter(is_copied).for_each(|(name, _)| outdated.put(name, Value::Null));
    }
    let of_specimen = specimen.and_then(|name| study.specimen(name)).map(|(animal, _)| animal);
    let animal = entries.get(ANIMAL).and_then(Value::as_str).or(of_specimen);
    let was = before.value(ANIMAL);
    if animal.is_some() && was.is_some() && animal != was.as_ref().and_then(Value::as_str) {
        let of_animal = before.about.iter().filter(|(name, _)| name.starts_with(ANIMAL_PREFIX));
        of_animal.for_each(|(name, _)| outdated.put(name, Value::Null));
    }
    outdated
}

/// The entries that are new, have another value or are removed.
fn changes(before: &SessionLabels, after: &SessionLabels) -> SessionMetadata {
    let mut changes = SessionMetadata::default();
    for key in METADATA_KEYS {
        let value = after.value(key.name);
        if value != before.value(key.name) {
            changes.put(key.name, value.unwrap_or_default());
        }
    }
    changes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(pairs: &[&str]) -> SessionLabels {
        let mut labels = SessionLabels::default();
        pairs.iter().for_each(|pair| labels.set_pair(pair).unwrap());
        labels
    }

    #[test]
    fn another_specimen_has_nothing_of_the_animal_and_the_specimen_before() {
        let study = Study::parse(
            "palpate-study = 1\n[animal.a]\nsex = 'male'\nage_days = 180\nspecimens = ['a1']\n[animal.b]\nsex = 'female'\nspecimens = ['b1']\n[specimen.a1]\nsite = 'left'\nthickness_mm = 9\n",
        )
        .unwrap();
        let mut before = labels(&["specimen=a1", "specimen.thickness_mm=11"]);
        study.complete(&mut before).unwrap();
        let mut entries = SessionMetadata::default();
        entries.set(SPECIMEN, "b1").unwrap();
        let after = completed(&before, &entries, &study).unwrap();
        // What was measured in the session stays.
        let expected =
            ["specimen=b1", "specimen.thickness_mm=11", "animal.name=b", "animal.sex=female"];
        assert_eq!(after, labels(&expected));
        let changes = changes(&before, &after);
        assert_eq!(
            changes.pairs(),
            "specimen=b1, animal.name=b, no animal.age_days, animal.sex=female, no specimen.site"
        );
        // The edit makes of the labels before what they are after, also from its JSON.
        let text = serde_json::to_string(&changes).unwrap();
        let mut edited = before.clone();
        edited.take(&serde_json::from_str(&text).unwrap());
        assert_eq!(edited, after);
        // A specimen that the study does not know keeps its animal: only its name was wrong.
        let mut renamed = SessionMetadata::default();
        renamed.set(SPECIMEN, "a-1").unwrap();
        let after = completed(&before, &renamed, &study).unwrap();
        assert_eq!(after.value(ANIMAL), Some("a".into()));
        assert_eq!(after.value("animal.age_days"), Some(180.0.into()));
    }
}
