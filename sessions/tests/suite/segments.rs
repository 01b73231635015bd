//! Long recordings: segments, crashes while a new one is begun, and what is missing.

use crate::support::{MemorySink, end, entries, manifest, quick_folder, rows, same_bits};
use palpate_model::Nanos;
use palpate_sessions::recover::{Salvage, salvage};
use palpate_sessions::{
    FolderSegments, LogEntry, LogError, LogWriter, ReadError, RecordingPace, SampleRow,
    SegmentSource, Session, SessionWriter, Sink, segment_file,
};
use std::fs;
use std::io::{self, Write};
use std::path::Path;
use std::sync::{Arc, Mutex};

/// One thing done to the disk.
#[derive(Clone)]
enum Step {
    Create(u32),
    Append(u32, Vec<u8>),
}

/// Records the order of operations, with chosen failures.
#[derive(Clone, Default)]
struct Journal(Arc<Mutex<JournalState>>);

#[derive(Default)]
struct JournalState {
    steps: Vec<Step>,
    operations: usize,
    fail_at: Option<usize>,
}

impl JournalState {
    fn count(&mut self) -> io::Result<()> {
        self.operations += 1;
        match self.fail_at {
            Some(at) if self.operations > at => Err(io::Error::from_raw_os_error(28)),
            _ => Ok(()),
        }
    }
}

struct JournalSink(Journal, u32);

impl Sink for JournalSink {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        let mut state = self.0.0.lock().unwrap();
        let outcome = state.count();
        // A failing write leaves a part of what it was given.
        let remaining = bytes.len() / if outcome.is_ok() { 1 } else { 2 };
        state.steps.push(Step::Append(self.1, bytes[..remaining].into()));
        outcome
    }

    fn sync(&mut self) -> io::Result<()> {
        self.0.0.lock().unwrap().count()
    }
}

impl SegmentSource for Journal {
    type Sink = JournalSink;

    fn path(&self, number: u32) -> String {
        format!("/data/{}", segment_file(number))
    }

    fn create(&mut self, number: u32) -> io::Result<JournalSink> {
        let mut state = self.0.lock().unwrap();
        state.count()?;
        state.steps.push(Step::Create(number));
        Ok(JournalSink(self.clone(), number))
    }
}

const BATCH: usize = 40;

/// Writes batches, two to a segment. Returns after how many steps how many rows were
/// acknowledged.
fn record(
    journal: &Journal,
    rows: &[SampleRow],
    entries: &[LogEntry],
) -> (Vec<(usize, usize)>, Result<(), LogError>) {
    let mut acknowledged = Vec::new();
    let mut pending = entries.iter().peekable();
    let outcome = LogWriter::begin_in_segments(Box::new(journal.clone()), 2, &manifest()).and_then(
        |mut log| {
            for (i, batch) in rows.chunks(BATCH).enumerate() {
                let stop = ((i + 1) * BATCH) as u64;
                let mut due = Vec::new();
                while let Some(entry) = pending.next_if(|entry| entry.after_sample < stop) {
                    due.push(entry.clone());
                }
                if let Err(err) = log.append(batch, &due) {
                    // Nothing is written after a failure, in whichever segment.
                    assert_eq!(log.append(batch, &due), Err(err.clone()));
                    return Err(err);
                }
                let steps = journal.0.lock().unwrap().steps.len();
                acknowledged.push((steps, (i + 1) * BATCH));
            }
            log.finish(end(Nanos::from_millis(rows.len() as u64)))
        },
    );
    (acknowledged, outcome)
}

fn replay_steps(steps: &[Step], folder: &Path) {
    for step in steps {
        match step {
            Step::Create(number) => {
                fs::File::create_new(folder.join(segment_file(*number))).unwrap();
            }
            Step::Append(number, bytes) => append(&folder.join(segment_file(*number)), bytes),
        }
    }
}

fn append(path: &Path, bytes: &[u8]) {
    let mut file = fs::OpenOptions::new().append(true).open(path).unwrap();
    file.write_all(bytes).unwrap();
}

fn check(
    session: &Session,
    rows: &[SampleRow],
    entries: &[LogEntry],
    at_least: usize,
    context: &str,
) {
    let (count, entry_count) = (session.rows.len(), session.entries.len());
    assert!(count >= at_least, "{context}: {count} of {at_least} rows");
    assert!(same_bits(&session.rows, &rows[..count]), "{context}");
    assert_eq!(session.entries, entries[..entry_count], "{context}");
    let due = entries.iter().filter(|entry| entry.after_sample < at_least as u64);
    assert!(entry_count >= due.count(), "{context}: entries are missing");
    assert_eq!(session.manifest, manifest());
    if session.end.is_none() {
        let is_no_end = |note: &String| note.contains("no end record");
        assert!(session.notes.iter().any(is_no_end), "{context}");
    } else {
        assert_eq!((count, entry_count), (rows.len(), entries.len()));
    }
}

/// Three segments in a folder, and what is in them.
fn three_segments() -> (tempfile::TempDir, Vec<SampleRow>, Vec<LogEntry>) {
    let rows = rows(6 * BATCH, 51);
    let entries = entries(&rows, 15);
    let journal = Journal::default();
    record(&journal, &rows, &entries).1.unwrap();
    let folder = quick_folder();
    replay_steps(&journal.0.lock().unwrap().steps, folder.path());
    assert!(folder.path().join("002.mcap").exists());
    assert!(!folder.path().join("003.mcap").exists());
    (folder, rows, entries)
}

fn salvaged(folder: &Path) -> (Salvage, Vec<SampleRow>) {
    let mut rows = Vec::new();
    let salvage = salvage(folder, &mut |block| rows.extend(block.rows())).unwrap();
    (salvage, rows)
}

fn cut(path: &Path, length: usize) {
    let bytes = fs::read(path).unwrap();
    fs::write(path, &bytes[..length]).unwrap();
}

#[test]
fn a_session_in_segments_comes_back_bit_for_bit() {
    for pace in [RecordingPace::Virtual, RecordingPace::Real] {
        let folder = quick_folder();
        let rows = rows(3000, 50);
        let entries = entries(&rows, 30);
        let source = FolderSegments::new(folder.path());
        let mut writer = SessionWriter::start_in_segments(source, 4, &manifest(), pace).unwrap();
        let mut pending = entries.iter().peekable();
        for (i, row) in rows.iter().enumerate() {
            while let Some(entry) = pending.next_if(|entry| entry.after_sample == i as u64) {
                writer.push_entry(entry.clone()).unwrap();
            }
            writer.push_row(*row).unwrap();
        }
        writer.close(end(Nanos::from_millis(3001))).unwrap();

        let session = Session::open(folder.path()).unwrap();
        assert!(same_bits(&session.rows, &rows));
        assert_eq!(session.entries, entries);
        assert_eq!(session.manifest, manifest());
        assert_eq!(session.notes, Vec::<String>::new());
        let ending = session.end.clone().unwrap();
        assert_eq!((ending.samples, ending.entries), (3000, 99));
        let salvage = salvage(folder.path(), &mut |_| {}).unwrap();
        assert_eq!((salvage.samples, salvage.missing.sentences()), (3000, Vec::new()));
        // Thirty batches, four to a segment; each a valid file with a bounded index. With the wall
        // clock entries end batches early.
        let present = |number: &u32| folder.path().join(segment_file(*number)).exists();
        let count = (0..).take_while(present).count() as u32;
        assert!(count == 8 || pace == RecordingPace::Real && count > 8, "{count}");
        for number in 0..count {
            let bytes = fs::read(folder.path().join(segment_file(number))).unwrap();
            let summary = mcap::read::Summary::read(&bytes).unwrap().unwrap();
            assert!(summary.chunk_indexes.len() <= 1 + 4 + 1);
            let count = mcap::MessageStream::new(&bytes).unwrap().count() as u64;
            assert_eq!(summary.stats.unwrap().message_count, count);
        }
    }
}

#[test]
fn a_segment_opens_alone_and_says_what_it_is() {
    let (folder, rows, _) = three_segments();
    let parts: Vec<Session> = (0..3)
        .map(|number| Session::open(&folder.path().join(segment_file(number))).unwrap())
        .collect();
    for (part, slice) in parts.iter().zip(rows.chunks(2 * BATCH)) {
        assert!(same_bits(&part.rows, slice));
    }
    let notes = |number: usize| parts[number].notes.join("; ");
    assert!(
        notes(0).contains("for the later parts") && !notes(0).contains("for the earlier parts")
    );
    assert!(notes(1).contains("for the later parts") && notes(1).contains("for the earlier parts"));
    assert!(
        !notes(2).contains("for the later parts") && notes(2).contains("for the earlier parts")
    );
    assert!(parts[1].end.is_none() && parts[2].end.is_some());
}

/// A process can die after any byte, in whichever file it is.
#[test]
fn every_prefix_across_rotations_keeps_everything_acknowledged() {
    let rows = rows(5 * BATCH, 52);
    let entries = entries(&rows, 15);
    let journal = Journal::default();
    let (acknowledged, outcome) = record(&journal, &rows, &entries);
    outcome.unwrap();
    let steps = journal.0.lock().unwrap().steps.clone();
    let folder = quick_folder();
    let mut is_open = false;
    for (i, step) in steps.iter().enumerate() {
        let reached = acknowledged.iter().rev().find(|(steps, _)| *steps <= i);
        let at_least = reached.map_or(0, |(_, rows)| *rows);
        let Step::Append(number, bytes) = step else {
            replay_steps(std::slice::from_ref(step), folder.path());
            if is_open {
                let session = Session::open(folder.path()).unwrap();
                check(&session, &rows, &entries, at_least, "created");
            }
            continue;
        };
        let path = folder.path().join(segment_file(*number));
        for (k, byte) in bytes.iter().enumerate() {
            append(&path, &[*byte]);
            let context = format!("step {i}, byte {k} of {}", path.display());
            match Session::open(folder.path()) {
                Ok(session) => {
                    check(&session, &rows, &entries, at_least, &context);
                    is_open = true;
                }
                // Only before the first manifest is whole is there nothing to open.
                Err(refusal) => assert!(!is_open, "{context}: {refusal}"),
            }
        }
    }
    let session = Session::open(folder.path()).unwrap();
    assert!(session.end.is_some() && session.notes.is_empty());
}

#[test]
fn whatever_operation_fails_across_rotations_is_reported_and_loses_nothing() {
    let rows = rows(5 * BATCH, 53);
    let entries = entries(&rows, 15);
    let mut blamed = std::collections::BTreeSet::new();
    for fail_at in 0.. {
        let journal = Journal::default();
        journal.0.lock().unwrap().fail_at = Some(fail_at);
        let (acknowledged, outcome) = record(&journal, &rows, &entries);
        let Err(err) = outcome else { break };
        let LogError::Disk { path, .. } = &err else {
            panic!("{err}");
        };
        blamed.insert(path.clone());
        let folder = quick_folder();
        replay_steps(&journal.0.lock().unwrap().steps, folder.path());
        if let Some((_, at_least)) = acknowledged.last() {
            let session = Session::open(folder.path()).unwrap();
            let context = format!("failure at {fail_at}");
            check(&session, &rows, &entries, *at_least, &context);
        }
    }
    let names: Vec<String> = (0..3).map(|number| Journal::default().path(number)).collect();
    assert!(blamed.iter().eq(&names), "{blamed:?}");
}

#[test]
fn a_new_segment_that_never_began_leaves_an_interrupted_session() {
    let (folder, rows, _) = three_segments();
    let last = folder.path().join("002.mcap");
    let full = fs::read(&last).unwrap();
    for length in [0, 3, 8, 40, 200] {
        for tail in [0, 4096] {
            let mut bytes = full[..length].to_vec();
            bytes.resize(length + tail, 0);
            fs::write(&last, bytes).unwrap();
            let session = Session::open(folder.path()).unwrap();
            assert!(same_bits(&session.rows, &rows[..4 * BATCH]));
            assert!(session.end.is_none());
            let notes = session.notes.join("; ");
            assert!(notes.contains("002.mcap"), "{notes}");
            assert!(notes.contains("no end record"), "{notes}");
        }
    }
    fs::remove_file(&last).unwrap();
    let session = Session::open(folder.path()).unwrap();
    assert!(session.notes[0].contains("no end record"));
}

#[test]
fn a_missing_segment_is_refused_and_can_be_recovered_from() {
    let (folder, rows, _) = three_segments();
    fs::rename(folder.path().join("001.mcap"), folder.path().join("away")).unwrap();
    let refusal = Session::open(folder.path()).unwrap_err();
    assert!(matches!(refusal, ReadError::Damaged { .. }), "{refusal}");
    assert!(refusal.to_string().contains("001.mcap"), "{refusal}");
    // The parts before and after are recovered; the gap is reported.
    let (salvage, remaining) = salvaged(folder.path());
    assert!(same_bits(&remaining[..2 * BATCH], &rows[..2 * BATCH]));
    assert!(same_bits(&remaining[2 * BATCH..], &rows[4 * BATCH..]));
    let sentences = salvage.missing.sentences().join("; ");
    assert!(
        sentences.contains("001.mcap") && sentences.contains("80 samples between"),
        "{sentences}"
    );
    // Another segment does not pass for it, nor for the first one.
    fs::rename(folder.path().join("002.mcap"), folder.path().join("001.mcap")).unwrap();
    assert!(Session::open(folder.path()).is_err());
    fs::remove_file(folder.path().join("000.mcap")).unwrap();
    assert!(Session::open(folder.path()).is_err());
    fs::rename(folder.path().join("001.mcap"), folder.path().join("000.mcap")).unwrap();
    assert!(Session::open(folder.path()).is_err());
}

#[test]
fn an_unfinished_segment_is_joined_only_where_the_next_goes_on() {
    let (folder, rows, _) = three_segments();
    let middle = folder.path().join("001.mcap");
    let whole = fs::read(&middle).unwrap();
    // The index alone is lost: no sample is.
    cut(&middle, whole.len() - 100);
    let session = Session::open(folder.path()).unwrap();
    assert!(same_bits(&session.rows, &rows) && session.end.is_some());
    assert!(session.notes[0].contains("001.mcap"));
    // Anything less, and samples are lost.
    let data = whole.len() / 3;
    cut(&middle, data);
    let refusal = Session::open(folder.path()).unwrap_err();
    assert!(matches!(refusal, ReadError::Damaged { .. }), "{refusal}");
    let (salvage, remaining) = salvaged(folder.path());
    let gap = &salvage.missing.gaps[0];
    let (before, after) = (gap.after_sample as usize, (gap.after_sample + gap.samples) as usize);
    assert!(same_bits(&remaining[..before], &rows[..before]));
    assert!(same_bits(&remaining[before..], &rows[after..]) && after <= 4 * BATCH);
}

/// That the next segment goes on without a gap does not make up for it: only one begun because of it would.
#[test]
fn a_wrong_checksum_in_any_segment_is_refused() {
    let (folder, rows, _) = three_segments();
    for number in 0..3 {
        let path = folder.path().join(segment_file(number));
        let whole = fs::read(&path).unwrap();
        let mut hurt = whole.clone();
        // In the index, where no sample is.
        let index = hurt.len() - 100;
        hurt[index] ^= 1;
        fs::write(&path, &hurt).unwrap();
        let refusal = Session::open(folder.path()).unwrap_err().to_string();
        assert!(refusal.contains("the index"), "{refusal}");
        assert!(refusal.contains(&segment_file(number)), "{refusal}");
        let (salvage, remaining) = salvaged(folder.path());
        assert!(same_bits(&remaining, &rows));
        let sentences = salvage.missing.sentences().join("; ");
        assert!(sentences.contains(&segment_file(number)), "{sentences}");
        fs::write(&path, &whole).unwrap();
    }
    Session::open(folder.path()).unwrap();
}

#[test]
fn segments_of_another_session_are_refused() {
    let (folder, rows, entries) = three_segments();
    let mut other = manifest();
    other.operator = "Eve".into();
    let journal = Journal::default();
    let mut log = LogWriter::begin_in_segments(Box::new(journal.clone()), 2, &other).unwrap();
    for batch in rows.chunks(BATCH) {
        log.append(batch, &[]).unwrap();
    }
    log.finish(end(Nanos::ZERO)).unwrap();
    let theirs = quick_folder();
    replay_steps(&journal.0.lock().unwrap().steps, theirs.path());
    fs::copy(theirs.path().join("001.mcap"), folder.path().join("001.mcap")).unwrap();
    let refusal = Session::open(folder.path()).unwrap_err().to_string();
    assert!(refusal.contains("manifest"), "{refusal}");

    // Nor may anything follow the end.
    let sink = MemorySink::default();
    let mut log = LogWriter::begin(sink.clone(), "memory", &manifest()).unwrap();
    log.append(&rows, &entries).unwrap();
    log.finish(end(Nanos::ZERO)).unwrap();
    fs::write(folder.path().join("000.mcap"), sink.bytes()).unwrap();
    let refusal = Session::open(folder.path()).unwrap_err();
    assert!(
        matches!(&refusal, ReadError::Damaged { path, .. } if path.ends_with("001.mcap")),
        "{refusal:?}"
    );
}
