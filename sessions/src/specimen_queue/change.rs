//! Changes of the queue, as its journal has them.

use crate::journal::JournalError;
use crate::lock::LockError;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;
use thiserror::Error;

/// A specimen that is to be measured.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct QueuedSpecimen {
    pub specimen: String,
    /// Name of a built-in or locked protocol, or the path of a protocol file.
    pub protocol: String,
    /// Further labels of its sessions, by the names of [`palpate_model::metadata::METADATA_KEYS`], as typed.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub labels: BTreeMap<String, String>,
}

palpate_model::named! {
    /// What a person says of a run.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "lowercase")]
    pub enum QueueVerdict {
        Accept = "accept",
        Reject = "reject",
        /// The run is rejected, and the specimen is the next one again.
        Repeat = "repeat",
    }
}

/// One change.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "change", rename_all = "snake_case")]
pub enum QueueChange {
    /// A new list; the one before stays in the journal.
    Started {
        queue_version: u32,
        name: String,
        /// Whether labels and order of specimens still to come are hidden from whoever measures.
        is_blinded: bool,
    },
    Added {
        specimens: Vec<QueuedSpecimen>,
    },
    /// The specimens that wait, in a random order.
    Shuffled {
        seed: u64,
        /// Their numbers, the next one first.
        order: Vec<u32>,
    },
    Moved {
        number: u32,
        /// New place among those that wait, from 1.
        place: u32,
    },
    Skipped {
        number: u32,
    },
    /// A skipped, accepted or rejected specimen waits again, as the last one.
    Restored {
        number: u32,
    },
    /// A run began.
    Begun {
        number: u32,
        /// Folder of its session, from the library where it is inside.
        session: PathBuf,
    },
    Judged {
        number: u32,
        verdict: QueueVerdict,
    },
}

impl QueueChange {
    /// Whether a person must say why.
    pub(super) fn needs_reason(&self) -> bool {
        match self {
            Self::Moved { .. } | Self::Skipped { .. } | Self::Restored { .. } => true,
            Self::Judged { verdict, .. } => *verdict != QueueVerdict::Accept,
            Self::Started { .. }
            | Self::Added { .. }
            | Self::Shuffled { .. }
            | Self::Begun { .. } => false,
        }
    }
}

/// A line of the journal.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct QueueRecord {
    /// When, RFC 3339.
    pub at: String,
    pub by: String,
    /// Empty where none is needed.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub reason: String,
    #[serde(flatten)]
    pub change: QueueChange,
}

/// The change is not possible.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum QueueRefusal {
    #[error("the queue has no specimen number {0}; 'palpate queue show' lists them")]
    Unknown(u32),
    #[error("specimen number {number} is {state}, and only one that is {needed} can be {done}")]
    State { number: u32, state: &'static str, needed: &'static str, done: &'static str },
    #[error("the run of specimen number {0} has no verdict yet; accept, reject or repeat it first")]
    Open(u32),
    #[error("give a reason in a few words; the queue keeps it")]
    NoReason,
    #[error("specimen {0} has no name; give each specimen one")]
    Nameless(usize),
    #[error("specimen '{0}' has no protocol; give one for it, or one for all")]
    NoProtocol(String),
    #[error("the queue already has a specimen '{0}'; give every specimen a name of its own")]
    Twice(String),
    #[error("{place} is no place among the {waiting} specimens that wait; count from 1")]
    Place { place: u32, waiting: usize },
    #[error("the order is not one of the specimens that wait; shuffle again")]
    Order,
    #[error("specimens still wait in the queue '{0}'; measure or skip them before a new one")]
    Unfinished(String),
    #[error(
        "a later palpate wrote this queue (version {version} of its lines); update palpate to continue it"
    )]
    Newer { version: u32 },
}

#[derive(Debug, Error)]
pub enum QueueError {
    #[error(transparent)]
    Refused(#[from] QueueRefusal),
    #[error(transparent)]
    Journal(#[from] JournalError),
    #[error(transparent)]
    Lock(#[from] LockError),
    #[error("the queue in {} cannot be written ({source}); check its permissions and the disk", path.display())]
    Io { path: PathBuf, source: std::io::Error },
    #[error(
        "line {line} of the queue in {} contradicts the lines before it ({refusal}); restore the folder from a backup, or move it elsewhere to begin a new queue",
        path.display()
    )]
    Contradiction { line: usize, refusal: QueueRefusal, path: PathBuf },
}
