//! Sessions to test with, and sinks that remember or fail.

use chrono::{TimeZone, Utc};
use palpate_model::metadata::{SessionLabels, SessionMetadata};
use palpate_model::rig::{AdcDescription, Limits, Phase, RawBytes, RigDescription, SignalFacts};
use palpate_model::{MmPerS, MmPerS2, Nanos, Position, Volts};
use palpate_sessions::{
    EndRecord, EntryKind, LogBatch, LogEntry, LogPart, LogWriter, Manifest, RECORD_VERSION,
    ReadError, SampleRow, Session, Sink,
};
use std::io;
use std::sync::{Arc, Mutex};

/// SplitMix64 (Steele, Lea and Flood 2014): enough randomness for tests, from one number.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit as u64) as usize
    }

    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn about() -> SessionMetadata {
    let mut labels = SessionLabels::default();
    labels.set_pair("specimen.temperature_c=36.6").expect("a known key");
    labels.about
}

fn signal() -> SignalFacts {
    SignalFacts {
        sample_rate_hz: 1e9 / 976_562.0,
        filter: "none".into(),
        range_v: Some([-10.0, 10.0 - 10.0 / 32768.0]),
        resolution_v: Some(10.0 / 32768.0),
        aliasing: "above 512 Hz".into(),
    }
}

pub fn manifest() -> Manifest {
    Manifest {
        record_version: RECORD_VERSION,
        session_id: "20260305T141507Z-0badcafe".into(),
        software_version: "0.1.0".into(),
        engine_version: 1,
        started_at: Utc.with_ymd_and_hms(2026, 3, 5, 14, 15, 7).unwrap(),
        operator: "Ada \"A.\" Lovelace\n".into(),
        specimen: "µ-gel 3 %".into(),
        indenter: "sphere 10 mm".into(),
        about: about(),
        signal: Some(signal()),
        imported: None,
        rig: Some(RigDescription {
            name: "sim".into(),
            identity: "simulated rig".into(),
            settings: [("seed".to_owned(), "7".to_owned())].into(),
            mm_per_pulse: 0.015,
            travel: Position(150.0),
            tick_nanos: 976_562,
            speed_quantum: MmPerS(0.03),
            speed_max: MmPerS(5.0),
            acceleration: MmPerS2(15.36),
            adc: Some(AdcDescription {
                counts_min: -32768,
                counts_max: 32767,
                volts_per_count: 10.0 / 32768.0,
            }),
            noise_expected: Volts(0.1 + 0.2),
            pulse_lag: palpate_model::units::Seconds(0.0),
            cell_delay: palpate_model::units::Seconds(0.0),
            ticks_per_sample: 1.0,
            unseen_max: RigDescription::UNSEEN_USUAL,
            takes_targets: false,
            sensors: Default::default(),
        }),
        limits: Some(Limits::for_travel(Position(149.999_999_999_999_97))),
        calibration: serde_json::json!({"slope_n_per_v": 3.591_234_567_890_123_4}),
        plan: serde_json::json!({"kind": "ramp-and-hold", "depth_mm": 30.0}),
        settings: serde_json::json!(null),
        acknowledgements: vec!["depth beyond the calibrated force".into()],
        recovered: None,
    }
}

/// Plausible rows at 1 kHz: missing values at first, then noise in every digit.
pub fn rows(count: usize, seed: u64) -> Vec<SampleRow> {
    let mut random = Random(seed);
    (0..count)
        .map(|i| {
            let volts = 0.5 + 0.01 * random.unit();
            let phase = Phase::ALL[(i * Phase::ALL.len()) / count.max(1)];
            SampleRow {
                tick: 1000 + i as u64,
                host: Nanos(1_000_000 * i as u64 + random.next() % 1000),
                age: None,
                counts: Some((volts * 3276.8) as i32),
                volts: Some(volts),
                pulses: Some((i / 7) as i64 - 3),
                status: 33,
                force: (i > count / 5).then_some(volts * 3.59),
                depth: (i > count / 4).then_some(i as f64 * 0.000_75),
                phase,
                cycle: (i > count / 2).into(),
            }
        })
        .collect()
}

/// What went over the wires for rows: a question and its answer for each, and a second device now and then.
pub fn raw_of(rows: &[SampleRow]) -> Vec<RawBytes> {
    let piece = |at, device: &str, is_sent, bytes: Vec<u8>| RawBytes {
        at,
        device: device.into(),
        is_sent,
        bytes,
    };
    rows.iter()
        .flat_map(|row| {
            let answer = format!(": {}\r\n", row.pulses.unwrap_or_default());
            let mut pieces = vec![
                piece(row.host, "controller", true, b"TP\r".into()),
                piece(row.host + Nanos(400), "controller", false, answer.into()),
            ];
            if row.tick % 7 == 0 {
                let noise = row.volts.unwrap_or_default().to_le_bytes();
                pieces.push(piece(row.host, "cell", false, noise.into()));
            }
            pieces
        })
        .collect()
}

/// The raw bytes of a session that opens.
pub fn read_raw(path: &std::path::Path) -> Result<Vec<RawBytes>, ReadError> {
    let mut found = Vec::new();
    Session::scan_parts(path, &mut |part| {
        if let LogPart::Raw(block) = part {
            found.extend(block.pieces().map(|piece| RawBytes {
                at: piece.at,
                device: block.device().into(),
                is_sent: piece.is_sent,
                bytes: piece.bytes.into(),
            }));
        }
    })?;
    Ok(found)
}

/// Raw bytes that were read are those that were recorded, from the first on, and those of `count` rows are there.
/// Blocks are of one device each, so only the order within a device is that of the recording.
pub fn check_raw(found: &[RawBytes], rows: &[SampleRow], count: usize, context: &str) {
    let all = raw_of(rows);
    for device in DEVICES {
        let is_right = own(&all, device).starts_with(&own(found, device));
        assert!(is_right, "{context}: wrong raw bytes of {device}");
    }
    check_raw_begins(found, &rows[..count], context);
}

/// Raw bytes that were read begin with those of rows.
pub fn check_raw_begins(found: &[RawBytes], rows: &[SampleRow], context: &str) {
    let due = raw_of(rows);
    for device in DEVICES {
        let is_there = own(found, device).starts_with(&own(&due, device));
        assert!(is_there, "{context}: raw bytes of {device} are missing");
    }
}

const DEVICES: [&str; 2] = ["controller", "cell"];

fn own<'p>(pieces: &'p [RawBytes], device: &str) -> Vec<&'p RawBytes> {
    let own = pieces.iter().filter(|piece| &*piece.device == device);
    own.collect()
}

/// One entry after every `every` rows, kinds in turn.
pub fn entries(rows: &[SampleRow], every: usize) -> Vec<LogEntry> {
    let kinds = [EntryKind::Input, EntryKind::Decision, EntryKind::Fit];
    rows.iter()
        .enumerate()
        .skip(every)
        .step_by(every)
        .enumerate()
        .map(|(order, (after, row))| LogEntry {
            kind: kinds[order % kinds.len()],
            order: order as u64 * 2,
            after_sample: after as u64,
            now: row.host,
            body: serde_json::json!({"step": order, "value": row.volts, "text": "naïve \u{0}"}),
        })
        .collect()
}

pub fn end(ended_at: Nanos) -> EndRecord {
    EndRecord {
        outcome: "finish".into(),
        reason: "the plan is complete".into(),
        samples: 0,
        entries: 0,
        raw_bytes: 0,
        ended_at,
        time_use: vec![("motion".into(), 40.049), ("hold".into(), 0.1)],
    }
}

/// A sink in memory with chosen failures.
#[derive(Clone, Default)]
pub struct MemorySink(pub Arc<Mutex<Memory>>);

#[derive(Default)]
pub struct Memory {
    pub bytes: Vec<u8>,
    /// Bytes that a power cut would leave.
    pub synced: usize,
    pub operations: usize,
    /// Fails this operation and all later ones; a failing append keeps `torn` of its bytes.
    pub fail_at: Option<usize>,
    pub torn: f64,
}

impl MemorySink {
    /// What is in the sink.
    pub fn bytes(&self) -> Vec<u8> {
        self.0.lock().unwrap().bytes.clone()
    }
}

impl Memory {
    fn count(&mut self) -> io::Result<()> {
        let operation = self.operations;
        self.operations += 1;
        match self.fail_at {
            // 28 is ENOSPC.
            Some(at) if operation >= at => Err(io::Error::from_raw_os_error(28)),
            _ => Ok(()),
        }
    }
}

impl Sink for MemorySink {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut memory = self.0.lock().unwrap();
        let outcome = memory.count();
        let remaining = match outcome {
            Ok(()) => bytes.len(),
            Err(_) => (bytes.len() as f64 * memory.torn) as usize,
        };
        memory.bytes.extend_from_slice(&bytes[..remaining]);
        outcome
    }

    fn sync(&mut self) -> io::Result<()> {
        let mut memory = self.0.lock().unwrap();
        memory.count()?;
        memory.synced = memory.bytes.len();
        Ok(())
    }
}

/// A log as bytes: batches of 100 rows, entries with the batch they follow.
pub fn log_bytes(rows: &[SampleRow], entries: &[LogEntry], end: Option<EndRecord>) -> Vec<u8> {
    log_bytes_with(rows, entries, end, |_| Vec::new())
}

/// The same with raw bytes for each row.
pub fn wired_log_bytes(
    rows: &[SampleRow],
    entries: &[LogEntry],
    end: Option<EndRecord>,
) -> Vec<u8> {
    log_bytes_with(rows, entries, end, raw_of)
}

fn log_bytes_with(
    rows: &[SampleRow],
    entries: &[LogEntry],
    end: Option<EndRecord>,
    raw_of: impl Fn(&[SampleRow]) -> Vec<RawBytes>,
) -> Vec<u8> {
    let sink = MemorySink::default();
    let mut log = LogWriter::begin(sink.clone(), "memory", &manifest()).unwrap();
    let mut entries = entries.iter().peekable();
    for (i, batch) in rows.chunks(100).enumerate() {
        let mut due = Vec::new();
        while let Some(entry) = entries.next_if(|entry| entry.after_sample < (i as u64 + 1) * 100) {
            due.push(entry.clone());
        }
        let parts = LogBatch { rows: batch, entries: &due, raw: &raw_of(batch), health: &[] };
        log.append_batch(&parts).unwrap();
    }
    if let Some(end) = end {
        log.finish(end).unwrap();
    }
    sink.bytes()
}

/// Opens bytes as if they were a file.
pub fn open_bytes(bytes: &[u8]) -> Result<Session, palpate_sessions::ReadError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("000.mcap");
    std::fs::write(&path, bytes).unwrap();
    Session::open(&path)
}

/// Whether two sets of rows agree in every bit, the sign of zero included.
pub fn same_bits(a: &[SampleRow], b: &[SampleRow]) -> bool {
    let bits = |row: &SampleRow| {
        (row.volts.map(f64::to_bits), row.force.map(f64::to_bits), row.depth.map(f64::to_bits))
    };
    a == b && a.iter().map(bits).eq(b.iter().map(bits))
}

/// A count that the soak script may raise by an environment variable.
pub fn count_from(variable: &str, usual: usize) -> usize {
    std::env::var(variable).ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

/// A folder in memory, where there is one: thousands of files are written for each test.
pub fn quick_folder() -> tempfile::TempDir {
    let memory = std::path::Path::new("/dev/shm");
    let folder = match memory.is_dir() {
        true => tempfile::tempdir_in(memory),
        false => tempfile::tempdir(),
    };
    folder.expect("a folder to write in")
}

/// Replaces a file: overwriting in place makes some file systems wait for the disk.
pub fn put(path: &std::path::Path, bytes: &[u8]) {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder).expect("a folder to write in");
    }
    let _ = std::fs::remove_file(path);
    std::fs::write(path, bytes).expect("a folder to write in");
}
