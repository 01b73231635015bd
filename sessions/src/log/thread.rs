//! The session writer: collects samples on the caller's thread, writes on its own.
//!
//! A batch is 100 ms of session time. At virtual pace a batch is only handed over when the one
//! before it is on its way to the disk, so a killed process loses at most two batches. At real
//! pace handing over never waits: 30 s of batches fit in a bounded queue, and a queue that is
//! full is a failure the caller sees, never a silent gap.

use super::error::LogError;
use super::news::{News, Notice, QUEUE, QUEUE_RAW, QUEUE_SECONDS, Shared};
use super::scribe::{monotonic_now, write_batches};
use super::sink::{FolderSegments, SegmentSource, Sink};
use super::writer::{BATCHES_PER_SEGMENT, LogWriter, Parts, check_order};
use crate::folder::SessionFolder;
use crate::health::{Health, MachineState};
use crate::manifest::Manifest;
use crate::record::{EndRecord, Entry, EntryKind, Row};
use palpate_model::Nanos;
use palpate_model::rig::RawBytes;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;

/// Session time in one batch.
pub(super) const BATCH: Nanos = Nanos::from_millis(100);
/// Samples in one batch, however little time they take.
const BATCH_ROWS_MAX: usize = 1 << 16;
/// Batches that fit in it: more than 30 s of batches, which slow samples make shorter.
const QUEUE_BATCHES: usize = 4096;
/// Raw bytes in one batch, however little time they take: a chunk of the log holds four times as many.
const BATCH_RAW_MAX: usize = 1 << 20;
/// How session time passes against wall time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pace {
    /// As fast as it is computed: the caller waits for the disk.
    Virtual,
    /// With the wall clock: the caller never waits.
    Real,
}

#[derive(Default)]
pub(super) struct Batch {
    pub rows: Vec<Row>,
    pub entries: Vec<Entry>,
    pub raw: Vec<RawBytes>,
    /// Bytes in `raw`.
    pub raw_bytes: usize,
    pub health: Vec<Health>,
    /// Newest time in the batch.
    pub through: Nanos,
    /// Session time it covers, a pause before it not counted.
    pub span: Nanos,
    pub end: Option<EndRecord>,
    /// Whether it holds an event, which must survive a power cut at once.
    pub has_event: bool,
}

impl Batch {
    pub fn parts(&self) -> Parts<'_> {
        Parts { rows: &self.rows, entries: &self.entries, raw: &self.raw, health: &self.health }
    }
}

/// Records one session on the thread `session-writer`.
///
/// Dropped without [`close`](Self::close), it saves what it was given but writes no end record,
/// so that the session is seen to be incomplete.
pub struct SessionWriter {
    batch: Batch,
    /// Where the batch's 100 ms begin: the end of the batch before, or the first item.
    batch_start: Option<Nanos>,
    last_order: Option<u64>,
    pace: Pace,
    path: String,
    sender: Option<SyncSender<Batch>>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    /// The worst that was told of a slow disk.
    told_slow: Option<Notice>,
    // Held until the log is closed.
    _folder: Option<SessionFolder>,
}

impl SessionWriter {
    /// Starts a session in a folder. When this returns, the manifest survives a power cut.
    ///
    /// Should the folder's disk fail, the recording goes on in a folder of the session's id in
    /// `spare`, best on another disk.
    pub fn start(
        folder: SessionFolder,
        spare: Option<&Path>,
        manifest: &Manifest,
        pace: Pace,
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

    /// Starts a session that goes on in a new segment after every so many batches.
    pub fn start_in_segments<G: SegmentSource + 'static>(
        source: G,
        batches_per_segment: u32,
        manifest: &Manifest,
        pace: Pace,
    ) -> Result<Self, LogError> {
        let path = source.path(0);
        let log = LogWriter::begin_in_segments(Box::new(source), batches_per_segment, manifest)?;
        Self::start_log(log, &path, pace)
    }

    /// Starts a session on one sink, however long it gets; `path` is only shown in errors.
    pub fn start_on<S: Sink + 'static>(
        sink: S,
        path: &str,
        manifest: &Manifest,
        pace: Pace,
    ) -> Result<Self, LogError> {
        let log = LogWriter::begin(sink, path, manifest)?;
        Self::start_log(log, path, pace)
    }

    fn start_log<S: Sink + 'static>(
        log: LogWriter<S>,
        path: &str,
        pace: Pace,
    ) -> Result<Self, LogError> {
        // A queue of none makes handing over wait until the thread is free.
        let (sender, receiver) = sync_channel(match pace {
            Pace::Virtual => 0,
            Pace::Real => QUEUE_BATCHES,
        });
        let shared = Arc::new(Shared::default());
        let thread_shared = Arc::clone(&shared);
        let thread = std::thread::Builder::new()
            .name("session-writer".into())
            .spawn(move || write_batches(log, &receiver, &thread_shared, monotonic_now))
            .map_err(|err| LogError::Disk {
                reason: format!("no thread to write on: {err}"),
                path: path.into(),
            })?;
        Ok(Self {
            batch: Batch::default(),
            batch_start: None,
            last_order: None,
            pace,
            path: path.into(),
            sender: Some(sender),
            shared,
            thread: Some(thread),
            told_slow: None,
            _folder: None,
        })
    }

    /// Records one sample. Costs well under a microsecond unless a batch is handed over.
    pub fn push_row(&mut self, row: Row) -> Result<(), LogError> {
        self.shared.check()?;
        if let Some(what) = row.non_finite() {
            return Err(LogError::NotFinite { what: format!("{what} of a sample") });
        }
        self.make_room(row.host)?;
        self.batch.rows.push(row);
        Ok(())
    }

    /// Records one entry; its order must be above that of the entry before.
    pub fn push_entry(&mut self, entry: Entry) -> Result<(), LogError> {
        self.shared.check()?;
        check_order(entry.order, self.last_order)?;
        self.make_room(entry.now)?;
        self.last_order = Some(entry.order);
        self.batch.has_event |= entry.kind != EntryKind::Fit;
        self.batch.entries.push(entry);
        Ok(())
    }

    /// Records bytes as exchanged with devices, each at its session time; `now` is that of the newest input.
    pub fn push_raw(&mut self, now: Nanos, raw: Vec<RawBytes>) -> Result<(), LogError> {
        for piece in raw {
            self.shared.check()?;
            self.make_room(now)?;
            self.batch.raw_bytes += piece.bytes.len();
            self.batch.raw.push(piece);
        }
        Ok(())
    }

    /// Records how the computer keeps up.
    pub fn push_health(&mut self, health: Health) -> Result<(), LogError> {
        self.shared.check()?;
        self.make_room(health.now)?;
        self.batch.health.push(health);
        Ok(())
    }

    /// How the disk keeps up: the log's part of a [`MachineState`], the longest synchronisation since this was
    /// last asked.
    pub fn disk_state(&self) -> MachineState {
        let sync_ns = self.shared.sync_ns.swap(0, Ordering::AcqRel);
        let free = self.shared.free_bytes.load(Ordering::Acquire);
        MachineState {
            queue_share: self.shared.queue_share(),
            sync_s: (sync_ns > 0).then(|| Nanos(sync_ns).seconds().0),
            free_bytes: free.checked_sub(1),
            ..MachineState::default()
        }
    }

    /// What becomes of the log after it was last asked, also once the writer is closed.
    pub fn news(&self) -> News {
        News::of(&self.shared)
    }

    /// News of the log since this was last asked.
    pub fn take_notices(&mut self) -> Vec<Notice> {
        let mut news = self.shared.take_moves();
        let share = self.shared.queue_share();
        let slow = match self.pace {
            Pace::Real if share >= 0.9 => Some(Notice::TooSlow),
            Pace::Real if share >= 0.5 => Some(Notice::Slow),
            _ => None,
        };
        if slow.is_some() && slow != self.told_slow && self.told_slow != Some(Notice::TooSlow) {
            self.told_slow.clone_from(&slow);
            news.extend(slow);
        }
        news
    }

    /// Hands over a batch that is old enough, for callers that go without samples for long.
    pub fn on_tick(&mut self, now: Nanos) -> Result<(), LogError> {
        self.shared.check()?;
        if self.is_due(now) {
            self.hand_over()?;
        }
        Ok(())
    }

    /// Why nothing more is saved; `None` while all is well.
    pub fn failure(&self) -> Option<String> {
        self.shared.check().err().map(|err| err.to_string())
    }

    /// Session time up to which everything is handed to the system, and so survives the death
    /// of this process.
    pub fn saved_through(&self) -> Nanos {
        Nanos(self.shared.saved_through_ns.load(Ordering::Acquire))
    }

    /// Writes the end record, waits until it is on the disk and ends the thread.
    pub fn close(mut self, end: EndRecord) -> Result<(), LogError> {
        let outcome = self.shared.check().and_then(|()| {
            let mut batch = std::mem::take(&mut self.batch);
            batch.through = batch.through.max(end.ended_at);
            batch.end = Some(end);
            self.send_waiting(batch)
        });
        self.join();
        outcome.and_then(|()| self.shared.check())
    }

    fn is_due(&self, now: Nanos) -> bool {
        let is_old = |start| now.since(start).0 >= BATCH.0;
        // With the wall clock, what belongs to one moment goes to the disk as soon as it is over.
        let is_event = self.batch.has_event && self.pace == Pace::Real && now > self.batch.through;
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
        match self.pace {
            Pace::Virtual => self.send_waiting(batch),
            Pace::Real => self.send_at_once(batch),
        }
    }

    fn send_waiting(&mut self, batch: Batch) -> Result<(), LogError> {
        let Some(sender) = &self.sender else {
            return Err(LogError::Closed);
        };
        self.shared.queued_ns.fetch_add(batch.span.0, Ordering::AcqRel);
        let raw = batch.raw_bytes as u64;
        self.shared.queued_raw.fetch_add(raw, Ordering::AcqRel);
        // The thread only goes away after it has failed, and then has said why.
        sender.send(batch).or_else(|_| self.shared.check().and(Err(LogError::Closed)))
    }

    fn send_at_once(&mut self, batch: Batch) -> Result<(), LogError> {
        let Some(sender) = &self.sender else {
            return Err(LogError::Closed);
        };
        let span = batch.span.0;
        let queued = self.shared.queued_ns.fetch_add(span, Ordering::AcqRel);
        let raw = batch.raw_bytes as u64;
        let queued_raw = self.shared.queued_raw.fetch_add(raw, Ordering::AcqRel);
        let outcome = if queued + span > QUEUE.0 || queued_raw + raw > QUEUE_RAW {
            Err(TrySendError::Full(batch))
        } else {
            sender.try_send(batch)
        };
        match outcome {
            Ok(()) => Ok(()),
            Err(TrySendError::Full(_)) => {
                self.shared
                    .fail(LogError::TooSlow { seconds: QUEUE_SECONDS, path: self.path.clone() });
                self.shared.check()
            }
            Err(TrySendError::Disconnected(_)) => self.shared.check().and(Err(LogError::Closed)),
        }
    }

    fn join(&mut self) {
        // Without a sender the thread ends once its queue is empty.
        self.sender = None;
        if let Some(thread) = self.thread.take()
            && thread.join().is_err()
        {
            self.shared.fail(LogError::Disk {
                reason: "the writer stopped unexpectedly".into(),
                path: self.path.clone(),
            });
        }
    }
}

impl Drop for SessionWriter {
    fn drop(&mut self) {
        let has_rest = !self.batch.parts().is_empty();
        if self.thread.is_some() && has_rest && self.shared.check().is_ok() {
            let batch = std::mem::take(&mut self.batch);
            // There is nobody left to tell: the failure shows as a missing end record.
            let _ = self.send_waiting(batch);
        }
        self.join();
    }
}
