//! Errors of writing and of reading a log.

use super::sink::Alteration;
use crate::folder::LOG_FILE;
use crate::manifest::RECORD_VERSION;
use std::fmt::Display;
use std::io;
use std::path::PathBuf;
use thiserror::Error;

#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum LogError {
    /// The file is not written to again, because a failed write or sync leaves it in an unknown state.
    #[error("cannot write the session log {path} ({reason}); everything saved until then is kept")]
    Disk { reason: String, path: String },
    /// Another program changed the file, or the disk lost data.
    #[error("another program changed the session log {path} during the recording: {alteration}")]
    Altered { alteration: Alteration, path: String },
    #[error(
        "the disk of {path} did not keep up for {seconds} s, and no more samples fit in memory; everything saved until then is kept; use a faster disk"
    )]
    TooSlow { seconds: u64, path: String },
    #[error(
        "the {what} is not a number and was not recorded; check the signal and the calibration"
    )]
    NotFinite { what: String },
    #[error("entry {order} was recorded after entry {previous}; record entries in ascending order")]
    OutOfOrder { order: u64, previous: u64 },
    #[error("the {what} cannot be recorded ({reason})")]
    Encode { what: &'static str, reason: String },
    #[error("the session log is closed; start a new session")]
    Closed,
}

impl LogError {
    pub(crate) fn disk(err: &io::Error, path: &str) -> Self {
        Self::Disk { reason: err.to_string(), path: path.into() }
    }
}

pub(crate) fn encode_error<E: Display>(what: &'static str) -> impl Fn(E) -> LogError {
    move |err| LogError::Encode { what, reason: err.to_string() }
}

#[derive(Debug, Error)]
pub enum ReadError {
    #[error("no session exists at {}; check the path", path.display())]
    Missing { path: PathBuf },
    #[error("{} is not a palpate session ({reason}); choose a session folder or its {LOG_FILE}", path.display())]
    NotASession { path: PathBuf, reason: String },
    #[error(
        "{} was written by palpate {software_version} with record version {record_version}, but this palpate reads versions up to {RECORD_VERSION}; update palpate", path.display()
    )]
    Newer { path: PathBuf, software_version: String, record_version: u64 },
    #[error(
        "{} is damaged at byte {offset} ({reason}); restore it from a backup, or recover the undamaged part", path.display()
    )]
    Damaged { path: PathBuf, offset: u64, reason: String },
    #[error("cannot read {} ({source}); check its permissions and the disk", path.display())]
    Io { path: PathBuf, source: io::Error },
}
