//! Metadata entries of sessions after the run: as given, and as the study of the library has them.

use crate::edits::{EditFailure, EditTarget};
use crate::session_actions::Attribution;
use crate::study_table::{StudyProblem, StudyTable};
use palpate_model::metadata::{METADATA_KEYS, MetadataError, SessionLabels, SessionMetadata};
use palpate_runner::study::{Study, StudyError};
use palpate_sessions::{EditChange, Manifest, SessionSummary};
use serde::Serialize;
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
    Contradiction(StudyProblem),
}

/// What was written beside a session: nothing where it had all entries.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EnteredSession {
    pub session: PathBuf,
    pub entries: SessionMetadata,
}

/// Sets entries of all sessions, completed by the study of the library. A refusal writes nothing.
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
        return Err(SessionEntriesError::Contradiction(problem));
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
    after.take(entries);
    study.complete(&mut after).map_err(|err| err.to_string())?;
    after.check().map_err(|err: MetadataError| err.to_string())?;
    Ok(after)
}

/// The entries that are new or have another value.
fn changes(before: &SessionLabels, after: &SessionLabels) -> SessionMetadata {
    let mut changes = SessionMetadata::default();
    for key in METADATA_KEYS {
        if let Some(value) = after.value(key.name)
            && before.value(key.name).as_ref() != Some(&value)
        {
            changes.put(key.name, value);
        }
    }
    changes
}
