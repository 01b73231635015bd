//! Status that the writer thread shares with the recording thread.

use super::error::LogError;
use palpate_model::Nanos;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Session time that the queue holds at real pace, in s.
pub(super) const QUEUE_SECONDS: u64 = 30;
const QUEUE: Nanos = Nanos::from_millis(QUEUE_SECONDS * 1000);
/// Raw bytes that the queue holds at real pace: 30 s at 1 MB/s, more than a serial line or a controller on Ethernet
/// transfers.
const QUEUE_RAW: u64 = 32 << 20;

/// An incident while a log is written, for the screen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LogNotice {
    /// A write or a sync failed; the recording continues without loss in another file.
    Moved {
        reason: String,
        /// The new file.
        path: String,
        /// Whether no other place is left, so that the run should end.
        is_last: bool,
    },
    /// Another program changed the log, and its content may be lost, so that the run should end.
    Altered(LogError),
    /// Half of the memory for unwritten samples is in use.
    Slow,
    /// Nine tenths of it are in use, so that the run should end before samples are lost.
    TooSlow,
}

impl LogNotice {
    /// Whether the run should end while everything can still be saved.
    pub fn is_reason_to_end(&self) -> bool {
        matches!(self, Self::Moved { is_last: true, .. } | Self::Altered(_) | Self::TooSlow)
    }
}

impl std::fmt::Display for LogNotice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Moved { reason, path, .. } => write!(
                f,
                "the disk failed ({reason}); the recording continues in {path} without loss"
            ),
            Self::Altered(err) => {
                write!(f, "{err}; the recording continues in another file, and the run ends")
            }
            Self::Slow => {
                write!(f, "the disk is too slow: {} s of samples wait in memory", QUEUE_SECONDS / 2)
            }
            Self::TooSlow => write!(
                f,
                "the disk is too slow: {} s of samples wait in memory, and the run ends before samples are lost",
                QUEUE_SECONDS / 10 * 9
            ),
        }
    }
}

#[derive(Default)]
pub(super) struct WriterStatus {
    has_failed: AtomicBool,
    failure: Mutex<Option<LogError>>,
    pub saved_through_ns: AtomicU64,
    /// Session time in unwritten batches.
    queued_ns: AtomicU64,
    /// Raw bytes in unwritten batches.
    queued_raw: AtomicU64,
    /// Longest synchronisation since the last query, in ns; 0 if there was none.
    pub sync_ns: AtomicU64,
    /// Free space after the last synchronisation plus 1, in bytes; 0 if unknown.
    pub free_bytes: AtomicU64,
    notices: Mutex<Vec<LogNotice>>,
}

impl WriterStatus {
    pub fn fail(&self, err: LogError) {
        let mut failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        // Later failures are consequences of the first.
        failure.get_or_insert(err);
        self.has_failed.store(true, Ordering::Release);
    }

    pub fn push_notice(&self, notice: LogNotice) {
        let mut notices = self.notices.lock().unwrap_or_else(PoisonError::into_inner);
        notices.push(notice);
    }

    pub fn record_sync(&self, took: Duration, free_bytes: Option<u64>) {
        let nanos = u64::try_from(took.as_nanos()).unwrap_or(u64::MAX);
        self.sync_ns.fetch_max(nanos.max(1), Ordering::AcqRel);
        let free = free_bytes.map_or(0, |free| free.saturating_add(1));
        self.free_bytes.store(free, Ordering::Release);
    }

    /// Counts a batch as queued; returns whether the queue is over its limits.
    pub fn add_queued(&self, span: Nanos, raw_bytes: usize) -> bool {
        let raw = raw_bytes as u64;
        let queued = self.queued_ns.fetch_add(span.0, Ordering::AcqRel) + span.0;
        let queued_raw = self.queued_raw.fetch_add(raw, Ordering::AcqRel) + raw;
        queued > QUEUE.0 || queued_raw > QUEUE_RAW
    }

    pub fn remove_queued(&self, span: Nanos, raw_bytes: usize) {
        self.queued_ns.fetch_sub(span.0, Ordering::AcqRel);
        self.queued_raw.fetch_sub(raw_bytes as u64, Ordering::AcqRel);
    }

    /// Fill level of the queue, 0 to 1.
    pub fn queue_share(&self) -> f64 {
        let time = self.queued_ns.load(Ordering::Acquire) as f64 / QUEUE.0 as f64;
        let raw = self.queued_raw.load(Ordering::Acquire) as f64 / QUEUE_RAW as f64;
        time.max(raw)
    }

    pub fn take_notices(&self) -> Vec<LogNotice> {
        let mut notices = self.notices.lock().unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut *notices)
    }

    pub fn check(&self) -> Result<(), LogError> {
        if !self.has_failed.load(Ordering::Acquire) {
            return Ok(());
        }
        let failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        Err(failure.clone().unwrap_or(LogError::Closed))
    }
}

/// Notices of a log, also after it is closed.
pub struct LogNotices(Arc<WriterStatus>);

impl LogNotices {
    pub(super) fn of(status: &Arc<WriterStatus>) -> Self {
        Self(Arc::clone(status))
    }

    /// Notices since the last call.
    pub fn take(&self) -> Vec<LogNotice> {
        self.0.take_notices()
    }
}
