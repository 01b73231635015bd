use crate::support::{MemorySink, end, manifest, open_bytes, rows, same_bits};
use palpate_model::Nanos;
use palpate_sessions::{
    LogError, LogWriter, RecordingPace, SampleRow, SessionFolder, SessionWriter,
};

/// Writes ten batches, syncing after each. Returns how many batches were reported as saved.
fn write_until_failure(sink: MemorySink, rows: &[SampleRow]) -> (usize, Result<(), LogError>) {
    let mut log = match LogWriter::begin(sink, "/data/000.mcap", &manifest()) {
        Ok(log) => log,
        Err(err) => return (0, Err(err)),
    };
    let mut saved = 0;
    for batch in rows.chunks(100) {
        let outcome = log.append(batch, &[]).and_then(|()| {
            saved += 1;
            log.sync()
        });
        if let Err(err) = outcome {
            // Nothing is ever written after a failure, whatever the caller tries.
            assert_eq!(log.append(batch, &[]), Err(err.clone()));
            assert_eq!(log.sync(), Err(err.clone()));
            assert_eq!(log.finish(end(Nanos::ZERO)), Err(err.clone()));
            return (saved, Err(err));
        }
    }
    (saved, log.finish(end(Nanos::from_millis(1000))))
}

#[test]
fn whatever_operation_fails_all_that_was_reported_saved_is_there() {
    let rows = rows(1000, 21);
    let mut failures = 0;
    for torn in [0.0, 0.3, 0.999] {
        for fail_at in 0.. {
            let sink = MemorySink::default();
            {
                let mut memory = sink.0.lock().unwrap();
                memory.fail_at = Some(fail_at);
                memory.torn = torn;
            }
            let (saved, outcome) = write_until_failure(sink.clone(), &rows);
            let memory = sink.0.lock().unwrap();
            let Err(err) = outcome else {
                assert_eq!(memory.operations, fail_at);
                assert_eq!(memory.synced, memory.bytes.len());
                assert!(open_bytes(&memory.bytes).unwrap().end.is_some());
                break;
            };
            failures += 1;
            assert!(
                matches!(&err, LogError::Disk { path, .. } if path == "/data/000.mcap"),
                "{err:?}"
            );
            match open_bytes(&memory.bytes) {
                Ok(session) => {
                    // A batch torn in the index behind its chunk is there, though not reported.
                    let count = session.rows.len();
                    let surplus = count.checked_sub(saved * 100);
                    assert!(matches!(surplus, Some(0 | 100)), "at {fail_at}: {count}");
                    assert!(same_bits(&session.rows, &rows[..count]));
                    // A sync can fail after everything, the end included, was written.
                    assert!(session.end.is_none() || saved == 10);
                }
                Err(refusal) => assert_eq!(saved, 0, "at {fail_at}: {refusal}"),
            }
        }
    }
    // Two operations to begin, two per batch, two to finish, for every way to tear.
    assert_eq!(failures, 3 * (2 + 20 + 2));
}

#[test]
fn the_thread_reports_its_failure_on_the_next_push_and_on_close() {
    for pace in [RecordingPace::Virtual, RecordingPace::Real] {
        let sink = MemorySink::default();
        sink.0.lock().unwrap().fail_at = Some(5);
        let mut writer =
            SessionWriter::start_on(sink.clone(), "/data/000.mcap", &manifest(), pace).unwrap();
        assert_eq!(writer.failure(), None);
        let rows = rows(1000, 22);
        let mut refused = None;
        // At real pace nothing waits for the thread, so its failure shows when it shows.
        while refused.is_none() {
            for row in &rows {
                if let Err(err) = writer.push_row(*row) {
                    refused = Some(err);
                    break;
                }
            }
        }
        let err = refused.unwrap();
        assert!(matches!(&err, LogError::Disk { path, .. } if path == "/data/000.mcap"), "{err:?}");
        assert_eq!(writer.failure(), Some(err.to_string()));
        assert_eq!(writer.close(end(Nanos::ZERO)), Err(err));
        let bytes = sink.bytes();
        assert!(open_bytes(&bytes).unwrap().end.is_none());
    }
}

#[test]
fn a_folder_that_cannot_be_written_refuses_the_start() {
    let parent = tempfile::tempdir().unwrap();
    let folder = SessionFolder::create(parent.path()).unwrap();
    // A log that appears in the locked folder is not overwritten.
    std::fs::write(parent.path().join("000.mcap"), "precious").unwrap();
    let refusal = SessionWriter::start(folder, None, &manifest(), RecordingPace::Virtual);
    let text = refusal.err().unwrap().to_string();
    assert!(text.contains("File exists"), "{text}");
    let bytes = std::fs::read(parent.path().join("000.mcap")).unwrap();
    assert_eq!(bytes, b"precious");
}
