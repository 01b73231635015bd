//! `palpate doctor` and `palpate recover`: each kind of file gets the right word, and the original is left alone.

use crate::support::{
    assert_prints, assert_says, json, log_file, palpate, short_run, stderr, stdout, succeeded,
};
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
    with("foreign", b"a text with the name of a log");
    let mut manifest = Session::open(&at.join("whole")).unwrap().manifest;
    manifest.record_version = palpate_sessions::RECORD_VERSION + 1;
    let newer = palpate_sessions::SessionFolder::create(&at.join("newer")).unwrap();
    let pace = palpate_sessions::RecordingPace::Virtual;
    drop(palpate_sessions::SessionWriter::start(newer, None, &manifest, pace).unwrap());

    for (name, word, code) in [
        ("whole", "healthy", 0),
        ("interrupted", "interrupted", 0),
        ("damaged", "damaged", 1),
        ("foreign", "not a session", 1),
        ("newer", "update palpate", 1),
    ] {
        let visit = palpate(at, &["doctor", name]);
        assert_eq!(visit.status.code(), Some(code), "{name}: {}", stderr(&visit));
        assert!(stdout(&visit).contains(word), "{name}: {}", stdout(&visit));
    }
    // The session a newer version wrote, and what is none, are not recovered.
    for (name, code) in [("newer", 2), ("foreign", 2), ("whole", 2)] {
        let refused = palpate(at, &["recover", name]);
        assert_eq!(refused.status.code(), Some(code), "{name}: {}", stderr(&refused));
        assert!(!at.join(format!("{name}.recovered")).exists());
    }

    let recovered = json(&palpate(at, &["recover", "damaged", "--json"]));
    let lost = recovered["sessions"][0]["missing"]["gaps"][0]["samples"].as_u64().unwrap();
    let kept = recovered["sessions"][0]["samples"].as_u64().unwrap();
    let all = Session::open(&at.join("whole")).unwrap().rows.len() as u64;
    assert_eq!(lost + kept, all);
    assert_eq!(fs::read(at.join("damaged/000.mcap")).unwrap(), hurt, "the original was touched");
    // What was recovered is a session like any other, and says what it lacks.
    let info = json(&palpate(at, &["info", "damaged.recovered", "--json"]));
    let note = info["notes"][0].as_str().unwrap();
    assert!(note.contains(&format!("{lost} samples between")), "{note}");
    succeeded(&palpate(at, &["fit", "damaged.recovered"]));
    let again = palpate(at, &["recover", "damaged"]);
    assert_says(&again, "was already recovered");
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
    assert_says(&next, "missing");
    let recovered = left.with_extension("recovered");
    assert!(Session::open(&recovered).unwrap().end.is_some());
    // Said once.
    assert!(!stderr(&short_run(at, "third", &[])).contains("recovered"));
}

/// What cannot be recovered does not keep the others from it; the worst gives the exit code.
#[test]
fn several_sessions_are_recovered_one_after_the_other() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&short_run(at, "whole", &[]));
    let bytes = fs::read(at.join("whole/000.mcap")).unwrap();
    for name in ["first", "last"] {
        fs::create_dir(at.join(name)).unwrap();
        fs::write(at.join(name).join("000.mcap"), &bytes[..bytes.len() / 2]).unwrap();
    }
    fs::create_dir(at.join("lost")).unwrap();
    fs::write(at.join("lost/000.mcap"), &bytes[..60]).unwrap();
    let all = palpate(at, &["recover", "first", "whole", "nowhere", "last"]);
    assert_eq!(all.status.code(), Some(2), "{}", stderr(&all));
    let text = stdout(&all);
    for part in ["first.recovered", "last.recovered", "whole is complete", "nowhere"] {
        assert!(text.contains(part), "{part} in {text}");
    }
    assert_says(&all, "2 of 4");
    // Done before is wrong use, and a session of which nothing is left a failure.
    let again = palpate(at, &["recover", "first", "lost", "--json"]);
    assert_eq!(again.status.code(), Some(1), "{}", stderr(&again));
    let first = stdout(&again).lines().next().unwrap().to_owned();
    let printed: serde_json::Value = serde_json::from_str(&first).unwrap();
    let exits = printed["not_recovered"].as_array().unwrap().iter();
    let exits: Vec<_> = exits.map(|one| one["exit"].as_u64()).collect();
    assert_eq!(exits, [Some(2), Some(1)]);
    let visit = palpate(at, &["doctor", "nowhere", "first", "whole"]);
    assert_eq!(visit.status.code(), Some(1));
    let text = stdout(&visit);
    assert!(text.contains("whole: healthy") && text.contains("first: interrupted"), "{text}");
}

#[test]
fn what_stands_beside_a_healthy_log_is_looked_at_too() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&short_run(at, "whole", &[]));
    succeeded(&palpate(at, &["tag", "whole", "+pilot"]));
    succeeded(&palpate(at, &["doctor", "whole"]));
    let journal = at.join("whole/edits.jsonl");
    let text = fs::read_to_string(&journal).unwrap();
    fs::write(&journal, text.replace("pilot", "pilow")).unwrap();
    let visit = palpate(at, &["doctor", "whole"]);
    assert_eq!(visit.status.code(), Some(1), "{}", stdout(&visit));
    assert_prints(&visit, "edits.jsonl");

    let line = |i: u32| format!("{0},{0},{1}\n", f64::from(i) * 0.01, f64::from(i * i) * 1e-4);
    let table: String = (0..300).map(line).collect();
    fs::write(at.join("table.csv"), format!("t_s,depth_mm,force_N\n{table}")).unwrap();
    succeeded(&palpate(at, &["import", "table.csv", "--into", "in"]));
    succeeded(&palpate(at, &["doctor", "in/table"]));
    let original = at.join("in/table/original/table.csv");
    fs::write(&original, "t_s,depth_mm,force_N\n").unwrap();
    let visit = palpate(at, &["doctor", "in/table", "--json"]);
    assert_eq!(visit.status.code(), Some(1));
    fs::remove_file(&original).unwrap();
    assert_eq!(palpate(at, &["doctor", "in/table"]).status.code(), Some(1));
}

/// The samples of an interrupted session and of its recovered copy are the same ones.
#[test]
fn a_session_and_its_recovered_copy_count_once() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&short_run(at, "whole", &[]));
    let bytes = fs::read(log_file(&at.join("whole"))).unwrap();
    fs::create_dir_all(at.join("L/cut")).unwrap();
    fs::write(at.join("L/cut/000.mcap"), &bytes[..bytes.len() * 9 / 10]).unwrap();
    // In the lake before it was recovered.
    succeeded(&palpate(at, &["export", "L", "--lake", "lake"]));
    succeeded(&palpate(at, &["recover", "L/cut"]));
    let printed = "because their recovered copies are included: ";
    for (args, is_reported) in [
        (["export", "L", "--lake", "other", "--json"], true),
        (["export", "L/cut.recovered", "--lake", "lake", "--json"], false),
        (["fit", "lake", "--jobs", "1", "--json"], true),
        (["fit", "L", "--jobs", "1", "--json"], true),
    ] {
        let output = palpate(at, &args);
        succeeded(&output);
        assert_eq!(stderr(&output).contains(printed), is_reported, "{args:?}: {}", stderr(&output));
        if args[0] == "export" {
            assert_eq!(json(&output)["added"], 1, "{args:?}");
        }
        if args[1] == "lake" {
            assert_eq!(json(&output)["sessions"], 1, "{args:?}");
        }
    }
}
