//! What other programs do to files of palpate while it uses them, or after.

use crate::support::{
    assert_refused, command, json, palpate, short_run, stderr, stdout, succeeded,
};
use palpate_tables::lake;
use palpate_test_support::wait::until;
use std::fs;
use std::process::Stdio;

#[test]
fn a_log_that_is_emptied_in_mid_run_ends_the_run_and_is_not_valid() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let child = command(at, &["run", "ramp-hold", "--out", "emptied", "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let log = at.join("emptied/000.mcap");
    let has_grown = || (fs::metadata(&log).ok()?.len() > 100_000).then_some(());
    until(has_grown, || "a log that grows".into());
    // An export of it into a lake is refused until it ends.
    let export = palpate(at, &["export", "emptied", "--lake", "lake"]);
    assert_refused(&export, 1, "being recorded");
    assert!(lake::list_sessions(&at.join("lake")).map_or(true, |found| found.is_empty()));
    fs::write(&log, "").unwrap();
    let done = child.wait_with_output().unwrap();
    assert_eq!(done.status.code(), Some(1), "{}", stderr(&done));
    let report: serde_json::Value =
        serde_json::from_str(stdout(&done).lines().next().unwrap()).unwrap();
    assert_ne!(report["ending"], "finish", "{report}");
    assert_ne!(report["verdict"], "valid", "{report}");
    assert!(report["samples_lost"].as_u64().unwrap() > 0, "{report}");
    let message = stderr(&done);
    for words in ["000.mcap", "another program", "are missing", "palpate recover"] {
        assert!(message.contains(words), "{words}: {message}");
    }
    // What came after is kept, and can be recovered.
    assert_eq!(palpate(at, &["doctor", "emptied"]).status.code(), Some(1));
    succeeded(&palpate(at, &["recover", "emptied"]));
    let info = json(&palpate(at, &["info", "emptied.recovered", "--json"]));
    assert_eq!(info["samples"], report["samples"]);
    assert_eq!((&info["is_complete"], &info["verdict"]), (&true.into(), &report["verdict"]));
}

#[test]
fn a_review_that_was_cut_off_is_reported_by_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&short_run(at, "library/sessions/one", &["--specimen", "gel"]));
    let one = "library/sessions/one";
    succeeded(&palpate(at, &["review", one, "--reject", "--reason", "hair on the probe"]));
    let edits = at.join(one).join("edits.jsonl");
    let text = fs::read_to_string(&edits).unwrap();
    let lines: Vec<&str> = text.split_inclusive('\n').collect();
    fs::write(&edits, lines[..lines.len() - 1].concat()).unwrap();
    for (words, code) in [
        (vec!["doctor", one], 1),
        (vec!["info", one], 1),
        (vec!["tag", one, "+good"], 1),
        (vec!["fit", one], 1),
        (vec!["find"], 0),
        (vec!["history", "specimen", "gel"], 0),
    ] {
        let output = palpate(at, &words);
        assert_eq!(output.status.code(), Some(code), "{words:?}: {}", stderr(&output));
        let message = stdout(&output) + &stderr(&output);
        assert!(
            message.contains("edits.jsonl") && message.contains("1 of 2"),
            "{words:?}: {message}"
        );
    }
    let history = json(&palpate(at, &["history", "specimen", "gel", "--json"]));
    assert_eq!(history["events"].as_array().unwrap().len(), 1);
    assert_eq!(history["remarks"].as_array().unwrap().len(), 1);
}

#[test]
fn what_a_killed_export_left_is_named_by_doctor_and_swept_by_the_next() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&short_run(at, "demo", &[]));
    let names = ["tables/.demo.csv.aBcDeF.palpate.tmp", ".demo.csv.123456.palpate.tmp"];
    fs::create_dir(at.join("tables")).unwrap();
    names.iter().for_each(|name| fs::write(at.join(name), "half").unwrap());
    let named = || {
        let visit = json(&palpate(at, &["doctor", "--json"]));
        let left = visit["leftovers"].as_array().unwrap().clone();
        left.iter()
            .map(|path| path.as_str().unwrap().trim_start_matches("./").to_owned())
            .collect::<Vec<_>>()
    };
    assert_eq!(named(), [names[1]]);
    assert!(stdout(&palpate(at, &["doctor", "tables"])).contains(names[0]));
    for (to, left) in [("tables", vec![names[1]]), (".", vec![])] {
        succeeded(&palpate(at, &["export", "demo", "--format", "csv", "--to", to]));
        assert_eq!(named(), left, "{to}");
        assert!(!at.join(names[0]).exists());
    }
}
