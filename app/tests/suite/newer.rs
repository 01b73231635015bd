//! Files that a newer palpate wrote: every command leaves them as they are, and what needs them says so in one sentence.

use crate::support::{command, palpate, stderr, stdout, succeeded};
use palpate_sessions::log::Session;
use palpate_sessions::{RECORD_VERSION, RecordingPace, SessionFolder, SessionWriter};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// The recorded session that the others are made of: the shortest with a fit.
const RECORDED: &str = "../tests/sessions/hold-until-lab";

/// Sessions of the library whose files are partly newer, and the newer files of each; all of them where none is named.
const SESSIONS: [(&str, &[&str]); 3] = [
    ("log", &[]),
    ("edits", &["edits.jsonl", "edits.jsonl.head"]),
    ("analyses", &["analyses.jsonl", "analyses.jsonl.head"]),
];

/// Commands that write about a session, which is `S`, and the words of a refusal where its edits or analyses are newer.
const ABOUT_SESSION: [(&str, [Option<&str>; 2]); 16] = [
    ("tag S +new", [Some(NEWER), None]),
    ("note S --text new", [Some(NEWER), None]),
    ("verdict S suspect --reason new", [Some(NEWER), None]),
    ("review S --accept --reason new", [Some(NEWER), Some(NEWER)]),
    ("correct-contact S --position 41 --reason new", [Some(NEWER), None]),
    ("mask S --name new --leave-out 95..96", [Some(NEWER), Some(NEWER)]),
    ("recalibrate S --calibration thesis", [Some(NEWER), Some(NEWER)]),
    ("withdraw S old --reason new", [None, Some(NEWER)]),
    ("fit S --save new", [Some(NEWER), Some(NEWER)]),
    ("analyse S", [Some(NEWER), None]),
    ("export S --format csv", [Some(NEWER), None]),
    ("export S --lake lake", [Some(NEWER), None]),
    ("report S --html S.html", [Some(NEWER), Some(NEWER)]),
    ("info S", [Some(NEWER), None]),
    ("replay S", [None, None]),
    ("recover S", [None, None]),
];

/// Commands that write about the library, each with words of its answer, none where it does not meet a newer file.
const ABOUT_LIBRARY: [(&str, Option<&str>); 12] = [
    ("find", Some("a newer version of palpate made the catalog")),
    ("catalog rebuild", Some("a newer version of palpate made the catalog")),
    ("catalog check", Some("a newer version of palpate made the catalog")),
    ("history rig sim", Some(NEWER)),
    ("doctor", Some("update palpate")),
    ("recover", None),
    ("calibration list", Some("format")),
    ("calibration supersede newer weights.csv --name newer --rig sim", Some("format")),
    ("compliance library/sessions/whole --show", None),
    ("daily-check --time-scale max --operator Ada", Some(NEWER)),
    ("fit library/sessions/whole", Some("a newer version of palpate wrote it")),
    ("plan", Some("a newer version of palpate wrote the file")),
];

const NEWER: &str = "a newer version of palpate wrote";

/// The files of a folder and the folders in it, with their bytes.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    for item in fs::read_dir(folder).into_iter().flatten().flatten() {
        match item.path() {
            path if path.is_dir() => found.extend(files(&path)),
            path => drop(found.insert(path.clone(), fs::read(path).unwrap())),
        }
    }
    found
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for item in fs::read_dir(from).unwrap().flatten() {
        fs::copy(item.path(), to.join(item.file_name())).unwrap();
    }
}

/// Raises the number after `"KEY":` in a file.
fn raise(file: &Path, key: &str) {
    let text = fs::read_to_string(file).unwrap_or_else(|err| panic!("{}: {err}", file.display()));
    let at = text.find(&format!("\"{key}\"")).unwrap_or_else(|| panic!("no {key} in {text}"));
    let digit = at + text[at..].find(|c: char| c.is_ascii_digit() && c != '0').unwrap();
    let after = digit + text[digit..].find(|c: char| !c.is_ascii_digit()).unwrap();
    let number: u32 = text[digit..after].parse().unwrap();
    fs::write(file, format!("{}{}{}", &text[..digit], number + 1, &text[after..])).unwrap();
}

/// Raises the version of a SQLite file, four bytes at 60 (SQLite file format, 1.3).
fn raise_catalog(file: &Path) {
    let mut bytes = fs::read(file).unwrap();
    bytes[63] += 1;
    fs::write(file, bytes).unwrap();
}

/// A library with one of every kind of file, raised by one; and those files.
fn newer_library(at: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let library = at.join("library");
    let session = |name: &str| library.join("sessions").join(name);
    for name in ["whole", "edits", "analyses"] {
        copy(Path::new(RECORDED), &session(name));
    }
    let mut manifest = Session::open(Path::new(RECORDED)).unwrap().manifest;
    manifest.record_version = RECORD_VERSION + 1;
    let newer = SessionFolder::create(&session("log")).unwrap();
    drop(SessionWriter::start(newer, None, &manifest, RecordingPace::Virtual).unwrap());
    // Every file is made by the program itself and then raised.
    fs::write(
        at.join("weights.csv"),
        "mass_g,volts\n0,1.28\n240,1.6\n440,1.87\n640,2.13\n840,2.4\n1040,2.67\n",
    )
    .unwrap();
    for line in [
        "tag library/sessions/edits +old",
        "mask library/sessions/analyses --name old --leave-out 95..96",
        "calibration import weights.csv --name newer --rig sim",
        "daily-check --time-scale max --operator Ada --calibration thesis",
        "fit library/sessions/whole",
        "find",
    ] {
        let words: Vec<&str> = line.split(' ').collect();
        succeeded(&palpate(at, &words));
    }
    raise(&session("edits").join("edits.jsonl.head"), "head_version");
    raise(&session("analyses").join("analyses.jsonl.head"), "head_version");
    raise(&library.join("checks/sim.jsonl.head"), "head_version");
    raise(&library.join("last-fit.json"), "last_fit_version");
    let calibration = files(&library.join("calibrations")).into_keys().next().unwrap();
    raise_format(&calibration);
    raise_catalog(&library.join("catalog.sqlite"));
    let mut newer = files(&session("log"));
    for (name, own) in SESSIONS {
        for file in own {
            let path = session(name).join(file);
            newer.insert(path.clone(), fs::read(path).unwrap());
        }
    }
    for path in [
        library.join("checks/sim.jsonl"),
        library.join("checks/sim.jsonl.head"),
        library.join("last-fit.json"),
        library.join("catalog.sqlite"),
        calibration,
    ] {
        newer.insert(path.clone(), fs::read(path).unwrap());
    }
    newer
}

/// Raises the format of a stored document, whose checksum is that of the compact JSON.
fn raise_format(file: &Path) {
    let text = fs::read_to_string(file).unwrap();
    let mut document: serde_json::Value = serde_json::from_str(&text).unwrap();
    let inner = &mut document["calibration"];
    inner["format"] = (inner["format"].as_u64().unwrap() + 1).into();
    document["checksum"] = crc32(inner.to_string().as_bytes()).into();
    fs::write(file, document.to_string()).unwrap();
}

/// CRC-32 (ISO 3309), bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    let step = |rest: u32, _| if rest & 1 == 1 { (rest >> 1) ^ 0xedb8_8320 } else { rest >> 1 };
    !bytes.iter().fold(u32::MAX, |rest, byte| (0..8).fold(rest ^ u32::from(*byte), step))
}

#[track_caller]
fn assert_unchanged(newer: &BTreeMap<PathBuf, Vec<u8>>, session: &Path, line: &str) {
    for (path, bytes) in newer {
        let now = fs::read(path).unwrap_or_else(|err| panic!("{line}: {} {err}", path.display()));
        assert!(now == *bytes, "'palpate {line}' changed {}", path.display());
    }
    let known = newer.keys().filter(|path| path.starts_with(session)).count();
    // The lock names who holds it; it is no part of the session.
    let now = files(session).into_keys().filter(|path| !path.ends_with("lock"));
    let without_lock =
        newer.keys().filter(|path| path.starts_with(session) && path.ends_with("lock"));
    assert_eq!(now.count(), known - without_lock.count(), "'palpate {line}' added a file");
}

#[test]
fn files_of_a_newer_version_are_never_changed_and_always_named() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let newer = newer_library(at);
    let log = at.join("library/sessions/log");
    let mut wrong = Vec::new();
    let mut run = |line: &str, expected: Option<&str>| {
        let words: Vec<&str> = line.split(' ').collect();
        let output = command(at, &words).output().unwrap();
        let said = stdout(&output) + &stderr(&output);
        assert!(!said.contains("panicked"), "{line}: {said}");
        assert_unchanged(&newer, &log, line);
        if expected.is_some_and(|expected| !said.contains(expected)) {
            wrong.push(format!("palpate {line}: no {expected:?} in {said}"));
        }
    };
    for (line, [edits, analyses]) in ABOUT_SESSION {
        for (name, expected) in
            [("log", Some("update palpate")), ("edits", edits), ("analyses", analyses)]
        {
            run(&line.replace('S', &format!("library/sessions/{name}")), expected);
        }
    }
    for (line, expected) in ABOUT_LIBRARY {
        run(line, expected);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    // Whole sessions of the same library are used as always, and new ones are recorded.
    succeeded(&palpate(at, &["tag", "library/sessions/whole", "+good"]));
    let found = stdout(&palpate(at, &["find", "--tag", "good"]));
    assert!(found.contains("sessions/whole"), "{found}");
    let found = stdout(&palpate(at, &["find"]));
    assert!(found.contains("sessions/log: ") && found.contains("update palpate"), "{found}");
}
