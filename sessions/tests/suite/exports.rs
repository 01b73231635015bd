use crate::support::{end, log_bytes, open_bytes, rows};
use palpate_model::Nanos;
use palpate_model::rig::Phase;
use palpate_sessions::{RECORD_VERSION, SampleRow, Session};
use palpate_tables::export::{
    ExtraColumns, SampleSelection, TableExport, TableFormat, dictionary_path,
};
use palpate_tables::{ExportError, read_table};
use palpate_test_support::skip::{self, TestNeed, skip};
use polars_io::prelude::{ParquetReader, SerReader};
use std::path::Path;
use std::process::Command;

const CSV: TableFormat = TableFormat::Csv(b',');

fn export(
    session: &Session,
    format: TableFormat,
    selection: &SampleSelection,
    path: &Path,
) -> Result<u64, ExportError> {
    let table = TableExport {
        manifest: &session.manifest,
        notes: &session.notes,
        extra: &ExtraColumns::default(),
        selection,
    };
    table.write(format, path, &mut |visit| {
        visit(&session.rows);
        Ok(())
    })
}

fn session() -> Session {
    let mut rows = rows(3000, 41);
    rows[5].counts = None;
    rows[6].volts = Some(1e-300);
    open_bytes(&log_bytes(&rows, &[], Some(end(Nanos::ZERO)))).unwrap()
}

fn time_of(session: &Session, i: usize) -> f64 {
    (session.rows[i].tick - session.rows[0].tick) as f64 * session.manifest.tick().0
}

#[test]
fn csv_holds_every_digit_and_reads_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("one.csv");
    let session = session();
    assert_eq!(export(&session, CSV, &SampleSelection::default(), &path).unwrap(), 3000);
    let text = std::fs::read_to_string(&path).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("t_s,depth_mm,force_N,signal_V,counts,pulses,phase,cycle"));
    for (i, line) in lines.enumerate() {
        let row = &session.rows[i];
        let cells: Vec<&str> = line.split(',').collect();
        let number = |cell: &str| (!cell.is_empty()).then(|| cell.parse::<f64>().unwrap());
        assert_eq!(number(cells[0]), Some(time_of(&session, i)));
        assert_eq!(number(cells[1]), row.depth);
        assert_eq!(number(cells[2]), row.force);
        assert_eq!(number(cells[3]), row.volts);
        assert_eq!(number(cells[4]), row.counts.map(f64::from));
        assert_eq!(cells[5], row.pulses.unwrap().to_string());
        assert_eq!(cells[6], row.phase.name());
        assert_eq!(cells[7], row.cycle.to_string());
    }
    assert_eq!(text.lines().count(), 3001);

    let table = read_table(&path, None).unwrap();
    let is_measured = |phase| matches!(phase, Phase::Ramp | Phase::Hold | Phase::Unload);
    let remaining: Vec<usize> =
        (0..session.rows.len()).filter(|&i| is_measured(session.rows[i].phase)).collect();
    assert_eq!(table.t.len(), remaining.len());
    for (k, &i) in remaining.iter().enumerate() {
        assert_eq!(table.t[k], time_of(&session, i));
        assert_eq!(Some(table.force[k]), session.rows[i].force);
        assert_eq!(Some(table.depth[k]), session.rows[i].depth);
        assert_eq!(table.is_unload[k], session.rows[i].phase == Phase::Unload);
    }
    let left_out = session.rows.len() - remaining.len();
    assert_eq!(table.notes.len(), 1);
    assert!(table.notes[0].starts_with(&format!("{left_out} rows")));
}

#[test]
fn table_in_memory_holds_the_same_with_units() {
    let session = session();
    let collect = |selection: &SampleSelection| {
        let table = TableExport {
            manifest: &session.manifest,
            notes: &session.notes,
            extra: &ExtraColumns::default(),
            selection,
        };
        let mut feed = |visit: &mut dyn FnMut(&[SampleRow])| {
            // As a log hands them out, some at a time.
            session.rows.chunks(77).for_each(visit);
            Ok(())
        };
        table.collect(&mut feed).unwrap()
    };
    let table = collect(&SampleSelection::default());
    let names = table.names().join(" ");
    assert_eq!(names, "t_s depth_mm force_N signal_V counts pulses phase cycle");
    assert_eq!((table.rows(), table.numbers("phase"), table.numbers("none")), (3000, None, None));
    let (t, counts) = (table.numbers("t_s").unwrap(), table.numbers("counts").unwrap());
    let force = table.numbers("force_N").unwrap();
    for (i, row) in session.rows.iter().enumerate() {
        assert_eq!(t[i], time_of(&session, i));
        let known = |cell: f64| Some(cell).filter(|cell| !cell.is_nan());
        assert_eq!((known(force[i]), known(counts[i])), (row.force, row.counts.map(f64::from)));
    }
    let id = ("palpate.session".to_owned(), session.manifest.session_id.clone());
    assert!(table.metadata().contains(&id));
    // A table without rows still has its columns, and a stream over it is no error.
    let none = collect(&SampleSelection { cycles: vec![9999], ..SampleSelection::default() });
    assert_eq!((none.rows(), none.names().len()), (0, 8));
    drop((none.stream(true), table.stream(false)));
}

#[test]
fn parquet_holds_the_same_with_units() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("one.parquet");
    let session = session();
    let all = SampleSelection::default();
    export(&session, TableFormat::Parquet, &all, &path).unwrap();
    assert_eq!(value_of_hash(&session).len(), 64);
    let mut reader = ParquetReader::new(std::fs::File::open(&path).unwrap());
    let metadata = reader.get_metadata().unwrap().clone();
    let pairs = metadata.key_value_metadata().clone().unwrap();
    let value = |key: &str| {
        let pair = pairs.iter().find(|pair| pair.key == key);
        pair.and_then(|pair| pair.value.clone()).unwrap()
    };
    let units: serde_json::Value = serde_json::from_str(&value("palpate.columns")).unwrap();
    let expected = serde_json::json!({"t_s": "s", "depth_mm": "mm", "force_N": "N",
        "signal_V": "V", "counts": "1", "pulses": "1", "phase": "", "cycle": "1"});
    assert_eq!(units, expected);
    assert_eq!(value("palpate.session"), session.manifest.session_id);
    assert_eq!(value("palpate.software"), "0.1.0");
    assert_eq!(value("palpate.record_version"), RECORD_VERSION.to_string());
    assert_eq!(value("palpate.table_version"), "1");
    assert_eq!(value("palpate.calibration_sha256"), value_of_hash(&session));

    let frame = reader.finish().unwrap();
    let column = |name: &str| frame.column(name).unwrap().clone();
    let names: Vec<String> = frame.get_column_names().iter().map(|name| name.to_string()).collect();
    let expected = "t_s depth_mm force_N signal_V counts pulses phase cycle";
    assert_eq!(names.join(" "), expected);
    let (depth, force) = (column("depth_mm"), column("force_N"));
    let (signal, counts) = (column("signal_V"), column("counts"));
    let (t, phase) = (column("t_s"), column("phase"));
    for (i, row) in session.rows.iter().enumerate() {
        assert_eq!(t.f64().unwrap().get(i), Some(time_of(&session, i)));
        assert_eq!(depth.f64().unwrap().get(i), row.depth);
        assert_eq!(force.f64().unwrap().get(i), row.force);
        assert_eq!(signal.f64().unwrap().get(i), row.volts);
        assert_eq!(counts.i32().unwrap().get(i), row.counts);
        assert_eq!(phase.str().unwrap().get(i), Some(row.phase.name()));
    }
    python_agrees(&path, &session);
}

/// SHA-256 of the calibration, as every record of the library has it.
fn value_of_hash(session: &Session) -> String {
    let calibration = &session.manifest.calibration;
    palpate_sessions::text::sha256(calibration.to_string().as_bytes())
}

/// What a script of Python's says of a file, as JSON. Where Python or a package of it is not installed it says so, and
/// nothing is compared.
fn python(script: &str, path: &Path) -> Option<serde_json::Value> {
    if skip::lacks_program("python3") {
        return None;
    }
    let run = Command::new("python3").args(["-c", script]).arg(path).output();
    let output = run.unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    if let Some(package) = text.trim().strip_prefix("no ") {
        skip(TestNeed::Python(package), "python3 does not import it");
        return None;
    }
    let found = serde_json::from_str(&text);
    Some(found.unwrap_or_else(|err| panic!("{err}: {}", String::from_utf8_lossy(&output.stderr))))
}

/// Another implementation reads the same, where one is installed.
fn python_agrees(path: &Path, session: &Session) {
    const SCRIPT: &str = "
import json, sys
try:
    import pyarrow.parquet as pq
except ImportError:
    print('no pyarrow'); sys.exit(0)
t = pq.read_table(sys.argv[1])
m = t.schema.metadata
assert pq.read_metadata(sys.argv[1]).metadata[b'palpate.columns'] == m[b'palpate.columns']
print(json.dumps([t.num_rows, str(t['counts'].type), str(t['cycle'].type), str(t['phase'].type), json.loads(m[b'palpate.columns'])['force_N'],
    m[b'palpate.session'].decode(), t['force_N'].null_count, t['counts'].null_count,
    t['signal_V'][2999].as_py(), t['phase'][2999].as_py(), t['t_s'][2999].as_py()]))
";
    let Some(found) = python(SCRIPT, path) else {
        return;
    };
    let last = &session.rows[2999];
    let nulls = session.rows.iter().filter(|row| row.force.is_none()).count();
    let expected = serde_json::json!([
        3000,
        "int32",
        "uint32",
        "string",
        "N",
        session.manifest.session_id,
        nulls,
        1,
        last.volts,
        last.phase.name(),
        time_of(session, 2999)
    ]);
    assert_eq!(found, expected);
}

#[test]
fn python_reads_the_log_itself() {
    const SCRIPT: &str = "
import json, sys
try:
    from mcap.reader import make_reader
except ImportError:
    print('no mcap'); sys.exit(0)
with open(sys.argv[1], 'rb') as file:
    reader = make_reader(file, validate_crcs=True)
    topics = {}
    for schema, channel, message in reader.iter_messages():
        topics[channel.topic] = topics.get(channel.topic, 0) + 1
        if channel.topic == '/manifest':
            session = json.loads(message.data)['session_id']
print(json.dumps([session, topics]))
";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("000.mcap");
    std::fs::write(&path, log_bytes(&rows(1000, 42), &[], Some(end(Nanos::ZERO)))).unwrap();
    let Some(found) = python(SCRIPT, &path) else {
        return;
    };
    let expected = serde_json::json!(["20260305T141507Z-0badcafe",
        // Of a second at 1 kHz with jitter one sample is shown every 20 ms.
        {"/manifest": 1, "/daq/block": 10, "/derived/block": 10, "/daq/view": 49, "/end": 1}]);
    assert_eq!(found, expected);
}

#[test]
fn exports_never_replace_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let session = session();
    for (name, format) in
        [("one.csv", CSV), ("one.parquet", TableFormat::Parquet), ("one.arrow", TableFormat::Arrow)]
    {
        let path = folder.path().join(name);
        let all = SampleSelection::default();
        std::fs::write(&path, "mine").unwrap();
        let refusal = export(&session, format, &all, &path).unwrap_err();
        assert!(matches!(refusal, ExportError::Exists { .. }), "{refusal}");
        assert_eq!(std::fs::read(&path).unwrap(), b"mine");
        let nowhere = folder.path().join("no/such/folder").join(name);
        assert!(matches!(export(&session, format, &all, &nowhere), Err(ExportError::Io { .. })));
        // Nor an existing dictionary.
        let path = folder.path().join(format!("two.{name}"));
        std::fs::write(dictionary_path(&path), "mine").unwrap();
        let refusal = export(&session, format, &all, &path).unwrap_err();
        assert!(matches!(refusal, ExportError::Exists { .. }), "{refusal}");
        assert!(!path.exists());
    }
    // No temporary file is left behind.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 6);
}

/// The samples of a CSV file, cell by cell, without its header.
fn cells(path: &Path) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(path).unwrap();
    let lines = text.lines().skip(1);
    lines.map(|line| line.split(',').map(String::from).collect()).collect()
}

#[test]
fn a_selection_is_what_a_plain_filter_finds() {
    let folder = tempfile::tempdir().unwrap();
    let session = session();
    let found = |selection: &SampleSelection, name: &str| -> Vec<usize> {
        let path = folder.path().join(selection.file_name(name, "csv"));
        let written = export(&session, CSV, selection, &path).unwrap();
        let cells = cells(&path);
        assert_eq!(cells.len() as u64, written);
        cells.iter().map(|row| row[0].parse().unwrap()).collect()
    };
    let filtered = |takes: &dyn Fn(usize, &SampleRow) -> bool| -> Vec<usize> {
        let rows = session.rows.iter().enumerate();
        rows.filter(|(i, row)| takes(*i, row)).map(|(i, _)| i).collect()
    };
    let numbers = SampleSelection {
        columns: vec!["sample".into(), "force_N".into()],
        ..SampleSelection::default()
    };
    let phases = [session.rows[10].phase, session.rows[2000].phase];
    let by_phase = SampleSelection { phases: phases.into(), ..numbers.clone() };
    let expected = filtered(&|_, row| phases.contains(&row.phase));
    assert!(!expected.is_empty() && expected.len() < 3000);
    assert_eq!(found(&by_phase, "phase"), expected);

    let cycle = session.rows[1500].cycle;
    let by_cycle = SampleSelection { cycles: vec![cycle], ..numbers.clone() };
    let expected = filtered(&|_, row| row.cycle == cycle);
    assert!(!expected.is_empty() && expected.len() < 3000);
    assert_eq!(found(&by_cycle, "cycle"), expected);

    let (from, to) = (time_of(&session, 700), time_of(&session, 2100));
    let by_time = SampleSelection { from_s: Some(from), to_s: Some(to), ..numbers.clone() };
    let within = |i: usize| (from..=to).contains(&time_of(&session, i));
    assert_eq!(found(&by_time, "time"), filtered(&|i, _| within(i)));

    // Thinned after the selection, and the name and the first column say so.
    let thinned = SampleSelection { every: Some(7), ..by_time };
    let expected: Vec<usize> = filtered(&|i, _| within(i)).into_iter().step_by(7).collect();
    assert_eq!(found(&thinned, "thin"), expected);
    let text = std::fs::read_to_string(folder.path().join("thin.every7.csv")).unwrap();
    assert!(text.starts_with("sample_every_7,sample,force_N\n"), "{text:.60}");

    let nothing = SampleSelection { from_s: Some(1e9), ..numbers };
    assert_eq!(found(&nothing, "nothing"), [0usize; 0]);
    let text = std::fs::read_to_string(folder.path().join("nothing.csv")).unwrap();
    assert_eq!(text, "sample,force_N\n");
    let unknown = SampleSelection { columns: vec!["force".into()], ..SampleSelection::default() };
    let path = folder.path().join("unknown.csv");
    let refusal = export(&session, CSV, &unknown, &path).unwrap_err();
    assert!(refusal.to_string().contains("force_N"), "{refusal}");
    assert!(!path.exists());
}

#[test]
fn text_that_looks_like_a_formula_is_harmless_and_numbers_stay_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session();
    session.rows.truncate(2);
    session.rows[1].force = Some(-1.5);
    for (hostile, expected) in [
        ("=1+1", "'=1+1"),
        ("+41 44", "'+41 44"),
        ("-2", "'-2"),
        ("@SUM(A1)", "'@SUM(A1)"),
        ("\tx", "'\tx"),
        ("\rx", "\"'\rx\""),
        ("=\"a\";b", "\"'=\"\"a\"\";b\""),
        ("liver 3", "liver 3"),
    ] {
        session.manifest.specimen = hostile.into();
        let selection = SampleSelection {
            columns: vec!["specimen".into(), "force_N".into()],
            from_s: Some(time_of(&session, 1)),
            ..SampleSelection::default()
        };
        let path = folder.path().join("one.csv");
        export(&session, TableFormat::Csv(b';'), &selection, &path).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(text, format!("specimen;force_N\n{expected};-1.5\n"));
        std::fs::remove_file(dictionary_path(&path)).unwrap();
        std::fs::remove_file(path).unwrap();
    }
}

#[test]
fn dictionary_describes_every_column_of_the_table() {
    let folder = tempfile::tempdir().unwrap();
    let mut session = session();
    session.notes.push("a | b\nc".into());
    for (name, selection) in [
        ("all.csv", SampleSelection::default()),
        (
            "some.csv",
            SampleSelection {
                columns: vec!["status".into(), "t_s".into()],
                every: Some(100),
                ..SampleSelection::default()
            },
        ),
    ] {
        let path = folder.path().join(name);
        export(&session, CSV, &selection, &path).unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        let dictionary = std::fs::read_to_string(dictionary_path(&path)).unwrap();
        let rows: Vec<Vec<&str>> = dictionary
            .lines()
            .filter(|line| line.starts_with("| "))
            .skip(1)
            .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
            .collect();
        let names: Vec<&str> = rows.iter().map(|row| row[0]).collect();
        assert_eq!(names, header);
        // Every column has a type, a meaning and an origin.
        assert!(rows.iter().all(|row| row.len() == 5 && !row[2..].contains(&"")));
        assert!(dictionary.contains("a \\| b c"), "{dictionary}");
        assert_eq!(dictionary.contains("one of every 100 "), selection.every.is_some());
    }
}

#[test]
fn another_reader_finds_the_same_in_arrow() {
    const SCRIPT: &str = "
import json, sys
try:
    import pyarrow as pa
except ImportError:
    print('no pyarrow'); sys.exit(0)
t = pa.ipc.open_file(sys.argv[1]).read_all()
m = t.schema.metadata
print(json.dumps([t.num_rows, t.column_names, json.loads(m[b'palpate.columns'])['force_N'], m[b'palpate.calibration_sha256'].decode(),
    t['force_N'].to_pylist(), t['phase'].to_pylist(), t['pulses'].to_pylist(), t['t_s'].to_pylist()]))
";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("one.arrow");
    let session = session();
    export(&session, TableFormat::Arrow, &SampleSelection::default(), &path).unwrap();
    let Some(found) = python(SCRIPT, &path) else {
        return;
    };
    fn each<T: serde::Serialize>(
        session: &Session,
        of: impl Fn(usize, &SampleRow) -> T,
    ) -> serde_json::Value {
        let rows = session.rows.iter().enumerate();
        let all: Vec<T> = rows.map(|(i, row)| of(i, row)).collect();
        serde_json::to_value(all).unwrap()
    }
    let names = "t_s depth_mm force_N signal_V counts pulses phase cycle";
    let expected = serde_json::json!([
        3000,
        names.split(' ').collect::<Vec<_>>(),
        "N",
        value_of_hash(&session),
        each(&session, |_, row| row.force),
        each(&session, |_, row| row.phase.name()),
        each(&session, |_, row| row.pulses),
        each(&session, |i, _| time_of(&session, i)),
    ]);
    let text = found.to_string();
    assert!(found == expected, "{text:.400}");
}
