//! `palpate doctor` and `palpate recover`: each kind of file gets the right word, and the original is left alone.

use super::{json, log_file, palpate, short_run, stderr, stdout, succeeded};
use palpate_sessions::log::Session;
use std::fs;

#[test]
fn every_kind_of_file_gets_the_right_word() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&short_run(at, "whole", &[]));
    let bytes = fs::read(log_file(&at.join("whole"))).unwrap();
    let with = |name: &str, bytes: &[u8]| {
        fs::create_dir(at.join(name)).unwrap();
        fs::write(at.join(name).join("000.mcap"), bytes).unwrap();
    };
    with("interrupted", &bytes[..bytes.len() * 2 / 3]);
    let mut hurt = bytes.clone();
    hurt[bytes.len() / 2] ^= 0x10;
    with("damaged", &hurt);
    with("foreign", b"a text that somebody called a log");
    let mut manifest = Session::open(&at.join("whole")).unwrap().manifest;
    manifest.record_version = palpate_sessions::RECORD_VERSION + 1;
    let newer = palpate_sessions::SessionFolder::create(&at.join("newer")).unwrap();
    let pace = palpate_sessions::Pace::Virtual;
    drop(palpate_sessions::SessionWriter::start(newer, None, &manifest, pace).unwrap());

    for (name, word, code) in [
        ("whole", "healthy", 0),
        ("interrupted", "interrupted", 0),
        ("damaged", "damaged", 1),
        ("foreign", "not a session", 1),
        ("newer", "update palpate", 1),
    ] {
        let visit = palpate(at, &["doctor", name]);
        assert_eq!(
            visit.status.code(),
            Some(code),
            "{name}: {}",
            stderr(&visit)
        );
        assert!(stdout(&visit).contains(word), "{name}: {}", stdout(&visit));
    }
    // The session a newer version wrote, and what is none, are not recovered.
    for (name, code) in [("newer", 2), ("foreign", 2), ("whole", 2)] {
        let refused = palpate(at, &["recover", name]);
        assert_eq!(
            refused.status.code(),
            Some(code),
            "{name}: {}",
            stderr(&refused)
        );
        assert!(!at.join(format!("{name}.recovered")).exists());
    }

    let recovered = json(&palpate(at, &["recover", "damaged", "--json"]));
    let lost = recovered["sessions"][0]["missing"]["gaps"][0]["samples"]
        .as_u64()
        .unwrap();
    let kept = recovered["sessions"][0]["samples"].as_u64().unwrap();
    let all = Session::open(&at.join("whole")).unwrap().rows.len() as u64;
    assert_eq!(lost + kept, all);
    assert_eq!(
        fs::read(at.join("damaged/000.mcap")).unwrap(),
        hurt,
        "the original was touched"
    );
    // What was recovered is a session like any other, and says what it lacks.
    let info = json(&palpate(at, &["info", "damaged.recovered", "--json"]));
    let note = info["notes"][0].as_str().unwrap();
    assert!(note.contains(&format!("{lost} samples between")), "{note}");
    succeeded(&palpate(at, &["fit", "damaged.recovered"]));
    let again = palpate(at, &["recover", "damaged"]);
    assert!(
        stderr(&again).contains("was recovered before"),
        "{}",
        stderr(&again)
    );
    let visit = stdout(&palpate(at, &["doctor", "damaged.recovered"]));
    assert!(visit.contains("healthy"), "{visit}");
}

#[test]
fn the_next_run_recovers_what_a_crash_left_in_the_library() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&short_run(at, "whole", &[]));
    let bytes = fs::read(log_file(&at.join("whole"))).unwrap();
    let left = at.join("library/sessions/20260101T000000Z-00000000");
    fs::create_dir_all(&left).unwrap();
    fs::write(left.join("000.mcap"), &bytes[..bytes.len() / 2]).unwrap();
    let next = short_run(at, "next", &[]);
    succeeded(&next);
    assert!(
        stderr(&next).contains("the end is missing"),
        "{}",
        stderr(&next)
    );
    let recovered = left.with_extension("recovered");
    assert!(Session::open(&recovered).unwrap().end.is_some());
    // Said once.
    assert!(!stderr(&short_run(at, "third", &[])).contains("recovered"));
}
