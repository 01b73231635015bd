use crate::support::{end, log_bytes, open_bytes, rows};
use palpate_model::Nanos;
use palpate_model::rig::Phase;
use palpate_sessions::export::Beside;
use palpate_sessions::{ExportError, Session, export_csv, export_parquet, read_table};
use polars::prelude::{ParquetReader, SerReader};
use std::path::Path;
use std::process::Command;

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
    export_csv(&session, &Beside::default(), &path).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    let mut lines = text.lines();
    assert_eq!(
        lines.next(),
        Some("t_s,depth_mm,force_N,signal_V,counts,pulses,phase,cycle")
    );
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
    let kept: Vec<usize> = (0..session.rows.len())
        .filter(|&i| is_measured(session.rows[i].phase))
        .collect();
    assert_eq!(table.t.len(), kept.len());
    for (k, &i) in kept.iter().enumerate() {
        assert_eq!(table.t[k], time_of(&session, i));
        assert_eq!(Some(table.force[k]), session.rows[i].force);
        assert_eq!(Some(table.depth[k]), session.rows[i].depth);
        assert_eq!(table.is_unload[k], session.rows[i].phase == Phase::Unload);
    }
    let left_out = session.rows.len() - kept.len();
    assert_eq!(
        table.notes,
        [format!(
            "{left_out} rows outside ramp, hold and unload are left out"
        )]
    );
}

#[test]
fn parquet_holds_the_same_with_units() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("one.parquet");
    let session = session();
    export_parquet(&session, &Beside::default(), &path).unwrap();
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
    assert_eq!(value("palpate.record_version"), "2");

    let frame = reader.finish().unwrap();
    let column = |name: &str| frame.column(name).unwrap().clone();
    let names: Vec<String> = frame
        .get_column_names()
        .iter()
        .map(|name| name.to_string())
        .collect();
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
    let run = Command::new("python3")
        .args(["-c", SCRIPT])
        .arg(path)
        .output();
    let output = match run {
        Ok(output) => output,
        Err(err) => return println!("skipped: python3 does not run ({err})"),
    };
    let text = String::from_utf8_lossy(&output.stdout);
    if text.trim() == "no pyarrow" {
        return println!("skipped: python3 has no pyarrow");
    }
    let last = &session.rows[2999];
    let nulls = session
        .rows
        .iter()
        .filter(|row| row.force.is_none())
        .count();
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
    let found: serde_json::Value = serde_json::from_str(&text)
        .unwrap_or_else(|err| panic!("{err}: {}", String::from_utf8_lossy(&output.stderr)));
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
    std::fs::write(
        &path,
        log_bytes(&rows(1000, 42), &[], Some(end(Nanos::ZERO))),
    )
    .unwrap();
    let run = Command::new("python3")
        .args(["-c", SCRIPT])
        .arg(&path)
        .output();
    let output = match run {
        Ok(output) => output,
        Err(err) => return println!("skipped: python3 does not run ({err})"),
    };
    let text = String::from_utf8_lossy(&output.stdout);
    if text.trim() == "no mcap" {
        return println!("skipped: python3 has no mcap");
    }
    let found: serde_json::Value = serde_json::from_str(&text)
        .unwrap_or_else(|err| panic!("{err}: {}", String::from_utf8_lossy(&output.stderr)));
    let expected = serde_json::json!(["20260305T141507Z-0badcafe",
        // Of a second at 1 kHz with jitter one sample is shown every 20 ms.
        {"/manifest": 1, "/daq/block": 10, "/derived/block": 10, "/daq/view": 49, "/end": 1}]);
    assert_eq!(found, expected);
}

#[test]
fn exports_never_replace_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let session = session();
    type Export = fn(&Session, &Beside, &Path) -> Result<(), ExportError>;
    for (name, export) in [
        ("one.csv", export_csv as Export),
        ("one.parquet", export_parquet as Export),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, "mine").unwrap();
        let refusal = export(&session, &Beside::default(), &path).unwrap_err();
        assert!(matches!(refusal, ExportError::Exists { .. }), "{refusal}");
        assert_eq!(std::fs::read(&path).unwrap(), b"mine");
        let nowhere = folder.path().join("no/such/folder").join(name);
        assert!(matches!(
            export(&session, &Beside::default(), &nowhere),
            Err(ExportError::Io { .. })
        ));
    }
    // No temporary file is left behind.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
}
