//! The session writer: collects samples on the caller's thread and writes them on its own thread.
//!
//! A batch is 100 ms of session time. At virtual pace the caller waits until the thread has taken the batch before, so a
//! killed process loses at most two batches. At real pace the caller never waits: a bounded queue holds 30 s of batches,
//! and a full queue is a reported failure, never a silent gap.

use super::batch_writer::{monotonic_now, write_batches};
use super::error::LogError;
use super::notices::{LogNotice, LogNotices, QUEUE_SECONDS, WriterStatus};
use super::sink::{FolderSegments, SegmentSource, Sink};
use super::writer::{BATCHES_PER_SEGMENT, LogBatch, LogWriter, check_order};
use crate::folder::SessionFolder;
use crate::health::{HealthMessage, MachineState};
use crate::manifest::Manifest;
use crate::record::{EndRecord, EntryKind, LogEntry, SampleRow};
use palpate_model::Nanos;
use palpate_model::rig::RawBytes;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;

pub(super) const BATCH: Nanos = Nanos::from_millis(100);
/// Largest number of samples in one batch.
const BATCH_ROWS_MAX: usize = 1 << 16;
/// Batches that the queue holds: more than 30 s, because events and slow samples end batches early.
const QUEUE_BATCHES: usize = 4096;
/// Largest number of raw bytes in one batch; a chunk of the log holds four times as many.
const BATCH_RAW_MAX: usize = 1 << 20;

/// Relation of session time to wall time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordingPace {
    /// As fast as the computation: the caller waits for the disk.
    Virtual,
    /// In step with the wall clock: the caller never waits.
    Real,
}

#[derive(Default)]
pub(super) struct Batch {
    pub rows: Vec<SampleRow>,
    pub entries: Vec<LogEntry>,
    pub raw: Vec<RawBytes>,
    /// Bytes in `raw`.
    pub raw_bytes: usize,
    pub health: Vec<HealthMessage>,
    pub through: Nanos,
    /// Session time that it covers, without a pause before it.
    pub span: Nanos,
    pub end: Option<EndRecord>,
    /// Whether it holds an event, which is synchronised at once.
    pub has_event: bool,
}

impl Batch {
    pub fn parts(&self) -> LogBatch<'_> {
        LogBatch { rows: &self.rows, entries: &self.entries, raw: &self.raw, health: &self.health }
    }
}

/// Records one session on the thread `session-writer`.
///
/// Without [`close`](Self::close), dropping it saves everything but writes no end record, so that the session counts as
/// interrupted.
pub struct SessionWriter {
    batch: Batch,
    /// Start of the batch's 100 ms: the end of the batch before, or the first item.
    batch_start: Option<Nanos>,
    last_order: Option<u64>,
    pace: RecordingPace,
    path: String,
    sender: Option<SyncSender<Batch>>,
    status: Arc<WriterStatus>,
    thread: Option<JoinHandle<()>>,
    /// The most severe notice of a slow disk so far.
    reported_slow: Option<LogNotice>,
    // Keeps the folder locked until the log is closed.
    _folder: Option<SessionFolder>,
}

impl SessionWriter {
    /// Starts a session in a folder. Once this returns, the manifest survives a power cut.
    ///
    /// If the folder's disk fails, the recording continues in a subfolder of `spare`, which should be on another disk.
    pub fn start(
        folder: SessionFolder,
        spare: Option<&Path>,
        manifest: &Manifest,
        pace: RecordingPace,
    ) -> Result<Self, LogError> {
        let source = match spare {
            None => FolderSegments::new(folder.path()),
            Some(spare) => FolderSegments::with_spare(folder.path(), spare, &manifest.session_id)
                .map_err(|err| {
                LogError::disk(&err, &format!("in the spare folder {}", spare.display()))
            })?,
        };
        let mut writer = Self::start_in_segments(source, BATCHES_PER_SEGMENT, manifest, pace)?;
        writer._folder = Some(folder);
        Ok(writer)
    }

    /// Starts a session with a new segment after every `batches_per_segment` batches.
    pub fn start_in_segments<G: SegmentSource + 'static>(
        source: G,
        batches_per_segment: u32,
        manifest: &Manifest,
        pace: RecordingPace,
    ) -> Result<Self, LogError> {
        let path = source.path(0);
        let log = LogWriter::begin_in_segments(Box::new(source), batches_per_segment, manifest)?;
        Self::start_log(log, &path, pace)
    }

    /// Starts a session in a single file; `path` is only for messages.
    pub fn start_on<S: Sink + 'static>(
        sink: S,
        path: &str,
        manifest: &Manifest,
        pace: RecordingPace,
    ) -> Result<Self, LogError> {
        let log = LogWriter::begin(sink, path, manifest)?;
        Self::start_log(log, path, pace)
    }

    fn start_log<S: Sink + 'static>(
        log: LogWriter<S>,
        path: &str,
        pace: RecordingPace,
    ) -> Result<Self, LogError> {
        // A queue of length 0 makes the sender wait until the thread takes the batch.
        let (sender, receiver) = sync_channel(match pace {
            RecordingPace::Virtual => 0,
            RecordingPace::Real => QUEUE_BATCHES,
        });
        let status = Arc::new(WriterStatus::default());
        let thread_status = Arc::clone(&status);
        let thread = std::thread::Builder::new()
            .name("session-writer".into())
            .spawn(move || write_batches(log, &receiver, &thread_status, monotonic_now))
            .map_err(|err| LogError::Disk {
                reason: format!("the writing thread did not start: {err}"),
                path: path.into(),
            })?;
        Ok(Self {
            batch: Batch::default(),
            batch_start: None,
            last_order: None,
            pace,
            path: path.into(),
            sender: Some(sender),
            status,
            thread: Some(thread),
            reported_slow: None,
            _folder: None,
        })
    }

    /// Takes well under 1 µs unless a batch is full.
    pub fn push_row(&mut self, row: SampleRow) -> Result<(), LogError> {
        self.status.check()?;
        if let Some(what) = row.non_finite() {
            return Err(LogError::NotFinite { what: format!("{what} of a sample") });
        }
        self.make_room(row.host)?;
        self.batch.rows.push(row);
        Ok(())
    }

    /// The entry's order must exceed that of the entry before.
    pub fn push_entry(&mut self, entry: LogEntry) -> Result<(), LogError> {
        self.status.check()?;
        check_order(entry.order, self.last_order)?;
        self.make_room(entry.now)?;
        self.last_order = Some(entry.order);
        self.batch.has_event |= entry.kind != EntryKind::Fit;
        self.batch.entries.push(entry);
        Ok(())
    }

    /// Records bytes exchanged with devices, each at its session time; `now` is the time of the newest input.
    pub fn push_raw(&mut self, now: Nanos, raw: Vec<RawBytes>) -> Result<(), LogError> {
        for piece in raw {
            self.status.check()?;
            self.make_room(now)?;
            self.batch.raw_bytes += piece.bytes.len();
            self.batch.raw.push(piece);
        }
        Ok(())
    }

    pub fn push_health(&mut self, health: HealthMessage) -> Result<(), LogError> {
        self.status.check()?;
        self.make_room(health.now)?;
        self.batch.health.push(health);
        Ok(())
    }

    /// The log's part of a [`MachineState`], with the longest synchronisation since the last call.
    pub fn disk_state(&self) -> MachineState {
        let sync_ns = self.status.sync_ns.swap(0, Ordering::AcqRel);
        let free = self.status.free_bytes.load(Ordering::Acquire);
        MachineState {
            queue_share: self.status.queue_share(),
            sync_s: (sync_ns > 0).then(|| Nanos(sync_ns).seconds().0),
            free_bytes: free.checked_sub(1),
            ..MachineState::default()
        }
    }

    /// Access to notices that remains after the writer is closed.
    pub fn notices(&self) -> LogNotices {
        LogNotices::of(&self.status)
    }

    /// Notices since the last call.
    pub fn take_notices(&mut self) -> Vec<LogNotice> {
        let mut notices = self.status.take_notices();
        let share = self.status.queue_share();
        let slow = match self.pace {
            RecordingPace::Real if share >= 0.9 => Some(LogNotice::TooSlow),
            RecordingPace::Real if share >= 0.5 => Some(LogNotice::Slow),
            _ => None,
        };
        let is_new = slow != self.reported_slow && self.reported_slow != Some(LogNotice::TooSlow);
        if slow.is_some() && is_new {
            self.reported_slow.clone_from(&slow);
            notices.extend(slow);
        }
        notices
    }

    /// Sends a batch that is due, for callers without samples for a while.
    pub fn on_tick(&mut self, now: Nanos) -> Result<(), LogError> {
        self.status.check()?;
        if self.is_due(now) {
            self.hand_over()?;
        }
        Ok(())
    }

    /// Why nothing is saved any more; `None` without a failure.
    pub fn failure(&self) -> Option<String> {
        self.status.check().err().map(|err| err.to_string())
    }

    /// Session time up to which the system has everything, so that it survives the death of this process.
    pub fn saved_through(&self) -> Nanos {
        Nanos(self.status.saved_through_ns.load(Ordering::Acquire))
    }

    /// Writes the end record, waits for the disk and ends the thread.
    pub fn close(mut self, end: EndRecord) -> Result<(), LogError> {
        let outcome = self.status.check().and_then(|()| {
            let mut batch = std::mem::take(&mut self.batch);
            batch.through = batch.through.max(end.ended_at);
            batch.end = Some(end);
            self.send(batch, RecordingPace::Virtual)
        });
        self.join();
        outcome.and_then(|()| self.status.check())
    }

    fn is_due(&self, now: Nanos) -> bool {
        let is_old = |start| now.since(start).0 >= BATCH.0;
        // At real pace an event is sent as soon as session time moves on.
        let is_event =
            self.batch.has_event && self.pace == RecordingPace::Real && now > self.batch.through;
        self.batch_start.is_some_and(is_old) || is_event || self.is_full()
    }

    fn is_full(&self) -> bool {
        self.batch.rows.len() >= BATCH_ROWS_MAX || self.batch.raw_bytes >= BATCH_RAW_MAX
    }

    fn make_room(&mut self, now: Nanos) -> Result<(), LogError> {
        if self.is_due(now) {
            self.hand_over()?;
        }
        self.batch_start.get_or_insert(now);
        self.batch.through = self.batch.through.max(now);
        Ok(())
    }

    fn hand_over(&mut self) -> Result<(), LogError> {
        if self.batch.parts().is_empty() {
            self.batch_start = None;
            return Ok(());
        }
        let through = self.batch.through;
        // Counted from the end of the batch before, two batches never span more than 200 ms.
        let start = self.batch_start.replace(through).unwrap_or(through);
        self.batch.span = through.since(start).min(BATCH);
        let next =
            Batch { rows: Vec::with_capacity(self.batch.rows.len()), through, ..Batch::default() };
        let batch = std::mem::replace(&mut self.batch, next);
        self.send(batch, self.pace)
    }

    /// Sends a batch to the thread; waits for it at virtual pace only.
    fn send(&mut self, batch: Batch, pace: RecordingPace) -> Result<(), LogError> {
        let Some(sender) = &self.sender else {
            return Err(LogError::Closed);
        };
        let is_over = self.status.add_queued(batch.span, batch.raw_bytes);
        let outcome = match pace {
            RecordingPace::Virtual => {
                sender.send(batch).map_err(|err| TrySendError::Disconnected(err.0))
            }
            RecordingPace::Real if is_over => Err(TrySendError::Full(batch)),
            RecordingPace::Real => sender.try_send(batch),
        };
        match outcome {
            Ok(()) => Ok(()),
            Err(TrySendError::Full(_)) => {
                self.status
                    .fail(LogError::TooSlow { seconds: QUEUE_SECONDS, path: self.path.clone() });
                self.status.check()
            }
            // The thread ends early only after it has reported a failure.
            Err(TrySendError::Disconnected(_)) => self.status.check().and(Err(LogError::Closed)),
        }
    }

    fn join(&mut self) {
        // Without a sender the thread ends once its queue is empty.
        self.sender = None;
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            self.status.fail(LogError::Disk {
                reason: "the writer stopped unexpectedly".into(),
                path: self.path.clone(),
            });
        }
    }
}

impl Drop for SessionWriter {
    fn drop(&mut self) {
        let has_rest = !self.batch.parts().is_empty();
        if self.thread.is_some() && has_rest && self.status.check().is_ok() {
            let batch = std::mem::take(&mut self.batch);
            // A failure cannot be returned here; it shows as a missing end record.
            let _ = self.send(batch, RecordingPace::Virtual);
        }
        self.join();
    }
}
