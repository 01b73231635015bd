//! Edits of a finished session, by people or by the program at the end of a run: data quality, corrected contacts, metadata
//! entries, tags, notes and reviews. The log stays unchanged; every edit stays in `edits.jsonl` beside it. The last verdict,
//! and the last correction of each contact and entry, counts.

use crate::analyses::AnalysisInput;
use crate::chain::{self, ChainError, ChainHead};
use crate::folder::{LOCK_FILE, file_beside, segment_number};
use crate::lock::{HolderLock, LockError};
use chrono::{DateTime, Utc};
use palpate_model::metadata::{SessionLabels, SessionMetadata};
use palpate_model::units::Position;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use thiserror::Error;

pub const EDITS_FILE: &str = "edits.jsonl";

palpate_model::named! {
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "lowercase")]
    pub enum DataQuality {
        Valid = "valid",
        /// Used, with a remark to every reader.
        Suspect = "suspect",
        /// Used only on request; still counted as a session.
        Rejected = "rejected",
    }
}

impl FromStr for DataQuality {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|one| one.name() == text);
        found.ok_or_else(|| format!("'{text}' is not a verdict; give valid, suspect or rejected"))
    }
}

palpate_model::named! {
    /// A reviewer's decision about a session.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "lowercase")]
    pub enum ReviewDecision {
        /// With its analyses.
        Accepted = "accepted",
        Rejected = "rejected",
        Repeat = "to be repeated",
    }
}

/// The last review and what has changed since.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Review {
    pub decision: ReviewDecision,
    pub by: String,
    pub at: DateTime<Utc>,
    pub reason: String,
    /// Names of files that differ from those reviewed; empty while the review is up to date.
    pub changed: Vec<String>,
}

/// Longest tag in letters.
const TAG_MAX: usize = 40;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "edit", rename_all = "lowercase")]
pub enum EditChange {
    Verdict {
        verdict: DataQuality,
    },
    Contact {
        /// Number of the contact in the session, from 1.
        number: u32,
        position_mm: Position,
        /// Position in the recording.
        was_mm: Position,
    },
    /// Metadata entries that were not known at the start, or were wrong.
    About {
        entries: SessionMetadata,
    },
    Tags {
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        add: Vec<String>,
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        remove: Vec<String>,
    },
    /// The note's text is the edit's reason.
    Note,
    Review {
        decision: ReviewDecision,
        /// Hashes of the reviewed files.
        seen: Vec<AnalysisInput>,
    },
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Edit {
    pub at: DateTime<Utc>,
    pub by: String,
    pub reason: String,
    #[serde(flatten)]
    pub change: EditChange,
}

#[derive(Debug, Error)]
pub enum EditError {
    #[error(transparent)]
    Chain(#[from] ChainError),
    #[error(transparent)]
    Lock(#[from] LockError),
    #[error("an edit needs a reason and a note needs a text; give a few words")]
    NoReason,
    #[error("'{tag}' cannot be a tag; give one word of at most {TAG_MAX} letters, as in +pilot")]
    Tag { tag: String },
    #[error("{} is not a session folder; choose a session folder", path.display())]
    NotAFolder { path: PathBuf },
}

/// All edits of a session, in the order of writing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Edits {
    pub all: Vec<Edit>,
    /// Whether the last line is incomplete, as a crash leaves it.
    pub is_torn: bool,
    pub head: ChainHead,
}

impl Edits {
    /// `session` is the session's folder or a log file in it. A log file under another name has no edits.
    pub fn read(session: &Path, session_id: &str) -> Result<Self, EditError> {
        Self::read_since(session, session_id, ChainHead::default())
    }

    /// Like [`read`](Self::read), and refuses a file that no longer holds the lines up to `since`.
    pub(crate) fn read_since(
        session: &Path,
        session_id: &str,
        since: ChainHead,
    ) -> Result<Self, EditError> {
        let Some(path) = file_beside(session, EDITS_FILE) else {
            return Ok(Self::default());
        };
        let chain = chain::read_since(&path, session_id, since)?;
        Ok(Self {
            all: chain.records(&path, "an edit")?,
            is_torn: chain.is_torn,
            head: chain.head(),
        })
    }

    /// The last verdict and its edit.
    pub fn verdict(&self) -> Option<(DataQuality, &Edit)> {
        self.all.iter().rev().find_map(|edit| match edit.change {
            EditChange::Verdict { verdict } => Some((verdict, edit)),
            _ => None,
        })
    }

    /// The last correction of a contact, numbered from 1.
    pub fn contact(&self, number: u32) -> Option<(Position, &Edit)> {
        self.all.iter().rev().find_map(|edit| match edit.change {
            EditChange::Contact { number: own, position_mm, .. } if own == number => {
                Some((position_mm, edit))
            }
            _ => None,
        })
    }

    /// Replaces labels by those that edits give.
    pub fn apply_to_labels(&self, labels: &mut SessionLabels) {
        for edit in &self.all {
            if let EditChange::About { entries } = &edit.change {
                labels.take(entries);
            }
        }
    }

    /// The last edit that gives a metadata entry.
    pub fn about(&self, name: &str) -> Option<&Edit> {
        self.all.iter().rev().find(|edit| match &edit.change {
            EditChange::About { entries } => entries.get(name).is_some(),
            _ => false,
        })
    }

    pub fn tags(&self) -> BTreeSet<&str> {
        let mut tags = BTreeSet::new();
        for edit in &self.all {
            if let EditChange::Tags { add, remove } = &edit.change {
                tags.extend(add.iter().map(String::as_str));
                for tag in remove {
                    tags.remove(tag.as_str());
                }
            }
        }
        tags
    }

    pub fn notes(&self) -> impl Iterator<Item = &Edit> {
        let is_note = |edit: &&Edit| matches!(edit.change, EditChange::Note);
        self.all.iter().filter(is_note)
    }

    /// The last review. `now` has the present hashes of the analyses and, to compare the log too, of all its files.
    pub fn review(&self, now: &[AnalysisInput]) -> Option<Review> {
        let is_review = |edit: &Edit| matches!(edit.change, EditChange::Review { .. });
        let at = self.all.iter().rposition(is_review)?;
        let (edit, later) = (&self.all[at], &self.all[at + 1..]);
        let EditChange::Review { decision, seen } = &edit.change else {
            return None;
        };
        let is_other = |one: &&AnalysisInput| {
            let seen = seen.iter().find(|seen| seen.what == one.what);
            seen.map(|seen| &seen.sha256) != Some(&one.sha256)
        };
        // If `now` has no log files, the log is not compared.
        let is_log = |one: &AnalysisInput| segment_number(&one.what).is_some();
        let has_logs = now.iter().any(is_log);
        let is_gone = |one: &&AnalysisInput| {
            (has_logs || !is_log(one)) && now.iter().all(|there| there.what != one.what)
        };
        let gone = seen.iter().filter(is_gone);
        let changed = now.iter().filter(is_other).chain(gone);
        let mut changed: Vec<String> = changed.map(|one| one.what.clone()).collect();
        // Tags and notes do not affect the reviewed data.
        let is_irrelevant =
            |edit: &Edit| matches!(edit.change, EditChange::Tags { .. } | EditChange::Note);
        if !later.iter().all(is_irrelevant) {
            changed.push(EDITS_FILE.to_owned());
        }
        Some(Review {
            decision: *decision,
            by: edit.by.clone(),
            at: edit.at,
            reason: edit.reason.clone(),
            changed,
        })
    }
}

fn check_tag(tag: &str) -> Result<(), EditError> {
    let is_word = !tag.is_empty() && !tag.chars().any(|it| it.is_whitespace() || it.is_control());
    if is_word && tag.chars().count() <= TAG_MAX {
        return Ok(());
    }
    Err(EditError::Tag { tag: tag.to_owned() })
}

/// Appends an edit. The recording must have ended.
pub fn add_edit(folder: &Path, session_id: &str, edit: &Edit) -> Result<(), EditError> {
    match &edit.change {
        // A tag explains itself.
        EditChange::Tags { add, remove } => {
            add.iter().chain(remove).try_for_each(|tag| check_tag(tag))?
        }
        _ if edit.reason.trim().is_empty() => return Err(EditError::NoReason),
        _ => {}
    }
    if !folder.is_dir() {
        return Err(EditError::NotAFolder { path: folder.into() });
    }
    let _lock = HolderLock::acquire_waiting(&folder.join(LOCK_FILE))?;
    // Nothing is added to edits that this version does not understand.
    Edits::read(folder, session_id)?;
    Ok(chain::append(&folder.join(EDITS_FILE), session_id, edit)?)
}

#[cfg(test)]
mod tests;
