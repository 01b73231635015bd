//! The thread's part of the session writer: batches to the disk, and what to do when that fails.

use super::error::LogError;
use super::news::{Notice, Shared};
use super::sink::Sink;
use super::thread::Batch;
use super::writer::{LogWriter, Parts};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

/// Samples that are kept in memory at most to be written again if the disk fails: 23 MB.
const ROWS_SINCE_SYNC_MAX: usize = 1 << 18;
/// Raw bytes that are kept for the same.
const RAW_SINCE_SYNC_MAX: usize = 8 << 20;
/// New files begun at most because the disk failed. A disk that fails more often will not do.
const MOVES_MAX: u32 = 4;
/// Wall time from the beginning of a synchronisation with the disk to when the next is due. It begins when the
/// batch in the making is written, 100 ms later at most, and takes tens of milliseconds: so a power cut costs
/// no more than a second.
const SYNC_EVERY: Duration = Duration::from_millis(800);

/// The thread's part: the log, and what must be written again if the disk fails.
struct Scribe<'a, S: Sink, C: Fn() -> Instant> {
    log: LogWriter<S>,
    shared: &'a Shared,
    clock: C,
    since_sync: Vec<Batch>,
    /// When the last synchronisation began: what came after it may be lost.
    last_sync: Instant,
    moves: u32,
    /// What another program did to the log first.
    altered: Option<LogError>,
}

/// The thread: writes batches until there are no more, and synchronises after events and whenever it is time.
pub(super) fn write_batches<S: Sink>(
    log: LogWriter<S>,
    receiver: &Receiver<Batch>,
    shared: &Shared,
    clock: impl Fn() -> Instant,
) {
    let mut scribe = Scribe {
        log,
        shared,
        since_sync: Vec::new(),
        last_sync: clock(),
        clock,
        moves: 0,
        altered: None,
    };
    if let Err(err) = scribe.run(receiver) {
        shared.fail(err);
    }
}

impl<S: Sink, C: Fn() -> Instant> Scribe<'_, S, C> {
    fn run(&mut self, receiver: &Receiver<Batch>) -> Result<(), LogError> {
        let mut carried = None;
        let mut has_event = false;
        loop {
            let next = carried.take().map_or_else(|| receiver.recv_timeout(self.patience()), Ok);
            match next {
                Ok(batch) => {
                    has_event |= batch.has_event;
                    if self.write(batch)? {
                        return Ok(());
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                // No end record was asked for; what was written is still made durable.
                Err(RecvTimeoutError::Disconnected) => return self.sync(),
            }
            let rows: usize = self.since_sync.iter().map(|batch| batch.rows.len()).sum();
            let raw: usize = self.since_sync.iter().map(|batch| batch.raw_bytes).sum();
            let is_much = rows >= ROWS_SINCE_SYNC_MAX || raw >= RAW_SINCE_SYNC_MAX;
            let is_due = self.patience().is_zero();
            if has_event {
                // One sync does for all events that wait.
                carried = receiver.try_recv().ok();
            }
            if is_due || is_much || (has_event && carried.is_none()) {
                self.sync()?;
                has_event = false;
            }
        }
    }

    /// How long the next synchronisation can wait.
    fn patience(&self) -> Duration {
        let since = (self.clock)().duration_since(self.last_sync);
        match self.since_sync.is_empty() {
            true => SYNC_EVERY,
            false => SYNC_EVERY.saturating_sub(since),
        }
    }

    /// Writes a batch; whether it was the last.
    fn write(&mut self, mut batch: Batch) -> Result<bool, LogError> {
        let end = batch.end.take();
        let (span, through, raw_bytes) = (batch.span, batch.through, batch.raw_bytes);
        let outcome = self.log.append_parts(&batch.parts());
        self.since_sync.push(batch);
        let outcome = outcome.or_else(|err| self.go_on_elsewhere(&err));
        self.shared.queued_ns.fetch_sub(span.0, Ordering::AcqRel);
        let queued_raw = &self.shared.queued_raw;
        queued_raw.fetch_sub(raw_bytes as u64, Ordering::AcqRel);
        outcome?;
        if let Some(end) = &end {
            while let Err(err) = self.log.finish(end.clone()) {
                self.go_on_elsewhere(&err)?;
            }
        }
        if let Some(err) = self.log.take_altered() {
            self.note_altered(err);
        }
        // Told last, so that the log has its end whatever became of what was before.
        if let (Some(_), Some(err)) = (&end, &self.altered) {
            return Err(err.clone());
        }
        let saved = &self.shared.saved_through_ns;
        saved.store(through.0, Ordering::Release);
        Ok(end.is_some())
    }

    fn sync(&mut self) -> Result<(), LogError> {
        let began = (self.clock)();
        if !self.since_sync.is_empty() {
            if let Err(err) = self.log.sync() {
                // What is written again is synced, too.
                self.go_on_elsewhere(&err)?;
            }
            self.since_sync.clear();
            let took = (self.clock)().duration_since(began);
            self.shared.note_sync(took, self.log.free_bytes());
        }
        self.last_sync = began;
        Ok(())
    }

    /// What another program did is a fault of the session, which nothing makes good.
    fn note_altered(&mut self, err: LogError) {
        self.shared.tell(Notice::Altered(err.clone()));
        self.altered.get_or_insert(err);
    }

    /// After the disk has failed, or another program has changed the file: a new segment, with everything that may be lost
    /// of the old one.
    fn go_on_elsewhere(&mut self, err: &LogError) -> Result<(), LogError> {
        let reason = match err {
            LogError::Disk { reason, .. } => reason.clone(),
            LogError::Altered { alteration, .. } => alteration.to_string(),
            _ => return Err(err.clone()),
        };
        let again: Vec<Parts<'_>> = self.since_sync.iter().map(Batch::parts).collect();
        let began = (self.clock)();
        let (path, is_elsewhere) = loop {
            if self.moves >= MOVES_MAX {
                return Err(err.clone());
            }
            self.moves += 1;
            if let Ok(place) = self.log.write_again(&again) {
                break place;
            }
        };
        self.since_sync.clear();
        self.last_sync = began;
        if let LogError::Altered { .. } = err {
            self.note_altered(err.clone());
            return Ok(());
        }
        self.shared.tell(Notice::Moved {
            reason,
            path,
            is_last: is_elsewhere || self.moves == MOVES_MAX,
        });
        Ok(())
    }
}

#[expect(
    clippy::disallowed_methods,
    reason = "how often to synchronise is about the disk, not about the session"
)]
pub(super) fn monotonic_now() -> Instant {
    Instant::now()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::thread::BATCH;
    use crate::manifest::Manifest;
    use crate::record::Row;
    use palpate_model::Nanos;
    use std::io;
    use std::sync::atomic::AtomicU64;
    use std::sync::mpsc::sync_channel;
    use std::sync::{Arc, Mutex};

    /// A disk in whose time batches come every 100 ms and a synchronisation takes a while.
    #[derive(Clone)]
    struct Slow {
        now_ms: Arc<AtomicU64>,
        sync_ms: u64,
        /// When each synchronisation began and ended.
        syncs: Arc<Mutex<Vec<(u64, u64)>>>,
    }

    impl Sink for Slow {
        fn append(&mut self, _: &[u8]) -> io::Result<()> {
            let batch_ms = BATCH.0 / 1_000_000;
            self.now_ms.fetch_add(batch_ms, Ordering::Relaxed);
            Ok(())
        }

        fn sync(&mut self) -> io::Result<()> {
            let began = self.now_ms.fetch_add(self.sync_ms, Ordering::Relaxed);
            let ended = began + self.sync_ms;
            self.syncs.lock().unwrap().push((began, ended));
            Ok(())
        }
    }

    fn manifest() -> Manifest {
        serde_json::from_value(serde_json::json!({
            "record_version": 2, "session_id": "one", "software_version": "0", "engine_version": 1,
            "started_at": "2026-03-05T14:15:07Z", "operator": "", "specimen": "", "indenter": "",
            "calibration": null, "plan": null, "settings": null, "acknowledgements": [],
        }))
        .unwrap()
    }

    fn scribe<'a>(
        disk: &Slow,
        shared: &'a Shared,
    ) -> Scribe<'a, Slow, impl Fn() -> Instant + use<>> {
        let (start, now_ms) = (monotonic_now(), Arc::clone(&disk.now_ms));
        let clock = move || start + Duration::from_millis(now_ms.load(Ordering::Relaxed));
        Scribe {
            log: LogWriter::begin(disk.clone(), "memory", &manifest()).unwrap(),
            shared,
            since_sync: Vec::new(),
            last_sync: clock(),
            clock,
            moves: 0,
            altered: None,
        }
    }

    fn disk(sync_ms: u64) -> Slow {
        Slow { now_ms: Arc::default(), sync_ms, syncs: Arc::default() }
    }

    fn batch(number: u64) -> Batch {
        let row = Row {
            tick: number,
            host: Nanos(BATCH.0 * number),
            age: None,
            counts: None,
            volts: Some(0.5),
            pulses: Some(0),
            status: 0,
            force: None,
            depth: None,
            phase: palpate_model::rig::Phase::Idle,
            cycle: 0,
        };
        Batch { rows: vec![row], through: row.host, span: BATCH, ..Batch::default() }
    }

    #[test]
    fn what_is_not_synchronised_is_never_older_than_a_second() {
        for sync_ms in [0, 4, 19, 60, 100] {
            let disk = disk(sync_ms);
            let shared = Shared::default();
            let mut scribe = scribe(&disk, &shared);
            let (sender, receiver) = sync_channel(200);
            for number in 0..200 {
                let mut batch = batch(number);
                batch.has_event = number % 37 == 0;
                sender.send(batch).unwrap();
            }
            drop(sender);
            scribe.run(&receiver).unwrap();
            let syncs = disk.syncs.lock().unwrap();
            assert!(syncs.len() > 20, "{}", syncs.len());
            for two in syncs.windows(2) {
                // What was taken since the one began is safe once the next has ended.
                let oldest_ms = two[1].1 - two[0].0;
                assert!(oldest_ms <= 1000, "{oldest_ms} ms, {sync_ms} ms a sync");
            }
        }
    }

    #[test]
    fn silence_does_not_put_a_synchronisation_off() {
        let disk = disk(10);
        let shared = Shared::default();
        let mut scribe = scribe(&disk, &shared);
        assert_eq!(scribe.patience(), SYNC_EVERY);
        for number in 0..7 {
            scribe.write(batch(number)).unwrap();
        }
        assert_eq!(scribe.patience(), Duration::from_millis(100));
        scribe.sync().unwrap();
        disk.now_ms.fetch_add(5000, Ordering::Relaxed);
        // Nothing waits to be made durable.
        assert_eq!(scribe.patience(), SYNC_EVERY);
    }
}
