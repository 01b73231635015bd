//! The sketch itself, compiled for this computer with a chip made of a few lines on its pins.

use palpate_drivers::hx711::protocol::{Header, Message, parse};
use palpate_test_support::skip;
use std::path::Path;
use std::process::Command;

#[test]
fn the_sketch_speaks_as_it_is_read() {
    if skip::lacks_program("g++") {
        return;
    }
    for gain in [128, 64] {
        speaks(gain);
    }
}

fn speaks(gain: u8) {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let out = tempfile::tempdir().expect("a folder");
    let program = out.path().join("sketch");
    let sketch = here.join("../hx711/palpate_hx711/palpate_hx711.ino");
    let sketch = std::fs::read_to_string(sketch).expect("the sketch");
    let (usual, set) = ("GAIN = 128;", format!("GAIN = {gain};"));
    assert!(sketch.contains(usual));
    let copy = out.path().join("palpate_hx711.ino");
    std::fs::write(copy, sketch.replace(usual, &set)).expect("a copy");
    let compiler = Command::new("g++")
        .args(["-std=c++11", "-funsigned-char", "-Wall", "-Wno-unused-function"])
        .arg("-I")
        .arg(out.path())
        .arg("-I")
        .arg(here.join("tests/suite/cells/board"))
        .arg(here.join("tests/suite/cells/board/main.cpp"))
        .arg("-o")
        .arg(&program)
        .output();
    let compiled = compiler.expect("g++");
    let errors = String::from_utf8_lossy(&compiled.stderr);
    assert!(compiled.status.success() && errors.is_empty(), "{errors}");
    let run = Command::new(&program).output().expect("the sketch");
    let text = String::from_utf8(run.stdout).expect("text");
    // 2: it asked for another gain; 3: it held PD_SCK up so long that the chip slept.
    assert_eq!(run.status.code(), Some(0), "{text}");

    let header = Header { rate: 80, gain, board: "board-1".into() };
    let mut counts = Vec::new();
    let mut times = Vec::new();
    let (mut started, mut answered) = (0, 0);
    for line in text.split_terminator("\r\n") {
        match parse(line).unwrap_or_else(|| panic!("{line:?} of {text}")) {
            Message::Started { header: found, .. } => {
                assert!(found == header && counts.is_empty());
                started += 1;
            }
            Message::Header { header: found, .. } => {
                assert_eq!(found, header);
                answered += 1;
            }
            Message::Value { micros, count } => {
                counts.push(count);
                times.push(micros);
            }
            Message::Missing { .. } => panic!("the chip was there: {text}"),
        }
    }
    assert_eq!((started, answered), (1, 1));
    let chip = [0, 8_388_607, -8_388_608, -1, 152_034, -152_034];
    let first = counts.iter().position(|count| *count == 0).expect("the first count");
    for (i, count) in counts[first..].iter().enumerate() {
        assert_eq!(*count, chip[i % 6], "{counts:?}");
    }
    assert!(counts.len() - first >= 8, "{counts:?}");
    // Stamped when it is ready, but while a question is answered.
    let late = times.windows(2).filter(|pair| (pair[1] - pair[0]).abs_diff(12_400) > 100).count();
    assert!(late <= 2, "{times:?}");
}
