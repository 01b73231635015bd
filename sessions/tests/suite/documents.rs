//! Sessions as Bluesky documents, read back without palpate's code for them. `scripts/other-readers` reads them by the
//! package event-model.

use crate::support::{end, entries, log_bytes, open_bytes, rows};
use palpate_model::Nanos;
use palpate_model::rig::{Phase, SampleAge};
use palpate_sessions::{EndRecord, SampleRow, Session};
use palpate_tables::ExportError;
use palpate_tables::export::{ExtraColumns, LogFacts, SampleSelection, TableExport};
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::Path;

const SAMPLES: usize = 3000;

fn session(end: Option<EndRecord>) -> Session {
    let mut rows = rows(SAMPLES, 41);
    // A value that is there but for one sample, extremes of a double, and a sample whose age is known.
    rows[5].counts = None;
    rows[6].volts = Some(1e-300);
    rows[7].volts = Some(-0.0);
    rows[8].volts = Some(f64::from_bits(1));
    rows[9].age = Some(SampleAge { by: Nanos(2_000_000), within: Nanos(1000) });
    for row in &mut rows {
        row.pulses = None;
    }
    open_bytes(&log_bytes(&rows, &entries(&rows, 500), end)).unwrap()
}

fn export(session: &Session, selection: &SampleSelection, path: &Path) -> Result<u64, ExportError> {
    let table = TableExport {
        manifest: &session.manifest,
        notes: &session.notes,
        extra: &ExtraColumns::default(),
        selection,
    };
    let log = LogFacts { entries: &session.entries, end: session.end.as_ref() };
    table.write_documents(path, log, &mut |visit| {
        // As a log hands them out, some at a time.
        session.rows.chunks(77).for_each(visit);
        Ok(())
    })
}

/// The documents of a file by their names. What Python reads as no number is null here.
fn documents(path: &Path) -> Vec<(String, Value)> {
    let text = std::fs::read_to_string(path).unwrap();
    let line = |line: &str| serde_json::from_str(&line.replace("NaN", "null")).unwrap();
    text.lines().map(line).collect()
}

fn of_name<'d>(documents: &'d [(String, Value)], name: &str) -> Vec<&'d Value> {
    documents.iter().filter(|one| one.0 == name).map(|one| &one.1).collect()
}

/// All values of a column of a stream's pages, such as `/time` or `/data/force_N`.
fn column(documents: &[(String, Value)], descriptor: &Value, pointer: &str) -> Vec<Value> {
    let pages = of_name(documents, "event_page").into_iter();
    let pages = pages.filter(|page| page["descriptor"] == descriptor["uid"]);
    pages.flat_map(|page| page.pointer(pointer).unwrap().as_array().unwrap().clone()).collect()
}

/// The same double to the bit, and null only where nothing is known.
fn assert_same(name: &str, found: &[Value], rows: &[SampleRow], of: fn(&SampleRow) -> Option<f64>) {
    assert_eq!(found.len(), rows.len());
    for (index, (value, row)) in found.iter().zip(rows).enumerate() {
        let bits = |value: Option<f64>| value.map(f64::to_bits);
        assert_eq!(bits(value.as_f64()), bits(of(row)), "{name} of sample {index}");
    }
}

#[test]
fn samples_are_events_with_every_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("one.jsonl");
    let session = session(Some(end(Nanos(4_000_000_000))));
    let count = export(&session, &SampleSelection::default(), &path).unwrap();
    assert_eq!(count, SAMPLES as u64);
    let documents = documents(&path);
    let descriptors = of_name(&documents, "descriptor");
    let (primary, log) = (descriptors[0], descriptors[1]);
    assert_eq!((&primary["name"], &log["name"]), (&"primary".into(), &"entries".into()));
    let of = |key: &str| column(&documents, primary, &format!("/data/{key}"));
    assert_same("depth_mm", &of("depth_mm"), &session.rows, |row| row.depth);
    assert_same("force_N", &of("force_N"), &session.rows, |row| row.force);
    assert_same("signal_V", &of("signal_V"), &session.rows, |row| row.volts);
    assert_same("counts", &of("counts"), &session.rows, |row| row.counts.map(f64::from));
    assert_same("cycle", &of("cycle"), &session.rows, |row| Some(row.cycle.into()));
    let (first, tick) = (session.rows[0].tick, session.manifest.tick().0);
    for (index, row) in session.rows.iter().enumerate() {
        assert_eq!(of("t_s")[index].as_f64(), Some((row.tick - first) as f64 * tick));
        if index > 20 {
            break;
        }
    }
    let phases: Vec<Value> = session.rows.iter().map(|row| row.phase.name().into()).collect();
    assert_eq!(of("phase"), phases);
    let numbers: Vec<Value> = (0..SAMPLES).map(Value::from).collect();
    assert_eq!(of("sample"), numbers);
    // 2026-03-05 14:15:07 UTC, as `date -u -d @1772720107` has it.
    let wall = |nanos: u64| (1_772_720_107_000_000_000 + i128::from(nanos)) as f64 / 1e9;
    let times = column(&documents, primary, "/time");
    let taken = column(&documents, primary, "/timestamps/force_N");
    for (index, row) in session.rows.iter().enumerate() {
        assert_eq!(times[index].as_f64(), Some(wall(row.host.0)), "sample {index}");
        let age = if index == 9 { 2_000_000 } else { 0 };
        assert_eq!(taken[index].as_f64(), Some(wall(row.host.0 - age)), "sample {index}");
    }
    let bodies = column(&documents, log, "/data/body");
    let recorded: Vec<Value> =
        session.entries.iter().map(|one| one.body.to_string().into()).collect();
    assert!(!recorded.is_empty());
    assert_eq!(bodies, recorded);
}

#[test]
fn documents_refer_to_each_other_and_describe_their_events() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("one.jsonl");
    let session = session(Some(end(Nanos(4_000_000_000))));
    export(&session, &SampleSelection::default(), &path).unwrap();
    let documents = documents(&path);
    let names: Vec<&str> = documents.iter().map(|one| one.0.as_str()).collect();
    let pages = ["event_page"; 3];
    let expected = [&["start", "descriptor"][..], &pages, &["descriptor", "event_page", "stop"]];
    assert_eq!(names, expected.concat());
    let (start, stop) = (&documents[0].1, &documents.last().unwrap().1);
    let mut ids = BTreeSet::new();
    for (name, document) in &documents {
        let of_events = document["uid"].as_array();
        let own = of_events.cloned().unwrap_or_else(|| vec![document["uid"].clone()]);
        for id in own {
            assert!(ids.insert(id.as_str().unwrap().to_owned()), "{id} of a {name} is used twice");
        }
        if matches!(name.as_str(), "descriptor" | "stop") {
            assert_eq!(document["run_start"], start["uid"]);
        }
        assert_no_dot(document);
    }
    for descriptor in of_name(&documents, "descriptor") {
        let keys = keys(&descriptor["data_keys"]);
        let numbers = column(&documents, descriptor, "/seq_num");
        assert_eq!(numbers, (1..=numbers.len()).map(Value::from).collect::<Vec<_>>());
        assert_eq!(stop["num_events"][descriptor["name"].as_str().unwrap()], numbers.len());
        for page in of_name(&documents, "event_page") {
            if page["descriptor"] == descriptor["uid"] {
                assert_eq!(self::keys(&page["data"]), keys);
                assert_eq!(self::keys(&page["timestamps"]), keys);
                assert!(page["seq_num"].as_array().unwrap().len() <= 1024);
            }
        }
        let objects = descriptor["object_keys"].as_object().unwrap();
        let of_objects = objects.values().flat_map(|names| names.as_array().unwrap());
        let of_objects: BTreeSet<String> =
            of_objects.map(|name| name.as_str().unwrap().to_owned()).collect();
        assert_eq!(of_objects, keys);
    }
    // Nothing is known of the pulses; of the counts one is missing, and no whole number can say so.
    let data_keys = &of_name(&documents, "descriptor")[0]["data_keys"];
    assert_eq!(data_keys.get("pulses"), None);
    assert_eq!(
        (&data_keys["counts"]["dtype"], &data_keys["cycle"]["dtype"]),
        (&"number".into(), &"integer".into())
    );
    assert_eq!(data_keys["force_N"]["units"], "N");
    assert_eq!(start["specimen_temperature_c"], 36.6);
    assert_eq!((&stop["exit_status"], &stop["outcome"]), (&"success".into(), &"finish".into()));
    assert_eq!(stop["time"].as_f64().unwrap() - start["time"].as_f64().unwrap(), 4.0);
}

fn keys(object: &Value) -> BTreeSet<String> {
    object.as_object().unwrap().keys().cloned().collect()
}

/// Event-model allows neither dots nor slashes in keys.
fn assert_no_dot(value: &Value) {
    match value {
        Value::Object(fields) => {
            for (key, value) in fields {
                assert!(!key.is_empty() && !key.contains(['.', '/']), "{key}");
                assert_no_dot(value);
            }
        }
        Value::Array(values) => values.iter().for_each(assert_no_dot),
        _ => {}
    }
}

#[test]
fn same_export_has_the_same_bytes_and_another_selection_another_run() {
    let folder = tempfile::tempdir().unwrap();
    let whole = session(Some(end(Nanos(4_000_000_000))));
    let written = |session: &Session, selection: &SampleSelection, name: &str| {
        let path = folder.path().join(name);
        let count = export(session, selection, &path).unwrap();
        (std::fs::read(&path).unwrap(), documents(&path), count)
    };
    let all = SampleSelection::default();
    let hold = SampleSelection {
        phases: vec![Phase::Hold],
        every: Some(10),
        ..SampleSelection::default()
    };
    let first = written(&whole, &all, "first.jsonl");
    assert!(first.0 == written(&whole, &all, "again.jsonl").0);
    let part = written(&whole, &hold, "hold.jsonl");
    let held = whole.rows.iter().filter(|row| row.phase == Phase::Hold).count();
    assert_eq!(part.2, held.div_ceil(10) as u64);
    assert_eq!(part.1[0].1["palpate"]["selection"]["phases"], serde_json::json!(["hold"]));
    let interrupted = written(&session(None), &all, "interrupted.jsonl");
    let stop = &interrupted.1.last().unwrap().1;
    assert_eq!(stop["exit_status"], "fail");
    let ids: BTreeSet<String> = [&first, &part, &interrupted]
        .map(|one| one.1[0].1["uid"].as_str().unwrap().to_owned())
        .into();
    assert_eq!(ids.len(), 3);
    // Without a selected sample it is a run without events.
    let none = SampleSelection { cycles: vec![9999], ..SampleSelection::default() };
    let none = written(&whole, &none, "none.jsonl");
    assert_eq!((none.2, &none.1.last().unwrap().1["num_events"]["primary"]), (0, &0.into()));
    let taken = export(&whole, &all, &folder.path().join("first.jsonl"));
    assert!(matches!(taken, Err(ExportError::Exists { .. })));
}

#[test]
fn outcome_of_a_run_is_its_exit_status() {
    let folder = tempfile::tempdir().unwrap();
    for (outcome, status) in [
        ("finish", "success"),
        ("stop", "success"),
        ("imported", "success"),
        ("abort", "abort"),
        ("halt", "abort"),
        ("interlock", "fail"),
        ("interrupted", "fail"),
    ] {
        let end = EndRecord { outcome: outcome.into(), reason: "why".into(), ..end(Nanos(0)) };
        let path = folder.path().join(outcome);
        export(&session(Some(end)), &SampleSelection::default(), &path).unwrap();
        let stop = documents(&path).pop().unwrap().1;
        assert_eq!((&stop["exit_status"], &stop["reason"]), (&status.into(), &"why".into()));
    }
}
