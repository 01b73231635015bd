//! Protocol files on the command line.

use crate::support::{
    answer, assert_prints, json, palpate, split_words, stderr, stdout, succeeded, typed,
};
use palpate_test_support::skip;
use serde_json::Value;
use std::path::Path;

/// A protocol short enough for a test, with something to set and something to ask.
const MINE: &str = r#"palpate = 1
name = "mine"
version = 3
title = "Two short presses"
about = "For a test."
source = "none"
ask = ["operator", "specimen.storage"]

[parameters]
depth = { default = "4 mm", max = "10 mm", about = "depth" }

[procedure]
steps = [
  { do = "self-test" },
  { do = "home" },
  { do = "tare" },
  { do = "find-contact", recovery = "1 s" },
  { repeat = 2, as = "press", cycle = true, checkpoint = "after press {press}", steps = [
      { do = "ramp", speed = "3 mm/s", depth = "$depth" },
      { do = "unload", speed = "3 mm/s" },
  ] },
  { do = "prompt", message = "Look at the specimen", timeout = "1 min" },
  { do = "retract" },
]
"#;

pub fn with_mine() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("mine.toml"), MINE).expect("a file that can be written");
    folder
}

fn run_mine(at: &Path, more: &[&str]) -> std::process::Output {
    let mut args = vec!["run", "mine.toml", "--time-scale", "max", "--out", "s", "--json"];
    args.extend(more);
    palpate(at, &args)
}

#[test]
fn a_file_runs_and_its_session_says_which_it_was() {
    let folder = with_mine();
    let at = folder.path();
    let printed = split_words("--set depth=6mm --operator Ada --about specimen.storage=saline");
    let run = run_mine(at, &printed);
    succeeded(&run);
    let run = json(&run);
    assert_eq!((run["plan"].as_str(), run["ending"].as_str()), (Some("mine"), Some("finish")));
    let replay = palpate(at, &["replay", "s", "--json"]);
    succeeded(&replay);
    let session = palpate_sessions::log::Session::open(&at.join("s")).unwrap();
    let plan = &session.manifest.plan;
    assert_eq!(plan["version"], 3);
    assert_eq!(plan["source"]["values"]["depth"], "6mm");
    let stored = session.manifest.about.get("specimen.storage");
    assert_eq!(stored, Some(&"saline".into()));
    assert_eq!(session.manifest.operator, "Ada");
}

#[test]
fn what_is_asked_and_not_reported_or_wrongly_set_starts_nothing() {
    let folder = with_mine();
    let at = folder.path();
    for (more, words) in [
        (&["--operator", "Ada"][..], "specimen.storage ("),
        (&["--about", "operater=Ada"], "operator, specimen"),
        (&["--set", "depth=12 mm"], "parameter 'depth': 12 mm"),
        (&["--set", "depth"], "depth=20mm"),
    ] {
        let run = run_mine(at, more);
        assert_eq!(run.status.code(), Some(2), "{}", stderr(&run));
        assert!(stderr(&run).contains(words), "{}", stderr(&run));
        assert!(!at.join("s").exists());
    }
    for (name, words) in
        [("preconditionin", "'preconditioning'"), ("nothing-like-it", "'palpate protocol list'")]
    {
        let run = palpate(at, &["run", name]);
        assert_eq!(run.status.code(), Some(2));
        assert!(stderr(&run).contains(words), "{}", stderr(&run));
    }
}

#[test]
fn check_tells_every_mistake_with_its_line() {
    let folder = with_mine();
    let at = folder.path();
    let spoilt = MINE.replace("\"ramp\"", "\"rmap\"").replace("\"3 mm/s\" },", "\"3 mm\" },");
    std::fs::write(at.join("spoilt.toml"), spoilt).unwrap();
    let deep =
        MINE.replace("max = \"10 mm\"", "max = \"900 mm\"").replace("\"4 mm\"", "\"400 mm\"");
    std::fs::write(at.join("deep.toml"), deep).unwrap();

    let sound = palpate(at, &["protocol", "check", "mine.toml", "creep"]);
    succeeded(&sound);
    assert_prints(&sound, "mine.toml: sound");

    let check = typed(at, "protocol check mine.toml spoilt.toml deep.toml");
    assert_eq!(check.status.code(), Some(2));
    let text = stdout(&check);
    for words in [
        "'rmap' is not a known step; did you mean 'ramp'?",
        "spoilt.toml, line 20: 'speed' of 'unload': \"3 mm\" is a length",
        "deep.toml, line 19: a depth of 400 mm",
    ] {
        assert!(text.contains(words), "{text}");
    }
    let object = palpate(at, &["protocol", "check", "spoilt.toml", "--json"]);
    let first: Value = serde_json::from_str(stdout(&object).lines().next().unwrap()).unwrap();
    assert_eq!(first["files"][0]["problems"][0]["line"], 19);
    assert_eq!(first["files"][0]["problems"][0]["severity"], "error");
}

#[test]
fn a_built_in_protocol_is_shown_copied_and_previewed() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let show = palpate(at, &["protocol", "show", "preconditioning"]);
    std::fs::write(at.join("copy.toml"), stdout(&show)).unwrap();
    let preview =
        answer(&typed(at, "protocol preview copy.toml --set cycles=3 --plot plan.svg --json"));
    assert_eq!(preview["checkpoints"][2]["name"], "after cycle 3");
    let steps = preview["steps"].as_array().unwrap();
    let rests = steps.iter().filter(|step| step["phase"] == "rest");
    assert!(rests.clone().all(|step| step["expected"] == 180.0 && step["is_exact"] == true));
    assert_eq!(rests.count(), 3);
    let picture = std::fs::read_to_string(at.join("plan.svg")).unwrap();
    assert_eq!(picture.matches("stroke-width=\"1.6\"").count(), 3, "depth, speed and force");
    let again = typed(at, "protocol preview copy.toml --plot plan.svg");
    assert_eq!(again.status.code(), Some(2), "never over another file");

    let list = json(&palpate(at, &["protocol", "list", "--json"]));
    let names = list["protocols"].as_array().unwrap();
    assert!(names.iter().any(|one| one["name"] == "relaxation-series"));
    let steps = palpate(at, &["protocol", "show", "sine", "--steps"]);
    assert_prints(&steps, "find-contact");
}

#[test]
fn the_pages_of_the_guide_are_those_of_the_protocols() {
    if skip::lacks_program("python3") {
        return;
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let check = std::process::Command::new("python3")
        .arg(root.join("scripts/protocol-pages"))
        .arg("--check")
        .env("PALPATE", env!("CARGO_BIN_EXE_palpate"))
        .output()
        .unwrap();
    assert!(check.status.success(), "{}", stderr(&check));
}

#[test]
fn every_protocol_takes_its_settings_in_the_same_ways() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let total = |more: &[&str]| {
        let seen = palpate(at, &[&["run"], more, &["--preview", "--json"]].concat());
        succeeded(&seen);
        json(&seen)["expected"].as_f64().unwrap()
    };
    let usual = total(&["ramp-hold"]);
    let longer = total(&["ramp-hold", "--set", "hold=70 s"]);
    assert!((longer - usual - 20.0).abs() < 1e-6, "{usual} {longer}");
    assert_eq!(total(&["ramp-hold", "--hold", "70"]), longer);
    // 15 mm less at 0.75 mm/s in and 6 mm/s out. --set goes with what is short for it, and every protocol with such a parameter takes both.
    let both = total(&["ramp-hold", "--depth", "15", "--set", "hold=70 s"]);
    assert!((both - longer + 22.5).abs() < 0.01, "{both} {longer}");
    let cycles = total(&["preconditioning", "--set", "depth=15 mm"]);
    assert_eq!(total(&["preconditioning", "--depth", "15"]), cycles);
    for (more, words) in [
        (&["ramp-hold", "--hold", "5", "--set", "hold=6 s"][..], "--set hold"),
        (&["ramp-hold", "--set", "hold=5"], "5 has no unit"),
        (&["ramp-hold", "--hold-until", "tau"], "'tau'"),
        (&["load-cell-calibration", "--depth", "5"], "parameter 'depth'"),
        (&["--hold", "5"], "give the name of a protocol"),
    ] {
        let refused = palpate(at, &[&["run"], more].concat());
        assert_eq!(refused.status.code(), Some(2));
        assert!(stderr(&refused).contains(words), "{}", stderr(&refused));
    }
}

#[test]
fn a_limit_that_changes_nothing_is_reported_where_it_stands() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for (limit, is_reported) in [
        ("force_max = 6 N", false),
        ("force_max = 9 N", true),
        ("force_max = 12 N", true),
        ("travel_max = 100 mm", false),
        ("travel_max = 1000 mm", true),
    ] {
        let (name, value) = limit.split_once(" = ").unwrap();
        let limited =
            MINE.replace("[procedure]", &format!("[limits]\n{name} = \"{value}\"\n\n[procedure]"));
        std::fs::write(at.join("mine.toml"), limited).unwrap();
        let check = palpate(at, &["protocol", "check", "mine.toml"]);
        succeeded(&check);
        let printed = stdout(&check);
        let words = format!("line 12: warning: {limit}");
        assert_eq!(printed.contains(&words), is_reported, "{printed}");
        assert_eq!(printed.contains("stops at "), is_reported, "{printed}");
        let preview = palpate(at, &["protocol", "preview", "mine.toml"]);
        succeeded(&preview);
        let message = stdout(&preview) + &stderr(&preview);
        assert_eq!(message.matches("has no effect").count(), usize::from(is_reported), "{message}");
    }
}

#[test]
fn a_search_ends_before_the_base_where_the_technician_says_it_stands() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let run = |name: &str, end: &str| {
        let args = ["run", "zeroing", "--time-scale", "max", "--out", name];
        palpate(at, &[&args[..], &["--travel-max", end]].concat())
    };
    let short = run("short", "20");
    assert_eq!(short.status.code(), Some(1));
    let words = "19.0 mm";
    assert!(stderr(&short).contains(words), "{}", stderr(&short));
    let columns = ["export", "short", "--format", "csv", "--columns", "pulses"];
    succeeded(&palpate(at, &columns));
    let table = std::fs::read_to_string(at.join("short.csv")).unwrap();
    let furthest = table.lines().skip(1).map(|line| {
        let last = line.rsplit(',').next().unwrap();
        0.015 * last.parse::<f64>().unwrap()
    });
    let furthest = furthest.fold(0.0, f64::max);
    // It did go all the way, and no pulse of 0.015 mm further.
    assert!((18.9..19.02).contains(&furthest), "{furthest}");
    for end in ["0", "-3", "1000", "nan"] {
        let refused = run("wrong", end);
        assert_eq!(refused.status.code(), Some(2), "{end}");
    }
    assert!(!at.join("wrong").exists());
    succeeded(&palpate(at, &["replay", "short"]));
}
