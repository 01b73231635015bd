//! A journal: one line of JSON an entry, each on disk before the next thing happens, so that a series that broke off
//! can be continued at the right place.

use crate::chain::{self, ChainError, Head};
use crate::folder::create_folder;
use chrono::{DateTime, SecondsFormat, Utc};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;
use thiserror::Error;

/// Name of the journal in the folder of a series.
pub const JOURNAL_FILE: &str = "journal.jsonl";

/// A journal could not be read or written.
#[derive(Debug, Error)]
pub enum JournalError {
    /// The disk does not do it.
    #[error("the journal cannot be {what} ({source}): {}", path.display())]
    Io {
        /// Read or written.
        what: &'static str,
        /// Its file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A line in the middle is no entry.
    #[error(
        "line {line} of the journal cannot be understood ({reason}); restore it from a backup or begin in a new folder: {}",
        path.display()
    )]
    Line {
        /// Counted from 1.
        line: usize,
        /// The parser's words.
        reason: String,
        /// Its file.
        path: PathBuf,
    },
    /// Entries are missing at its end that were written.
    #[error(
        "the journal holds {found} of the {written} entries that were written, or others; restore it from a backup, or take {} away to go on from those that are there: {}",
        Head::file_of(path).display(), path.display()
    )]
    Shortened {
        /// Entries in it.
        found: u64,
        /// Entries that were written.
        written: u64,
        /// Its file.
        path: PathBuf,
    },
    /// Another program has locked it, or its head cannot be understood.
    #[error(transparent)]
    Chain(ChainError),
}

/// A time as a journal writes it: RFC 3339 in UTC, to the millisecond.
#[must_use]
pub fn stamp(at: SystemTime) -> String {
    DateTime::<Utc>::from(at).to_rfc3339_opts(SecondsFormat::Millis, true)
}

/// An open journal.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    is_plain: bool,
}

impl Journal {
    /// Opens the journal of a folder, new or begun, and reads what it holds. A last line without its end is
    /// what a crash left of an entry that never counted.
    ///
    /// Every line carries a checksum, as described in [`crate::edits`]. A journal begun by a palpate that wrote
    /// none is read as it is, and goes on without.
    pub fn open<T: DeserializeOwned>(folder: &Path) -> Result<(Self, Vec<T>), JournalError> {
        let path = folder.join(JOURNAL_FILE);
        let failed = |what| {
            let path = path.clone();
            move |source| JournalError::Io { what, path, source }
        };
        create_folder(folder).map_err(failed("written"))?;
        let bytes = match fs::read(&path) {
            Ok(bytes) => bytes,
            Err(err) if err.kind() == io::ErrorKind::NotFound => Vec::new(),
            Err(err) => return Err(failed("read")(err)),
        };
        let first = bytes.split(|byte| *byte == b'\n').next();
        let first = first.and_then(|line| serde_json::from_slice::<Value>(line).ok());
        let is_plain = first.is_some_and(|line| line.get("checksum").is_none());
        let bodies = match is_plain {
            true => plain_lines(&path, &bytes)?,
            false => chain::read(&path, JOURNAL_FILE).map_err(told)?.bodies,
        };
        let entries = bodies.into_iter().enumerate().map(|(index, body)| {
            T::deserialize(body).map_err(|err| JournalError::Line {
                line: index + 1,
                reason: err.to_string(),
                path: path.clone(),
            })
        });
        let entries = entries.collect::<Result<Vec<T>, _>>()?;
        Ok((Self { path, is_plain }, entries))
    }

    /// Appends one entry; when this returns it is on disk.
    pub fn push<T: Serialize>(&mut self, entry: &T) -> Result<(), JournalError> {
        let failed = |source| JournalError::Io { what: "written", path: self.path.clone(), source };
        match self.is_plain {
            true => push_plain(&self.path, entry).map_err(failed),
            false => chain::append(&self.path, JOURNAL_FILE, entry).map_err(told),
        }
    }
}

/// Where the last whole line ends.
fn whole(bytes: &[u8]) -> usize {
    let end = bytes.iter().rposition(|byte| *byte == b'\n');
    end.map_or(0, |end| end + 1)
}

fn plain_lines(path: &Path, bytes: &[u8]) -> Result<Vec<Value>, JournalError> {
    let lines = bytes[..whole(bytes)].split_inclusive(|byte| *byte == b'\n');
    let lines = lines.enumerate().map(|(index, line)| {
        serde_json::from_slice(line).map_err(|err| JournalError::Line {
            line: index + 1,
            reason: err.to_string(),
            path: path.into(),
        })
    });
    lines.collect()
}

fn push_plain(path: &Path, entry: &impl Serialize) -> io::Result<()> {
    let length = whole(&fs::read(path)?);
    let mut file = OpenOptions::new().append(true).open(path)?;
    file.set_len(length as u64)?;
    // Keys in alphabetical order, as in a chain.
    let body = serde_json::to_value(entry)?;
    file.write_all(format!("{body}\n").as_bytes())?;
    file.sync_data()
}

fn told(err: ChainError) -> JournalError {
    match err {
        ChainError::Changed { path, line } => {
            JournalError::Line { line, reason: "it is not as it was written".into(), path }
        }
        ChainError::Io { what, path, source } => {
            JournalError::Io { what: if what == "read" { what } else { "written" }, path, source }
        }
        ChainError::Shortened { path, found, written } => {
            JournalError::Shortened { found, written, path }
        }
        other => JournalError::Chain(other),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_torn_last_line_never_counted() {
        let folder = tempfile::tempdir().unwrap();
        let (mut journal, old) = Journal::open::<u32>(folder.path()).unwrap();
        assert!(old.is_empty());
        for entry in [1, 22, 333] {
            journal.push(&entry).unwrap();
        }
        drop(journal);
        let path = folder.path().join(JOURNAL_FILE);
        // As written now, and as palpate wrote it before lines had checksums.
        for whole in [fs::read(&path).unwrap(), b"1\n22\n333\n".to_vec()] {
            for cut in 0..=whole.len() {
                fs::write(&path, &whole[..cut]).unwrap();
                // A crash comes before the head.
                let _ = fs::remove_file(folder.path().join("journal.jsonl.head"));
                let (mut journal, old) = Journal::open::<u32>(folder.path()).unwrap();
                let ended = whole[..cut].iter().filter(|byte| **byte == b'\n').count();
                assert_eq!(old, [1, 22, 333][..ended], "{cut}");
                journal.push(&4444).unwrap();
                let (_, again) = Journal::open::<u32>(folder.path()).unwrap();
                assert_eq!(again.len(), ended + 1);
                assert_eq!(again.last(), Some(&4444));
            }
        }
    }

    #[test]
    fn an_entry_that_was_taken_off_the_end_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let (mut journal, _) = Journal::open::<u32>(folder.path()).unwrap();
        for entry in [1, 22, 333] {
            journal.push(&entry).unwrap();
        }
        let path = folder.path().join(JOURNAL_FILE);
        let text = fs::read_to_string(&path).unwrap();
        let two: Vec<&str> = text.split_inclusive('\n').take(2).collect();
        fs::write(&path, two.concat()).unwrap();
        let refused = Journal::open::<u32>(folder.path());
        assert!(matches!(refused, Err(JournalError::Shortened { found: 2, written: 3, .. })));
        assert!(journal.push(&4).is_err());
    }

    #[test]
    fn a_changed_entry_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let (mut journal, _) = Journal::open::<u32>(folder.path()).unwrap();
        for entry in [1, 22, 333] {
            journal.push(&entry).unwrap();
        }
        let path = folder.path().join(JOURNAL_FILE);
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, text.replacen("22", "23", 1)).unwrap();
        let refusal = Journal::open::<u32>(folder.path()).unwrap_err();
        assert!(matches!(refusal, JournalError::Line { line: 2, .. }), "{refusal:?}");
        assert!(journal.push(&4).is_err());
    }

    #[test]
    fn a_line_that_is_no_entry_is_named() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(JOURNAL_FILE), "1\nx\n3\n").unwrap();
        let refusal = Journal::open::<u32>(folder.path()).unwrap_err();
        assert!(matches!(refusal, JournalError::Line { line: 2, .. }), "{refusal:?}");
    }
}
