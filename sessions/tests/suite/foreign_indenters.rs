//! Exports of indenters as text: Optics11's in all versions that were seen, and Anton Paar's.

use palpate_tables::import::{ForeignFile, ImportOptions, parse_foreign};
use std::fmt::Write;

fn read(text: &str, layout: &str) -> ForeignFile {
    let read = parse_foreign("curve.txt", text.into(), &ImportOptions::default())
        .unwrap_or_else(|reason| panic!("{reason}\n{text}"));
    assert_eq!(read.parts[0].imported.format, layout);
    read
}

fn fact<'a>(read: &'a ForeignFile, part: usize, key: &str) -> Option<&'a str> {
    let facts = &read.parts[part].imported.facts;
    facts.iter().find(|(one, _)| one == key).map(|(_, value)| value.as_str())
}

/// Time in s, depth in mm and force in N of a part.
fn numbers(read: &ForeignFile, part: usize) -> Vec<[f64; 3]> {
    let samples = read.parts[part].samples.iter();
    samples.map(|one| [one.t, one.depth.unwrap(), one.force.unwrap()]).collect()
}

fn assert_near(found: &[[f64; 3]], expected: impl Fn(f64) -> [f64; 3]) {
    for (index, found) in found.iter().enumerate() {
        for (found, expected) in found.iter().zip(expected(index as f64)) {
            assert!((found - expected).abs() < 1e-15, "{index}: {found} {expected}");
        }
    }
}

/// A displacement-controlled indentation of the first Chiaros, with six columns; as python-chiaro reads it.
fn optics11(columns: &str) -> String {
    let mut text = "Date\t10/09/2018\tTime\t11:03:05\tStatus\tOK\r\ngel 3\r\nScan (#)\t1\tX (#)\t2\tY (#)\t3\tIndentation (#)\t4\r\n\
        X-position (um)\t100.0\r\nPiezo position (nm) (Measured)\t2000.0\r\n\r\nk (N/m)\t0.510\r\n\r\nTip radius (um)\t10.000\r\n\
        Calibration factor\t2.500\r\nWavelength (nm)\t1560.000\r\nAuto find surface\tNot used in single indent mode\r\n\r\n\
        Piezo Indentation Sweep Settings (Relative to piezo position setpoint at start):\r\n\
        D[Z1] (nm)\t5000.000\tt[1] (s)\t2.000\r\nD[Z2] (nm)\tNaN\tt[2] (s)\tNaN\r\n\r\n\
        E[eff] (Pa)\t1400.000\r\nE[v=0.500] (Pa)\t1050.000\r\n\r\nTime (s)\tLoad (uN)\tIndentation (nm)\t"
        .to_owned();
    writeln!(text, "{columns}\r").unwrap();
    let beside = columns.split('\t').map(|_| "1.0").collect::<Vec<_>>().join("\t");
    for i in 0..4 {
        let i = f64::from(i);
        writeln!(text, "{:.4}\t{:.5}\t{:.3}\t{beside}\r", 0.001 * i, 0.125 * i, 50.5 * i).unwrap();
    }
    text
}

fn optics11_numbers(i: f64) -> [f64; 3] {
    [0.001 * i, 50.5e-6 * i, 0.125e-6 * i]
}

#[test]
fn every_version_of_optics11_gives_its_facts_and_numbers() {
    let six = optics11("Cantilever (nm)\tPiezo (nm)\tAuxiliary");
    let five = optics11("Cantilever (nm)\tPiezo (nm)");
    // Computers with a decimal comma write it everywhere.
    let comma = six.replace('.', ",");
    // Later versions state device and control, and when the steps began.
    let later = six
        .replace(
            "Scan (#)",
            "Device:\tPiuma\r\nSoftware version:\t3.4.1\r\nControl mode:\tIndentation\r\nScan (#)",
        )
        .replace(
            "\r\nE[eff]",
            "\r\nSMDuration (s)\t0.5\r\nStep absolute start times (s)\t0.5,1.5,2.5\r\nE[eff]",
        );
    for text in [&six, &five, &comma, &later] {
        let read = read(text, "optics11");
        assert_near(&numbers(&read, 0), optics11_numbers);
        let plain = |key: &str| fact(&read, 0, key).map(|value| value.replace(',', "."));
        for (key, value) in [
            ("Specimen", "gel 3"),
            ("Status", "OK"),
            ("Indentation (#)", "4"),
            ("k (N/m)", "0.510"),
            ("Tip radius (um)", "10.000"),
            ("D[Z1] (nm)", "5000.000"),
            ("E[eff] (Pa)", "1400.000"),
        ] {
            assert_eq!(plain(key).as_deref(), Some(value), "{key}");
        }
    }
    let later = read(&later, "optics11");
    for (key, value) in
        [("Control mode", "Indentation"), ("Step absolute start times (s)", "0.5,1.5,2.5")]
    {
        assert_eq!(fact(&later, 0, key), Some(value), "{key}");
    }
}

/// The file beside the recording of a dynamic measurement lists its frequencies and has no curve.
#[test]
fn list_of_a_dynamic_measurement_is_refused() {
    let text = "Time 1.0 Freq 1.0 Periods 5 Amp 100 Relaxation 2.0\nTime 8.0 Freq 2.0 Periods 5 Amp 100 Relaxation 2.0\n";
    let reason = parse_foreign("gel_DMAinfo.txt", text.into(), &ImportOptions::default());
    let reason = reason.unwrap_err();
    assert!(reason.contains("no column names") || reason.contains("is recognised"), "{reason}");
}

/// An indentation as the reader of NHT3 exports expects it.
fn indentation(serial: u32, scale: f64) -> String {
    let mut text = format!(
        "Indentation\r\nDate: 05.03.2026\r\nTime: 14:15:07\r\nX position: 12,345 mm\r\nNHT S/N: {serial}\r\n\
         Acquisition rate : 10,0 [Hz]\r\nPause : 30,0 s\r\n\tMethod : Oliver & Pharr\r\nEIT = 0,021 GPa\r\n\r\nMeasured values\r\n\
         Time\tPd\tFn\tFn ref\tSegment\r\n[s]\t[µm]\t[mN]\t[mN]\t\r\n"
    );
    for i in 0..4 {
        let i = f64::from(i);
        let row =
            format!("{:.1}\t{:.4}\t{:.5}\t{:.5}\t2\r\n", 0.1 * i, scale * i, 0.25 * i, 0.25 * i);
        text += &row.replace('.', ",");
    }
    text
}

#[test]
fn anton_paar_indentations_become_parts_with_their_facts() {
    let text = indentation(101, 0.5) + "\r\n" + &indentation(102, 0.75);
    let read = read(&text, "anton-paar");
    let names: Vec<&str> = read.parts.iter().map(|part| part.imported.part.as_str()).collect();
    assert_eq!(names, ["Indentation 1", "Indentation 2"]);
    for (part, serial, scale) in [(0, "101", 0.5), (1, "102", 0.75)] {
        assert_near(&numbers(&read, part), |i| [0.1 * i, scale * 1e-3 * i, 0.25e-3 * i]);
        for (key, value) in [("NHT S/N", serial), ("EIT", "0,021 GPa"), ("X position", "12,345 mm")]
        {
            assert_eq!(fact(&read, part, key), Some(value), "{key}");
        }
    }
    let one = self::read(&indentation(101, 0.5), "anton-paar");
    assert_eq!(one.parts[0].imported.part, "");
}

/// A Bioindenter writes units behind the names, a line without anything below them, and its maker's own moduli above.
#[test]
fn bioindenter_has_units_behind_its_names() {
    let text = "Indentation\n\n+ TTX - UNHT Bio S/N: 1000136751 settings\n   Fn contact : 25 µN\n\n\
        Analysis n # 1\n\n   Method :\tHertz\n\n   EHz=\t755.57 \tkPa\n\nMeasured values\n\
        Time (s)\tPd (µm)\tFn (µN)\tFnRef (µN)\tSegmentID\n\n\
        0\t0\t0\t5.3546\t1\n0.1\t0.1811\t0.4911\t5.3551\t1\n0.2\t0.3606\t1.1353\t5.3608\t1\n";
    let found = read(text, "anton-paar");
    let forces = [0.0, 0.4911e-6, 1.1353e-6];
    let depths = [0.0, 0.1811e-3, 0.3606e-3];
    assert_near(&numbers(&found, 0), |i| [0.1 * i, depths[i as usize], forces[i as usize]]);
    assert_eq!(fact(&found, 0, "Fn contact"), Some("25 µN"));
    assert_eq!(fact(&found, 0, "EHz"), Some("755.57 kPa"));
}

#[test]
fn anton_paar_file_cut_off_after_any_byte_is_refused_or_has_the_first_rows() {
    let text = indentation(101, 0.5) + &indentation(102, 0.75);
    let whole = read(&text, "anton-paar");
    for length in (1..text.len()).filter(|length| text.is_char_boundary(*length)) {
        let cut = parse_foreign("nht.txt", text[..length].into(), &ImportOptions::default());
        let Ok(cut) = cut else { continue };
        for (part, expected) in cut.parts.iter().zip(&whole.parts) {
            let certain = part.samples.len() - 1;
            assert_eq!(part.samples[..certain], expected.samples[..certain], "{length}");
        }
    }
    let short = "Measured values\nTime\tPd\tFn\n";
    let options =
        ImportOptions { format: Some("anton-paar".parse().unwrap()), ..ImportOptions::default() };
    let reason = parse_foreign("nht.txt", format!("1\t2\n{short}").into(), &options).unwrap_err();
    assert_eq!(reason, "it has no rows of numbers");
}

/// A step of TRIOS has its time under several names, and an axial test its gap in µm.
#[test]
fn trios_step_is_read_from_the_column_time() {
    let text = "Filename\tgel\nInstrument serial number\t5332-0001\nNormal Stress Constant\t3000.00 Pa/N\n[step]\nAxial - 1\n\
        Torque\tStep time\tAxial force\tGap\tRun time\tTime\nµN.m\tmin\tN\tµm\tmin\tmin\n\
        1\t0\t0\t1000\t2\t0\n1\t0.5\t0.25\t900\t2.5\t0.5\n1\t1\t1\t800\t3\t1\n";
    let options =
        ImportOptions { columns: vec!["depth=-Gap".parse().unwrap()], ..ImportOptions::default() };
    let read = parse_foreign("gel.txt", text.into(), &options).unwrap();
    assert_eq!(numbers(&read, 0), [[0.0, -1.0, 0.0], [30.0, -0.9, 0.25], [60.0, -0.8, 1.0]]);
    assert_eq!(fact(&read, 0, "Instrument serial number"), Some("5332-0001"));
}
