//! Edits of sessions: tags, notes, data quality and reviews. Each is a record beside the log and overwrites nothing.

use crate::progress::Progress;
use crate::report::said::tags;
use chrono::{DateTime, Utc};
use palpate_runner::wall_now;
use palpate_sessions::analyses::{Analyses, AnalysisError, inputs_of};
use palpate_sessions::{
    Change, Decision, EDITS_FILE, Edit, EditError, Edits, ReadError, Summary, Verdict, add_edit,
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
pub enum SayFailure {
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error(transparent)]
    Analyses(#[from] AnalysisError),
    #[error(transparent)]
    Edit(#[from] EditError),
}

/// A session to be edited.
#[derive(Clone, Debug)]
pub struct Subject {
    pub folder: PathBuf,
    pub id: String,
    pub edits: Edits,
}

impl Subject {
    pub fn read(folder: &Path) -> Result<Self, SayFailure> {
        let id = Summary::read(folder)?.manifest.session_id;
        Ok(Self { edits: Edits::read(folder, &id)?, folder: folder.to_owned(), id })
    }

    pub fn say(&self, by: &str, reason: &str, change: Change) -> Result<Edit, SayFailure> {
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
    pub fn review(&self, decision: Decision) -> Result<Change, SayFailure> {
        let mut seen = inputs_of(&self.folder)?;
        // The order of the edits shows which came before; the review itself is among them.
        seen.retain(|one| one.what != EDITS_FILE);
        seen.extend(Analyses::read(&self.folder, &self.id)?.input());
        Ok(Change::Review { decision, seen })
    }
}

/// An edit of one or several sessions.
#[derive(Clone, Debug, PartialEq)]
pub enum Saying {
    Tags {
        add: Vec<String>,
        remove: Vec<String>,
    },
    Note(String),
    /// Data quality, and the reason.
    Verdict(Verdict, String),
    /// A reviewer's decision, and the reason.
    Review(Decision, String),
}

impl Saying {
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
    written: (Change, String),
    opposite: (Change, String),
}

/// Edits made together, which are undone together.
#[derive(Clone, Debug, PartialEq)]
pub struct Act {
    pub words: String,
    steps: Vec<Step>,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Said {
    pub words: String,
    /// The part that can be undone.
    pub act: Option<Act>,
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
) -> Said {
    let (mut steps, mut failed, mut written) = (Vec::new(), Vec::new(), 0);
    for (done, item) in of.iter().enumerate() {
        let name = folder(item).file_name().unwrap_or_default();
        if progress.tell(done, of.len(), &name.to_string_lossy()).is_break() {
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
    Said { act: (!steps.is_empty()).then(|| Act { words: words.clone(), steps }), words, failed }
}

/// Edits sessions. Notes and reviews stay: only tags and data quality can be undone.
#[must_use]
pub fn say(saying: &Saying, folders: &[PathBuf], by: &str, progress: &dyn Progress) -> Said {
    let one = |folder: &PathBuf| say_one(saying, folder, by).map_err(|err| err.to_string());
    each(&saying.words(), folders, progress, |it| it.as_path(), one)
}

fn say_one(saying: &Saying, folder: &Path, by: &str) -> Result<(Option<Step>, bool), SayFailure> {
    let subject = Subject::read(folder)?;
    let (change, reason, opposite) = match saying {
        Saying::Tags { add, remove } => {
            let has = subject.edits.tags();
            // Only what changes is written, so that only that is undone.
            let (mut add, mut remove) = (add.clone(), remove.clone());
            add.retain(|tag| !has.contains(tag.as_str()));
            remove.retain(|tag| has.contains(tag.as_str()));
            if add.is_empty() && remove.is_empty() {
                return Ok((None, false));
            }
            let opposite = Change::Tags { add: remove.clone(), remove: add.clone() };
            (Change::Tags { add, remove }, "", Some((opposite, String::new())))
        }
        Saying::Note(text) => (Change::Note, text.as_str(), None),
        Saying::Review(decision, reason) => (subject.review(*decision)?, reason.as_str(), None),
        Saying::Verdict(verdict, reason) => {
            let opposite = subject
                .edits
                .verdict()
                .map(|(verdict, edit)| (Change::Verdict { verdict }, edit.reason.clone()));
            (Change::Verdict { verdict: *verdict }, reason.as_str(), opposite)
        }
    };
    let wrote = subject.say(by, reason, change.clone())?.at;
    let written = (change, reason.to_owned());
    let folder = folder.to_owned();
    Ok((opposite.map(|opposite| Step { folder, wrote, written, opposite }), true))
}

/// Writes the opposite of edits, as records of their own. Undoing the result repeats the edits.
#[must_use]
pub fn take_back(act: &Act, by: &str, progress: &dyn Progress) -> Said {
    let one = |step: &Step| take_back_one(step, by).map(|step| (Some(step), true));
    let mut outcome = each("", &act.steps, progress, |step| &step.folder, one);
    outcome.words = match outcome.act {
        Some(_) => act.words.clone(),
        None => "nothing was written".into(),
    };
    if let Some(opposite) = &mut outcome.act {
        opposite.words.clone_from(&act.words);
    }
    outcome
}

fn take_back_one(step: &Step, by: &str) -> Result<Step, String> {
    let subject = Subject::read(&step.folder).map_err(|err| err.to_string())?;
    let (change, reason) = &step.opposite;
    let is_newest = subject.edits.verdict().is_some_and(|(_, edit)| edit.at == step.wrote);
    if matches!(change, Change::Verdict { .. }) && !is_newest {
        return Err("its verdict was given again since, so it is not undone".into());
    }
    let edit = subject.say(by, reason, change.clone()).map_err(|err| err.to_string())?;
    Ok(Step {
        folder: step.folder.clone(),
        wrote: edit.at,
        written: step.opposite.clone(),
        opposite: step.written.clone(),
    })
}
