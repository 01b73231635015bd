//! Exports of testXpert and of Chinese testers: names of columns in several languages, and what the lines above them say.

use palpate_tables::import::{ForeignFile, ImportOptions, parse_foreign};

fn read(bytes: Vec<u8>) -> ForeignFile {
    parse_foreign("export.txt", bytes, &ImportOptions::default())
        .unwrap_or_else(|reason| panic!("{reason}"))
}

/// Time, depth and force of the only part.
fn numbers(read: &ForeignFile) -> Vec<[f64; 3]> {
    assert_eq!(read.parts.len(), 1);
    let samples = read.parts[0].samples.iter();
    samples.map(|one| [one.t, one.depth.unwrap(), one.force.unwrap()]).collect()
}

fn encoded(name: &str, text: &str) -> Vec<u8> {
    let encoding = encoding_rs::Encoding::for_label(name.as_bytes()).unwrap();
    let (bytes, _, is_lossy) = encoding.encode(text);
    assert!(!is_lossy, "{text}");
    bytes.into_owned()
}

const EXPECTED: [[f64; 3]; 3] = [[0.0, 0.0, 0.05], [0.1, 0.25, 0.175], [0.2, 0.5, 0.5]];

/// The layout of testXpert III: names and values in quotes, names of columns, their units, rows.
#[test]
fn testxpert_text_keeps_what_it_says_of_the_test() {
    let text = "\"Prüfer\"\t\"Ada\"\r\n\"Kraftaufnehmer\"\t\"KA-001\"\r\n\"Datum/Uhrzeit\"\t44335.4\t\"\"\r\n\
        \"Prüfgeschwindigkeit\"\t2.5\t\"mm/s\"\r\n\"Bemerkung\"\t\"\"\r\n\
        \"Prüfzeit\"\t\"Standardkraft\"\t\"Traversenweg absolut\"\t\"Standardweg\"\t\"Dehnung\"\r\n\
        \"s\"\t\"N\"\t\"mm\"\t\"µm\"\t\"%\"\r\n\
        0.0\t0.05\t9\t0\t0\r\n0.1\t0.175\t9\t250\t1\r\n0.2\t0.5\t9\t500\t2\r\n";
    let read = read(text.into());
    assert_eq!(numbers(&read), EXPECTED);
    let expected = [
        ("Prüfer", "Ada"),
        ("Kraftaufnehmer", "KA-001"),
        ("Datum/Uhrzeit", "44335.4"),
        ("Prüfgeschwindigkeit", "2.5 mm/s"),
    ];
    let facts: Vec<(&str, &str)> = read.parts[0]
        .imported
        .facts
        .iter()
        .map(|(key, value)| (key.as_str(), value.as_str()))
        .collect();
    assert_eq!(facts, expected);
}

#[test]
fn names_in_six_languages_are_recognised() {
    for (encoding, names) in [
        ("utf-8", ["Test time", "Standard force", "Standard travel"]),
        ("windows-1252", ["Prüfzeit", "Standardkraft", "Standardweg"]),
        ("windows-1252", ["Temps d'essai", "Force standard", "Déformation"]),
        ("windows-1252", ["Temps d'essai", "Force standard", "Allongement"]),
        ("windows-1252", ["Tempo di prova", "Forza standard", "Deformazione"]),
        ("windows-1252", ["Tiempo de ensayo", "Fuerza estándar", "Deformación"]),
        ("gb18030", ["时间", "试验力", "位移"]),
        ("gbk", ["试验时间", "载荷", "变形"]),
    ] {
        let text =
            format!("{}\ns;N;mm\n0,0;0,05;0\n0,1;0,175;0,25\n0,2;0,5;0,5\n", names.join(";"));
        let read = read(encoded(encoding, &text));
        assert_eq!(numbers(&read), EXPECTED, "{names:?}");
        // Names and units in one cell.
        let text = format!(
            "{}(s),{}(N),{}(mm)\n0,0.05,0\n0.1,0.175,0.25\n0.2,0.5,0.5\n",
            names[0], names[1], names[2]
        );
        assert_eq!(numbers(&self::read(encoded(encoding, &text))), EXPECTED, "{names:?}");
    }
}

/// A header of two lines in GBK, names above units in brackets, as Bluehill writes it on a Chinese computer.
#[test]
fn chinese_header_of_two_lines_is_read() {
    let text =
        "试样标签,凝胶\n\n时间,位移,载荷\n(s),(mm),(N)\n0,0,0.05\n0.1,0.25,0.175\n0.2,0.5,0.5\n";
    let read = read(encoded("gbk", text));
    assert_eq!(numbers(&read), EXPECTED);
    let readings = &read.parts[0].imported.readings;
    let encoding = readings.iter().find(|one| one.what == "encoding").unwrap();
    assert!(encoding.found.starts_with("gb18030, assumed"), "{}", encoding.found);
    assert_eq!(read.parts[0].imported.facts, [("试样标签".to_owned(), "凝胶".to_owned())]);
}
