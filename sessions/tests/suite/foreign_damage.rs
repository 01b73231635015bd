//! Foreign files that are made to ask for more memory than they deserve.

use palpate_sessions::import::{Told, parse_foreign};
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
    let wide: Vec<u8> = "\u{feff}"
        .encode_utf16()
        .chain(table.encode_utf16())
        .flat_map(u16::to_le_bytes)
        .collect();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    vec![
        ("table", table.into()),
        ("mach-1", mach1.into()),
        ("rheometer", rheometer.into()),
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
    parse_foreign("bomb", bytes, &Told::default()).unwrap_err()
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
    assert!(reason.contains("unpacks to more than"), "{reason}");
    let liar = xlsx_with("xl/sharedStrings.xml", &mut |file| {
        file.write_all(b"<sst uniqueCount=\"9999999999999\"></sst>")
            .unwrap();
    });
    let reason = reason_of(liar);
    assert!(reason.contains("more texts than it has bytes"), "{reason}");
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
