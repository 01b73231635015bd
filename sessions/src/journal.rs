//! Journal of a programme or a queue: one JSON line per entry, each on the disk before the work continues, so that
//! interrupted work resumes at the right place.

use crate::chain::{self, ChainError, ChainHead, bytes_or_none, complete_length};
use crate::folder::create_folder;
use crate::manifest::format_utc;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::SystemTime;
use thiserror::Error;

pub const JOURNAL_FILE: &str = "journal.jsonl";

#[derive(Debug, Error)]
pub enum JournalError {
    #[error("the journal {} cannot be {what} ({source}); check its permissions and the disk", path.display())]
    Io { what: &'static str, path: PathBuf, source: io::Error },
    #[error(
        "line {line} of the journal {} is damaged ({reason}); restore the journal from a backup, or move its folder elsewhere to begin anew",
        path.display()
    )]
    Line {
        /// Counted from 1.
        line: usize,
        reason: String,
        path: PathBuf,
    },
    #[error(
        "the journal {} is incomplete: it has {found} entries, but {written} were written; restore it from a backup, or move {} elsewhere to continue after the last entry that is present",
        path.display(), ChainHead::file_of(path).display()
    )]
    Shortened { found: u64, written: u64, path: PathBuf },
    #[error(transparent)]
    Chain(ChainError),
}

/// RFC 3339 in UTC, to the millisecond, as journals have it.
#[must_use]
pub fn format_time(at: SystemTime) -> String {
    format_utc(at.into())
}

#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    is_plain: bool,
}

impl Journal {
    /// Opens or begins the journal of a folder and reads its entries. An incomplete last line, as a crash leaves it, does not
    /// count.
    ///
    /// The file is a chain of lines with checksums (`chain.rs`). A journal of an old version has no checksums and continues
    /// without.
    pub fn open<T: DeserializeOwned>(folder: &Path) -> Result<(Self, Vec<T>), JournalError> {
        let path = folder.join(JOURNAL_FILE);
        let failed = |what| {
            let path = path.clone();
            move |source| JournalError::Io { what, path, source }
        };
        create_folder(folder).map_err(failed("written"))?;
        let bytes = bytes_or_none(&path).map_err(failed("read"))?;
        let first = bytes.split(|byte| *byte == b'\n').next();
        let first = first.and_then(|line| serde_json::from_slice::<Value>(line).ok());
        let is_plain = first.is_some_and(|line| line.get("checksum").is_none());
        let entries = if is_plain {
            let bodies = plain_lines(&path, &bytes)?.into_iter().enumerate();
            let entry = |(index, body): (usize, Value)| {
                T::deserialize(body).map_err(|err| line_error(&path, index, &err))
            };
            bodies.map(entry).collect::<Result<Vec<T>, _>>()?
        } else {
            let chain = chain::read(&path, JOURNAL_FILE).map_err(journal_error)?;
            chain.records(&path, "an entry").map_err(journal_error)?
        };
        Ok((Self { path, is_plain }, entries))
    }

    /// Appends one entry; when this returns it is on disk.
    pub fn push<T: Serialize>(&mut self, entry: &T) -> Result<(), JournalError> {
        let failed = |source| JournalError::Io { what: "written", path: self.path.clone(), source };
        match self.is_plain {
            true => push_plain(&self.path, entry).map_err(failed),
            false => chain::append(&self.path, JOURNAL_FILE, entry).map_err(journal_error),
        }
    }
}

fn line_error(path: &Path, index: usize, err: &serde_json::Error) -> JournalError {
    JournalError::Line { line: index + 1, reason: err.to_string(), path: path.into() }
}

fn plain_lines(path: &Path, bytes: &[u8]) -> Result<Vec<Value>, JournalError> {
    let lines = bytes[..complete_length(bytes)].split_inclusive(|byte| *byte == b'\n');
    let lines = lines.enumerate().map(|(index, line)| {
        serde_json::from_slice(line).map_err(|err| line_error(path, index, &err))
    });
    lines.collect()
}

fn push_plain(path: &Path, entry: &impl Serialize) -> io::Result<()> {
    let length = complete_length(&fs::read(path)?);
    let mut file = OpenOptions::new().append(true).open(path)?;
    file.set_len(length as u64)?;
    // Keys in alphabetical order, as in a chain.
    let body = serde_json::to_value(entry)?;
    file.write_all(format!("{body}\n").as_bytes())?;
    file.sync_data()
}

fn journal_error(err: ChainError) -> JournalError {
    match err {
        ChainError::Changed { path, line } => {
            JournalError::Line { line, reason: "it was changed".into(), path }
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
    fn incomplete_last_line_does_not_count() {
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
    fn entry_cut_off_the_end_is_noticed() {
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
    fn malformed_line_is_named() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(JOURNAL_FILE), "1\nx\n3\n").unwrap();
        let refusal = Journal::open::<u32>(folder.path()).unwrap_err();
        assert!(matches!(refusal, JournalError::Line { line: 2, .. }), "{refusal:?}");
    }
}
