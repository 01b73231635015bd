//! What people say of sessions afterwards, as the command line and the window both write it: every time a record beside
//! the log, never over anything.

use crate::progress::Progress;
use crate::report::said::tags;
use chrono::{DateTime, Utc};
use palpate_runner::wall_now;
use palpate_sessions::analyses::{Analyses, AnalysisError, inputs_of};
use palpate_sessions::edits::{
    Change, Decision, EDITS_FILE, Edit, EditError, Edits, Verdict, add_edit,
};
use palpate_sessions::log::{ReadError, Summary};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// The name given, or that of the login.
#[must_use]
pub fn author(given: Option<&str>) -> String {
    let login = || std::env::var("USER").or_else(|_| std::env::var("USERNAME"));
    given.map_or_else(|| login().unwrap_or_else(|_| "unknown".into()), str::to_owned)
}

/// Nothing was said of a session.
#[derive(Debug, Error)]
pub enum SayFailure {
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error(transparent)]
    Analyses(#[from] AnalysisError),
    #[error(transparent)]
    Edit(#[from] EditError),
}

/// A session of which something is to be said.
#[derive(Clone, Debug)]
pub struct Subject {
    pub folder: PathBuf,
    pub id: String,
    /// What was said of it so far.
    pub edits: Edits,
}

impl Subject {
    /// Reads what the session says of itself, and its edits.
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

/// What is to be said of sessions.
#[derive(Clone, Debug, PartialEq)]
pub enum Saying {
    /// Words by which they are found.
    Tags {
        /// Those they get.
        add: Vec<String>,
        /// Those they lose.
        remove: Vec<String>,
    },
    Note(String),
    /// What they are worth, and why.
    Verdict(Verdict, String),
    /// A reviewer's decision, and why.
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

/// One edit that can be taken back: what was written, and what says the opposite.
#[derive(Clone, Debug, PartialEq)]
struct Step {
    folder: PathBuf,
    wrote: DateTime<Utc>,
    written: Part,
    opposite: Part,
}

/// The part of an edit that an opposite has.
#[derive(Clone, Debug, PartialEq)]
enum Part {
    Tags { add: Vec<String>, remove: Vec<String> },
    Verdict(Verdict, String),
}

/// Edits made together, which are taken back together.
#[derive(Clone, Debug, PartialEq)]
pub struct Act {
    /// What was done, in words.
    pub words: String,
    steps: Vec<Step>,
}

/// What came of saying something.
#[derive(Clone, Debug, PartialEq)]
pub struct Said {
    /// What was done, in words.
    pub words: String,
    /// What can be taken back of it.
    pub act: Option<Act>,
    /// Why nothing was said of some of the sessions, a sentence each.
    pub failed: Vec<String>,
}

fn sessions(count: usize) -> String {
    match count {
        1 => "1 session".into(),
        count => format!("{count} sessions"),
    }
}

/// Does `one` to every session and tells what came of it; `one` gives what can be taken back, and whether anything was
/// written.
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
            let left = sessions(of.len() - done);
            failed.push(format!("{left} not changed: cancelled"));
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

/// Says something of sessions. Notes and reviews stay: only tags and verdicts can be taken back.
#[must_use]
pub fn say(saying: &Saying, folders: &[PathBuf], by: &str, progress: &dyn Progress) -> Said {
    let folder = |folder: &PathBuf| -> Result<_, String> {
        say_one(saying, folder, by).map_err(|err| err.to_string())
    };
    each(&saying.words(), folders, progress, |it| it.as_path(), folder)
}

fn say_one(saying: &Saying, folder: &Path, by: &str) -> Result<(Option<Step>, bool), SayFailure> {
    let subject = Subject::read(folder)?;
    let step = |edit: Edit, written, opposite| Step {
        folder: folder.to_owned(),
        wrote: edit.at,
        written,
        opposite,
    };
    match saying {
        Saying::Tags { add, remove } => {
            let has = subject.edits.tags();
            // Only what changes is written, so that only that is taken back.
            let (mut add, mut remove) = (add.clone(), remove.clone());
            add.retain(|tag| !has.contains(tag.as_str()));
            remove.retain(|tag| has.contains(tag.as_str()));
            if add.is_empty() && remove.is_empty() {
                return Ok((None, false));
            }
            let written = Part::Tags { add: add.clone(), remove: remove.clone() };
            let opposite = Part::Tags { add: remove.clone(), remove: add.clone() };
            let edit = subject.say(by, "", Change::Tags { add, remove })?;
            Ok((Some(step(edit, written, opposite)), true))
        }
        Saying::Note(text) => {
            subject.say(by, text, Change::Note)?;
            Ok((None, true))
        }
        Saying::Review(decision, reason) => {
            subject.say(by, reason, subject.review(*decision)?)?;
            Ok((None, true))
        }
        Saying::Verdict(verdict, reason) => {
            let before = subject.edits.verdict();
            let opposite =
                before.map(|(verdict, edit)| Part::Verdict(verdict, edit.reason.clone()));
            let edit = subject.say(by, reason, Change::Verdict { verdict: *verdict })?;
            let written = Part::Verdict(*verdict, reason.clone());
            Ok((opposite.map(|opposite| step(edit, written, opposite)), true))
        }
    }
}

/// Writes the opposite of edits, as records of their own. What can be taken back of that is the way to do them again.
#[must_use]
pub fn take_back(act: &Act, by: &str, progress: &dyn Progress) -> Said {
    let one = |step: &Step| take_back_one(step, by).map(|step| (Some(step), true));
    let mut said = each("", &act.steps, progress, |step| &step.folder, one);
    said.words = match said.act {
        Some(_) => act.words.clone(),
        None => "nothing was written".into(),
    };
    if let Some(opposite) = &mut said.act {
        opposite.words.clone_from(&act.words);
    }
    said
}

fn take_back_one(step: &Step, by: &str) -> Result<Step, String> {
    let subject = Subject::read(&step.folder).map_err(|err| err.to_string())?;
    let (reason, change) = match &step.opposite {
        Part::Tags { add, remove } => {
            (String::new(), Change::Tags { add: add.clone(), remove: remove.clone() })
        }
        Part::Verdict(verdict, reason) => {
            let now = subject.edits.verdict();
            if now.is_none_or(|(_, edit)| edit.at != step.wrote) {
                return Err("its verdict was given again since, so it is not undone".into());
            }
            (reason.clone(), Change::Verdict { verdict: *verdict })
        }
    };
    let edit = subject.say(by, &reason, change).map_err(|err| err.to_string())?;
    Ok(Step {
        folder: step.folder.clone(),
        wrote: edit.at,
        written: step.opposite.clone(),
        opposite: step.written.clone(),
    })
}
