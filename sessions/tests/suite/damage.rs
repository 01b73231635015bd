use crate::support::{
    MemorySink, Random, check_raw, count_from, end, entries, log_bytes, manifest, put,
    quick_folder, raw_of, read_raw, rows, same_bits,
};
use palpate_model::Nanos;
use palpate_sessions::recover::{recover, salvage};
use palpate_sessions::{LogBatch, LogEntry, LogWriter, ReadError, SampleBlock, SampleRow, Session};
use std::path::Path;

/// What a session held, and its file.
pub struct Original {
    pub rows: Vec<SampleRow>,
    pub entries: Vec<LogEntry>,
    pub bytes: Vec<u8>,
}

impl Original {
    fn new(is_finished: bool) -> Self {
        let rows = rows(3000, 11);
        let entries = entries(&rows, 40);
        let end = is_finished.then(|| end(Nanos::from_millis(3000)));
        let bytes = log_bytes(&rows, &entries, end);
        Self { rows, entries, bytes }
    }

    /// Everything returned must be as recorded, and what is missing must be announced.
    pub fn check(&self, session: &Session, context: &str) {
        assert_eq!(session.manifest, manifest(), "{context}");
        let count = session.rows.len();
        assert!(
            count <= self.rows.len() && same_bits(&session.rows, &self.rows[..count]),
            "{context}: wrong rows"
        );
        let entry_count = session.entries.len();
        assert_eq!(session.entries, self.entries[..entry_count], "{context}");
        let is_short = count < self.rows.len() || entry_count < self.entries.len();
        if is_short {
            assert!(session.end.is_none(), "{context}: short, yet said to be complete");
            assert!(!session.notes.is_empty(), "{context}: short without a word");
        }
    }
}

impl Original {
    /// Recovered data is as recorded, and missing data is reported to the sample.
    pub fn check_salvage(&self, path: &Path, context: &str) -> Option<usize> {
        let mut blocks = Vec::new();
        let mut visit = |block: &SampleBlock| {
            blocks.push((block.first_sample() as usize, block.rows().collect::<Vec<_>>()));
        };
        let salvage = salvage(path, &mut visit).ok()?;
        assert_eq!(salvage.manifest, manifest(), "{context}");
        let mut next = 0;
        let mut remaining = 0;
        let mut gaps = salvage.missing.gaps.iter();
        for (first, rows) in &blocks {
            let there = &self.rows[*first..first + rows.len()];
            assert!(same_bits(rows, there), "{context}: wrong rows");
            if *first > next {
                let gap = gaps.next().unwrap();
                assert_eq!(gap.samples as usize, first - next, "{context}");
                assert_eq!(gap.after_sample as usize, remaining, "{context}");
                assert_eq!(gap.to_s, Some(rows[0].host.seconds().0), "{context}");
            }
            assert!(*first >= next, "{context}: a block twice");
            (next, remaining) = (first + rows.len(), remaining + rows.len());
        }
        assert_eq!(salvage.samples as usize, remaining, "{context}");
        let is_kept = |entry: &&LogEntry| salvage.entries.contains(entry);
        let entries: Vec<&LogEntry> = self.entries.iter().filter(is_kept).collect();
        assert!(entries.iter().copied().eq(&salvage.entries), "{context}: wrong entries");
        if remaining < self.rows.len() || entries.len() < self.entries.len() {
            assert!(!salvage.missing.sentences().is_empty(), "{context}: short without a word");
        }
        Some(remaining)
    }
}

/// A process can die after any byte: every prefix opens with the batches it holds whole.
#[test]
fn every_prefix_keeps_every_whole_batch() {
    let rows = rows(250, 12);
    let bytes = log_bytes(&rows, &[], Some(end(Nanos::from_millis(250))));
    let folder = quick_folder();
    let path = folder.path().join("000.mcap");
    let mut most = 0;
    let mut openable = 0;
    for length in 0..bytes.len() {
        put(&path, &bytes[..length]);
        match Session::open(&path) {
            Ok(session) => {
                assert!(same_bits(&session.rows, &rows[..session.rows.len()]));
                assert!([0, 100, 200, 250].contains(&session.rows.len()));
                assert!(session.rows.len() >= most, "{length}: fewer than before");
                assert!(!session.notes.is_empty());
                most = session.rows.len();
                openable += 1;
            }
            // Only before the first chunk is whole is there nothing to open.
            Err(refusal) => assert_eq!(openable, 0, "{length}: {refusal}"),
        }
    }
    assert_eq!(most, 250);
}

#[test]
fn damage_in_the_middle_is_refused_and_can_be_recovered_from() {
    for is_finished in [true, false] {
        let original = Original::new(is_finished);
        let mut bytes = original.bytes.clone();
        let middle = bytes.len() / 2;
        bytes[middle..middle + 64].fill(0xa5);
        let folder = quick_folder();
        let path = folder.path().join("000.mcap");
        put(&path, &bytes);
        let refusal = Session::open(&path).unwrap_err();
        let ReadError::Damaged { offset, .. } = &refusal else {
            panic!("{refusal}");
        };
        assert!(*offset as usize <= middle && middle - (*offset as usize) < 20_000);
        let remaining = original.check_salvage(&path, "recovered").unwrap();
        // One batch is hit, or two at their edge.
        assert!(remaining >= 2800, "{remaining}");
    }
}

/// A length that leads past the end looks like a write that was interrupted, but for what lies behind it.
#[test]
fn a_length_that_leads_past_the_end_hides_nothing() {
    let original = Original::new(false);
    let folder = quick_folder();
    let path = folder.path().join("000.mcap");
    let bytes = &original.bytes;
    let length_at =
        |place: usize| u64::from_le_bytes(bytes[place + 1..place + 9].try_into().unwrap());
    let mut places = Vec::new();
    let mut place = 8;
    while place < bytes.len() {
        // The chunks behind that of the manifest.
        if bytes[place] == 6 {
            places.push(place);
        }
        place += 9 + length_at(place) as usize;
    }
    assert_eq!(places.len(), 1 + 30);
    for place in &places[1..30] {
        let mut bytes = bytes.clone();
        let past_end = (bytes.len() - place) as u64;
        bytes[place + 1..place + 9].copy_from_slice(&past_end.to_le_bytes());
        put(&path, &bytes);
        let refusal = Session::open(&path).unwrap_err();
        let ReadError::Damaged { offset, .. } = refusal else {
            panic!("{refusal}");
        };
        assert_eq!(offset, *place as u64);
        let remaining = original.check_salvage(&path, "a wrong length");
        assert_eq!(remaining, Some(2900), "a batch and no more");
    }
}

#[test]
fn one_flipped_bit_costs_a_batch() {
    let rows = rows(20_000, 13);
    let entries = entries(&rows, 400);
    let bytes = log_bytes(&rows, &entries, Some(end(Nanos::from_millis(20_000))));
    let original = Original { rows, entries, bytes };
    let folder = quick_folder();
    let path = folder.path().join("000.mcap");
    let mut random = Random(14);
    let (mut remaining, mut refused) = (0, 0);
    let cases = count_from("PALPATE_MUTATIONS", 60);
    for case in 0..cases {
        let mut bytes = original.bytes.clone();
        let place = random.below(bytes.len());
        bytes[place] ^= 1 << random.below(8);
        put(&path, &bytes);
        match original.check_salvage(&path, &format!("bit flip, case {case}")) {
            Some(count) => remaining += count,
            None => refused += 1,
        }
    }
    let share = remaining as f64 / (cases * original.rows.len()) as f64;
    println!(
        "{cases} flipped bits: {:.2} % of the samples recovered, {refused} files refused",
        100.0 * share
    );
    assert!(share >= 0.95, "{share}");
}

/// Lengths that ask for memory are refused before any is taken.
#[test]
fn absurd_lengths_are_refused() {
    let original = Original::new(false);
    for (opcode, length) in [(6u8, u64::MAX), (6, 1 << 40), (9, 3), (0x80, 0), (1, u64::MAX)] {
        let mut bytes = original.bytes.clone();
        let mut frame = vec![opcode];
        frame.extend(length.to_le_bytes());
        bytes.splice(8..8, frame);
        let folder = quick_folder();
        let path = folder.path().join("000.mcap");
        put(&path, &bytes);
        assert!(Session::open(&path).is_err(), "opcode {opcode}, length {length}");
    }
    // A chunk that claims to hold more than it may.
    let mut bytes = original.bytes.clone();
    let chunk = 8 + 9 + u64::from_le_bytes(bytes[9..17].try_into().unwrap()) as usize;
    assert_eq!(bytes[chunk], 6);
    bytes[chunk + 9 + 16..chunk + 9 + 24].copy_from_slice(&(1u64 << 50).to_le_bytes());
    let folder = quick_folder();
    let path = folder.path().join("000.mcap");
    put(&path, &bytes);
    let refusal = Session::open(&path).unwrap_err().to_string();
    assert!(refusal.contains("largest possible size"), "{refusal}");
}

/// Of a damaged log the raw bytes that are left are kept, and those that are not are counted to the byte.
#[test]
fn raw_bytes_that_are_lost_are_counted() {
    let rows = rows(1000, 31);
    let sink = MemorySink::default();
    let mut log = LogWriter::begin(sink.clone(), "memory", &manifest()).unwrap();
    let mut places = Vec::new();
    for batch in rows.chunks(100) {
        places.push(sink.bytes().len());
        let parts = LogBatch { rows: batch, raw: &raw_of(batch), ..LogBatch::default() };
        log.append_batch(&parts).unwrap();
    }
    log.finish(end(Nanos::from_millis(1000))).unwrap();
    let bytes_of = |rows: &[SampleRow]| -> u64 {
        let raw = raw_of(rows);
        raw.iter().map(|piece| piece.bytes.len() as u64).sum()
    };
    let whole = sink.bytes();
    // The fourth batch, and the last: behind that one only the end tells.
    for (removed, batch) in [(300..400, 3), (900..1000, 9)] {
        let mut bytes = whole.clone();
        bytes[places[batch] + 100] ^= 1;
        let folder = quick_folder();
        let session = folder.path().join("one");
        put(&session.join("000.mcap"), &bytes);
        let salvage = salvage(&session, &mut |_| {}).unwrap();
        let missing = bytes_of(&rows[removed.clone()]);
        assert_eq!(salvage.missing.raw_bytes, missing);
        assert_eq!(salvage.raw_bytes, bytes_of(&rows) - missing);
        let sentences = salvage.missing.sentences().join("; ");
        assert!(sentences.contains(&format!("{missing} raw bytes")), "{sentences}");
        let copy = recover(&session, "1", chrono::DateTime::UNIX_EPOCH).unwrap();
        let remaining: Vec<SampleRow> = [&rows[..removed.start], &rows[removed.end..]].concat();
        check_raw(&read_raw(&copy.folder).unwrap(), &remaining, remaining.len(), "a copy");
        let copied = Session::open(&copy.folder).unwrap();
        assert_eq!(copied.auxiliary.raw_bytes, salvage.raw_bytes);
    }
}
