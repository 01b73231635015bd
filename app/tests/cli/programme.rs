//! Programmes and the calibration they measure, as a user meets them.

use super::{json, palpate, stderr, stdout, succeeded};
use std::fs;

const TWO: &str = r#"
palpate-programme = 1
name = "two"
title = "Two tasks"

[[task]]
name = "look"
protocol = "free-jog"

[[task]]
name = "press"
protocol = "ramp-hold"
set = { depth = "DEPTH", hold = "1 s", speed = "3 mm/s" }
specimen = 2
"#;

#[test]
fn a_programme_leaves_sessions_and_a_page_and_is_previewed_whole() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("deep.toml"), TWO.replace("DEPTH", "200 mm")).unwrap();
    let refused = palpate(
        at,
        &["run", "deep.toml", "--out", "day", "--time-scale", "max"],
    );
    assert_eq!(refused.status.code(), Some(2));
    let told = stderr(&refused);
    assert!(
        told.contains("line 10: task 'press'") && told.contains("200"),
        "{told}"
    );
    assert!(!at.join("day").exists(), "something ran");

    fs::write(at.join("two.toml"), TWO.replace("DEPTH", "10 mm")).unwrap();
    let ahead = palpate(at, &["run", "two.toml", "--preview", "--json"]);
    succeeded(&ahead);
    assert_eq!(json(&ahead)["sessions"], 2);
    let run = [
        "run",
        "two.toml",
        "--out",
        "day",
        "--time-scale",
        "max",
        "--json",
    ];
    let done = palpate(at, &run);
    succeeded(&done);
    let report = json(&done);
    assert_eq!(report["runs"].as_array().map(Vec::len), Some(2), "{report}");
    assert_eq!(
        report["tasks"][1]["fits"].as_array().map(Vec::len),
        Some(1),
        "{report}"
    );
    let page = fs::read_to_string(at.join("day/summary.html")).unwrap();
    assert!(
        page.contains("<svg") && page.contains("press/01"),
        "no page"
    );

    // Rejected, it stays in the count and is fitted no more.
    let verdict = [
        "verdict",
        "day/press/01",
        "rejected",
        "--reason",
        "a hair on the probe",
    ];
    succeeded(&palpate(at, &verdict));
    let again = palpate(at, &run);
    succeeded(&again);
    let report = json(&again);
    assert_eq!(report["was_continued"], true);
    assert_eq!(
        report["tasks"][1]["fits"].as_array().map(Vec::len),
        Some(0),
        "{report}"
    );
    assert_eq!(
        report["runs"][1]["verdict"],
        "rejected: a hair on the probe"
    );
}

#[test]
fn weights_read_on_the_rig_become_a_document() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let masses = r#"masses="340 g, 640 g, 840 g""#;
    let weigh = [
        "run",
        "load-cell-calibration",
        "--set",
        masses,
        "--set",
        "repeats=1",
        "--operator",
        "Ada",
        "--time-scale",
        "max",
        "--out",
        "weights",
    ];
    // The shell would have taken the quotes away.
    let weigh = weigh.map(|word| word.replace('"', ""));
    let weigh: Vec<&str> = weigh.iter().map(String::as_str).collect();
    succeeded(&palpate(at, &weigh));
    let import = ["calibration", "import", "weights", "--name", "bench"];
    succeeded(&palpate(at, &import));
    let shown = palpate(at, &["calibration", "show", "bench"]);
    succeeded(&shown);
    assert!(stdout(&shown).contains("840.0"), "{}", stdout(&shown));
}
