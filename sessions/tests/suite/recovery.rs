//! Sessions that broke off or were damaged, recovered beside the original.

use crate::support::{Random, end, entries, log_bytes, manifest, rows, same_bits};
use chrono::{TimeZone, Utc};
use palpate_model::Nanos;
use palpate_sessions::recover::{
    RecoverError, SessionHealth, examine_session, find_unfinished_sessions, recover,
    recovered_folder,
};
use palpate_sessions::{LOG_FILE, ReadError, RecordingPace, Session, SessionFolder, SessionWriter};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

fn at() -> chrono::DateTime<Utc> {
    Utc.with_ymd_and_hms(2026, 3, 6, 9, 0, 0).unwrap()
}

/// Every file below a folder with its bytes.
fn contents(folder: &Path) -> BTreeMap<std::path::PathBuf, Vec<u8>> {
    let files = fs::read_dir(folder).unwrap().map(|item| item.unwrap().path());
    files.map(|path| (path.clone(), fs::read(path).unwrap())).collect()
}

/// A session folder in a library, with bytes as its log.
fn session_with(library: &Path, name: &str, bytes: &[u8]) -> std::path::PathBuf {
    let folder = library.join("sessions").join(name);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join(LOG_FILE), bytes).unwrap();
    folder
}

#[test]
fn an_interrupted_session_is_found_and_recovered_beside_the_original() {
    let library = tempfile::tempdir().unwrap();
    let rows = rows(2000, 71);
    let entries = entries(&rows, 60);
    let whole = log_bytes(&rows, &entries, None);
    let folder = session_with(library.path(), "a", &whole[..whole.len() - 77]);
    session_with(library.path(), "b", &log_bytes(&rows, &entries, Some(end(Nanos::ZERO))));
    let before = contents(&folder);
    assert_eq!(find_unfinished_sessions(library.path()).unwrap(), std::slice::from_ref(&folder));

    let recovery = recover(&folder, "1.2.3", at()).unwrap();
    assert_eq!(contents(&folder), before, "the original was touched");
    assert_eq!(recovery.folder, recovered_folder(&folder));
    let session = Session::open(&recovery.folder).unwrap();
    let original = Session::open(&folder).unwrap();
    assert!(same_bits(&session.rows, &original.rows));
    assert_eq!(session.entries, original.entries);
    assert_eq!(session.end.as_ref().unwrap().outcome, "interrupted");
    assert!(
        session.notes[0].contains("recovered from") && session.notes[0].contains("end is missing"),
        "{:?}",
        session.notes
    );
    let mut original = session.manifest.clone();
    let recovered = original.recovered.take().unwrap();
    assert_eq!(recovered.from, manifest().session_id);
    assert_eq!((recovered.at, recovered.software_version.as_str()), (at(), "1.2.3"));
    original.session_id = manifest().session_id;
    assert_eq!(original, manifest());
    // Found no more, and not made twice.
    assert_eq!(find_unfinished_sessions(library.path()).unwrap(), Vec::<std::path::PathBuf>::new());
    assert!(matches!(recover(&folder, "1.2.3", at()), Err(RecoverError::Before { .. })));
}

#[test]
fn entries_stay_between_the_samples_they_came_between() {
    let rows = rows(3000, 72);
    let entries = entries(&rows, 40);
    let mut random = Random(72);
    for case in 0..60 {
        let library = tempfile::tempdir().unwrap();
        let mut bytes = log_bytes(&rows, &entries, Some(end(Nanos::from_millis(3000))));
        for _ in 0..1 + case % 4 {
            let place = random.below(bytes.len());
            bytes[place] ^= 1 << random.below(8);
        }
        let folder = session_with(library.path(), "a", &bytes);
        let Ok(recovery) = recover(&folder, "1.2.3", at()) else {
            continue;
        };
        let session = Session::open(&recovery.folder).unwrap();
        // Samples are known by their time, which differs between any two.
        let number = |row: &palpate_sessions::SampleRow| {
            rows.iter().position(|one| one.host == row.host).unwrap()
        };
        let numbers: Vec<usize> = session.rows.iter().map(number).collect();
        assert!(numbers.is_sorted());
        for (row, number) in session.rows.iter().zip(&numbers) {
            assert!(same_bits(&[*row], &[rows[*number]]));
        }
        for entry in &session.entries {
            let old = entries.iter().find(|one| one.order == entry.order).unwrap();
            assert_eq!(old.body, entry.body);
            let before = numbers.iter().filter(|n| (**n as u64) < old.after_sample).count();
            assert_eq!(entry.after_sample, before as u64, "case {case}, entry {}", entry.order);
        }
    }
}

#[test]
fn the_doctor_says_what_each_file_is() {
    let library = tempfile::tempdir().unwrap();
    let rows = rows(1500, 73);
    let ending = || Some(end(Nanos::from_millis(1500)));
    let whole = log_bytes(&rows, &[], ending());
    let open = log_bytes(&rows, &[], None);
    // The first byte behind the middle that costs samples: others describe, or are stored twice.
    let costs_samples = |place: &usize| {
        let mut hurt = whole.clone();
        hurt[*place] ^= 4;
        let patient = examine_session(&session_with(library.path(), "try", &hurt));
        patient.samples < 1500
    };
    let middle = (whole.len() / 2..whole.len()).step_by(500).find(costs_samples);
    let middle = middle.expect("a byte of samples");
    let mut hurt = whole.clone();
    hurt[middle] ^= 4;
    let health =
        |name: &str, bytes: &[u8]| examine_session(&session_with(library.path(), name, bytes));

    let patient = health("whole", &whole);
    assert_eq!((patient.health, patient.samples), (SessionHealth::Healthy, 1500));
    let patient = health("open", &open);
    assert_eq!((patient.health, patient.samples), (SessionHealth::Interrupted, 1500));
    assert!(patient.findings[0].contains("interrupted at 1.5 s"), "{:?}", patient.findings);
    let patient = health("hurt", &hurt);
    let SessionHealth::Damaged { missing } = &patient.health else { panic!("{patient:?}") };
    assert_eq!(missing.gaps[0].samples + patient.samples, 1500);
    assert!(patient.findings.iter().any(|one| one.contains("000.mcap") && one.contains("byte")));
    // Where no sample is: nothing is missing, and it is still made whole again.
    let mut hurt = whole.clone();
    let index = hurt.len() - 100;
    hurt[index] ^= 4;
    let patient = health("index", &hurt);
    assert_eq!(patient.samples, 1500);
    let damage = patient.findings.join("; ");
    assert!(damage.contains("the index"), "{damage}");
    let copy = recover(&library.path().join("sessions/index"), "1", at()).unwrap();
    let copy = Session::open(&copy.folder).unwrap();
    assert!(same_bits(&copy.rows, &rows) && copy.end.is_some());
    assert_eq!(health("foreign", b"PK\x03\x04 a spreadsheet").health, SessionHealth::Foreign);
    assert_eq!(health("empty", b"").health, SessionHealth::Foreign);
    assert_eq!(health("begun", &whole[..60]).health, SessionHealth::Lost);
    assert_eq!(examine_session(&library.path().join("nothing")).health, SessionHealth::Foreign);

    // Where nothing is, nothing is damaged, and recovery would not help.
    let hollow = library.path().join("hollow");
    fs::create_dir(&hollow).unwrap();
    let refusal = recover(&hollow, "1", at()).unwrap_err();
    assert!(
        matches!(&refusal, RecoverError::Read(ReadError::NotASession { path, .. }) if *path == hollow),
        "{refusal:?}"
    );

    // A session in use is left alone.
    let path = library.path().join("sessions/live");
    let held = SessionFolder::create(&path).unwrap();
    let mut writer = SessionWriter::start(held, None, &manifest(), RecordingPace::Virtual).unwrap();
    rows.iter().for_each(|row| writer.push_row(*row).unwrap());
    assert_eq!(examine_session(&path).health, SessionHealth::BeingRecorded);
    assert!(matches!(recover(&path, "1", at()), Err(RecoverError::InUse { .. })));
    assert!(!find_unfinished_sessions(library.path()).unwrap().contains(&path));
    writer.close(end(Nanos::from_millis(1500))).unwrap();
    assert_eq!(examine_session(&path).health, SessionHealth::Healthy);
    assert!(matches!(recover(&path, "1", at()), Err(RecoverError::Whole { .. })));
}

#[test]
fn invalid_record_version_is_quoted() {
    let folder = tempfile::tempdir().unwrap();
    let mut file = std::io::Cursor::new(Vec::new());
    let options = mcap::WriteOptions::new().profile("palpate");
    let mut writer = options.create(&mut file).unwrap();
    let channel = writer.add_channel(0, "/manifest", "json", &BTreeMap::new());
    let header = mcap::records::MessageHeader {
        channel_id: channel.unwrap(),
        sequence: 0,
        log_time: 0,
        publish_time: 0,
    };
    writer.write_to_known_channel(&header, br#"{"record_version": -1}"#).unwrap();
    writer.finish().unwrap();
    drop(writer);
    let path = session_with(folder.path(), "odd", &file.into_inner());
    let reason = Session::open(&path).unwrap_err().to_string();
    assert!(reason.contains("record version is -1"), "{reason}");
}
