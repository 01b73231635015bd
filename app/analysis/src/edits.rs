//! Edits of sessions: tags, notes, data quality and reviews. Each is a record beside the log and overwrites nothing.

use crate::progress::Progress;
use crate::report::session_text::tags;
use chrono::{DateTime, Utc};
use palpate_runner::wall_now;
use palpate_sessions::analyses::{Analyses, AnalysisError, read_session_inputs};
use palpate_sessions::{
    DataQuality, EDITS_FILE, Edit, EditChange, EditError, Edits, ReadError, ReviewDecision,
    SessionSummary, add_edit,
};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// The given name, else the login name.
#[must_use]
pub fn author(given: Option<&str>) -> String {
    let login = || std::env::var("USER").or_else(|_| std::env::var("USERNAME"));
    given.map_or_else(|| login().unwrap_or_else(|_| "unknown".into()), str::to_owned)
}

#[derive(Debug, Error)]
pub enum EditFailure {
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error(transparent)]
    Analyses(#[from] AnalysisError),
    #[error(transparent)]
    Edit(#[from] EditError),
}

/// A session to be edited.
#[derive(Clone, Debug)]
pub struct EditTarget {
    pub folder: PathBuf,
    pub id: String,
    pub edits: Edits,
}

impl EditTarget {
    pub fn read(folder: &Path) -> Result<Self, EditFailure> {
        let id = SessionSummary::read(folder)?.manifest.session_id;
        Ok(Self { edits: Edits::read(folder, &id)?, folder: folder.to_owned(), id })
    }

    pub fn add_edit(
        &self,
        by: &str,
        reason: &str,
        change: EditChange,
    ) -> Result<Edit, EditFailure> {
        let edit = Edit {
            at: wall_now().into(),
            by: by.to_owned(),
            reason: reason.trim().to_owned(),
            change,
        };
        add_edit(&self.folder, &self.id, &edit)?;
        Ok(edit)
    }

    /// A review of the session as it is now: with the hash of every file of the log and of the analyses.
    pub fn review(&self, decision: ReviewDecision) -> Result<EditChange, EditFailure> {
        let mut seen = read_session_inputs(&self.folder)?;
        // The order of the edits shows which came before; the review itself is among them.
        seen.retain(|one| one.what != EDITS_FILE);
        seen.extend(Analyses::read(&self.folder, &self.id)?.input());
        Ok(EditChange::Review { decision, seen })
    }
}

/// An edit of one or several sessions.
#[derive(Clone, Debug, PartialEq)]
pub enum SessionEdit {
    Tags {
        add: Vec<String>,
        remove: Vec<String>,
    },
    Note(String),
    /// Data quality, and the reason.
    Verdict(DataQuality, String),
    /// A reviewer's decision, and the reason.
    Review(ReviewDecision, String),
}

impl SessionEdit {
    pub fn words(&self) -> String {
        match self {
            Self::Tags { add, remove } => tags(add, remove),
            Self::Note(_) => "note".into(),
            Self::Verdict(verdict, _) => format!("verdict {verdict}"),
            Self::Review(decision, _) => format!("review, {}", decision.name()),
        }
    }
}

/// One edit that can be undone: the change that was written, and its opposite, each with its reason.
#[derive(Clone, Debug, PartialEq)]
struct Step {
    folder: PathBuf,
    wrote: DateTime<Utc>,
    written: (EditChange, String),
    opposite: (EditChange, String),
}

/// Edits made together, which are undone together.
#[derive(Clone, Debug, PartialEq)]
pub struct UndoableEdits {
    pub words: String,
    steps: Vec<Step>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct EditOutcome {
    pub words: String,
    /// The part that can be undone.
    pub undo: Option<UndoableEdits>,
    /// A sentence for each session that could not be edited.
    pub failed: Vec<String>,
}

fn sessions(count: usize) -> String {
    match count {
        1 => "1 session".into(),
        count => format!("{count} sessions"),
    }
}

/// Does `one` to every session; `one` returns the step that can be undone, and whether anything was written.
fn each<T>(
    words: &str,
    of: &[T],
    progress: &dyn Progress,
    folder: impl Fn(&T) -> &Path,
    one: impl Fn(&T) -> Result<(Option<Step>, bool), String>,
) -> EditOutcome {
    let (mut steps, mut failed, mut written) = (Vec::new(), Vec::new(), 0);
    for (done, item) in of.iter().enumerate() {
        let name = folder(item).file_name().unwrap_or_default();
        if progress.report(done, of.len(), &name.to_string_lossy()).is_break() {
            let remaining = sessions(of.len() - done);
            failed.push(format!("{remaining} not changed: cancelled"));
            break;
        }
        match one(item) {
            Ok((step, was_written)) => {
                steps.extend(step);
                written += usize::from(was_written);
            }
            Err(err) => failed.push(format!("{}: {err}", name.to_string_lossy())),
        }
    }
    let words = format!("{words} on {}", sessions(written));
    EditOutcome {
        undo: (!steps.is_empty()).then(|| UndoableEdits { words: words.clone(), steps }),
        words,
        failed,
    }
}

/// Edits sessions. Notes and reviews stay: only tags and data quality can be undone.
#[must_use]
pub fn edit_sessions(
    saying: &SessionEdit,
    folders: &[PathBuf],
    by: &str,
    progress: &dyn Progress,
) -> EditOutcome {
    let one = |folder: &PathBuf| say_one(saying, folder, by).map_err(|err| err.to_string());
    each(&saying.words(), folders, progress, |it| it.as_path(), one)
}

fn say_one(
    saying: &SessionEdit,
    folder: &Path,
    by: &str,
) -> Result<(Option<Step>, bool), EditFailure> {
    let subject = EditTarget::read(folder)?;
    let (change, reason, opposite) = match saying {
        SessionEdit::Tags { add, remove } => {
            let has = subject.edits.tags();
            // Only what changes is written, so that only that is undone.
            let (mut add, mut remove) = (add.clone(), remove.clone());
            add.retain(|tag| !has.contains(tag.as_str()));
            remove.retain(|tag| has.contains(tag.as_str()));
            if add.is_empty() && remove.is_empty() {
                return Ok((None, false));
            }
            let opposite = EditChange::Tags { add: remove.clone(), remove: add.clone() };
            (EditChange::Tags { add, remove }, "", Some((opposite, String::new())))
        }
        SessionEdit::Note(text) => (EditChange::Note, text.as_str(), None),
        SessionEdit::Review(decision, reason) => {
            (subject.review(*decision)?, reason.as_str(), None)
        }
        SessionEdit::Verdict(verdict, reason) => {
            let opposite = subject
                .edits
                .verdict()
                .map(|(verdict, edit)| (EditChange::Verdict { verdict }, edit.reason.clone()));
            (EditChange::Verdict { verdict: *verdict }, reason.as_str(), opposite)
        }
    };
    let wrote = subject.add_edit(by, reason, change.clone())?.at;
    let written = (change, reason.to_owned());
    let folder = folder.to_owned();
    Ok((opposite.map(|opposite| Step { folder, wrote, written, opposite }), true))
}

/// Writes the opposite of edits, as records of their own. Undoing the result repeats the edits.
#[must_use]
pub fn undo_edits(act: &UndoableEdits, by: &str, progress: &dyn Progress) -> EditOutcome {
    let one = |step: &Step| take_back_one(step, by).map(|step| (Some(step), true));
    let mut outcome = each("", &act.steps, progress, |step| &step.folder, one);
    outcome.words = match outcome.undo {
        Some(_) => act.words.clone(),
        None => "nothing was written".into(),
    };
    if let Some(opposite) = &mut outcome.undo {
        opposite.words.clone_from(&act.words);
    }
    outcome
}

fn take_back_one(step: &Step, by: &str) -> Result<Step, String> {
    let subject = EditTarget::read(&step.folder).map_err(|err| err.to_string())?;
    let (change, reason) = &step.opposite;
    let is_newest = subject.edits.verdict().is_some_and(|(_, edit)| edit.at == step.wrote);
    if matches!(change, EditChange::Verdict { .. }) && !is_newest {
        return Err("the edit cannot be undone, because the verdict was changed after it".into());
    }
    let edit = subject.add_edit(by, reason, change.clone()).map_err(|err| err.to_string())?;
    Ok(Step {
        folder: step.folder.clone(),
        wrote: edit.at,
        written: step.opposite.clone(),
        opposite: step.written.clone(),
    })
}
