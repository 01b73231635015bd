//! Writes the readable part of a session as a new session beside the original.

use super::companions::CompanionFiles;
use super::salvage::salvage_parts;
use super::{MissingData, Salvage, salvage};
use crate::chain::ChainError;
use crate::folder::{FolderError, SessionFolder, sync_folder_of};
use crate::lock::{self, LockFailure, LockTimeout};
use crate::log::files::{absent_spare, describe_absent};
use crate::log::{FileSink, LogBatch, LogError, LogPart, LogWriter, ReadError};
use crate::manifest::Manifest;
use crate::record::{EndRecord, LogEntry, SampleRow};
use chrono::{DateTime, Utc};
use palpate_model::Nanos;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// The original of a recovered session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RecoveryOrigin {
    /// Name of the original session.
    pub from: String,
    pub at: DateTime<Utc>,
    pub software_version: String,
    pub missing: MissingData,
}

#[derive(Debug, Error)]
pub enum RecoverError {
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error("{} is complete and needs no recovery", path.display())]
    Whole { path: PathBuf },
    #[error("{} is being recorded; wait for the run to end", path.display())]
    InUse { path: PathBuf },
    #[error("{} is already being recovered by {}; wait for that recovery to end, and use its result", path.display(), lock::holder_name(*holder))]
    InProgress { path: PathBuf, holder: Option<u32> },
    #[error("{} is not recovered yet: {}, or, if the disk is lost for good, delete the file 'spare' in the session's folder", path.display(), describe_absent(spare))]
    Away { path: PathBuf, spare: PathBuf },
    #[error("{} was already recovered into {}; use that folder", path.display(), folder.display())]
    Before { path: PathBuf, folder: PathBuf },
    #[error(transparent)]
    Folder(#[from] FolderError),
    #[error(transparent)]
    Write(#[from] LogError),
    #[error(transparent)]
    Beside(#[from] ChainError),
    #[error("the files in {} cannot be copied ({source}); check their permissions and the free space on the disk", path.display())]
    Original { path: PathBuf, source: std::io::Error },
}

#[derive(Clone, Debug)]
pub struct RecoveredSession {
    pub folder: PathBuf,
    pub session_id: String,
    pub salvage: Salvage,
}

impl RecoveredSession {
    /// A line with the result, then one for each kind of missing data; `from` is the original.
    pub fn sentences(&self, from: &Path) -> Vec<String> {
        let raw = match self.salvage.raw_bytes {
            0 => String::new(),
            count => format!(" and {count} raw bytes"),
        };
        let result = format!(
            "{}: {} samples{raw} recovered into {}",
            from.display(),
            self.salvage.samples,
            self.folder.display()
        );
        let missing = self.salvage.missing.sentences().into_iter();
        let missing = missing.map(|sentence| format!("  {sentence}"));
        [result].into_iter().chain(missing).collect()
    }
}

#[must_use]
pub fn recovered_folder(path: &Path) -> PathBuf {
    let folder = session_folder(path);
    let name = folder.file_name().unwrap_or_default().to_string_lossy();
    folder.with_file_name(format!("{name}.recovered"))
}

/// A file stands for its folder.
fn session_folder(path: &Path) -> PathBuf {
    // The path of the current folder, or of a file in it, has no folder's name.
    let path = std::path::absolute(path).unwrap_or_else(|_| path.into());
    match path.parent() {
        Some(folder) if path.is_file() => folder.into(),
        _ => path,
    }
}

#[must_use]
pub fn recovered_id(session_id: &str) -> String {
    format!("{session_id}-recovered")
}

/// Whether a session, given its folder or a file of it, is being recorded.
#[must_use]
pub fn is_in_use(path: &Path) -> bool {
    let lock = std::fs::File::open(session_folder(path).join(crate::folder::LOCK_FILE));
    lock.is_ok_and(|file| {
        let outcome = file.try_lock_shared();
        // Closing is not enough: a child process that is just starting shares the file, and with it the lock.
        let _ = file.unlock();
        matches!(outcome, Err(std::fs::TryLockError::WouldBlock))
    })
}

/// Recovers an interrupted or damaged session into a folder beside it. The original is only read.
///
/// Samples get new numbers without gaps and keep their times; the manifest lists what is missing. Edits, analyses and the
/// original of an import are copied unless their meaning would change.
pub fn recover(
    path: &Path,
    software_version: &str,
    at: DateTime<Utc>,
) -> Result<RecoveredSession, RecoverError> {
    let _lock = lock_recovery(path)?;
    if is_in_use(path) {
        return Err(RecoverError::InUse { path: path.into() });
    }
    let folder = recovered_folder(path);
    // A copy without an end is the remainder of an attempt that crashed.
    if crate::log::SessionSummary::read(&folder).is_ok_and(|summary| summary.end.is_some()) {
        return Err(RecoverError::Before { path: path.into(), folder });
    }
    let mut salvage = salvage(path, &mut |_| {})?;
    let lacks_files = salvage.missing.is_end_lost || salvage.lacks_segments;
    if let Some(spare) = absent_spare(path).filter(|_| lacks_files) {
        let path = path.into();
        return Err(RecoverError::Away { path, spare });
    }
    if !salvage.missing.is_lossy() && !salvage.missing.is_end_lost {
        return Err(RecoverError::Whole { path: path.into() });
    }
    let companions = CompanionFiles::read(path, &salvage);
    salvage.missing.left_out.clone_from(&companions.left_out);
    let unfinished = folder.with_extension("recovering");
    clear(&unfinished)?;
    let session_id = recovered_id(&salvage.manifest.session_id);
    let manifest = Manifest {
        session_id: session_id.clone(),
        recovered: Some(RecoveryOrigin {
            from: salvage.manifest.session_id.clone(),
            at,
            software_version: software_version.into(),
            missing: salvage.missing.clone(),
        }),
        ..salvage.manifest.clone()
    };
    {
        let held = SessionFolder::create(&unfinished)?;
        let log_path = held.log_path();
        let shown = log_path.display().to_string();
        let sink = FileSink::create(&log_path).map_err(|err| LogError::disk(&err, &shown))?;
        let mut log = LogWriter::begin(sink, &shown, &manifest)?;
        copy(path, &salvage, &mut log)?;
        companions.write(&unfinished, &session_id)?;
    }
    // The rename makes the copy appear complete or not at all.
    std::fs::rename(&unfinished, &folder)
        .and_then(|()| sync_folder_of(&folder))
        .map_err(|source| FolderError::Io { path: folder.clone(), source })?;
    Ok(RecoveredSession { folder, session_id, salvage })
}

/// Excludes other recoveries of the session; waits a little for another one. The lock is on the folder itself, so it needs no
/// file and is the same for every path into the folder. On a file system without locks, and on Windows, where folders have none,
/// nothing is excluded.
fn lock_recovery(path: &Path) -> Result<Option<File>, RecoverError> {
    let Ok(session) = File::open(session_folder(path)) else {
        // Reading the session reports the error.
        return Ok(None);
    };
    match lock::lock_waiting(&session, &session_folder(path)) {
        Ok(()) => Ok(Some(session)),
        Err(LockFailure::Io(_)) => Ok(None),
        Err(LockFailure::LockTimeout(LockTimeout { holder, .. })) => {
            Err(RecoverError::InProgress { path: path.into(), holder })
        }
    }
}

/// Deletes the remainder of an attempt that crashed.
fn clear(folder: &Path) -> Result<(), RecoverError> {
    if folder.exists() {
        std::fs::remove_dir_all(folder)
            .map_err(|source| FolderError::Io { path: folder.into(), source })?;
    }
    Ok(())
}

fn copy(path: &Path, salvage: &Salvage, log: &mut LogWriter<FileSink>) -> Result<(), RecoverError> {
    let mut pending = salvage.entries.iter().peekable();
    let mut outcome = Ok(());
    let (mut written, mut last) = (0u64, Nanos::ZERO);
    let mut visit = |part: LogPart<'_>| {
        if outcome.is_err() {
            return;
        }
        let block = match part {
            LogPart::Samples(block) => block,
            LogPart::Raw(block) => {
                let raw = &block.to_pieces();
                outcome = log.append_batch(&LogBatch { raw, ..LogBatch::default() });
                return;
            }
            LogPart::Health(health) => {
                let health = std::slice::from_ref(health);
                outcome = log.append_batch(&LogBatch { health, ..LogBatch::default() });
                return;
            }
        };
        let rows: Vec<SampleRow> = block.rows().collect();
        let end = block.first_sample() + rows.len() as u64;
        let mut entries = Vec::new();
        while let Some(entry) = pending.next_if(|entry| entry.after_sample < end) {
            // The entry keeps its position between the remaining samples.
            let seen = entry.after_sample.saturating_sub(block.first_sample());
            entries.push(LogEntry { after_sample: written + seen, ..entry.clone() });
        }
        written += rows.len() as u64;
        last = block.last_time().unwrap_or(last);
        outcome = log.append(&rows, &entries);
    };
    salvage_parts(path, &mut visit)?;
    outcome?;
    let rest: Vec<LogEntry> =
        pending.map(|entry| LogEntry { after_sample: written, ..entry.clone() }).collect();
    log.append(&[], &rest)?;
    let ended_at = rest.last().map_or(last, |entry| entry.now.max(last));
    let end = salvage.end.clone().unwrap_or(EndRecord {
        outcome: "interrupted".into(),
        reason: "the recording was interrupted; this is its readable part".into(),
        ended_at,
        ..EndRecord::default()
    });
    log.finish(end)?;
    Ok(())
}
