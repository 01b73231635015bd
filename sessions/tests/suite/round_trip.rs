use crate::support::{
    MemorySink, check_raw, end, entries, log_bytes, manifest, open_bytes, raw_of, read_raw, rows,
    same_bits,
};
use palpate_model::Nanos;
use palpate_model::rig::RawBytes;
use palpate_sessions::health::HealthContent;
use palpate_sessions::{
    FolderSegments, HealthMessage, LogError, LogPart, LogWriter, MachineState, RECORD_VERSION,
    ReadError, RecordingPace, Session, SessionFolder, SessionWriter,
};

#[test]
fn a_session_comes_back_bit_for_bit_at_either_pace() {
    for pace in [RecordingPace::Virtual, RecordingPace::Real] {
        let parent = tempfile::tempdir().unwrap();
        let path = parent.path().join("sessions/one");
        let folder = SessionFolder::create(&path).unwrap();
        let mut rows = rows(5000, 1);
        rows[17].force = Some(-0.0);
        // A rig whose converter drops out: counts vanish and come back.
        rows[2345..2350].iter_mut().for_each(|row| row.counts = None);
        let entries = entries(&rows, 50);
        let mut writer = SessionWriter::start(folder, None, &manifest(), pace).unwrap();
        let mut pending = entries.iter().peekable();
        for (i, row) in rows.iter().enumerate() {
            while let Some(entry) = pending.next_if(|entry| entry.after_sample == i as u64) {
                writer.push_entry(entry.clone()).unwrap();
            }
            writer.push_row(*row).unwrap();
        }
        writer.close(end(Nanos::from_millis(5001))).unwrap();

        let session = Session::open(&path).unwrap();
        assert_eq!(session.manifest, manifest());
        assert!(same_bits(&session.rows, &rows));
        assert_eq!(session.entries, entries);
        assert_eq!(session.notes, Vec::<String>::new());
        let ending = session.end.clone().unwrap();
        assert_eq!((ending.samples, ending.entries), (5000, 99));
        assert_eq!(ending.time_use, end(Nanos::ZERO).time_use);
        let by_file = Session::open(&path.join("000.mcap")).unwrap();
        assert_eq!(by_file, session);
    }
}

/// The container's own library, with all checks, accepts the file.
#[test]
fn the_file_is_a_valid_mcap_file() {
    let rows = rows(1000, 2);
    let entries = entries(&rows, 100);
    let bytes = log_bytes(&rows, &entries, Some(end(Nanos::from_millis(1000))));
    let summary = mcap::read::Summary::read(&bytes).unwrap().unwrap();
    let stats = summary.stats.as_ref().unwrap();
    // One manifest, ten pairs of blocks, nine entries, one end; and 50 of the samples on the
    // thinned channel, the first and those that are first of their 20 ms, which jitter shifts.
    let shown = stats.message_count - (1 + 20 + 9 + 1);
    assert!((48..=50).contains(&shown), "{shown}");
    assert_eq!(summary.chunk_indexes.len(), 12);
    let mut last = std::collections::BTreeMap::new();
    let mut count = 0;
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        assert!(message.channel.schema.is_some(), "viewers skip channels without");
        let sequence: &mut u32 = last.entry(message.channel.topic.clone()).or_default();
        assert_eq!(message.sequence, *sequence);
        *sequence += 1;
        count += 1;
    }
    assert_eq!(count, stats.message_count);
    // Every chunk is where the index says, with an index per channel.
    for index in &summary.chunk_indexes {
        assert_eq!(bytes[index.chunk_start_offset as usize], 6);
        assert!(!index.message_index_offsets.is_empty());
    }
}

#[test]
fn a_log_without_an_end_opens_with_a_note() {
    let rows = rows(12_300, 3);
    let session = open_bytes(&log_bytes(&rows, &[], None)).unwrap();
    assert!(same_bits(&session.rows, &rows));
    assert_eq!(session.end, None);
    let note = &session.notes[0];
    assert!(
        note.starts_with("the recording has no end record") && note.contains("12.3 s"),
        "{note}"
    );
}

#[test]
fn a_newer_session_is_refused_with_both_versions() {
    let mut newer = manifest();
    newer.record_version = RECORD_VERSION + 1;
    newer.software_version = "3.1.4".into();
    let sink = MemorySink::default();
    let mut log = LogWriter::begin(sink.clone(), "memory", &newer).unwrap();
    log.append(&rows(10, 4), &[]).unwrap();
    log.finish(end(Nanos::ZERO)).unwrap();
    let bytes = sink.bytes();
    let refusal = open_bytes(&bytes).unwrap_err();
    let ReadError::Newer { software_version, record_version, .. } = refusal else {
        panic!("{refusal:?}");
    };
    assert_eq!(
        (software_version.as_str(), record_version),
        ("3.1.4", u64::from(RECORD_VERSION) + 1)
    );
}

#[test]
fn files_other_than_sessions_are_distinguished() {
    let folder = tempfile::tempdir().unwrap();
    let missing = Session::open(&folder.path().join("nothing")).unwrap_err();
    assert!(matches!(missing, ReadError::Missing { .. }), "{missing}");
    let empty = Session::open(folder.path()).unwrap_err();
    assert!(matches!(empty, ReadError::NotASession { .. }), "{empty}");
    for bytes in [&b""[..], b"this is no session", &[0; 4096]] {
        let refusal = open_bytes(bytes).unwrap_err();
        assert!(matches!(refusal, ReadError::NotASession { .. }), "{refusal}");
    }
    let mut foreign = Vec::new();
    let mut other = mcap::Writer::new(std::io::Cursor::new(&mut foreign)).unwrap();
    let channel = other.add_channel(0, "/daq/block", "json", &Default::default()).unwrap();
    let header = mcap::records::MessageHeader {
        channel_id: channel,
        sequence: 0,
        log_time: 0,
        publish_time: 0,
    };
    other.write_to_known_channel(&header, b"{}").unwrap();
    other.finish().unwrap();
    drop(other);
    let refusal = open_bytes(&foreign).unwrap_err();
    assert!(matches!(refusal, ReadError::NotASession { .. }), "{refusal}");
}

#[test]
fn what_could_not_be_read_back_is_not_written() {
    let sink = MemorySink::default();
    let mut log = LogWriter::begin(sink.clone(), "memory", &manifest()).unwrap();
    let good = rows(3, 5);
    let mut bad = good.clone();
    bad[1].volts = Some(f64::NAN);
    let refusal = log.append(&bad, &[]).unwrap_err();
    assert!(matches!(refusal, LogError::NotFinite { .. }), "{refusal}");
    let mut entries = entries(&rows(30, 5), 10);
    entries.swap(0, 1);
    let refusal = log.append(&[], &entries).unwrap_err();
    assert!(matches!(refusal, LogError::OutOfOrder { .. }), "{refusal}");
    let mut deep = serde_json::Value::Null;
    for _ in 0..200 {
        deep = serde_json::Value::Array(vec![deep]);
    }
    entries.truncate(1);
    entries[0].body = deep;
    let refusal = log.append(&[], &entries).unwrap_err();
    assert!(refusal.to_string().contains("levels deep"), "{refusal}");
    // None of the refusals harmed the log.
    log.append(&good, &[]).unwrap();
    log.finish(end(Nanos::ZERO)).unwrap();
    let bytes = sink.bytes();
    assert!(same_bits(&open_bytes(&bytes).unwrap().rows, &good));

    let mut manifest = manifest();
    manifest.limits.as_mut().unwrap().travel_max.0 = f64::INFINITY;
    let refusal = LogWriter::begin(MemorySink::default(), "memory", &manifest);
    assert!(refusal.is_err());
}

/// A log with raw bytes and health: at either pace, over several segments, by folder and by file.
#[test]
fn raw_bytes_and_health_come_back_at_either_pace() {
    let health = |now: Nanos, lateness_s: f64| HealthMessage {
        now,
        content: HealthContent::State(MachineState {
            lateness_s,
            queue_share: 0.25,
            sync_s: Some(0.004),
            free_bytes: Some(1 << 40),
            missed_readings: 1,
        }),
    };
    for pace in [RecordingPace::Virtual, RecordingPace::Real] {
        let parent = tempfile::tempdir().unwrap();
        let path = parent.path().join("one");
        let _held = SessionFolder::create(&path).unwrap();
        let rows = rows(3000, 21);
        let source = FolderSegments::new(&path);
        let mut writer = SessionWriter::start_in_segments(source, 9, &manifest(), pace).unwrap();
        let mut recorded = Vec::new();
        for (number, row) in rows.iter().enumerate() {
            let raw = raw_of(std::slice::from_ref(row));
            writer.push_raw(row.host, raw).unwrap();
            writer.push_row(*row).unwrap();
            if number % 1000 == 999 {
                recorded.push(health(row.host, number as f64 * 1e-6));
                writer.push_health(recorded[recorded.len() - 1].clone()).unwrap();
            }
        }
        writer.close(end(Nanos::from_millis(3000))).unwrap();
        assert!(path.join("002.mcap").is_file(), "it has several segments");

        let session = Session::open(&path).unwrap();
        assert!(same_bits(&session.rows, &rows));
        assert_eq!(session.notes, Vec::<String>::new());
        check_raw(&read_raw(&path).unwrap(), &rows, 3000, "whole");
        let bytes: usize = raw_of(&rows).iter().map(|piece| piece.bytes.len()).sum();
        assert_eq!(session.auxiliary.raw_bytes, bytes as u64);
        assert_eq!(session.end.unwrap().raw_bytes, bytes as u64);
        let mut found = Vec::new();
        Session::scan_parts(&path, &mut |part| {
            if let LogPart::Health(one) = part {
                found.push(one.clone());
            }
        })
        .unwrap();
        assert_eq!(found, recorded);
        let worst = session.auxiliary.health.worst.unwrap();
        assert_eq!((worst.lateness_s, worst.missed_readings), (2999e-6, 3));
        // A later segment alone knows what it holds.
        let part = Session::open(&path.join("001.mcap")).unwrap();
        assert!(part.auxiliary.raw_bytes > 0 && part.auxiliary.raw_bytes < bytes as u64);
    }
}

/// A disk that hangs cannot make raw bytes fill the memory.
#[test]
fn raw_bytes_count_in_the_bounded_queue() {
    let (go, gate) = std::sync::mpsc::sync_channel::<()>(1);
    struct Stuck(Option<std::sync::mpsc::Receiver<()>>, usize);
    impl palpate_sessions::Sink for Stuck {
        fn append(&mut self, _: &[u8]) -> std::io::Result<()> {
            self.1 += 1;
            // The manifest still gets through.
            if self.1 > 1
                && let Some(gate) = self.0.take()
            {
                let _ = gate.recv();
            }
            Ok(())
        }

        fn sync(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let sink = Stuck(Some(gate), 0);
    let mut writer =
        SessionWriter::start_on(sink, "memory", &manifest(), RecordingPace::Real).unwrap();
    let piece = |millis| RawBytes {
        at: Nanos::from_millis(millis),
        device: "controller".into(),
        is_sent: false,
        bytes: vec![7; 1 << 20],
    };
    let mut taken = 0;
    let refusal = loop {
        assert!(taken < 100, "100 MB wait in memory");
        // All within a second, so that it is not time that fills the queue.
        match writer.push_raw(Nanos::from_millis(taken), vec![piece(taken)]) {
            Ok(()) => taken += 1,
            Err(refusal) => break refusal,
        }
    };
    assert!(matches!(refusal, LogError::TooSlow { .. }), "{refusal}");
    assert!((30..40).contains(&taken), "{taken}");
    let notices = writer.take_notices();
    assert!(notices.iter().any(palpate_sessions::LogNotice::is_reason_to_end));
    go.send(()).unwrap();
}
