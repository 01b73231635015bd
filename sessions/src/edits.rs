//! What people, or the program at the end of a run, say of a session afterwards. Nothing is ever written
//! over: the log stays as it is, and every edit stays in `edits.jsonl` beside it. Of several verdicts, or
//! several corrections of one contact, the last counts.

use crate::analyses::Input;
use crate::chain::{self, ChainError, Head};
use crate::folder::{LOCK_FILE, file_beside, segment_number};
use crate::lock::{HolderLock, LockError};
use chrono::{DateTime, Utc};
use palpate_model::units::Position;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use thiserror::Error;

/// Name of the file of edits in a session folder.
pub const EDITS_FILE: &str = "edits.jsonl";

palpate_model::named! {
    /// What a session is worth.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "lowercase")]
    pub enum Verdict {
        /// Nothing speaks against it.
        Valid = "valid",
        /// Something does; it is used, and every reader is told.
        Suspect = "suspect",
        /// It is not used unless asked for, and stays in the counts.
        Rejected = "rejected",
    }
}

impl FromStr for Verdict {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|one| one.name() == text);
        found.ok_or_else(|| format!("'{text}' is no verdict; give valid, suspect or rejected"))
    }
}

palpate_model::named! {
    /// What a person who looked at a session decided.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "lowercase")]
    pub enum Decision {
        /// It stands, with its analyses.
        Accepted = "accepted",
        /// It does not.
        Rejected = "rejected",
        /// It is to be done again.
        Repeat = "to be repeated",
    }
}

/// The review that counts, and what has changed since.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Review {
    /// What was decided.
    pub decision: Decision,
    /// By whom.
    pub by: String,
    /// When.
    pub at: DateTime<Utc>,
    /// Why.
    pub reason: String,
    /// What is not any more as it was seen; empty while the review stands.
    pub changed: Vec<String>,
}

/// Longest tag in letters.
const TAG_MAX: usize = 40;

/// What is said.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "edit", rename_all = "lowercase")]
pub enum Change {
    /// What the session is worth.
    Verdict {
        /// That.
        verdict: Verdict,
    },
    /// Where contact really was.
    Contact {
        /// Which of the contacts the session found, from 1.
        number: u32,
        /// Position from home.
        position_mm: Position,
        /// Position that was found, from home.
        was_mm: Position,
    },
    /// Words by which it is found.
    Tags {
        /// Those it gets.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        add: Vec<String>,
        /// Those it loses.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        remove: Vec<String>,
    },
    /// A remark; what it says is the edit's reason.
    Note,
    /// That somebody looked at it and decided.
    Review {
        /// What.
        decision: Decision,
        /// The files that were seen, with their hashes.
        seen: Vec<Input>,
    },
}

/// One edit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Edit {
    /// When it was made.
    pub at: DateTime<Utc>,
    /// By whom.
    pub by: String,
    /// Why.
    pub reason: String,
    /// What.
    #[serde(flatten)]
    pub change: Change,
}

/// Edits could not be read or made.
#[derive(Debug, Error)]
pub enum EditError {
    /// The file is not as it was written, or the disk refuses.
    #[error(transparent)]
    Chain(#[from] ChainError),
    /// The session is still being recorded.
    #[error(transparent)]
    Lock(#[from] LockError),
    /// Nobody would know why.
    #[error("an edit needs a reason, and a note its words; say it in a few words")]
    NoReason,
    /// Not a word that can be searched.
    #[error("'{tag}' cannot be a tag; give one word of at most {TAG_MAX} letters, as in +pilot")]
    Tag {
        /// What was given.
        tag: String,
    },
    /// A part of a recording, or a file, has no place for edits.
    #[error("{} is not a session folder; name the folder", path.display())]
    NotAFolder {
        /// What was named.
        path: PathBuf,
    },
}

/// Every edit of a session, in the order made.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Edits {
    /// The edits.
    pub all: Vec<Edit>,
    /// Whether the last one was begun and never finished, as a crash leaves it.
    pub is_torn: bool,
    /// How far their file goes.
    pub head: Head,
}

impl Edits {
    /// Reads the edits of a session, given its folder or a log file in it. A log file under another name
    /// than a session's has none.
    pub fn read(session: &Path, session_id: &str) -> Result<Self, EditError> {
        Self::read_since(session, session_id, Head::default())
    }

    /// As [`read`](Self::read), and refuses a file that does not hold what it held once.
    pub(crate) fn read_since(
        session: &Path,
        session_id: &str,
        since: Head,
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

    /// The verdict that counts, with the edit that says why.
    pub fn verdict(&self) -> Option<(Verdict, &Edit)> {
        self.all.iter().rev().find_map(|edit| match edit.change {
            Change::Verdict { verdict } => Some((verdict, edit)),
            _ => None,
        })
    }

    /// The correction that counts of a contact, numbered from 1.
    pub fn contact(&self, number: u32) -> Option<(Position, &Edit)> {
        self.all.iter().rev().find_map(|edit| match edit.change {
            Change::Contact { number: own, position_mm, .. } if own == number => {
                Some((position_mm, edit))
            }
            _ => None,
        })
    }

    /// The tags it has.
    pub fn tags(&self) -> BTreeSet<&str> {
        let mut tags = BTreeSet::new();
        for edit in &self.all {
            if let Change::Tags { add, remove } = &edit.change {
                tags.extend(add.iter().map(String::as_str));
                for tag in remove {
                    tags.remove(tag.as_str());
                }
            }
        }
        tags
    }

    /// The remarks, in the order made.
    pub fn notes(&self) -> impl Iterator<Item = &Edit> {
        let is_note = |edit: &&Edit| matches!(edit.change, Change::Note);
        self.all.iter().filter(is_note)
    }

    /// The last review. `now` are the files that were seen as they are now: the analyses and, unless only
    /// those are to be compared, every file of the log.
    pub fn review(&self, now: &[Input]) -> Option<Review> {
        let place = |edit: &Edit| matches!(edit.change, Change::Review { .. });
        let at = self.all.iter().rposition(place)?;
        let (edit, later) = (&self.all[at], &self.all[at + 1..]);
        let Change::Review { decision, seen } = &edit.change else {
            return None;
        };
        let is_other = |one: &&Input| {
            let seen = seen.iter().find(|seen| seen.what == one.what);
            seen.map(|seen| &seen.sha256) != Some(&one.sha256)
        };
        // Where no log is compared, none is missing.
        let is_log = |one: &Input| segment_number(&one.what).is_some();
        let has_logs = now.iter().any(is_log);
        let is_gone = |one: &&Input| {
            (has_logs || !is_log(one)) && now.iter().all(|there| there.what != one.what)
        };
        let gone = seen.iter().filter(is_gone);
        let changed = now.iter().filter(is_other).chain(gone);
        let mut changed: Vec<String> = changed.map(|one| one.what.clone()).collect();
        // Words by which it is found and remarks change nothing of what was seen.
        let is_aside = |edit: &Edit| matches!(edit.change, Change::Tags { .. } | Change::Note);
        if !later.iter().all(is_aside) {
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

/// Whether a word can be a tag.
fn check_tag(tag: &str) -> Result<(), EditError> {
    let is_word = !tag.is_empty() && !tag.chars().any(|it| it.is_whitespace() || it.is_control());
    if is_word && tag.chars().count() <= TAG_MAX {
        return Ok(());
    }
    Err(EditError::Tag { tag: tag.to_owned() })
}

/// Adds an edit to a session folder whose recording has ended.
pub fn add_edit(folder: &Path, session_id: &str, edit: &Edit) -> Result<(), EditError> {
    match &edit.change {
        // A tag says by itself why it is there.
        Change::Tags { add, remove } => {
            add.iter().chain(remove).try_for_each(|tag| check_tag(tag))?
        }
        _ if edit.reason.trim().is_empty() => return Err(EditError::NoReason),
        _ => {}
    }
    if !folder.is_dir() {
        return Err(EditError::NotAFolder { path: folder.into() });
    }
    let _lock = HolderLock::acquire_soon(&folder.join(LOCK_FILE))?;
    Ok(chain::append(&folder.join(EDITS_FILE), session_id, edit)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use chrono::TimeZone;

    fn edit(reason: &str, change: Change) -> Edit {
        Edit {
            at: Utc.with_ymd_and_hms(2026, 3, 5, 14, 15, 7).unwrap(),
            by: "Ada".into(),
            reason: reason.into(),
            change,
        }
    }

    fn verdict(verdict: Verdict) -> Change {
        Change::Verdict { verdict }
    }

    #[test]
    fn the_last_counts_and_all_are_kept() {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        let contact = |number, mm| Change::Contact {
            number,
            position_mm: Position(mm),
            was_mm: Position(41.0),
        };
        let edits = [
            edit("it finished", verdict(Verdict::Valid)),
            edit("by eye", contact(1, 41.25)),
            edit("hair on the probe", verdict(Verdict::Rejected)),
            edit("again, with the video", contact(1, 0.1 + 0.2)),
            edit("the gel was warm", Change::Note),
        ];
        for one in &edits {
            add_edit(at, "id", one).unwrap();
        }
        let read = Edits::read(at, "id").unwrap();
        assert_eq!(read.all, edits);
        let (worth, why) = read.verdict().unwrap();
        assert_eq!((worth, why.reason.as_str()), (Verdict::Rejected, "hair on the probe"));
        assert_eq!(read.contact(1).unwrap().0, Position(0.1 + 0.2));
        assert!(read.contact(2).is_none());
        let notes: Vec<&str> = read.notes().map(|one| one.reason.as_str()).collect();
        assert_eq!(notes, ["the gel was warm"]);
        // A segment belongs to the same session; a file of another name to none.
        assert_eq!(Edits::read(&at.join("001.mcap"), "id").unwrap(), read);
        assert_eq!(Edits::read(&at.join("alone.mcap"), "id").unwrap(), Edits::default());
    }

    #[test]
    fn tags_come_and_go_and_are_words() {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        let words = |words: &[&str]| words.iter().map(ToString::to_string).collect();
        let tags =
            |add: &[&str], remove: &[&str]| Change::Tags { add: words(add), remove: words(remove) };
        add_edit(at, "id", &edit("", tags(&["pilot", "µ-gel"], &[]))).unwrap();
        add_edit(at, "id", &edit("", tags(&["good"], &["pilot", "none"]))).unwrap();
        let read = Edits::read(at, "id").unwrap();
        assert_eq!(read.tags(), BTreeSet::from(["good", "µ-gel"]));
        for tag in ["", "two words", "a\u{0}", &"x".repeat(41)] {
            let refused = add_edit(at, "id", &edit("", tags(&[], &[tag])));
            assert!(matches!(refused, Err(EditError::Tag { .. })), "{tag:?}");
        }
    }

    #[test]
    fn a_review_stands_until_something_it_saw_changes() {
        let input = |what: &str, sha256: &str| Input { what: what.into(), sha256: sha256.into() };
        let seen = vec![input("000.mcap", "a"), input("analyses.jsonl", "b")];
        let decision = Decision::Accepted;
        let review = Change::Review { decision, seen: seen.clone() };
        let mut edits = Edits::default();
        assert_eq!(edits.review(&seen), None);
        edits.all = vec![edit("before", verdict(Verdict::Suspect)), edit("I looked", review)];
        let changed = |edits: &Edits, now: &[Input]| edits.review(now).unwrap().changed;
        assert!(changed(&edits, &seen).is_empty());
        assert!(changed(&edits, &seen[1..]).is_empty());
        assert_eq!(changed(&edits, &seen[..1]), ["analyses.jsonl"]);
        assert_eq!(changed(&edits, &[]), ["analyses.jsonl"]);
        let other = [input("000.mcap", "c"), input("001.mcap", "d"), seen[1].clone()];
        assert_eq!(changed(&edits, &other), ["000.mcap", "001.mcap"]);
        let other = [input("001.mcap", "d"), seen[1].clone()];
        assert_eq!(changed(&edits, &other), ["001.mcap", "000.mcap"]);
        let tags = Change::Tags { add: vec!["good".into()], remove: Vec::new() };
        edits.all.push(edit("", tags));
        edits.all.push(edit("seen by two", Change::Note));
        assert!(changed(&edits, &seen).is_empty());
        edits.all.push(edit("after", verdict(Verdict::Valid)));
        assert_eq!(changed(&edits, &seen), [EDITS_FILE]);
    }

    #[test]
    fn an_edit_needs_a_reason_a_folder_and_an_ended_recording() {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        let none = add_edit(at, "id", &edit(" ", verdict(Verdict::Valid))).unwrap_err();
        assert!(none.to_string().contains("needs a reason"));
        let no_folder = add_edit(&at.join("x"), "id", &edit("why", verdict(Verdict::Valid)));
        assert!(no_folder.unwrap_err().to_string().contains("name the folder"));
        let held = HolderLock::acquire(&at.join(LOCK_FILE)).unwrap();
        let busy = add_edit(at, "id", &edit("why", verdict(Verdict::Valid))).unwrap_err();
        let id = std::process::id().to_string();
        assert!(busy.to_string().contains(&id), "{busy}");
        // Whoever only adds an edit at the same time is waited for.
        std::thread::scope(|scope| {
            scope.spawn(|| add_edit(at, "id", &edit("why", verdict(Verdict::Valid))).unwrap());
            std::thread::sleep(std::time::Duration::from_millis(100));
            drop(held);
        });
        assert_eq!(Edits::read(at, "id").unwrap().all.len(), 1);
    }
}
