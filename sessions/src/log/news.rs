//! What the thread that writes a log tells whoever records.

use super::error::LogError;
use palpate_model::Nanos;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Session time that fits in the queue at real pace, in s.
pub(super) const QUEUE_SECONDS: u64 = 30;
pub(super) const QUEUE: Nanos = Nanos::from_millis(QUEUE_SECONDS * 1000);
/// Raw bytes that fit in the queue at real pace: 30 s at 1 MB/s, more than a rig on a serial line or a controller
/// on Ethernet exchanges.
pub(super) const QUEUE_RAW: u64 = 32 << 20;

/// What became of the log while it was written, for the screen.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Notice {
    /// A write or a sync failed; the recording goes on in another file and lacks nothing.
    Moved {
        /// What failed.
        reason: String,
        /// The file that is written now.
        path: String,
        /// Whether it is the last place there is, so that the run should come to an end.
        is_last: bool,
    },
    /// Another program changed the log, so the run should come to an end: what was in the file may be lost.
    Altered(LogError),
    /// Half of the memory for unwritten samples is in use.
    Slow,
    /// Nine tenths of it are in use, so the run should come to an end while nothing is lost.
    TooSlow,
}

impl Notice {
    /// Whether a run should come to its end while all of it can still be saved.
    pub fn ends_the_run(&self) -> bool {
        matches!(self, Self::Moved { is_last: true, .. } | Self::Altered(_) | Self::TooSlow)
    }
}

impl std::fmt::Display for Notice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Moved { reason, path, .. } => write!(
                f,
                "the disk failed ({reason}); the recording goes on in {path} and lacks nothing"
            ),
            Self::Altered(err) => write!(
                f,
                "{err}; what is recorded from now on goes into another file, and the run ends"
            ),
            Self::Slow => {
                write!(f, "the disk is too slow: {} s of samples wait in memory", QUEUE_SECONDS / 2)
            }
            Self::TooSlow => write!(
                f,
                "the disk is too slow: {} s of samples wait in memory, so the run ends while all can be saved",
                QUEUE_SECONDS / 10 * 9
            ),
        }
    }
}

/// What the writer thread tells the caller.
#[derive(Default)]
pub(super) struct Shared {
    has_failed: AtomicBool,
    failure: Mutex<Option<LogError>>,
    pub saved_through_ns: AtomicU64,
    /// Session time in batches that are not written yet.
    pub queued_ns: AtomicU64,
    /// Raw bytes in them.
    pub queued_raw: AtomicU64,
    /// The longest synchronisation since it was last asked for, in ns; 0 if there was none.
    pub sync_ns: AtomicU64,
    /// Free room on the disk at the last one, and one more, in bytes; 0 while it is not known.
    pub free_bytes: AtomicU64,
    moves: Mutex<Vec<Notice>>,
}

impl Shared {
    pub fn fail(&self, err: LogError) {
        let mut failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        // The first reason is the cause, later ones its consequences.
        failure.get_or_insert(err);
        self.has_failed.store(true, Ordering::Release);
    }

    pub fn tell(&self, news: Notice) {
        let mut moves = self.moves.lock().unwrap_or_else(PoisonError::into_inner);
        moves.push(news);
    }

    /// How long a synchronisation took, and what room there is after it.
    pub fn note_sync(&self, took: Duration, free_bytes: Option<u64>) {
        let nanos = u64::try_from(took.as_nanos()).unwrap_or(u64::MAX);
        self.sync_ns.fetch_max(nanos.max(1), Ordering::AcqRel);
        let free = free_bytes.map_or(0, |free| free.saturating_add(1));
        self.free_bytes.store(free, Ordering::Release);
    }

    /// Share of the queue that is in use.
    pub fn queue_share(&self) -> f64 {
        let time = self.queued_ns.load(Ordering::Acquire) as f64 / QUEUE.0 as f64;
        let raw = self.queued_raw.load(Ordering::Acquire) as f64 / QUEUE_RAW as f64;
        time.max(raw)
    }

    pub fn take_moves(&self) -> Vec<Notice> {
        let mut moves = self.moves.lock().unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut *moves)
    }

    pub fn check(&self) -> Result<(), LogError> {
        if !self.has_failed.load(Ordering::Acquire) {
            return Ok(());
        }
        let failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        Err(failure.clone().unwrap_or(LogError::Closed))
    }
}

/// News of a log that may be closed already.
pub struct News(Arc<Shared>);

impl News {
    pub(super) fn of(shared: &Arc<Shared>) -> Self {
        Self(Arc::clone(shared))
    }

    /// What happened since this was last asked.
    pub fn take(&self) -> Vec<Notice> {
        self.0.take_moves()
    }
}
