use crate::support::{MemorySink, end, entries, manifest, open_bytes, rows, same_bits};
use palpate_model::Nanos;
use palpate_sessions::{LogError, LogNotice, RecordingPace, SessionWriter, Sink};
use std::io;
use std::sync::{Arc, Mutex};

#[test]
fn at_virtual_pace_no_more_than_two_batches_are_at_risk() {
    let sink = MemorySink::default();
    let mut writer =
        SessionWriter::start_on(sink.clone(), "memory", &manifest(), RecordingPace::Virtual)
            .unwrap();
    let rows = rows(3000, 31);
    for (i, row) in rows.iter().enumerate() {
        writer.push_row(*row).unwrap();
        let at_risk = row.host.since(writer.saved_through());
        assert!(at_risk <= Nanos::from_millis(200), "{at_risk} at row {i}");
        if i % 500 == 499 {
            // What a kill at this moment would leave.
            let saved = writer.saved_through();
            let bytes = sink.bytes();
            let session = open_bytes(&bytes).unwrap();
            assert!(same_bits(&session.rows, &rows[..session.rows.len()]));
            assert!(session.last_time() >= saved);
        }
    }
    // Dropped, not closed: all samples, no end.
    drop(writer);
    let memory = sink.0.lock().unwrap();
    assert_eq!(memory.synced, memory.bytes.len());
    let session = open_bytes(&memory.bytes).unwrap();
    assert!(same_bits(&session.rows, &rows));
    assert!(session.end.is_none());
}

#[test]
fn entries_without_samples_are_saved_by_ticks() {
    let sink = MemorySink::default();
    let mut writer =
        SessionWriter::start_on(sink.clone(), "memory", &manifest(), RecordingPace::Virtual)
            .unwrap();
    let mut entry = entries(&rows(20, 32), 10).remove(0);
    entry.now = Nanos::from_millis(40);
    writer.push_entry(entry.clone()).unwrap();
    let again = writer.push_entry(entry.clone()).unwrap_err();
    assert!(matches!(again, LogError::OutOfOrder { .. }), "{again}");
    writer.on_tick(Nanos::from_millis(139)).unwrap();
    assert_eq!(writer.saved_through(), Nanos::ZERO);
    writer.on_tick(Nanos::from_millis(140)).unwrap();
    // The next hand-over waits for the one before.
    entry.order += 1;
    entry.now = Nanos::from_millis(150);
    writer.push_entry(entry).unwrap();
    writer.on_tick(Nanos::from_millis(260)).unwrap();
    assert!(writer.saved_through() >= Nanos::from_millis(40));
    writer.close(end(Nanos::from_millis(260))).unwrap();
    let session = open_bytes(&sink.0.lock().unwrap().bytes).unwrap();
    assert_eq!(session.entries.len(), 2);
}

/// A disk that hangs while its gate is held.
struct StuckSink {
    inner: MemorySink,
    gate: Arc<Mutex<()>>,
}

impl Sink for StuckSink {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        drop(self.gate.lock());
        self.inner.append(bytes)
    }

    fn sync(&mut self) -> io::Result<()> {
        self.inner.sync()
    }
}

#[test]
fn at_real_pace_a_stuck_disk_is_noticed_and_never_waited_for() {
    let gate = Arc::new(Mutex::new(()));
    let inner = MemorySink::default();
    let sink = StuckSink { inner: inner.clone(), gate: Arc::clone(&gate) };
    let mut writer =
        SessionWriter::start_on(sink, "memory", &manifest(), RecordingPace::Real).unwrap();
    let rows = rows(40_000, 33);
    let stuck = gate.lock().unwrap();
    let mut notices = Vec::new();
    let mut failed_at = None;
    for row in &rows {
        // Were any push to wait for the disk, this test would never end.
        let outcome = writer.push_row(*row);
        for notice in writer.take_notices() {
            notices.push((notice, row.host.seconds().0));
        }
        if let Err(err) = outcome {
            assert!(matches!(err, LogError::TooSlow { seconds: 30, .. }), "{err}");
            failed_at = Some(row.host.seconds().0);
            break;
        }
    }
    let failed_at = failed_at.unwrap();
    // Once each, and the second while there is still room for the end of the run.
    let [(LogNotice::Slow, slow_at), (LogNotice::TooSlow, too_slow_at)] = notices[..] else {
        panic!("{notices:?}");
    };
    assert!((14.0..16.5).contains(&slow_at), "{slow_at}");
    assert!((26.0..28.5).contains(&too_slow_at), "{too_slow_at}");
    assert!((30.0..31.0).contains(&failed_at), "{failed_at}");
    drop(stuck);
    assert!(writer.close(end(Nanos::ZERO)).is_err());
    // What fitted is saved without a gap once the disk answers.
    let session = open_bytes(&inner.0.lock().unwrap().bytes).unwrap();
    assert!(session.rows.len() > 29_000);
    assert!(same_bits(&session.rows, &rows[..session.rows.len()]));
}
