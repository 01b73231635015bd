//! Raw data of Instron's Bluehill: the layouts are those of public files (`docs/guide/import.md`), the numbers are known
//! by construction.

use palpate_tables::import::{ForeignFile, ImportOptions, parse_foreign};
use std::fmt::Write;

fn read(text: &str, options: &ImportOptions) -> Result<ForeignFile, String> {
    parse_foreign("Specimen_RawData_1.csv", text.as_bytes().to_vec(), options)
}

fn detected(text: &str) -> ForeignFile {
    let read =
        read(text, &ImportOptions::default()).unwrap_or_else(|reason| panic!("{reason}\n{text}"));
    let layout = &read.parts[0].imported.readings[0];
    assert_eq!(
        (layout.what.as_str(), layout.found.as_str(), layout.how.as_str()),
        ("layout", "bluehill", "detected")
    );
    read
}

fn refused(text: &str) -> String {
    let options =
        ImportOptions { format: Some("bluehill".parse().unwrap()), ..ImportOptions::default() };
    match read(text, &options) {
        Ok(read) => panic!("{text:?} was read as {:?}", read.parts),
        Err(reason) => reason,
    }
}

/// Time in s, depth in mm and force in N of a part.
fn numbers(read: &ForeignFile, part: usize) -> Vec<[f64; 3]> {
    let samples = &read.parts[part].samples;
    let one = |i: usize| [samples[i].t, samples[i].depth.unwrap(), samples[i].force.unwrap()];
    (0..samples.len()).map(one).collect()
}

fn names(read: &ForeignFile) -> Vec<&str> {
    read.parts.iter().map(|part| part.imported.part.as_str()).collect()
}

fn fact<'a>(read: &'a ForeignFile, part: usize, key: &str) -> Option<&'a str> {
    let facts = &read.parts[part].imported.facts;
    let found = facts.iter().find(|(one, _)| one == key);
    found.map(|(_, value)| value.as_str())
}

/// One specimen as Bluehill 3 writes it, every value quoted.
fn specimen(label: &str, first: u32) -> String {
    let mut text = format!(
        "Test : Rate 1,\"15.00000\",mm/min\r\nTest : Load cell,\"2530-100N\"\r\n\
         Specimen properties : Specimen label,\"{label}\"\r\nNotes,\"\"\r\n\r\n\
         Time,Extension,Load,Cycle count\r\n(s),(mm),(N),\r\n"
    );
    for i in 0..4 {
        let (t, n) = (f64::from(i) * 0.1, f64::from(first + i));
        write!(text, "\"{t:.5}\",\"{:.5}\",\"{:.5}\",\"0\"\r\n", 0.25 * n, 1250.5 * n).unwrap();
    }
    text
}

fn expected(first: u32) -> Vec<[f64; 3]> {
    let one = |i: u32| {
        let n = f64::from(first + i);
        [[0.0, 0.1, 0.2, 0.3][i as usize], 0.25 * n, 1250.5 * n]
    };
    (0..4).map(one).collect()
}

#[test]
fn specimen_is_read_with_what_the_file_says_of_it() {
    let read = detected(&specimen("gel 3", 0));
    assert_eq!((names(&read), numbers(&read, 0)), (vec!["gel 3"], expected(0)));
    assert_eq!(fact(&read, 0, "Test : Rate 1"), Some("15.00000 mm/min"));
    assert_eq!(fact(&read, 0, "Test : Load cell"), Some("2530-100N"));
    assert_eq!(fact(&read, 0, "Notes"), None);
    let reading = |what: &str| {
        let readings = &read.parts[0].imported.readings;
        let one = readings.iter().find(|one| one.what == what);
        one.unwrap().found.clone()
    };
    assert_eq!((reading("header"), reading("units")), ("line 6".into(), "line 7".into()));
    assert_eq!(reading("force"), "column 3 'Load' in N");
    // A specimen without a label has no name.
    assert_eq!(names(&detected(&specimen("", 0))), [""]);
}

#[test]
fn specimens_of_one_file_are_parts_of_their_own() {
    let bare = "Time,Extension,Load\n(s),(mm),(N)\n0,1,2\n1,2,3\n";
    let text = specimen("a", 0)
        + "\r\n"
        + &specimen("b", 7)
        + &specimen("a", 2)
        + "Specimen 4\n"
        + bare
        + bare;
    let read = detected(&text);
    assert_eq!(names(&read), ["a", "b", "a 2", "Specimen 4", "specimen 5"]);
    assert_eq!(numbers(&read, 1), expected(7));
    assert_eq!(numbers(&read, 2), expected(2));
    assert_eq!(numbers(&read, 4), [[0.0, 1.0, 2.0], [1.0, 2.0, 3.0]]);
    let options = ImportOptions { parts: vec!["b".into()], ..ImportOptions::default() };
    assert_eq!(names(&self::read(&text, &options).unwrap()), ["b"]);
}

#[test]
fn other_languages_and_units_are_read() {
    let polish = "Test : Tempo 1;\"15,00000\";mm/min\n\nGodzina;Przemieszczenie;Obciążenie\n(min);(cm);(kN)\n\
        \"0,00000\";\"0,00746\";\"1,25000\"\n\"0,50000\";\"0,02761\";\"2,50000\"\n";
    let read = detected(polish);
    assert_eq!(numbers(&read, 0), [[0.0, 0.0746, 1250.0], [30.0, 0.2761, 2500.0]]);
    let chinese = "时间,位移,载荷,压缩应变 (位移),循环计数\n(s),(mm),(N),(%),\n0,0,-0.5,0,0\n0.1,0.25,0.5,0.05,0\n";
    assert_eq!(numbers(&detected(chinese), 0), [[0.0, 0.0, -0.5], [0.1, 0.25, 0.5]]);
    for names in ["Zeit;Traversenweg;Last", "Tiempo;Extensión;Carga"] {
        let text =
            format!("{names}\n(s);(mm);(N)\n\"0,0\";\"0,5\";\"1,25\"\n\"0,1\";\"0,75\";\"2,5\"\n");
        assert_eq!(numbers(&detected(&text), 0), [[0.0, 0.5, 1.25], [0.1, 0.75, 2.5]], "{names}");
    }
}

/// Bluehill Universal: results first, units behind the names.
const UNIVERSAL: &str = "Results Table 1\n,Maximum Force,Note\n,(N),\n1,12.5,good\nMean,12.5,\n\nRaw Data\n\
    Time (s),Displacement (mm),Force (N),Compressive strain (Displacement) (%)\n0,0,1,0\n0.5,2,\"1,250.25\",0.1\n";

#[test]
fn results_are_facts_and_units_may_stand_behind_names() {
    let read = detected(UNIVERSAL);
    assert_eq!(numbers(&read, 0), [[0.0, 0.0, 1.0], [0.5, 2.0, 1250.25]]);
    assert_eq!(fact(&read, 0, "Results Table 1, 1: Maximum Force"), Some("12.5 N"));
    assert_eq!(fact(&read, 0, "Results Table 1, 1: Note"), Some("good"));
    assert_eq!(fact(&read, 0, "Results Table 1, Mean: Maximum Force"), Some("12.5 N"));
}

#[test]
fn extension_and_its_compressive_twin_are_a_question() {
    let twins = "Time,Extension,Compressive extension,Compressive load\n(s),(mm),(mm),(N)\n0,0,0,1\n1,-1,1,2\n";
    let reason = read(twins, &ImportOptions::default()).unwrap_err();
    assert!(
        reason.contains("columns 'Extension' and 'Compressive extension' could both be the depth"),
        "{reason}"
    );
    let options = ImportOptions {
        columns: vec!["depth=Compressive extension".parse().unwrap()],
        ..ImportOptions::default()
    };
    let read = read(twins, &options).unwrap();
    assert_eq!(numbers(&read, 0), [[0.0, 0.0, 1.0], [1.0, 1.0, 2.0]]);
}

#[test]
fn damaged_files_are_refused_with_the_line() {
    let whole = specimen("gel 3", 0);
    let lines: Vec<&str> = whole.lines().collect();
    let with = |number: usize, line: &str| {
        let mut lines = lines.clone();
        lines[number - 1] = line;
        lines.join("\n")
    };
    for (text, expected) in [
        (lines[8..].join("\n"), "line 1: the numbers have no column names"),
        (with(7, ""), "line 8: the numbers have no column names"),
        (with(7, "(s),(mm),(N)"), "line 7 has 3 units for the 4 columns of line 6"),
        (with(9, "torn,1,2,0"), "line 9: 'torn,1,2,0' is no row of numbers"),
        (with(11, "\"0.3"), "line 11: a quote is not closed"),
        (with(11, "End of test,1"), "line 11: 'End of test,1' is no row of numbers"),
        (with(10, "\"0.2\",\"x\",\"1\",\"0\""), "line 10: the depth 'x' is not a number"),
        (with(10, "\"0.2\",\"\",\"1\",\"0\""), "line 10: the depth is missing"),
        (
            with(10, "\"0.1\",\"0\",\"1\",\"0\""),
            "line 10: the time 0.1 s equals that of the previous row",
        ),
        (with(10, "0.2,0,1,0,0"), "line 10 has a cell in column 5"),
        (with(1, "a remark by hand"), "line 1: 'a remark by hand' is neither"),
        (lines[..7].join("\n") + "\n1,1,1,1\n", "fewer than two rows"),
        ("0,1\n1,2\n".to_owned(), "line 1: the numbers have"),
        (lines[..3].join("\n") + "\na,1,2\n", "no column names above a line of units"),
        (whole.clone() + &lines[..4].join("\n"), "line 12: 'Test : Rate 1"),
    ] {
        let reason = refused(&text);
        assert!(reason.contains(expected), "{reason}\n{text}");
        // A file with a fact of Bluehill's is never read as a plain table.
        if text.contains(" : ") && !expected.contains("units") && !expected.contains("names") {
            assert_eq!(read(&text, &ImportOptions::default()).unwrap_err(), reason);
        }
    }
}

#[test]
fn a_file_cut_off_anywhere_is_refused_or_has_what_is_left() {
    let text = specimen("a", 0) + &specimen("b", 3);
    let whole = detected(&text);
    let all: Vec<_> = (0..2).flat_map(|part| numbers(&whole, part)).collect();
    for length in 0..text.len() {
        let Ok(part) = read(&text[..length], &ImportOptions::default()) else {
            continue;
        };
        let parts = part.parts.len();
        let mut found: Vec<_> = (0..parts).flat_map(|index| numbers(&part, index)).collect();
        // The last number may be cut off within; the rest is as it was.
        found.pop();
        assert_eq!(found, all[..found.len()], "{length}");
    }
}

#[test]
fn tables_with_units_in_brackets_stay_tables() {
    let text = "my own remark\nTime,Extension,Load\n(s),(mm),(N)\n0,1,2\n1,2,3\n";
    let read = read(text, &ImportOptions::default()).unwrap();
    assert_eq!(read.parts[0].imported.format, "table");
}
