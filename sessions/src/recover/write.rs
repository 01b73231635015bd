//! Writes what is left of a session as a session of its own, beside the original.

use super::beside::Beside;
use super::salvage::parts;
use super::{Missing, Salvage, salvage};
use crate::chain::ChainError;
use crate::folder::{FolderError, SessionFolder, sync_folder_of};
use crate::lock::{self, Busy, NotLocked};
use crate::log::files::{absent_spare, away};
use crate::log::{FileSink, LogError, LogWriter, Part, Parts, ReadError};
use crate::manifest::Manifest;
use crate::record::{EndRecord, Entry, Row};
use chrono::{DateTime, Utc};
use palpate_model::Nanos;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// What a recovered session says of the one it comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recovered {
    /// Name of the session it was recovered from.
    pub from: String,
    /// When.
    pub at: DateTime<Utc>,
    /// The program that did it.
    pub software_version: String,
    /// What is not in it.
    pub missing: Missing,
}

/// A session was not recovered.
#[derive(Debug, Error)]
pub enum RecoverError {
    /// Nothing of it can be used.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// It lacks nothing.
    #[error("{} is whole; there is nothing to recover", path.display())]
    Whole {
        /// The session.
        path: PathBuf,
    },
    /// It is being written.
    #[error("{} is being recorded; wait for the run to end", path.display())]
    InUse {
        /// The session.
        path: PathBuf,
    },
    /// Somebody else is at it.
    #[error("{} is being recovered by {} already; wait until that is done, and use what it made", path.display(), lock::named(*holder))]
    InProgress {
        /// The session.
        path: PathBuf,
        /// Process number of who does it, where the system tells.
        holder: Option<u32>,
    },
    /// A disk that its segments may be on is not there.
    #[error("{} is not recovered yet: {}, or, if it is lost for good, take the file 'spare' out of the session's folder", path.display(), away(spare))]
    Away {
        /// The session.
        path: PathBuf,
        /// The folder on that disk.
        spare: PathBuf,
    },
    /// It was done before.
    #[error("{} was recovered before, into {}; use that", path.display(), folder.display())]
    Before {
        /// The session.
        path: PathBuf,
        /// What was recovered.
        folder: PathBuf,
    },
    /// The new folder cannot be had.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The new session cannot be written.
    #[error(transparent)]
    Write(#[from] LogError),
    /// Its edits or analyses cannot be written.
    #[error(transparent)]
    Beside(#[from] ChainError),
    /// What an import was made from cannot be copied.
    #[error("the files in {} cannot be copied ({source}); check their permissions and the room on the disk", path.display())]
    Original {
        /// The folder.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
}

/// A recovered session and what is missing of it.
#[derive(Clone, Debug)]
pub struct Recovery {
    /// Its folder.
    pub folder: PathBuf,
    /// Its name.
    pub session_id: String,
    /// What is in it and what is not.
    pub salvage: Salvage,
}

impl Recovery {
    /// What was kept of the session at `from` and, after it, what is missing.
    pub fn sentences(&self, from: &Path) -> Vec<String> {
        let raw = match self.salvage.raw_bytes {
            0 => String::new(),
            count => format!(" and {count} raw bytes"),
        };
        let kept = format!(
            "{}: {} samples{raw} kept in {}",
            from.display(),
            self.salvage.samples,
            self.folder.display()
        );
        let missing = self.salvage.missing.sentences().into_iter();
        let missing = missing.map(|sentence| format!("  {sentence}"));
        [kept].into_iter().chain(missing).collect()
    }
}

/// Where a session is recovered to: beside it, with its name and an ending.
#[must_use]
pub fn recovered_folder(path: &Path) -> PathBuf {
    let folder = session_folder(path);
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    folder.with_file_name(format!("{name}.recovered"))
}

/// A file stands for the folder it is in.
fn session_folder(path: &Path) -> PathBuf {
    // A file of the present folder, or that folder itself, has no name before it.
    let path = std::path::absolute(path).unwrap_or_else(|_| path.into());
    match path.parent() {
        Some(folder) if path.is_file() => folder.into(),
        _ => path,
    }
}

/// The name that what is recovered of a session gets.
#[must_use]
pub fn recovered_id(session_id: &str) -> String {
    format!("{session_id}-recovered")
}

/// Whether a session's folder, given it or a file in it, is locked by whoever records it. The lock is only looked at.
#[must_use]
pub fn is_in_use(path: &Path) -> bool {
    let lock = std::fs::File::open(session_folder(path).join(crate::folder::LOCK_FILE));
    lock.is_ok_and(|file| {
        let looked = file.try_lock_shared();
        // Not left to closing: a program started at this moment would hold it a little longer.
        let _ = file.unlock();
        matches!(looked, Err(std::fs::TryLockError::WouldBlock))
    })
}

/// Recovers an interrupted or damaged session into a folder beside it. The original is only read.
///
/// Samples are numbered anew without gaps; their times are the recorded ones, and the manifest
/// says what is missing between them. Edits, analyses and the original of an import go with it, unless they
/// would mean something else.
pub fn recover(
    path: &Path,
    software_version: &str,
    at: DateTime<Utc>,
) -> Result<Recovery, RecoverError> {
    let _alone = alone(path)?;
    if is_in_use(path) {
        return Err(RecoverError::InUse { path: path.into() });
    }
    let folder = recovered_folder(path);
    // A finished one is not made anew; an unfinished one is what a crash left of another attempt.
    if crate::log::Summary::read(&folder).is_ok_and(|summary| summary.end.is_some()) {
        return Err(RecoverError::Before { path: path.into(), folder });
    }
    let mut left = salvage(path, &mut |_| {})?;
    let lacks_files = left.missing.is_end_lost || left.lacks_segments;
    if let Some(spare) = absent_spare(path).filter(|_| lacks_files) {
        let path = path.into();
        return Err(RecoverError::Away { path, spare });
    }
    if !left.missing.is_lossy() && !left.missing.is_end_lost {
        return Err(RecoverError::Whole { path: path.into() });
    }
    let beside = Beside::of(path, &left);
    left.missing.left_out.clone_from(&beside.left_out);
    let unfinished = folder.with_extension("recovering");
    clear(&unfinished)?;
    let session_id = recovered_id(&left.manifest.session_id);
    let manifest = Manifest {
        session_id: session_id.clone(),
        recovered: Some(Recovered {
            from: left.manifest.session_id.clone(),
            at,
            software_version: software_version.into(),
            missing: left.missing.clone(),
        }),
        ..left.manifest.clone()
    };
    {
        let held = SessionFolder::create(&unfinished)?;
        let log_path = held.log_path();
        let shown = log_path.display().to_string();
        let sink = FileSink::create(&log_path).map_err(|err| LogError::disk(&err, &shown))?;
        let mut log = LogWriter::begin(sink, &shown, &manifest)?;
        copy(path, &left, &mut log)?;
        beside.write(&unfinished, &session_id)?;
    }
    // Either all of it is there, or nothing is.
    std::fs::rename(&unfinished, &folder)
        .and_then(|()| sync_folder_of(&folder))
        .map_err(|source| FolderError::Io { path: folder.clone(), source })?;
    Ok(Recovery { folder, session_id, salvage: left })
}

/// Makes sure that nobody else recovers the session, and waits a little for who does. The folder itself is locked, so nothing is
/// written into it or left beside it, and whether it or a file in it was named makes no difference; where a disk cannot do
/// that, nothing is made sure of.
fn alone(path: &Path) -> Result<Option<File>, RecoverError> {
    let Ok(session) = File::open(session_folder(path)) else {
        // It is told why when it is read.
        return Ok(None);
    };
    match lock::lock_soon(&session, &session_folder(path)) {
        Ok(()) => Ok(Some(session)),
        Err(NotLocked::Io(_)) => Ok(None),
        Err(NotLocked::Busy(Busy { holder, .. })) => {
            Err(RecoverError::InProgress { path: path.into(), holder })
        }
    }
}

/// Takes away what an attempt that died left behind. It holds nothing that the original does not.
fn clear(folder: &Path) -> Result<(), RecoverError> {
    if folder.exists() {
        std::fs::remove_dir_all(folder)
            .map_err(|source| FolderError::Io { path: folder.into(), source })?;
    }
    Ok(())
}

fn copy(path: &Path, left: &Salvage, log: &mut LogWriter<FileSink>) -> Result<(), RecoverError> {
    let mut pending = left.entries.iter().peekable();
    let mut outcome = Ok(());
    let (mut kept, mut last) = (0u64, Nanos::ZERO);
    let mut visit = |part: Part<'_>| {
        if outcome.is_err() {
            return;
        }
        let block = match part {
            Part::Samples(block) => block,
            Part::Raw(block) => {
                let raw = &block.to_pieces();
                outcome = log.append_parts(&Parts { raw, ..Parts::default() });
                return;
            }
            Part::Health(health) => {
                let health = std::slice::from_ref(health);
                outcome = log.append_parts(&Parts { health, ..Parts::default() });
                return;
            }
        };
        let rows: Vec<Row> = block.rows().collect();
        let end = block.first_sample() + rows.len() as u64;
        let mut entries = Vec::new();
        while let Some(entry) = pending.next_if(|entry| entry.after_sample < end) {
            // Between the samples that are left it comes where it came.
            let seen = entry.after_sample.saturating_sub(block.first_sample());
            entries.push(Entry { after_sample: kept + seen, ..entry.clone() });
        }
        kept += rows.len() as u64;
        last = block.last_time().unwrap_or(last);
        outcome = log.append(&rows, &entries);
    };
    parts(path, &mut visit)?;
    outcome?;
    let rest: Vec<Entry> =
        pending.map(|entry| Entry { after_sample: kept, ..entry.clone() }).collect();
    log.append(&[], &rest)?;
    let ended_at = rest.last().map_or(last, |entry| entry.now.max(last));
    let end = left.end.clone().unwrap_or(EndRecord {
        outcome: "interrupted".into(),
        reason: "the recording was interrupted; this is what was left of it".into(),
        samples: 0,
        entries: 0,
        raw_bytes: 0,
        ended_at,
        time_use: Vec::new(),
    });
    log.finish(end)?;
    Ok(())
}
