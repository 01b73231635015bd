//! Why a log could not be written.

use super::sink::Alteration;
use std::io;
use thiserror::Error;

/// A session could not be written.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
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
        Self::Disk {
            reason: err.to_string(),
            path: path.into(),
        }
    }
}

pub(super) fn json_error(what: &'static str) -> impl Fn(serde_json::Error) -> LogError {
    move |err| LogError::Encode {
        what,
        reason: err.to_string(),
    }
}

pub(crate) fn encode_error(what: &'static str) -> impl Fn(mcap::McapError) -> LogError {
    move |err| LogError::Encode {
        what,
        reason: err.to_string(),
    }
}
