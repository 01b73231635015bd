//! Logs that another program changes during the recording: the change is reported, and later data is saved.

use crate::support::{end, entries, manifest, rows};
use palpate_model::Nanos;
use palpate_sessions::recover::{SessionHealth, examine_session};
use palpate_sessions::{
    Alteration, FileSink, FolderSegments, LOG_FILE, LogError, LogNotice, LogWriter, RecordingPace,
    SampleRow, Session, SessionFolder, SessionWriter, segment_file,
};
use palpate_test_support::wait::until;
use std::path::Path;
use std::process::Command;

/// Does something to the file `$1` in a process of its own.
fn stranger(command: &str, file: &Path) {
    let done = Command::new("sh").args(["-ec", command, "stranger"]).arg(file).status();
    assert!(done.expect("there is a shell").success(), "{command}");
}

const EMPTY: &str = ": > \"$1\"";
const CUT: &str = "truncate -s 5000 \"$1\"";
const REMOVE: &str = "rm \"$1\"";
const REPLACE: &str = "cp \"$1\" \"$1.copy\"; mv \"$1.copy\" \"$1\"";
const ADD: &str = "printf x >> \"$1\"";
const CHANGE: &str = "printf x | dd of=\"$1\" bs=1 seek=5000 conv=notrunc status=none";

#[test]
fn alteration_by_another_program_is_reported_when_the_log_is_closed() {
    let rows = rows(2000, 5);
    for command in [EMPTY, CUT, REMOVE, REPLACE, ADD, CHANGE] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(LOG_FILE);
        let sink = FileSink::create(&path).unwrap();
        let mut log = LogWriter::begin(sink, "log", &manifest()).unwrap();
        log.append(&rows, &[]).unwrap();
        log.sync().unwrap();
        stranger(command, &path);
        let Err(LogError::Altered { alteration, .. }) = log.finish(end(Nanos(0))) else {
            panic!("not reported: {command}");
        };
        let is_right = match command {
            EMPTY | CUT | ADD => {
                matches!(alteration, Alteration::Length { found, written } if found != written)
            }
            REMOVE => alteration == Alteration::Gone,
            REPLACE => alteration == Alteration::Replaced,
            _ => alteration == Alteration::Content,
        };
        assert!(is_right, "{command}: {alteration}");
    }
}

/// Pushes rows, an event after the last of them.
fn push(writer: &mut SessionWriter, rows: &[SampleRow], order: u64) {
    for row in rows {
        writer.push_row(*row).unwrap();
    }
    let last = rows.last().unwrap();
    let mut event = entries(rows, rows.len() - 1).pop().unwrap();
    (event.order, event.now) = (order, last.host);
    writer.push_entry(event).unwrap();
    writer.on_tick(last.host + Nanos(1)).unwrap();
}

#[test]
fn altered_log_is_reported_at_once_and_the_recording_continues() {
    let rows = rows(6000, 6);
    let (first, rest) = rows.split_at(3000);
    for command in [EMPTY, CUT, REMOVE, REPLACE] {
        let parent = tempfile::tempdir().unwrap();
        let path = parent.path().join("session");
        let folder = SessionFolder::create(&path).unwrap();
        let mut writer =
            SessionWriter::start(folder, None, &manifest(), RecordingPace::Real).unwrap();
        push(&mut writer, first, 1);
        let is_saved = || {
            let is_synced = writer.disk_state().sync_s.is_some();
            (writer.saved_through() >= first[2999].host && is_synced).then_some(())
        };
        until(is_saved, || "all that was pushed on the disk".into());
        stranger(command, &path.join(LOG_FILE));
        push(&mut writer, rest, 2);
        let first_notices = || {
            let notices = writer.take_notices();
            (!notices.is_empty()).then_some(notices)
        };
        let notices = until(first_notices, || "a notice".into());
        assert!(
            matches!(&notices[..], [LogNotice::Altered(LogError::Altered { .. })]),
            "{command}: {notices:?}"
        );
        assert!(notices[0].is_reason_to_end());
        let closed = writer.close(end(rows[5999].host));
        assert!(matches!(closed, Err(LogError::Altered { .. })), "{command}: {closed:?}");
        // Later data is complete, and missing data is reported.
        let patient = examine_session(&path);
        if command == REPLACE {
            // The copy has everything on the disk by then: nothing is missing, and the alteration is reported all the same.
            assert_eq!((&patient.health, patient.samples), (&SessionHealth::Healthy, 6000));
            continue;
        }
        let SessionHealth::Damaged { missing } = &patient.health else {
            panic!("{command}: {patient:?}");
        };
        assert!(!missing.is_end_lost, "{command}: {missing:?}");
        assert!(patient.samples >= 3000 && patient.until_s > 5.9, "{command}: {patient:?}");
        let missing_samples: u64 = missing.gaps.iter().map(|gap| gap.samples).sum();
        assert_eq!(patient.samples + missing_samples, 6000, "{command}");
        assert!(Session::open(&path).is_err());
    }
}

#[test]
fn finished_segment_is_checked_too() {
    let rows = rows(4000, 7);
    let (first, rest) = rows.split_at(2000);
    for (command, is_open) in [(CHANGE, true), (CUT, false), (CHANGE, false), (REPLACE, false)] {
        let folder = tempfile::tempdir().unwrap();
        let source = FolderSegments::new(folder.path());
        let batches = if is_open { 1000 } else { 5 };
        let mut writer =
            SessionWriter::start_in_segments(source, batches, &manifest(), RecordingPace::Virtual)
                .unwrap();
        first.iter().for_each(|row| writer.push_row(*row).unwrap());
        let second = folder.path().join(segment_file(1));
        assert_eq!(second.exists(), !is_open);
        stranger(command, &folder.path().join(LOG_FILE));
        rest.iter().for_each(|row| writer.push_row(*row).unwrap());
        let closed = writer.close(end(rows[3999].host));
        let Err(LogError::Altered { path, .. }) = closed else {
            panic!("{command}: {closed:?}");
        };
        assert!(path.ends_with(LOG_FILE), "{path}");
    }
}
