//! JSON-lines files beside a log that are damaged or lack lines: reported by name, and the rest is shown.

use crate::support::{end, log_bytes, manifest, rows};
use chrono::{TimeZone, Utc};
use palpate_model::Nanos;
use palpate_sessions::analyses::{Analysis, AnalysisContent, add_analysis};
use palpate_sessions::catalog::{Catalog, HistorySubject};
use palpate_sessions::checks::{DailyCheck, add_check};
use palpate_sessions::edits::{DataQuality, Edit, EditChange, EditError, Edits, add_edit};
use palpate_sessions::journal::Journal;
use palpate_sessions::recover::examine_session;
use palpate_sessions::{ANALYSES_FILE, ChainError, EDITS_FILE, LOG_FILE};
use std::fs;
use std::path::{Path, PathBuf};

/// A library with a session that has two verdicts and an analysis.
fn library() -> (tempfile::TempDir, PathBuf) {
    let library = tempfile::tempdir().unwrap();
    let session = library.path().join("sessions/one");
    fs::create_dir_all(&session).unwrap();
    let log = log_bytes(&rows(100, 1), &[], Some(end(Nanos(0))));
    fs::write(session.join(LOG_FILE), log).unwrap();
    for verdict in [DataQuality::Valid, DataQuality::Rejected] {
        let edit = Edit {
            at: Utc.with_ymd_and_hms(2026, 4, 1, 9, 0, 0).unwrap(),
            by: "Ada".into(),
            reason: "hair on the probe".into(),
            change: EditChange::Verdict { verdict },
        };
        add_edit(&session, &manifest().session_id, &edit).unwrap();
    }
    let mask = Analysis {
        name: "bump".into(),
        at: Utc.with_ymd_and_hms(2026, 4, 2, 9, 0, 0).unwrap(),
        by: "Ada".into(),
        reason: String::new(),
        software_version: "0.1.0".into(),
        engine_version: 1,
        inputs: Vec::new(),
        what: AnalysisContent::Mask { left_out_s: vec![[1.0, 2.0]] },
    };
    add_analysis(&session, &manifest().session_id, &mask).unwrap();
    (library, session)
}

fn flip(path: &Path) {
    let mut bytes = fs::read(path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(path, bytes).unwrap();
}

fn cut_last_line(path: &Path) {
    let text = fs::read_to_string(path).unwrap();
    let lines: Vec<&str> = text.split_inclusive('\n').collect();
    fs::write(path, lines[..lines.len() - 1].concat()).unwrap();
}

/// Kinds of events in the history of a subject, and its remarks.
fn history(library: &Path, subject: HistorySubject, name: &str) -> (Vec<String>, Vec<String>) {
    let history = Catalog::with(library, |catalog| {
        catalog.update(&mut |_, _| {})?;
        catalog.history(subject, name)
    });
    let (events, remarks) = history.unwrap();
    (events.into_iter().map(|one| one.what).collect(), remarks)
}

#[test]
fn history_names_every_damaged_file_and_shows_the_rest() {
    let (library, session) = library();
    let at = library.path();
    let specimen = manifest().specimen;
    let all = ["session", "verdict", "verdict", "mask"].map(String::from);
    let of_specimen = || history(at, HistorySubject::Specimen, &specimen);
    assert_eq!(of_specimen(), (all.to_vec(), vec![]));
    for damage in [flip, cut_last_line] {
        let analyses = session.join(ANALYSES_FILE);
        let original = fs::read(&analyses).unwrap();
        damage(&analyses);
        let (events, remarks) = of_specimen();
        assert_eq!(events, all[..3]);
        assert!(remarks.len() == 1 && remarks[0].contains(ANALYSES_FILE), "{remarks:?}");
        // With the edits too, both are named.
        let edits = session.join(EDITS_FILE);
        let kept_edits = fs::read(&edits).unwrap();
        damage(&edits);
        let (events, remarks) = of_specimen();
        assert_eq!(events, all[..1]);
        let remarks = remarks.join("\n");
        assert!(remarks.contains(ANALYSES_FILE) && remarks.contains(EDITS_FILE), "{remarks}");
        fs::write(&edits, kept_edits).unwrap();
        fs::write(&analyses, original).unwrap();
    }
    let check = DailyCheck {
        at: Utc.with_ymd_and_hms(2026, 3, 5, 8, 0, 0).unwrap(),
        rig: "sim".into(),
        by: "Ada".into(),
        session_id: "id".into(),
        calibration: "cell".into(),
        is_passed: true,
        parts: Vec::new(),
    };
    add_check(at, &check).unwrap();
    let (events, remarks) = history(at, HistorySubject::Rig, "sim");
    assert!(events.contains(&"check".into()) && remarks.is_empty(), "{events:?}");
    let file = at.join("checks/sim.jsonl");
    let original = fs::read(&file).unwrap();
    for damage in [flip, cut_last_line, |path: &Path| fs::remove_file(path).unwrap()] {
        damage(&file);
        let (events, remarks) = history(at, HistorySubject::Rig, "sim");
        assert_eq!(events, all);
        assert!(remarks.len() == 1 && remarks[0].contains("sim.jsonl"), "{remarks:?}");
        fs::write(&file, &original).unwrap();
    }
}

#[test]
fn a_verdict_that_was_cut_off_is_missed_by_every_reader() {
    let (library, session) = library();
    let at = library.path();
    let id = manifest().session_id;
    let trouble = || {
        Catalog::with(at, |catalog| {
            catalog.update(&mut |_, _| {})?;
            assert_eq!(catalog.check(&mut |_, _| {})?, []);
            Ok(catalog.all()?.pop().and_then(|entry| entry.trouble))
        })
        .unwrap()
    };
    assert_eq!(trouble(), None);
    let edits = session.join(EDITS_FILE);
    let whole = fs::read(&edits).unwrap();
    cut_last_line(&edits);
    let is_reported = |text: &str| text.contains(EDITS_FILE) && text.contains("1 of 2");
    assert!(matches!(
        Edits::read(&session, &id),
        Err(EditError::Chain(ChainError::Shortened { found: 1, written: 2, .. }))
    ));
    let wrong = examine_session(&session).damaged_companions;
    assert!(wrong.len() == 1 && is_reported(&wrong[0]), "{wrong:?}");
    assert!(trouble().is_some_and(|text| is_reported(&text)));
    // The catalog notices even if the head is deleted too.
    fs::remove_file(session.join("edits.jsonl.head")).unwrap();
    assert!(examine_session(&session).damaged_companions.is_empty());
    for _ in 0..2 {
        assert!(trouble().is_some_and(|text| is_reported(&text)));
        // Changed again, it is read again.
        fs::write(session.join("spoor"), "").unwrap();
    }
    fs::write(&edits, &whole).unwrap();
    assert_eq!(trouble(), None);
    // It knows after a rebuild, and after it replaced the catalog of an older version.
    cut_last_line(&edits);
    let catalog = at.join("catalog.sqlite");
    Catalog::open(at).unwrap().rebuild(&mut |_, _| {}).unwrap();
    assert!(trouble().is_some_and(|text| is_reported(&text)));
    let mut bytes = fs::read(&catalog).unwrap();
    // The user version, four bytes at 60 (SQLite file format, 1.3).
    bytes[60..64].copy_from_slice(&1u32.to_be_bytes());
    fs::write(&catalog, bytes).unwrap();
    assert!(trouble().is_some_and(|text| is_reported(&text)));
    fs::write(&edits, &whole).unwrap();
    assert_eq!(trouble(), None);
    // A session from before there were heads.
    fs::remove_file(at.join("catalog.sqlite")).unwrap();
    cut_last_line(&edits);
    assert_eq!(trouble(), None);
}

#[test]
fn a_check_or_a_journal_that_was_cut_off_with_its_head_is_missed_by_the_catalog() {
    let (library, _) = library();
    let at = library.path();
    for number in 0..2 {
        let check = DailyCheck {
            at: chrono::DateTime::UNIX_EPOCH,
            rig: "sim:bench 2".into(),
            by: format!("Ada {number}"),
            session_id: "id".into(),
            calibration: "cell".into(),
            is_passed: number == 0,
            parts: Vec::new(),
        };
        add_check(at, &check).unwrap();
    }
    let programme = at.join("programmes/ten-a");
    let (mut journal, _) = Journal::open::<u32>(&programme).unwrap();
    [1, 22].iter().for_each(|entry| journal.push(entry).unwrap());
    let mut files = fs::read_dir(at.join("checks")).unwrap().map(|item| item.unwrap().path());
    let checks = files.find(|path| path.extension().unwrap() == "jsonl").unwrap();
    let update = || {
        let update = |catalog: &mut Catalog| {
            let remarks = catalog.update(&mut |_, _| {})?.remarks;
            let doubts = catalog.check(&mut |_, _| {})?.len();
            assert_eq!(doubts, remarks.len(), "{remarks:?}");
            Ok(remarks)
        };
        Catalog::with(at, update).unwrap()
    };
    assert_eq!(update(), Vec::<String>::new());
    for file in [&checks, &programme.join("journal.jsonl")] {
        let whole = fs::read(file).unwrap();
        let head = file.with_extension("jsonl.head");
        let known = fs::read(&head).unwrap();
        for damage in [cut_last_line, |path: &Path| fs::remove_file(path).unwrap()] {
            damage(file);
            fs::remove_file(&head).unwrap();
            for _ in 0..2 {
                let remarks = update();
                let name = file.file_name().unwrap().to_str().unwrap();
                assert!(remarks.len() == 1 && remarks[0].contains(name), "{remarks:?}");
                Catalog::open(at).unwrap().rebuild(&mut |_, _| {}).unwrap();
            }
            fs::write(file, &whole).unwrap();
            fs::write(&head, &known).unwrap();
            assert_eq!(update(), Vec::<String>::new());
        }
    }
    // A programme that is gone as a whole was taken away by who needs it no more.
    fs::remove_dir_all(&programme).unwrap();
    assert_eq!(update(), Vec::<String>::new());
}
