//! Foreign files that are made to ask for more memory than they deserve.

use crate::foreign_jpk;
use crate::hostile::limit_memory;
use crate::support::{put, quick_folder};
use crate::worker::{command, reported_numbers};
use palpate_tables::import::{ImportOptions, parse_foreign};
use std::fs;
use std::io::{Cursor, Write};
use std::path::Path;

/// Sound files of every kind.
pub fn seeds() -> Vec<(&'static str, Vec<u8>)> {
    let table = "t_s;x_mm;F_N\n0,0;0,1;0,2\n0,1;0,2;0,4\n0,2;0,3;\"0,6\"\n0,3;1.000,4;0,8\n";
    let mach1 = "<Mach-1 File>\n<INFO>\nTime:\t1\n<END INFO>\n<Move>\n<DATA>\nTime, s\tPosition (z), mm\tFz, gf\n\
        0.0\t1\t2\n0.1\t2\t3\n<divider>\n0.0\t2\t3\n0.1\t2\t3\n<END DATA>\n";
    let rheometer = "Result:\tR\nInterval and data points:\t1\t2\nInterval data:\tTime\tDisplacement\tNormal Force\n\
        \t[s]\t[mm]\t[N]\n\t0,0\t1,5\t2\n\t0,1\t1,6\t3\n[step]\nS\nTime\tPosition\tForce\ns\tmm\tN\n0\t1\t2\n1\t2\t3\n";
    let bluehill = "Test : Rate 1,\"1.0\",mm/s\nResults Table 1\n,Load\n,(N)\n1,3\n\nTime,Extension,Load\n(s),(mm),(N)\n\
        \"0.0\",\"1\",\"2\"\n\"0.1\",\"2\",\"3\"\nSpecimen label,b\nTime,Extension,Load\n(s),(mm),(N)\n0,1,2\n1,2,3\n";
    let optics11 = "Date\t1\tTime\t2\ngel\nTip radius (um)\t10\nTime (s)\tLoad (uN)\tIndentation (nm)\n\
        0.0\t1\t2\n0.1\t2\t3\n";
    let anton_paar = "Indentation\nNHT S/N: 1\nEIT = 0,2 GPa\nMeasured values\nTime\tPd\tFn\n[s]\t[nm]\t[mN]\n\
        0,0\t1\t2\n0,1\t2\t3\nIndentation\nMeasured values\nTime\tPd\tFn\n[s]\t[nm]\t[mN]\n0,0\t1\t2\n0,1\t2\t3\n";
    let press = "<Mach-1 File>\n<INFO>\nTime:\t1:2:3\n<END INFO>\n<Find Contact>\n<DATA>\nTime, s\tPosition (z), mm\tFz, N\n\
        0.0\t1\t0\n0.1\t2\t0\n<END DATA>\n<INFO>\nTime:\t1:2:4\n<END INFO>\n<Stress Relaxation>\n<DATA>\n\
        Time, s\tPosition (z), mm\tFz, N\n0.0\t2\t0\n0.1\t3\t1\n<divider>\n0.2\t3\t1\n<END DATA>\n";
    let wide: Vec<u8> =
        "\u{feff}".encode_utf16().chain(table.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    vec![
        ("table", table.into()),
        ("mach-1", mach1.into()),
        ("rheometer", rheometer.into()),
        ("bluehill", bluehill.into()),
        ("optics11", optics11.into()),
        ("anton-paar", anton_paar.into()),
        ("mach-1-press", press.into()),
        ("jpk", foreign_jpk::seed()),
        ("utf-16", wide),
        ("xlsx", fs::read(data.join("zwick.xlsx")).unwrap()),
        ("xls", fs::read(data.join("zwick.xls")).unwrap()),
    ]
}

fn xlsx_with(name: &str, content: &mut dyn FnMut(&mut dyn Write)) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default();
    archive.start_file(name, options).unwrap();
    content(&mut archive);
    archive.finish().unwrap().into_inner()
}

fn reason_of(bytes: Vec<u8>) -> String {
    parse_foreign("bomb", bytes, &ImportOptions::default()).unwrap_err()
}

#[test]
fn an_archive_that_unpacks_to_too_much_is_refused() {
    let block = vec![b' '; 1 << 20];
    let bomb = xlsx_with("xl/workbook.xml", &mut |file| {
        for _ in 0..300 {
            file.write_all(&block).unwrap();
        }
    });
    assert!(bomb.len() < 1 << 20, "{} bytes", bomb.len());
    let reason = reason_of(bomb);
    assert!(reason.contains("unpacks"), "{reason}");
    let liar = xlsx_with("xl/sharedStrings.xml", &mut |file| {
        file.write_all(b"<sst uniqueCount=\"9999999999999\"></sst>").unwrap();
    });
    let reason = reason_of(liar);
    assert!(reason.contains("more text entries"), "{reason}");
}

/// Found by damaging the workbook at random: 5632 bytes made the reader ask for 180 MB.
#[test]
fn a_small_workbook_with_a_cell_far_away_is_refused() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus/foreign");
    let reason = reason_of(fs::read(corpus.join("wide-xls")).unwrap());
    assert!(reason.contains("span more than"), "{reason}");
}

#[test]
fn a_sheet_that_claims_the_whole_world_is_refused() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let sound = fs::read(data.join("zwick.xls")).unwrap();
    // The first number record (0x0203, 14 bytes) is moved to the last row and a far column.
    let head = [0x03, 0x02, 14, 0];
    let place = sound.windows(4).position(|window| window == head).unwrap();
    let mut far = sound.clone();
    far[place + 4..place + 8].copy_from_slice(&[0xff, 0xff, 0xff, 0xff]);
    assert!(reason_of(far).contains("structure is broken"));
    // Within the format's own limits, but sheet by sheet more than is worth it.
    let mut wide = sound.clone();
    let label = [0x04, 0x02];
    let first = wide.windows(2).position(|window| window == label).unwrap();
    wide[first + 4..first + 8].copy_from_slice(&[0, 0, 0, 0]);
    wide[place + 4..place + 8].copy_from_slice(&[0xff, 0xff, 0xff, 0]);
    let reason = reason_of(wide);
    assert!(reason.contains("span more than"), "{reason}");
}

/// A sound workbook: time, depth and force in so many rows.
fn workbook(rows: usize) -> Vec<u8> {
    let mut archive = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default();
    let space = "http://schemas.openxmlformats.org";
    let relation = format!("{space}/officeDocument/2006/relationships");
    let parts = [
        ("[Content_Types].xml", format!("<Types xmlns=\"{space}/package/2006/content-types\"/>")),
        (
            "_rels/.rels",
            format!(
                "<Relationships xmlns=\"{space}/package/2006/relationships\"><Relationship Id=\"r1\" \
                 Type=\"{relation}/officeDocument\" Target=\"xl/workbook.xml\"/></Relationships>"
            ),
        ),
        (
            "xl/workbook.xml",
            format!(
                "<workbook xmlns=\"{space}/spreadsheetml/2006/main\" xmlns:r=\"{relation}\"><sheets>\
                 <sheet name=\"A\" sheetId=\"1\" r:id=\"r1\"/></sheets></workbook>"
            ),
        ),
        (
            "xl/_rels/workbook.xml.rels",
            format!(
                "<Relationships xmlns=\"{space}/package/2006/relationships\"><Relationship Id=\"r1\" \
                 Type=\"{relation}/worksheet\" Target=\"worksheets/sheet1.xml\"/></Relationships>"
            ),
        ),
    ];
    for (name, text) in parts {
        archive.start_file(name, options).unwrap();
        archive.write_all(text.as_bytes()).unwrap();
    }
    archive.start_file("xl/worksheets/sheet1.xml", options).unwrap();
    let mut sheet =
        format!("<worksheet xmlns=\"{space}/spreadsheetml/2006/main\"><sheetData><row r=\"1\">");
    for (column, name) in [("A", "t_s"), ("B", "depth_mm"), ("C", "force_N")] {
        sheet += &format!("<c r=\"{column}1\" t=\"inlineStr\"><is><t>{name}</t></is></c>");
    }
    sheet += "</row>";
    for row in 0..rows {
        let (t, number) = (row as f64 * 1e-3, row + 2);
        let (depth, force) = ((t * 0.7).sin() + 2.0, (t * 1.3).cos() + 3.0);
        sheet += &format!(
            "<row r=\"{number}\"><c r=\"A{number}\"><v>{t:.3}</v></c><c r=\"B{number}\"><v>{depth:.5}</v></c>\
             <c r=\"C{number}\"><v>{force:.5}</v></c></row>"
        );
    }
    sheet += "</sheetData></worksheet>";
    archive.write_all(sheet.as_bytes()).unwrap();
    archive.finish().unwrap().into_inner()
}

/// Rows of three cells that a workbook may have at most, its head not counted.
const WORKBOOK_ROWS: usize = (1 << 19) / 3 - 1;

/// The work of a process: reads a workbook in no more than 64 MiB.
pub fn read_workbook(folder: &Path) {
    let path = folder.join("book.xlsx");
    limit_memory(64 << 20);
    let bytes = fs::read(&path).unwrap();
    let read = parse_foreign("book.xlsx", bytes, &ImportOptions::default()).unwrap();
    eprintln!("rows {}", read.parts[0].samples.len());
}

#[test]
fn the_largest_workbook_is_read_in_little_memory_and_a_larger_one_is_refused() {
    let folder = quick_folder();
    put(&folder.path().join("book.xlsx"), &workbook(WORKBOOK_ROWS));
    let output = command(&[], "workbook", folder.path()).output().unwrap();
    assert!(output.status.success(), "{output:?}");
    assert_eq!(reported_numbers(&output, "rows"), [WORKBOOK_ROWS as u64]);
    let reason = reason_of(workbook(WORKBOOK_ROWS + 1));
    assert!(reason.contains("524288 cells"), "{reason}");
    let texts = xlsx_with("xl/sharedStrings.xml", &mut |file| {
        file.write_all(&vec![b' '; (4 << 20) + 1]).unwrap();
    });
    let reason = reason_of(texts);
    assert!(reason.contains("4194304"), "{reason}");
}
