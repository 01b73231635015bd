//! The writer thread: writes batches to the disk and continues in a new segment when that fails.

use super::error::LogError;
use super::notices::{LogNotice, WriterStatus};
use super::sink::Sink;
use super::thread::Batch;
use super::writer::{LogBatch, LogWriter};
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

/// Largest number of samples held in memory for rewriting after a disk failure: 23 MB.
const ROWS_SINCE_SYNC_MAX: usize = 1 << 18;
/// Largest number of raw bytes held for the same purpose.
const RAW_SINCE_SYNC_MAX: usize = 8 << 20;
/// Largest number of new files after disk failures.
const MOVES_MAX: u32 = 4;
/// Wall time from the start of one synchronisation to the due time of the next. The next starts after the present batch, at
/// most 100 ms later, and takes tens of milliseconds, so a power cut costs at most 1 s.
const SYNC_EVERY: Duration = Duration::from_millis(800);

/// The log, and the batches to rewrite if the disk fails.
struct BatchWriter<'a, S: Sink, C: Fn() -> Instant> {
    log: LogWriter<S>,
    status: &'a WriterStatus,
    clock: C,
    since_sync: Vec<Batch>,
    /// Start of the last synchronisation; later batches may be lost.
    last_sync: Instant,
    moves: u32,
    /// The first alteration by another program.
    altered: Option<LogError>,
}

/// Writes batches until the channel closes; synchronises after events and at intervals.
pub(super) fn write_batches<S: Sink>(
    log: LogWriter<S>,
    receiver: &Receiver<Batch>,
    status: &WriterStatus,
    clock: impl Fn() -> Instant,
) {
    let mut batch_writer = BatchWriter {
        log,
        status,
        since_sync: Vec::new(),
        last_sync: clock(),
        clock,
        moves: 0,
        altered: None,
    };
    if let Err(err) = batch_writer.run(receiver) {
        status.fail(err);
    }
}

impl<S: Sink, C: Fn() -> Instant> BatchWriter<'_, S, C> {
    fn run(&mut self, receiver: &Receiver<Batch>) -> Result<(), LogError> {
        let mut carried = None;
        let mut has_event = false;
        loop {
            let next =
                carried.take().map_or_else(|| receiver.recv_timeout(self.time_to_sync()), Ok);
            match next {
                Ok(batch) => {
                    has_event |= batch.has_event;
                    if self.write(batch)? {
                        return Ok(());
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
                // Closed without an end record; everything written is still synchronised.
                Err(RecvTimeoutError::Disconnected) => return self.sync(),
            }
            let rows: usize = self.since_sync.iter().map(|batch| batch.rows.len()).sum();
            let raw: usize = self.since_sync.iter().map(|batch| batch.raw_bytes).sum();
            let is_much = rows >= ROWS_SINCE_SYNC_MAX || raw >= RAW_SINCE_SYNC_MAX;
            let is_due = self.time_to_sync().is_zero();
            if has_event {
                // One synchronisation serves all waiting events.
                carried = receiver.try_recv().ok();
            }
            if is_due || is_much || (has_event && carried.is_none()) {
                self.sync()?;
                has_event = false;
            }
        }
    }

    /// Time until the next synchronisation is due.
    fn time_to_sync(&self) -> Duration {
        let since = (self.clock)().duration_since(self.last_sync);
        match self.since_sync.is_empty() {
            true => SYNC_EVERY,
            false => SYNC_EVERY.saturating_sub(since),
        }
    }

    /// Writes a batch; returns whether it was the last.
    fn write(&mut self, mut batch: Batch) -> Result<bool, LogError> {
        let end = batch.end.take();
        let (span, through, raw_bytes) = (batch.span, batch.through, batch.raw_bytes);
        let outcome = self.log.append_batch(&batch.parts());
        self.since_sync.push(batch);
        let outcome = outcome.or_else(|err| self.go_on_elsewhere(&err));
        self.status.remove_queued(span, raw_bytes);
        outcome?;
        if let Some(end) = &end {
            while let Err(err) = self.log.finish(end.clone()) {
                self.go_on_elsewhere(&err)?;
            }
        }
        if let Some(err) = self.log.take_altered() {
            self.report_altered(err);
        }
        // Reported last, so that the log has its end record in any case.
        if let (Some(_), Some(err)) = (&end, &self.altered) {
            return Err(err.clone());
        }
        let saved = &self.status.saved_through_ns;
        saved.store(through.0, Ordering::Release);
        Ok(end.is_some())
    }

    fn sync(&mut self) -> Result<(), LogError> {
        let began = (self.clock)();
        if !self.since_sync.is_empty() {
            if let Err(err) = self.log.sync() {
                // Rewriting includes a synchronisation.
                self.go_on_elsewhere(&err)?;
            }
            self.since_sync.clear();
            let took = (self.clock)().duration_since(began);
            self.status.record_sync(took, self.log.free_bytes());
        }
        self.last_sync = began;
        Ok(())
    }

    /// An alteration by another program cannot be repaired; closing the session reports it.
    fn report_altered(&mut self, err: LogError) {
        self.status.push_notice(LogNotice::Altered(err.clone()));
        self.altered.get_or_insert(err);
    }

    /// After a disk failure or an alteration, continues in a new segment and rewrites everything that the old one may have
    /// lost.
    fn go_on_elsewhere(&mut self, err: &LogError) -> Result<(), LogError> {
        let reason = match err {
            LogError::Disk { reason, .. } => reason.clone(),
            LogError::Altered { alteration, .. } => alteration.to_string(),
            _ => return Err(err.clone()),
        };
        let since_sync: Vec<LogBatch<'_>> = self.since_sync.iter().map(Batch::parts).collect();
        let began = (self.clock)();
        let (path, is_elsewhere) = loop {
            if self.moves >= MOVES_MAX {
                return Err(err.clone());
            }
            self.moves += 1;
            if let Ok(segment) = self.log.rewrite(&since_sync) {
                break segment;
            }
        };
        self.since_sync.clear();
        self.last_sync = began;
        if let LogError::Altered { .. } = err {
            self.report_altered(err.clone());
            return Ok(());
        }
        self.status.push_notice(LogNotice::Moved {
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
    use crate::record::SampleRow;
    use palpate_model::Nanos;
    use std::io;
    use std::sync::atomic::AtomicU64;
    use std::sync::mpsc::sync_channel;
    use std::sync::{Arc, Mutex};

    /// A disk with its own clock: a batch takes 100 ms, a synchronisation `sync_ms`.
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

    fn batch_writer<'a>(
        disk: &Slow,
        status: &'a WriterStatus,
    ) -> BatchWriter<'a, Slow, impl Fn() -> Instant + use<>> {
        let (start, now_ms) = (monotonic_now(), Arc::clone(&disk.now_ms));
        let clock = move || start + Duration::from_millis(now_ms.load(Ordering::Relaxed));
        BatchWriter {
            log: LogWriter::begin(disk.clone(), "memory", &manifest()).unwrap(),
            status,
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
        let row = SampleRow {
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
    fn unsynchronised_data_is_never_older_than_a_second() {
        for sync_ms in [0, 4, 19, 60, 100] {
            let disk = disk(sync_ms);
            let status = WriterStatus::default();
            let mut batch_writer = batch_writer(&disk, &status);
            let (sender, receiver) = sync_channel(200);
            for number in 0..200 {
                let mut batch = batch(number);
                batch.has_event = number % 37 == 0;
                sender.send(batch).unwrap();
            }
            drop(sender);
            batch_writer.run(&receiver).unwrap();
            let syncs = disk.syncs.lock().unwrap();
            assert!(syncs.len() > 20, "{}", syncs.len());
            for two in syncs.windows(2) {
                // Batches since the start of one synchronisation are safe at the end of the next.
                let oldest_ms = two[1].1 - two[0].0;
                assert!(oldest_ms <= 1000, "{oldest_ms} ms, {sync_ms} ms a sync");
            }
        }
    }

    #[test]
    fn pause_between_batches_does_not_delay_a_synchronisation() {
        let disk = disk(10);
        let status = WriterStatus::default();
        let mut batch_writer = batch_writer(&disk, &status);
        assert_eq!(batch_writer.time_to_sync(), SYNC_EVERY);
        for number in 0..7 {
            batch_writer.write(batch(number)).unwrap();
        }
        assert_eq!(batch_writer.time_to_sync(), Duration::from_millis(100));
        batch_writer.sync().unwrap();
        disk.now_ms.fetch_add(5000, Ordering::Relaxed);
        // No batch waits for synchronisation.
        assert_eq!(batch_writer.time_to_sync(), SYNC_EVERY);
    }
}
