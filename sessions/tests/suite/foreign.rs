//! Files of other programs: what is taken for what, what is refused, and the session that is made.
//!
//! The numbers are known by construction; the layouts are those cited in `docs/guide/import.md`.

use chrono::{TimeZone, Utc};
use palpate_model::metadata::SessionLabels;
use palpate_model::rig::Phase;
use palpate_sessions::{FolderError, ORIGINAL_FOLDER, Session};
use palpate_tables::import::{
    ForeignFile, ForeignPart, ForeignSample, ImportOptions, ImportTarget, StoreImportError,
    folder_name, open_foreign, parse_foreign, store_import,
};
use palpate_test_support::skip;
use std::fmt::Write;
use std::path::{Path, PathBuf};

fn detect_all() -> ImportOptions {
    ImportOptions::default()
}

/// Options as on the command line.
fn parse_options(options: &[(&str, &str)]) -> ImportOptions {
    let mut result = detect_all();
    for (option, value) in options {
        let text = *value;
        match *option {
            "column" => result.columns.push(text.parse().unwrap()),
            "unit" => result.units.push(text.parse().unwrap()),
            "zero" => result.zeros.push(text.parse().unwrap()),
            "skip" => result.skip.push(text.parse().unwrap()),
            "decimal" => result.decimal = Some(text.parse().unwrap()),
            "delimiter" => result.delimiter = Some(text.parse().unwrap()),
            "columns" => result.names = text.split(',').map(str::to_owned).collect(),
            "header-row" => result.header_row = Some(text.parse().unwrap()),
            "units-row" => result.units_row = Some(text.parse().unwrap()),
            "part" => result.parts.push(text.to_owned()),
            other => panic!("{other}"),
        }
    }
    result
}

fn read(text: &str, options: &ImportOptions) -> ForeignFile {
    parse_foreign("file.txt", text.as_bytes().to_vec(), options)
        .unwrap_or_else(|reason| panic!("{reason}\n{text}"))
}

fn refused(text: &str, options: &ImportOptions) -> String {
    match parse_foreign("file.txt", text.as_bytes().to_vec(), options) {
        Ok(read) => panic!("{text:?} was read as {:?}", read.parts),
        Err(reason) => reason,
    }
}

/// Time, depth and force of a part.
fn numbers(part: &ForeignPart) -> Vec<[f64; 3]> {
    let one = |sample: &ForeignSample| [sample.t, sample.depth.unwrap(), sample.force.unwrap()];
    part.samples.iter().map(one).collect()
}

fn reading(part: &ForeignPart, what: &str) -> String {
    let readings = &part.imported.readings;
    let one = readings.iter().find(|one| one.what == what);
    let one = one.unwrap_or_else(|| panic!("no reading of {what}: {readings:?}"));
    format!("{} ({})", one.found, one.how)
}

fn utf16(text: &str) -> Vec<u8> {
    let units = std::iter::once(0xfeff).chain(text.encode_utf16());
    units.flat_map(u16::to_le_bytes).collect()
}

#[test]
fn table_is_read_and_every_property_is_reported() {
    let text = "Sample;gel 3\nOperator;Ada\n\nPrüfzeit;Weg;Kraft;Spannung\ns;µm;mN;mV\n\
        0,0;0;0,3;1,5\n0,1;250;1.250,5;2,5\n0,2;500;2.500,75;3,5\n";
    let bytes: Vec<u8> = text.chars().map(|c| c as u8).collect();
    let read = parse_foreign("Zug.csv", bytes.clone(), &detect_all()).unwrap();
    let part = &read.parts[0];
    let expected = [[0.0, 0.0, 0.0003], [0.1, 0.25, 1.2505], [0.2, 0.5, 2.50075]];
    assert_eq!(numbers(part), expected);
    assert_eq!(part.samples[1].signal, Some(0.0025));
    assert_eq!(read.bytes, bytes);
    for (what, expected) in [
        ("layout", "table (detected)"),
        ("encoding", "windows-1252"),
        ("delimiter", "semicolon (detected)"),
        ("header", "line 4 (detected)"),
        ("units", "line 5 (detected)"),
        ("decimal sign", "'0,0' in line 6"),
        ("depth", "column 2 'Weg' in µm"),
        ("force", "column 3 'Kraft' in mN"),
    ] {
        let found = reading(part, what);
        assert!(found.contains(expected) && found.ends_with("(detected)"), "{found}");
    }
}

#[test]
fn options_override_detection() {
    let text = "time;z;up;load\n0;10,5;1;-2\n1;10,25;1;-3\n2;10;2;-4\n";
    let options = [
        ("column", "depth=-z"),
        ("column", "force=-4"),
        ("unit", "depth=mm"),
        ("unit", "force=gf"),
        ("unit", "time=ms"),
        ("zero", "depth=first"),
    ];
    let read = read(text, &parse_options(&options));
    let part = &read.parts[0];
    let gram = 0.009_806_65;
    let expected = [[0.0, 0.0, 2.0 * gram], [1e-3, 0.25, 3.0 * gram], [2e-3, 0.5, 4.0 * gram]];
    for (found, expected) in numbers(part).iter().zip(expected) {
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() <= 1e-16, "{found} {expected}");
        }
    }
    for (what, expected) in [("depth", "column 2 'z' in mm"), ("force", "column 4 'load' in gf")] {
        let found = reading(part, what);
        assert!(found.starts_with(expected) && found.ends_with("(told)"), "{found}");
    }
    // A file without names.
    let bare = "0 0,5 1\n1 0,75 2\n";
    let read_bare = |options: &[(&str, &str)]| numbers(&read_one(bare, &parse_options(options)));
    let expected = [[0.0, 0.5, 1.0], [1.0, 0.75, 2.0]];
    assert_eq!(read_bare(&[("columns", "t_s,x_mm,F_N")]), expected);
    let numbered = [
        ("columns", "a,b,c"),
        ("column", "time=1"),
        ("column", "depth=2"),
        ("column", "force=3"),
        ("unit", "depth=mm"),
        ("unit", "force=N"),
    ];
    assert_eq!(read_bare(&numbered), expected);
}

fn read_one(text: &str, options: &ImportOptions) -> ForeignPart {
    read(text, options).parts.remove(0)
}

#[test]
fn ambiguous_file_is_refused_with_a_question() {
    for (text, options, expected) in [
        ("t_s;x_mm;F_N\n1;1,234;5\n2;2,345;6\n", &[][..], "'1,234' in line 2"),
        ("t_s;x_mm;F_N\n0;0,5;1\n1;0.75;2\n", &[], "'0.75' in line 3"),
        ("t_s;x_mm;F_N\n0;0,5;1\n1;0.75;2\n", &[("decimal", "comma")], "line 3: the depth '0.75'"),
        ("t_s,Step time,x_mm,F_N\n0,0,0,0\n1,1,1,1\n", &[], "'t_s' and 'Step time'"),
        ("t_s,x_mm,F_furlong\n0,0,0\n1,1,1\n", &[], "'furlong'"),
        ("t_s,x_mm,force\n0,0,0\n1,1,1\n", &[], "N, mN"),
        ("t_s,x_mm\n0,0\n1,1\n", &[], "'t_s', 'x_mm'"),
        ("0,0,0\n1,1,1\n", &[], "no column names"),
        ("0,0,0\n1,1,1\n", &[("columns", "t_s,x_mm")], "3 columns"),
        ("t_s,x_mm,F_N\n0,0,0\n1,1,1\n", &[("column", "depth=y")], "line 1 has no column 'y'"),
        ("t_s,x_mm,F_N\n0,0,0\n1,1,1,9\n", &[], "column 4"),
        ("t_s,x_mm,F_N\n0,0,0\n1,1,one\n2,2,2\n", &[], "line 3: the force 'one'"),
        ("t_s,x_mm,F_N\n0,0,0\n1,,1\n2,2,2\n", &[], "line 3: the depth is missing"),
        ("t_s,x_mm,F_N\n0,0,0\n1,1,NaN\n2,2,2\n", &[], "line 3: the force is missing"),
        ("t_s,x_mm,F_N\n0,0,0\n0,1,1\n2,2,2\n", &[], "line 3: the time 0 s"),
        ("t_s,x_mm,F_N\n0,0,0\n2,1,1\n1,2,2\n", &[], "from 2 to 1 s"),
        ("t_s,x_mm,F_N\n0,0,0\n2,1,1\n1,2,2\n", &[("part", "x")], "'x'"),
        ("t_s,x_mm,F_N\n0,0,0\n", &[], "two rows"),
        ("nothing of use\n", &[], "two numbers"),
        ("t_s,x_mm,F_N\n0,0,0\n1,1,\"1\n", &[], "line 3: a quote"),
    ] {
        let reason = refused(text, &parse_options(options));
        assert!(reason.contains(expected), "{expected}: {text:?}: {reason}");
    }
    assert!(parse_foreign("f", Vec::new(), &detect_all()).is_err());
}

#[test]
fn skipped_rows_are_counted_and_gaps_are_reported() {
    let mut text = "t_s,x_mm,F_N\n".to_owned();
    for i in 0..50 {
        let t = 0.1 * f64::from(i);
        writeln!(text, "{t:.1},{},{}", 0.01 * t, 0.2 * t).unwrap();
    }
    text += "5.0,,1\n4.9,1,1\n4.9,1,1\n4.0,1,1\n5.5,1,1\n5.6,1,nan\n";
    let all = [("skip", "missing"), ("skip", "repeated"), ("skip", "backward")];
    let part = read_one(&text, &parse_options(&all));
    assert_eq!(part.samples.len(), 51);
    let expected = [
        ["2 rows without a value", "line 52"],
        ["2 rows with the time", "line 53"],
        ["1 rows with decreasing time", "line 55"],
        ["1 time step(s)", "after line 51, is 0.600000 s"],
    ];
    assert_eq!(part.imported.remarks.len(), expected.len());
    for (remark, facts) in part.imported.remarks.iter().zip(expected) {
        assert!(facts.iter().all(|fact| remark.contains(fact)), "{facts:?}: {remark}");
    }
    for (option, value) in all {
        let others: Vec<(&str, &str)> = all.into_iter().filter(|one| one.1 != value).collect();
        let reason = refused(&text, &parse_options(&others));
        assert!(reason.ends_with(&format!("'{value}'")), "{option} {value}: {reason}");
    }
    let turned = read_one("t_s,x_mm,F_N\n0,0,0\n1,1,-1\n2,2,-2\n", &detect_all());
    assert!(
        turned.imported.remarks[0].contains("invert its sign"),
        "{:?}",
        turned.imported.remarks
    );
    // At rest an inverted force rises, for longer than it fell.
    let row = |i: i32| {
        let (t, x) = (f64::from(i), f64::from(i.min(20)));
        format!("{t},{x},{}\n", if i < 20 { -t } else { -400.0 / t })
    };
    let relaxing: String = (0..200).map(row).collect();
    let relaxing = read_one(&format!("t_s,x_mm,F_N\n{relaxing}"), &detect_all());
    assert!(relaxing.imported.remarks[0].contains("invert its sign"));
    let uneven = read_one("t_s,x_mm,F_N\n0,0,0\n1,1,1\n10,2,2\n100,2,2\n", &detect_all());
    assert!(uneven.imported.remarks[0].contains("1.000000 to 90.000000 s"));
}

/// A file as a Mach-1 writes it: a command without data, one with, and one with two ramps.
fn mach1() -> String {
    let info = |name: &str| {
        format!(
            "<INFO>\r\nTime:\t10:37:09.27\r\nDate:\tMonday, May 15, 2023\r\nLoad Cell Type:\tSingle axis\r\n<END INFO>\r\n<{name}>\r\n"
        )
    };
    let header = "Time, s\tPosition (z), mm\tPosition (x), mm\tFz, gf\r\n";
    let mut text = format!("<Mach-1 File>\r\n{}Load cell:\tz\r\n", info("Zero Load"));
    write!(text, "{}Velocity, mm/s:\t0.1\r\n<DATA>\r\n{header}", info("Move Relative")).unwrap();
    for i in 0..5 {
        let t = 0.01 * f64::from(i);
        write!(text, "{t:.3}\t{:.4}\t2.0000\t{:.4}\r\n", 10.0 + t, 100.0 * t).unwrap();
    }
    write!(text, "<END DATA>\r\n{}<DATA>\r\n{header}", info("Stress Relaxation")).unwrap();
    text += "0.000\t10.0400\t2.0000\t4.0000\r\n0.010\t10.1400\t2.0000\t14.0000\r\n<divider>\r\n";
    text += "0.000\t10.1400\t2.0000\t13.0000\r\n0.010\t10.2400\t2.0000\t29.0000\r\n<END DATA>\r\n";
    text
}

#[test]
fn mach1_blocks_become_parts_in_newtons() {
    let read = read(&mach1(), &detect_all());
    let names: Vec<&str> = read.parts.iter().map(|part| part.imported.part.as_str()).collect();
    let expected = ["Move Relative 1", "Stress Relaxation 1 ramp 1", "Stress Relaxation 1 ramp 2"];
    assert_eq!(names, expected);
    let last = numbers(&read.parts[2]);
    assert_eq!(last[1][..2], [0.01, 10.24]);
    assert!((last[1][2] - 29.0 * 0.009_806_65).abs() < 1e-15);
    let facts = &read.parts[0].imported.facts;
    assert!(facts.contains(&("Velocity, mm/s".into(), "0.1".into())), "{facts:?}");
    assert_eq!(reading(&read.parts[0], "layout"), "mach-1 (detected)");
    let by_number = self::read(&mach1(), &parse_options(&[("part", "3")]));
    assert_eq!(by_number.parts.len(), 1);
    assert_eq!(numbers(&by_number.parts[0]), last);
}

/// An Optics11 indenter's file: micronewtons and nanometres, and beside them columns that are not read.
#[test]
fn optics11_curves_have_their_facts() {
    let mut text = "Date\t01/02/2020\tTime\t11:03\tStatus\tOK\ngel 3\nk (N/m)\t0.510\n\nTip radius (um)\t10.000\n\
        E[v=0.50] (Pa)\t35156.063\n\nTime (s)\tLoad (uN)\tIndentation (nm)\tCantilever (nm)\tPiezo (nm)\tAuxiliary\n"
        .to_owned();
    for i in 0..4 {
        let i = f64::from(i);
        writeln!(text, "{:.3}\t{:.3}\t{:.1}\t1\t2\t3", 0.001 * i, 0.125 * i, 50.0 * i).unwrap();
    }
    let read = read(&text, &detect_all());
    assert_eq!(reading(&read.parts[0], "layout"), "optics11 (detected)");
    let last = *numbers(&read.parts[0]).last().unwrap();
    let expected = [0.003, 1.5e-4, 3.75e-7];
    for (found, expected) in last.iter().zip(expected) {
        assert!((found / expected - 1.0).abs() < 1e-12, "{last:?}");
    }
    let facts = &read.parts[0].imported.facts;
    for (name, value) in [("Tip radius (um)", "10.000"), ("Specimen", "gel 3"), ("Time", "11:03")] {
        assert!(facts.contains(&(name.into(), value.into())), "{name}: {facts:?}");
    }
}

/// A rheometer's export: intervals, blank rows, a row of units, decimal commas.
fn rheometer() -> String {
    let mut text =
        "Project:\tgels\r\n\r\nTest:\tgel 3\r\n\r\nResult:\tSqueeze 1\r\n\r\n".to_owned();
    for interval in 1..=2 {
        write!(
            text,
            "Interval and data points:\t{interval}\t3\r\nInterval data:\tPoint No.\tTime\tGap\tNormal Force\tStatus\r\n\
             \t\t\t\t\t\r\n\t\t[s]\t[mm]\t[N]\t\r\n"
        )
        .unwrap();
        for i in 0..3 {
            let t = 10.0 * f64::from(interval) + 0.5 * f64::from(i);
            let line =
                format!("\t{}\t{t:.3}\t{:.4}\t{:.3E}\tMV-\r\n", i + 1, 2.5 - 0.1 * t, 0.2 * t);
            text += &line.replace('.', ",");
        }
        text += "\r\n";
    }
    text
}

#[test]
fn rheometer_intervals_in_utf16_become_parts() {
    let options = parse_options(&[("column", "depth=-Gap")]);
    let read = parse_foreign("gel.csv", utf16(&rheometer()), &options).unwrap();
    assert_eq!(read.parts.len(), 2);
    let part = &read.parts[1];
    assert_eq!(part.imported.part, "Squeeze 1 interval 2");
    for (found, t) in numbers(part).iter().zip([20.0, 20.5, 21.0]) {
        let expected = [t, 0.1 * t - 2.5, 0.2 * t];
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
    }
    assert!(reading(part, "encoding").starts_with("UTF-16LE"));
    assert!(reading(part, "decimal sign").starts_with("comma, from '"));
    // The header of the second interval and its units, two lines below.
    assert_eq!(
        (reading(part, "header"), reading(part, "units")),
        ("line 16 (detected)".into(), "line 18 (detected)".into())
    );
    let reason = parse_foreign("gel.csv", utf16(&rheometer()), &detect_all()).unwrap_err();
    assert!(
        reason.contains("part 'Squeeze 1 interval 1': ") && reason.contains("depth"),
        "{reason}"
    );
}

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

#[test]
fn sheets_with_a_time_become_parts_in_both_formats() {
    for name in ["zwick.xlsx", "zwick.xls"] {
        let read = open_foreign(&data(name), &detect_all()).unwrap_or_else(|err| panic!("{err}"));
        let names: Vec<&str> = read.parts.iter().map(|part| part.imported.part.as_str()).collect();
        assert_eq!(names, ["P002-1", "P002-2"], "{name}");
        assert_eq!(read.left_out.len(), 2, "{:?}", read.left_out);
        assert!(read.left_out[0].contains("Paramètres"), "{:?}", read.left_out);
        // Both sheets hold what make_workbooks.py wrote, in units of their own.
        for part in &read.parts {
            assert_eq!(part.samples.len(), 20);
            let facts =
                [("Paramètres: Vitesse d'essai", "10 mm/min"), ("Paramètres: Précharge", "0.05 N")];
            let facts = facts.map(|(key, value)| (key.to_owned(), value.to_owned()));
            assert_eq!(part.imported.facts, facts, "{name}");
            for (i, found) in numbers(part).iter().enumerate() {
                let i = i as f64;
                for (found, expected) in found.iter().zip([0.1 * i, 0.25 * i, 0.5 + 0.125 * i * i])
                {
                    assert!((found - expected).abs() < 1e-12, "{name}: {found} {expected}");
                }
            }
        }
        let force = reading(&read.parts[1], "force");
        assert!(force.starts_with("column 3 'Force standard' in mN"), "{force}");
    }
}

#[test]
fn import_makes_a_session_and_stores_the_original() {
    let folder = tempfile::tempdir().unwrap();
    let original = mach1().into_bytes();
    let read = parse_foreign("Gel 3 (first).txt", original.clone(), &detect_all()).unwrap();
    let part = &read.parts[2];
    let name = folder_name(&part.imported);
    assert_eq!(name, "Gel-3--first--Stress-Relaxation-1-ramp-2");
    let at = folder.path().join(name);
    let make = || {
        let target = ImportTarget {
            folder: &at,
            original: &original,
            session_id: "20260305T141507Z-0badcafe".into(),
            at: Utc.with_ymd_and_hms(2026, 3, 5, 14, 15, 7).unwrap(),
            software_version: "0.1.0",
            labels: SessionLabels { specimen: "gel 3".into(), ..SessionLabels::default() },
        };
        store_import(part, target)
    };
    make().unwrap();
    assert_eq!(
        std::fs::read(at.join(ORIGINAL_FOLDER).join("Gel 3 (first).txt")).unwrap(),
        original
    );
    let session = Session::open(&at).unwrap();
    assert_eq!(session.manifest.imported.as_ref(), Some(&part.imported));
    assert_eq!(session.manifest.specimen, "gel 3");
    assert!(session.manifest.rig.is_none() && session.manifest.calibration.is_null());
    assert_eq!(session.end.as_ref().unwrap().samples, part.samples.len() as u64);
    assert!(session.notes[0].contains("Gel 3 (first).txt"), "{:?}", session.notes);
    for (row, sample) in session.rows.iter().zip(&part.samples) {
        // Nothing that the file does not have is made up.
        assert_eq!((row.volts, row.pulses, row.counts), (None, None, None));
        assert_eq!(
            (row.depth, row.force, row.phase),
            (sample.depth, sample.force, Phase::Imported)
        );
        assert_eq!(session.manifest.time_of(row.tick as i64).0.to_bits(), sample.t.to_bits());
    }
    assert!(matches!(make(), Err(StoreImportError::Folder(FolderError::NotEmpty { .. }))));
}

#[test]
fn times_that_no_session_holds_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (text, expected) in [
        ("t_s,x_mm,F_N\n0,0,0\n1e7,1,1\n", "106 days"),
        ("t_s,x_mm,F_N\n0,0,0\n1e-13,1,1\n", "picosecond"),
    ] {
        let part = read_one(text, &detect_all());
        let target = ImportTarget {
            folder: &folder.path().join("no"),
            original: text.as_bytes(),
            session_id: "id".into(),
            at: Utc.with_ymd_and_hms(2026, 3, 5, 14, 15, 7).unwrap(),
            software_version: "0.1.0",
            labels: SessionLabels::default(),
        };
        let refusal = store_import(&part, target).unwrap_err().to_string();
        assert!(refusal.contains(expected), "{refusal}");
        assert!(!folder.path().join("no").exists());
    }
}

#[test]
fn real_recordings_are_read_as_another_reader_reads_them() {
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let path = shared.join("perineal_P002_load_hold_unload.csv");
    if skip::lacks_file(&path) {
        return;
    }
    let text = std::fs::read_to_string(&path).unwrap();
    // Columns t_s, F_N, x_mm; the reader of tables for fits goes another way to the numbers.
    let table = palpate_tables::parse_table(&text, None).unwrap();
    let part = open_foreign(&path, &detect_all()).unwrap().parts.remove(0);
    let expected: Vec<[f64; 3]> =
        (0..table.t.len()).map(|i| [table.t[i], table.depth[i], table.force[i]]).collect();
    assert_eq!(numbers(&part), expected);
}
