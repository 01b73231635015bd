//! What stands beside a damaged log, edits and analyses and the original of an import, and what of it a
//! recovered copy has.

use crate::support::{end, log_bytes, manifest, rows};
use chrono::{TimeZone, Utc};
use palpate_model::{Nanos, Position};
use palpate_sessions::analyses::{Analyses, Analysis, AnalysisContent, add_analysis};
use palpate_sessions::edits::{DataQuality, Edit, EditChange, Edits, add_edit};
use palpate_sessions::recover::{recover, recovered_folder};
use palpate_sessions::{EntryKind, LOG_FILE, LogEntry, ORIGINAL_FOLDER, SampleRow, Session};
use std::fs;
use std::path::Path;

fn at() -> chrono::DateTime<Utc> {
    Utc.with_ymd_and_hms(2026, 3, 6, 9, 0, 0).unwrap()
}

fn edits() -> Vec<Edit> {
    let edit =
        |reason: &str, change| Edit { at: at(), by: "Ada".into(), reason: reason.into(), change };
    let contact = |number| EditChange::Contact {
        number,
        position_mm: Position(41.05),
        was_mm: Position(41.0),
    };
    let verdict = DataQuality::Rejected;
    let add = vec!["pilot".to_owned()];
    let remove = Vec::new();
    vec![
        edit("by eye", contact(1)),
        edit("hair on the probe", EditChange::Verdict { verdict }),
        edit("", EditChange::Tags { add, remove }),
        edit("by eye", contact(2)),
    ]
}

fn analyses() -> Vec<Analysis> {
    let analysis = |name: &str, what| Analysis {
        name: name.into(),
        at: at(),
        by: "Ada".into(),
        reason: "bump".into(),
        software_version: "0.1.0".into(),
        engine_version: 1,
        inputs: Vec::new(),
        what,
    };
    let mask = || AnalysisContent::Mask { left_out_s: vec![[1.0, 1.5]] };
    let fit =
        AnalysisContent::Fit { based_on: None, settings: "kelvin".into(), results: 1.5.into() };
    let calibration =
        AnalysisContent::Recalibration { calibration: "lab".into(), results: 0.5.into() };
    vec![
        analysis("stretch", mask()),
        analysis("mistake", mask()),
        analysis("mistake", AnalysisContent::Withdrawal),
        analysis("kelvin", fit),
        analysis("lab", calibration),
    ]
}

/// Two contacts in a session of three seconds.
fn contacts(rows: &[SampleRow]) -> Vec<LogEntry> {
    let contact = |order, after_sample: u64| LogEntry {
        kind: EntryKind::Decision,
        order,
        after_sample,
        now: rows[after_sample as usize].host,
        body: serde_json::json!({"effect": "record", "record": "contact_found", "position": 41.0}),
    };
    vec![contact(0, 700), contact(1, 1700)]
}

fn session(folder: &Path, log: &[u8]) {
    fs::create_dir_all(folder.join(ORIGINAL_FOLDER)).unwrap();
    fs::write(folder.join(LOG_FILE), log).unwrap();
    fs::write(folder.join(ORIGINAL_FOLDER).join("a.csv"), "t_s,F_N\n").unwrap();
    let id = manifest().session_id;
    for one in edits() {
        add_edit(folder, &id, &one).unwrap();
    }
    for one in analyses() {
        add_analysis(folder, &id, &one).unwrap();
    }
}

/// What a flipped bit takes, and what therefore is not carried.
#[derive(Debug, Default)]
struct Counts {
    samples: u32,
    first_samples: u32,
    decisions: u32,
}

#[test]
fn companions_with_the_same_meaning_are_copied_and_others_reported() {
    let rows = rows(3000, 75);
    let whole = log_bytes(&rows, &contacts(&rows), Some(end(Nanos::from_millis(3000))));
    let mut counts = Counts::default();
    for place in (0..whole.len()).step_by(whole.len() / 60) {
        let library = tempfile::tempdir().unwrap();
        let folder = library.path().join("a");
        let mut hurt = whole.clone();
        hurt[place] ^= 1;
        session(&folder, &hurt);
        let Ok(recovery) = recover(&folder, "1.2.3", at()) else {
            continue;
        };
        let copy = Session::open(&recovery.folder).unwrap();
        let missing = copy.manifest.recovered.unwrap().missing;
        let has_first = missing.gaps.iter().all(|gap| gap.after_sample > 0);
        let has_contacts = copy.entries.len() == 2;
        counts.samples += u32::from(has_first && has_contacts && !missing.gaps.is_empty());
        counts.first_samples += u32::from(!has_first);
        counts.decisions += u32::from(!has_contacts);
        assert_eq!(missing.entries > 0, !has_contacts, "{place}: {missing:?}");

        let id = &recovery.session_id;
        let remaining = Edits::read(&recovery.folder, id).unwrap().all;
        // Without an end the number of decisions is unknown.
        let is_sure = has_contacts && !missing.is_end_lost;
        let is_kept = |edit: &Edit| is_sure || !matches!(edit.change, EditChange::Contact { .. });
        let expected: Vec<Edit> = edits().into_iter().filter(is_kept).collect();
        assert_eq!(remaining, expected, "{place}: {missing:?}");
        let remaining = Analyses::read(&recovery.folder, id).unwrap().all;
        let is_kept = |one: &Analysis| match one.what {
            AnalysisContent::Mask { .. } | AnalysisContent::Withdrawal => has_first,
            AnalysisContent::Recalibration { .. } => is_sure,
            AnalysisContent::Fit { .. } | AnalysisContent::Material { .. } => false,
        };
        let expected: Vec<Analysis> = analyses().into_iter().filter(is_kept).collect();
        assert_eq!(remaining, expected, "{place}: {missing:?}");
        // The notes of the copy report the rest too.
        let note = &copy.notes[0];
        assert_eq!(recovery.salvage.missing, missing);
        for (words, is_reported) in [
            ("fit 'kelvin'", true),
            ("mask 'stretch'", !has_first),
            ("'mistake'", false),
            ("recalibration 'lab'", !is_sure),
            ("contact 1, made by Ada", !is_sure),
            ("contact 2, made by Ada", !is_sure),
            ("t_s counts", !has_first),
        ] {
            assert_eq!(note.contains(words), is_reported, "{place}: {words}: {note}");
        }
        let original = recovery.folder.join(ORIGINAL_FOLDER).join("a.csv");
        assert_eq!(fs::read(original).unwrap(), b"t_s,F_N\n");
    }
    let Counts { samples, first_samples, decisions } = counts;
    assert!(samples > 5 && first_samples > 0 && decisions > 1, "{counts:?}");
}

/// Of an interrupted session everything up to the last sample is there, so what was said of it goes with it.
#[test]
fn a_copy_of_an_interrupted_session_keeps_its_edits_but_those_of_contacts_it_lacks() {
    let library = tempfile::tempdir().unwrap();
    let folder = library.path().join("a");
    let rows = rows(3000, 76);
    let open = log_bytes(&rows, &contacts(&rows), None);
    session(&folder, &open[..open.len() * 45 / 100]);
    let recovery = recover(&folder, "1.2.3", at()).unwrap();
    let copy = Session::open(&recovery.folder).unwrap();
    assert_eq!(copy.entries.len(), 1, "the cut is elsewhere");
    let remaining = Edits::read(&recovery.folder, &recovery.session_id).unwrap();
    assert_eq!(remaining.all, edits()[..3]);
    assert!(copy.notes[0].contains("contact 2, made by Ada"), "{:?}", copy.notes);
}

#[test]
fn unreadable_edits_are_reported() {
    let library = tempfile::tempdir().unwrap();
    let folder = library.path().join("a");
    let rows = rows(500, 77);
    session(&folder, &log_bytes(&rows, &[], None));
    for file in ["edits.jsonl", "analyses.jsonl"] {
        let path = folder.join(file);
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, text.replacen("Ada", "Eve", 1)).unwrap();
    }
    let sentences = recover(&folder, "1.2.3", at()).unwrap().sentences(&folder);
    let copy = recovered_folder(&folder);
    assert!(!copy.join("edits.jsonl").exists());
    for what in ["edit", "analysis"] {
        let of_it = |one: &&String| one.contains(what) && one.contains("line 1");
        assert_eq!(sentences.iter().filter(of_it).count(), 1, "{sentences:?}");
    }
}
