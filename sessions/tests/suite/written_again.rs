//! Disks that fail while a session is recorded: it goes on in another file and lacks nothing.

use crate::support::{Random, end, entries, manifest, quick_folder, rows, same_bits};
use palpate_model::Nanos;
use palpate_sessions::recover::{
    RecoverError, SessionHealth, examine_session, recover, recovered_folder,
};
use palpate_sessions::{
    FileSink, FolderSegments, LogEntry, LogError, LogNotice, ReadError, RecordingPace, SPARE_FILE,
    SampleRow, SegmentSource, Session, SessionSummary, SessionWriter, Sink, segment_file,
};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// What a failing disk leaves of a file.
#[derive(Clone, Copy, Debug)]
enum Leaves {
    /// Everything.
    All,
    /// What was synced.
    Synced,
    /// What was synced, then zeros.
    Zeros,
    /// What was synced, then anything.
    Garbage,
}

/// Segments in a folder whose disk fails at given operations, counted over all files.
#[derive(Clone)]
struct Failing {
    folder: PathBuf,
    leaves: Leaves,
    counted: Arc<Mutex<Counted>>,
}

struct Counted {
    operations: u32,
    fail_at: Vec<u32>,
    failed: u32,
}

struct FailingSink {
    inner: FileSink,
    path: PathBuf,
    synced: u64,
    disk: Failing,
}

impl Failing {
    fn new(folder: &Path, leaves: Leaves, fail_at: &[u32]) -> Self {
        Self {
            folder: folder.into(),
            leaves,
            counted: Arc::new(Mutex::new(Counted {
                operations: 0,
                fail_at: fail_at.into(),
                failed: 0,
            })),
        }
    }

    fn count(&self) -> io::Result<()> {
        let mut counted = self.counted.lock().unwrap();
        let operation = counted.operations;
        counted.operations += 1;
        if counted.fail_at.contains(&operation) {
            counted.failed += 1;
            return Err(io::Error::from_raw_os_error(5));
        }
        Ok(())
    }
}

impl FailingSink {
    fn spoil(&self, err: io::Error) -> io::Error {
        let mut bytes = fs::read(&self.path).unwrap();
        let synced = self.synced as usize;
        match self.disk.leaves {
            Leaves::All => {}
            Leaves::Synced => bytes.truncate(synced),
            Leaves::Zeros => bytes[synced..].fill(0),
            Leaves::Garbage => {
                let mut random = Random(bytes.len() as u64);
                bytes[synced..].fill_with(|| random.next() as u8);
            }
        }
        fs::write(&self.path, bytes).unwrap();
        err
    }
}

impl Sink for FailingSink {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.disk.count().map_err(|err| {
            self.inner.append(&bytes[..bytes.len() / 2]).unwrap();
            self.spoil(err)
        })?;
        self.inner.append(bytes)
    }

    fn sync(&mut self) -> io::Result<()> {
        self.disk.count().map_err(|err| self.spoil(err))?;
        self.synced = fs::metadata(&self.path)?.len();
        Ok(())
    }
}

impl SegmentSource for Failing {
    type Sink = FailingSink;

    fn path(&self, number: u32) -> String {
        self.folder.join(segment_file(number)).display().to_string()
    }

    fn create(&mut self, number: u32) -> io::Result<FailingSink> {
        self.count()?;
        let path = self.folder.join(segment_file(number));
        Ok(FailingSink { inner: FileSink::create(&path)?, path, synced: 0, disk: self.clone() })
    }
}

/// Records a session of ten batches and some for its entries, so many to a segment, with its notices.
fn record(
    source: Failing,
    batches_per_segment: u32,
    rows: &[SampleRow],
    entries: &[LogEntry],
) -> Result<Vec<LogNotice>, (Vec<LogNotice>, LogError)> {
    let start = SessionWriter::start_in_segments(
        source,
        batches_per_segment,
        &manifest(),
        RecordingPace::Real,
    );
    let mut writer = start.map_err(|err| (Vec::new(), err))?;
    let mut pending = entries.iter().peekable();
    let mut pushed = Ok(());
    for (i, row) in rows.iter().enumerate() {
        while let Some(entry) = pending.next_if(|entry| entry.after_sample == i as u64) {
            pushed = pushed.and_then(|()| writer.push_entry(entry.clone()));
        }
        pushed = pushed.and_then(|()| writer.push_row(*row));
    }
    // The thread may not have come to the last failures yet.
    let mut notices = writer.take_notices();
    let news = writer.notices();
    let closed = writer.close(end(Nanos::from_millis(1000)));
    notices.extend(news.take());
    pushed.and(closed).map_err(|err| (notices.clone(), err))?;
    Ok(notices)
}

fn check_whole(folder: &Path, rows: &[SampleRow], entries: &[LogEntry], context: &str) -> Session {
    let session = Session::open(folder).unwrap_or_else(|err| panic!("{context}: {err}"));
    assert!(same_bits(&session.rows, rows), "{context}: {}", session.rows.len());
    assert_eq!(session.entries, entries, "{context}");
    assert_eq!(session.end.as_ref().unwrap().samples, rows.len() as u64);
    let summary = SessionSummary::read(folder).unwrap();
    assert_eq!(summary.samples, rows.len() as u64, "{context}");
    assert_eq!(summary.end, session.end, "{context}");
    session
}

#[test]
fn whichever_operation_fails_the_session_lacks_nothing() {
    let rows = rows(1000, 61);
    let entries = entries(&rows, 60);
    let mut moved = 0;
    for leaves in [Leaves::All, Leaves::Synced, Leaves::Zeros, Leaves::Garbage] {
        for fail_at in 0.. {
            let folder = quick_folder();
            let source = Failing::new(folder.path(), leaves, &[fail_at]);
            let counted = Arc::clone(&source.counted);
            let context = format!("{leaves:?}, operation {fail_at}");
            let outcome = record(source, 3, &rows, &entries);
            if counted.lock().unwrap().failed == 0 {
                break;
            }
            match outcome {
                Ok(notices) => {
                    moved += 1;
                    let [LogNotice::Moved { reason, is_last: false, .. }] = &notices[..] else {
                        panic!("{context}: {notices:?}");
                    };
                    assert!(reason.contains("Input/output error"), "{reason}");
                    check_whole(folder.path(), &rows, &entries, &context);
                }
                // What is not begun yet is refused before anything moves.
                Err((_, err)) => assert!(fail_at < 3, "{context}: {err}"),
            }
        }
    }
    assert!(moved > 4 * 20, "{moved}");
}

#[test]
fn several_failures_lose_nothing_and_too_many_are_reported() {
    let rows = rows(1000, 62);
    let entries = entries(&rows, 60);
    let mut random = Random(62);
    let (mut whole, mut failed) = (0, 0);
    for case in 0..200 {
        let folder = quick_folder();
        let leaves = [Leaves::All, Leaves::Synced, Leaves::Zeros, Leaves::Garbage][case % 4];
        let fail_at: Vec<u32> = (0..2 + case % 4).map(|_| 3 + random.below(40) as u32).collect();
        let source = Failing::new(folder.path(), leaves, &fail_at);
        let context = format!("{leaves:?}, operations {fail_at:?}");
        match record(source, 3, &rows, &entries) {
            Ok(_) => {
                check_whole(folder.path(), &rows, &entries, &context);
                whole += 1;
            }
            Err((_, LogError::Disk { .. })) => {
                failed += 1;
                // The present data is correct, and a missing end is reported.
                match Session::open(folder.path()) {
                    Ok(session) => {
                        let count = session.rows.len();
                        assert!(same_bits(&session.rows, &rows[..count]), "{context}");
                        assert!(session.end.is_none() && !session.notes.is_empty(), "{context}");
                    }
                    Err(ReadError::Damaged { .. }) => {}
                    Err(err) => panic!("{context}: {err}"),
                }
            }
            Err((_, err)) => panic!("{context}: {err}"),
        }
    }
    assert!(whole > 100 && failed > 5, "{whole} {failed}");
}

#[test]
fn a_full_disk_sends_the_recording_to_the_spare_folder() {
    /// A folder that takes so many bytes, and a spare one that takes all.
    struct Full {
        own: FolderSegments,
        room: Arc<Mutex<usize>>,
    }
    struct FullSink(FileSink, Option<Arc<Mutex<usize>>>);
    impl Sink for FullSink {
        fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
            if let Some(room) = &self.1 {
                let mut room = room.lock().unwrap();
                let fits = bytes.len().min(*room);
                *room -= fits;
                self.0.append(&bytes[..fits])?;
                if fits < bytes.len() {
                    return Err(io::Error::from_raw_os_error(28));
                }
                return Ok(());
            }
            self.0.append(bytes)
        }
        fn sync(&mut self) -> io::Result<()> {
            self.0.sync()
        }
    }
    impl SegmentSource for Full {
        type Sink = FullSink;
        fn path(&self, number: u32) -> String {
            self.own.path(number)
        }
        fn create(&mut self, number: u32) -> io::Result<FullSink> {
            let room = Arc::clone(&self.room);
            Ok(FullSink(self.own.create(number)?, Some(room)))
        }
        fn create_elsewhere(&mut self, number: u32) -> io::Result<(FullSink, String)> {
            let (sink, path) = self.own.create_elsewhere(number)?;
            Ok((FullSink(sink, None), path))
        }
    }
    let rows = rows(1000, 63);
    let mut away = 0;
    for room in (12_000..60_000).step_by(3001) {
        let (folder, spare) = (quick_folder(), quick_folder());
        let own = FolderSegments::with_spare(folder.path(), spare.path(), "id").unwrap();
        let room = Arc::new(Mutex::new(room));
        let source = Full { own, room: Arc::clone(&room) };
        let start =
            SessionWriter::start_in_segments(source, 100, &manifest(), RecordingPace::Virtual);
        let mut writer = start.unwrap();
        rows.iter().for_each(|row| writer.push_row(*row).unwrap());
        let news = writer.notices();
        writer.close(end(Nanos::from_millis(1000))).unwrap();
        let notices = news.take();
        if *room.lock().unwrap() == 0 {
            let [LogNotice::Moved { is_last: true, path, .. }] = &notices[..] else {
                panic!("{notices:?}");
            };
            assert!(path.starts_with(spare.path().to_str().unwrap()), "{path}");
            assert!(notices[0].is_reason_to_end());
        } else {
            assert!(notices.is_empty());
        }
        let session = check_whole(folder.path(), &rows, &[], "spare");
        // Without the spare folder the session is there up to where the disk was full.
        if !notices.is_empty() {
            assert!(
                session.notes.iter().any(|note| note.contains("failed")),
                "{:?}",
                session.notes
            );
            assert!(session.is_whole());
            away += u32::from(is_spare_reported(folder.path(), spare.path()));
            fs::remove_file(folder.path().join(SPARE_FILE)).unwrap();
            let rest = Session::open(folder.path()).unwrap();
            assert!(same_bits(&rest.rows, &rows[..rest.rows.len()]));
            assert!(rest.rows.len() == rows.len() || rest.end.is_none());
            assert!(!rest.notes.is_empty());
        }
    }
    assert!(away > 2, "{away}");
}

/// Checks that a missing spare disk is reported; returns whether something is missing.
fn is_spare_reported(folder: &Path, spare: &Path) -> bool {
    let away = spare.with_extension("away");
    fs::rename(spare, &away).unwrap();
    let words = "connect its disk";
    let open = Session::open(folder).unwrap();
    if open.end.is_some() {
        fs::rename(away, spare).unwrap();
        return false;
    }
    assert!(open.notes.iter().any(|note| note.contains(words)));
    let patient = examine_session(folder);
    assert_eq!(patient.health, SessionHealth::Incomplete);
    assert!(patient.findings.iter().any(|one| one.contains(words)));
    let refusal = recover(folder, "1", chrono::DateTime::UNIX_EPOCH).unwrap_err();
    assert!(matches!(refusal, RecoverError::Away { .. }), "{refusal}");
    assert!(!recovered_folder(folder).exists());
    fs::rename(away, spare).unwrap();
    assert_eq!(examine_session(folder).health, SessionHealth::Healthy);
    true
}

/// A process can die at any byte of the file that is written again.
#[test]
fn a_crash_while_writing_again_keeps_what_the_old_file_held() {
    let rows = rows(1000, 64);
    let folder = quick_folder();
    // Operations: create, manifest, sync; then appends, with one sync at the end of ten batches.
    let source = Failing::new(folder.path(), Leaves::All, &[9]);
    record(source, 100, &rows, &[]).unwrap();
    let first = Session::open(&folder.path().join("000.mcap")).unwrap().rows.len();
    assert!(first >= 300, "{first}");
    let second = folder.path().join("001.mcap");
    let whole = fs::read(&second).unwrap();
    // Every seventh byte meets every kind of record at each of its parts.
    for length in (0..whole.len()).step_by(7) {
        fs::write(&second, &whole[..length]).unwrap();
        let session = Session::open(folder.path()).unwrap();
        assert!(session.rows.len() >= first, "{length}: {}", session.rows.len());
        assert!(same_bits(&session.rows, &rows[..session.rows.len()]));
    }
}

/// Folders of one name, as `--out` makes them, in two places.
#[test]
fn sessions_of_one_name_go_on_in_spare_folders_of_their_own() {
    let disks = quick_folder();
    let mut paths = Vec::new();
    for id in ["one", "two"] {
        let folder = disks.path().join(id).join("s");
        fs::create_dir_all(&folder).unwrap();
        let spare = disks.path().join("spare");
        let mut own = FolderSegments::with_spare(&folder, &spare, id).unwrap();
        let (_, path) = own.create_elsewhere(1).unwrap();
        let named = fs::read_to_string(folder.join(SPARE_FILE)).unwrap();
        assert!(path.starts_with(&named), "{path}");
        paths.push(named);
    }
    assert_ne!(paths[0], paths[1]);
}
