use crate::support::{end, log_bytes, open_bytes, rows};
use palpate_model::Nanos;
use palpate_sessions::atomic;
use palpate_sessions::edits::DataQuality;
use palpate_sessions::{EntryKind, LogEntry, Session, SessionOutline};
use palpate_tables::export::ExportError;
use palpate_tables::lake::{
    FitFile, FitState, LakeAddition, LakeError, LakeQuality, LakeResult, add_session, find_fit,
    is_lake, list_models, list_sessions, read_fit, read_session, store_fit,
};
use std::fs;
use std::path::{Path, PathBuf};

fn session() -> Session {
    let mut rows = rows(3000, 43);
    rows[5].counts = None;
    rows[6].volts = Some(1e-300);
    rows[7].volts = None;
    rows[8].pulses = None;
    rows[9].force = Some(-0.0);
    let entries = [
        LogEntry {
            kind: EntryKind::Input,
            order: 0,
            after_sample: 3,
            now: Nanos(17),
            body: serde_json::json!({"start": 0.1 + 0.2, "why": "µ \"q\"\n"}),
        },
        LogEntry {
            kind: EntryKind::Decision,
            order: 1,
            after_sample: 4,
            now: Nanos(18),
            body: serde_json::json!({"effect": "record", "value": 1e-300}),
        },
    ];
    open_bytes(&log_bytes(&rows, &entries, Some(end(Nanos(5_000_000_000))))).unwrap()
}

fn put(lake: &Path, session: &Session, quality: LakeQuality) -> Result<LakeAddition, ExportError> {
    let outline = SessionOutline {
        path: session.path.clone(),
        manifest: session.manifest.clone(),
        samples: session.rows.len() as u64,
        entries: session.entries.clone(),
        end: session.end.clone(),
        notes: session.notes.clone(),
        auxiliary: session.auxiliary.clone(),
    };
    add_session(lake, &outline, quality, &mut |visit| {
        visit(&session.rows);
        Ok(())
    })
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let all = walkdir::WalkDir::new(folder).sort_by_file_name();
    let all = all.into_iter().map(|one| one.unwrap().into_path());
    all.filter(|path| path.is_file()).collect()
}

#[test]
fn a_session_comes_out_of_a_lake_as_it_went_in() {
    let folder = tempfile::tempdir().unwrap();
    let lake = folder.path();
    let session = session();
    assert!(!is_lake(lake));
    assert!(matches!(list_sessions(lake), Err(LakeError::NoLake { .. })));
    let verdict = Some((DataQuality::Rejected, "slipped"));
    let added = put(lake, &session, LakeQuality { quality: verdict }).unwrap();
    assert!(!added.was_there);
    let id = &session.manifest.session_id;
    let expected = [
        ("checksums", "json"),
        ("events", "parquet"),
        ("samples", "parquet"),
        ("sessions", "parquet"),
    ];
    let expected = expected
        .map(|(part, ending)| lake.join(format!("v1/{part}/rig=sim/month=2026-03/{id}.{ending}")));
    assert_eq!(files(lake), expected);
    assert_eq!(added.samples, expected[2]);

    let listed = list_sessions(lake).unwrap();
    assert_eq!(listed.len(), 1);
    assert_eq!(listed[0].id, *id);
    let (mut back, rejection) = read_session(lake, &listed[0]).unwrap();
    assert_eq!(rejection.as_deref(), Some("slipped"));
    back.path.clone_from(&session.path);
    assert!(back == session, "the session is another one");
    let sign = back.rows[9].force.unwrap().is_sign_negative();
    assert!(sign, "minus zero lost its sign");
}

#[test]
fn files_of_a_lake_never_change() {
    let folder = tempfile::tempdir().unwrap();
    let lake = folder.path();
    let session = session();
    put(lake, &session, LakeQuality::default()).unwrap();
    let before: Vec<Vec<u8>> = files(lake).iter().map(|path| fs::read(path).unwrap()).collect();
    // What a killed writer left.
    let samples = &files(lake)[2];
    let name = samples.file_name().unwrap().to_string_lossy();
    let abandoned = samples.with_file_name(format!(".{name}.abcdef.palpate.tmp"));
    fs::write(&abandoned, vec![7; 1 << 20]).unwrap();
    assert!(put(lake, &session, LakeQuality::default()).unwrap().was_there);
    assert_eq!(atomic::remove_leftovers(lake, usize::MAX), [abandoned]);
    let mut other = session.clone();
    other.rows[100].force = Some(1.0);
    let refusal = put(lake, &other, LakeQuality::default()).unwrap_err();
    assert!(matches!(refusal, ExportError::Different { .. }), "{refusal}");
    let after: Vec<Vec<u8>> = files(lake).iter().map(|path| fs::read(path).unwrap()).collect();
    assert!(before == after, "something changed or was left behind");
}

#[test]
fn a_name_or_a_rig_never_leads_out_of_the_lake() {
    let folder = tempfile::tempdir().unwrap();
    let lake = folder.path().join("lake");
    let mut session = session();
    session.manifest.rig.as_mut().unwrap().name = "../../Rig 1".into();
    put(&lake, &session, LakeQuality::default()).unwrap();
    assert_eq!(list_sessions(&lake).unwrap().len(), 1);
    assert!(files(&lake)[0].to_string_lossy().contains("rig=..%2F..%2FRig%201/"));
    session.manifest.session_id = "../../evil".into();
    let refusal = put(&lake, &session, LakeQuality::default()).unwrap_err();
    assert!(matches!(refusal, ExportError::BadName { .. }), "{refusal}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn a_damaged_lake_is_refused_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let lake = folder.path();
    put(lake, &session(), LakeQuality::default()).unwrap();
    let one = list_sessions(lake).unwrap().remove(0);
    let files = files(lake);
    assert!(files.len() >= 2, "{files:?}");
    for file in files {
        let whole = fs::read(&file).unwrap();
        for cut in [0, 4, whole.len() / 2, whole.len() - 2] {
            fs::write(&file, &whole[..cut]).unwrap();
            let refusal = read_session(lake, &one).unwrap_err();
            assert!(matches!(refusal, LakeError::Bad { .. }), "{refusal}");
        }
        fs::remove_file(&file).unwrap();
        let refusal = read_session(lake, &one).unwrap_err();
        assert!(matches!(refusal, LakeError::Io { .. }), "{refusal}");
        fs::write(&file, whole).unwrap();
    }
    read_session(lake, &one).unwrap();
}

#[test]
fn a_fit_is_kept_once_and_made_with_other_settings_refused() {
    let folder = tempfile::tempdir().unwrap();
    let settings = serde_json::json!({"fixed": ["f_offset=0"]});
    let others = serde_json::json!({"fixed": []});
    let file = FitFile {
        lake: folder.path(),
        result: LakeResult::Fit,
        model: "kelvin/3",
        session_id: "20260305T141507Z-0badcafe",
        settings: &settings,
    };
    assert_eq!(find_fit(&file).unwrap(), FitState::Missing);
    store_fit(&file, &serde_json::json!({"r2": 0.5})).unwrap();
    assert_eq!(find_fit(&file).unwrap(), FitState::There);
    let read = |model: &str| read_fit::<serde_json::Value>(file.lake, model, file.session_id);
    let stored = read("kelvin/3").unwrap().unwrap();
    assert_eq!((&stored.settings, &stored.fit), (&settings, &serde_json::json!({"r2": 0.5})));
    assert!(read("kelvin").unwrap().is_none());
    assert_eq!(list_models(file.lake, LakeResult::Fit).unwrap(), ["kelvin%2F3"]);
    assert!(list_models(file.lake, LakeResult::Modulus).unwrap().is_empty());
    let path = folder.path().join("v1/fits/model=kelvin%2F3/20260305T141507Z-0badcafe.json");
    assert_eq!(files(folder.path()), [path]);
    let other = FitFile { settings: &others, ..file };
    assert!(matches!(find_fit(&other), Err(ExportError::Different { .. })));
    assert!(store_fit(&other, &serde_json::json!({"r2": 0.5})).is_err());
    let evil = FitFile { session_id: "../evil", ..file };
    assert!(matches!(store_fit(&evil, &1), Err(ExportError::BadName { .. })));
}
