//! A journal: one line of JSON an entry, each on disk before the next thing happens, so that a series that broke off
//! can be continued at the right place.

use chrono::{DateTime, SecondsFormat, Utc};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs::{self, File, OpenOptions};
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
        "line {line} of the journal cannot be understood ({reason}); mend it by hand or begin in a new folder: {}",
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
    file: File,
}

impl Journal {
    /// Opens the journal of a folder, new or begun, and reads what it holds. A last line without its end is
    /// what a crash left of an entry that never counted; it is cut off.
    pub fn open<T: DeserializeOwned>(folder: &Path) -> Result<(Self, Vec<T>), JournalError> {
        let path = folder.join(JOURNAL_FILE);
        let failed = |what| {
            let path = path.clone();
            move |source| JournalError::Io { what, path, source }
        };
        fs::create_dir_all(folder).map_err(failed("written"))?;
        let text = match fs::read_to_string(&path) {
            Ok(text) => text,
            Err(err) if err.kind() == io::ErrorKind::NotFound => String::new(),
            Err(err) => return Err(failed("read")(err)),
        };
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let entries = text[..whole].lines().enumerate();
        let entries = entries.map(|(index, line)| {
            serde_json::from_str(line).map_err(|err| JournalError::Line {
                line: index + 1,
                reason: err.to_string(),
                path: path.clone(),
            })
        });
        let entries = entries.collect::<Result<Vec<T>, _>>()?;
        let file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(&path)
            .map_err(failed("written"))?;
        file.set_len(whole as u64).map_err(failed("written"))?;
        Ok((Self { path, file }, entries))
    }

    /// Appends one entry; when this returns it is on disk.
    pub fn push<T: Serialize>(&mut self, entry: &T) -> Result<(), JournalError> {
        let failed = |source| JournalError::Io {
            what: "written",
            path: self.path.clone(),
            source,
        };
        let mut line = serde_json::to_vec(entry).map_err(|err| failed(err.into()))?;
        line.push(b'\n');
        self.file
            .write_all(&line)
            .and_then(|()| self.file.sync_data())
            .map_err(failed)
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
        let whole = fs::read(&path).unwrap();
        for cut in 0..=whole.len() {
            fs::write(&path, &whole[..cut]).unwrap();
            let (mut journal, old) = Journal::open::<u32>(folder.path()).unwrap();
            let ended = whole[..cut].iter().filter(|byte| **byte == b'\n').count();
            assert_eq!(old, [1, 22, 333][..ended], "{cut}");
            journal.push(&4444).unwrap();
            drop(journal);
            let (_, again) = Journal::open::<u32>(folder.path()).unwrap();
            assert_eq!(again.len(), ended + 1);
        }
    }

    #[test]
    fn a_line_that_is_no_entry_is_named() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(JOURNAL_FILE), "1\nx\n3\n").unwrap();
        let refusal = Journal::open::<u32>(folder.path()).unwrap_err().to_string();
        assert!(refusal.contains("line 2 of the journal"), "{refusal}");
    }
}
