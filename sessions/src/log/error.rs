//! Why a log could not be written, and why one could not be read.

use super::sink::Alteration;
use crate::folder::LOG_FILE;
use crate::manifest::RECORD_VERSION;
use std::io;
use std::path::PathBuf;
use thiserror::Error;

/// A session could not be written.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum LogError {
    /// The disk refused. The file is not written to again: what a failed write or sync left
    /// behind is unknown.
    #[error("cannot write the session log ({reason}): {path}; everything saved before is kept")]
    Disk {
        /// What the system said.
        reason: String,
        /// The log.
        path: String,
    },
    /// Another program changed the file while it was written, or the disk did not keep what it took.
    #[error("another program changed the session log while it was recorded: {alteration}, {path}")]
    Altered {
        /// How.
        alteration: Alteration,
        /// The file.
        path: String,
    },
    /// The disk was too slow for too long.
    #[error(
        "the disk did not keep up for {seconds} s and no more samples fit in memory: {path}; everything saved before is kept, use a faster disk"
    )]
    TooSlow {
        /// Session time that waited in memory, in s.
        seconds: u64,
        /// The log.
        path: String,
    },
    /// A value is not a number.
    #[error(
        "the {what} is not a number and was not recorded; check the signal and the calibration"
    )]
    NotFinite {
        /// Which value.
        what: String,
    },
    /// Entries must be in order.
    #[error("entry {order} came after entry {previous}; entries must be recorded in order")]
    OutOfOrder {
        /// The entry's place.
        order: u64,
        /// The place of the entry before.
        previous: u64,
    },
    /// A message does not fit the file format.
    #[error("the {what} cannot be recorded ({reason})")]
    Encode {
        /// What was to be recorded.
        what: &'static str,
        /// Why not.
        reason: String,
    },
    /// The writer has ended.
    #[error("the session log is closed; start a new session")]
    Closed,
}

impl LogError {
    pub(crate) fn disk(err: &io::Error, path: &str) -> Self {
        Self::Disk { reason: err.to_string(), path: path.into() }
    }
}

pub(super) fn json_error(what: &'static str) -> impl Fn(serde_json::Error) -> LogError {
    move |err| LogError::Encode { what, reason: err.to_string() }
}

pub(crate) fn encode_error(what: &'static str) -> impl Fn(mcap::McapError) -> LogError {
    move |err| LogError::Encode { what, reason: err.to_string() }
}

/// A session could not be opened.
#[derive(Debug, Error)]
pub enum ReadError {
    /// Nothing is at the path.
    #[error("there is no session at {}; check the path", path.display())]
    Missing {
        /// The path given.
        path: PathBuf,
    },
    /// Something is at the path, but not a session.
    #[error("{} is not a palpate session ({reason}); choose a session folder or its {LOG_FILE}", path.display())]
    NotASession {
        /// The path given.
        path: PathBuf,
        /// How it differs.
        reason: String,
    },
    /// The session was written by a newer version of the program.
    #[error(
        "{} was written by palpate {software_version} with record version {record_version}; this palpate reads up to {RECORD_VERSION}; update palpate", path.display()
    )]
    Newer {
        /// The log.
        path: PathBuf,
        /// The program that wrote it.
        software_version: String,
        /// Its record version.
        record_version: u64,
    },
    /// The session is not as it was written.
    #[error(
        "{} is damaged at byte {offset} ({reason}); restore it from a backup, or keep what is whole", path.display()
    )]
    Damaged {
        /// The log.
        path: PathBuf,
        /// Where in the file.
        offset: u64,
        /// What is wrong there.
        reason: String,
    },
    /// The system does not let the session be read.
    #[error("cannot read {} ({source}); check its permissions and the disk", path.display())]
    Io {
        /// The log.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}
