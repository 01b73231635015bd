//! Programmes and the calibration they measure, as a user meets them.

use crate::protocol::with_mine;
use crate::support::{
    answer, assert_prints, assert_refused, json, palpate, split_words, stderr, stdout, succeeded,
    typed,
};
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
    let refused = typed(at, "run deep.toml --out day --time-scale max");
    assert_eq!(refused.status.code(), Some(2));
    let printed = stderr(&refused);
    assert!(printed.contains("line 10: task 'press'") && printed.contains("200"), "{printed}");
    assert!(!at.join("day").exists(), "something ran");

    fs::write(at.join("two.toml"), TWO.replace("DEPTH", "10 mm")).unwrap();
    let ahead = palpate(at, &["run", "two.toml", "--preview", "--json"]);
    succeeded(&ahead);
    assert_eq!(json(&ahead)["sessions"], 2);
    let run = split_words("run two.toml --out day --time-scale max --json");
    let done = palpate(at, &run);
    succeeded(&done);
    let report = json(&done);
    assert_eq!(report["runs"].as_array().map(Vec::len), Some(2), "{report}");
    assert_eq!(report["tasks"][1]["fits"].as_array().map(Vec::len), Some(1), "{report}");
    let page = fs::read_to_string(at.join("day/summary.html")).unwrap();
    assert!(page.contains("<svg") && page.contains("press/01"), "no page");

    // Rejected, it stays in the count and is fitted no more.
    let verdict = ["verdict", "day/press/01", "rejected", "--reason", "a hair on the probe"];
    succeeded(&palpate(at, &verdict));
    let again = palpate(at, &run);
    succeeded(&again);
    let report = json(&again);
    assert_eq!(report["was_continued"], true);
    assert_eq!(report["tasks"][1]["fits"].as_array().map(Vec::len), Some(0), "{report}");
    assert_eq!(report["runs"][1]["verdict"], "rejected: a hair on the probe");
}

#[test]
fn weights_read_on_the_rig_become_a_document() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let weigh = |masses: &[&str], out: &str| {
        let common = split_words(
            "run load-cell-calibration --set repeats=1 --operator Ada --time-scale max --out",
        );
        succeeded(&palpate(at, &[&common[..], &[out], masses].concat()));
    };
    weigh(&[], "weights");
    let import = |session: &'static str| ["calibration", "import", session, "--name", session];
    succeeded(&palpate(at, &import("weights")));
    let shown = palpate(at, &["calibration", "show", "weights"]);
    succeeded(&shown);
    assert_prints(&shown, "840.0");

    // Three weights do not tell the curve of this cell.
    weigh(&["--set", "masses=340 g, 840 g"], "few");
    let checked = json(&palpate(at, &["quality", "few", "--json"]));
    let rank = |name: &str| {
        let mut checks = checked["checks"].as_array().unwrap().iter();
        checks.find(|one| one["name"] == name).unwrap()["rank"].clone()
    };
    assert_eq!((rank("weights"), rank("range")), ("bad".into(), "good".into()), "{checked}");
    assert_refused(&palpate(at, &import("few")), 1, "too few to tell the curve");
    let despite = [&import("few")[..], &["--despite", "only to look at", "--json"]].concat();
    let kept = answer(&palpate(at, &despite));
    let source = kept["document"]["source"].as_str().unwrap();
    assert!(source.ends_with("kept despite its checks: only to look at"), "{source}");
}

const ASKING: &str = r#"palpate-programme = 1
name = "asking"
title = "Two tasks that ask"

[[task]]
name = "press"
protocol = "mine.toml"
specimen = 2

[[task]]
name = "press-again"
protocol = "mine.toml"
set = { depth = "DEPTH" }
"#;

#[test]
fn what_its_protocols_ask_for_is_reported_before_anything_moves_and_stands_in_every_session() {
    let folder = with_mine();
    let at = folder.path();
    let write = |name: &str, text: String| fs::write(at.join(name), text).unwrap();
    write("asking.toml", ASKING.replace("DEPTH", "5 mm"));
    let run = |more: &[&str]| {
        let run = ["run", "asking.toml", "--out", "day", "--time-scale", "max"];
        palpate(at, &[&run, more].concat())
    };
    // Every task with every word, and nothing has moved.
    for (more, is_nameless) in [(&[][..], true), (&["--operator", "Ada"][..], false)] {
        let refused = run(more);
        assert_eq!(refused.status.code(), Some(2));
        let printed = stderr(&refused);
        for fact in ["line 5: task 'press'", "line 10: task 'press-again'", "specimen.storage"] {
            assert!(printed.contains(fact), "{fact}: {printed}");
        }
        assert_eq!(printed.contains("operator ("), is_nameless, "{printed}");
        assert!(
            printed.contains("[about]") && printed.trim_end().lines().count() == 1,
            "{printed}"
        );
        assert!(!at.join("day").exists(), "something ran");
    }
    let check = palpate(at, &["protocol", "check", "asking.toml"]);
    succeeded(&check);
    assert_prints(&check, "asking.toml, line 5: warning: ");

    let about = "[about]\noperator = \"Ada\"\nspecimen.storage = \"saline\"\nspecimen.temperature_c = 21\n\n[[task]]";
    write("asking.toml", ASKING.replace("DEPTH", "5 mm").replacen("[[task]]", about, 1));
    let done = run(&["--specimen", "<stomach>", "--about", "specimen.temperature_c=4", "--json"]);
    succeeded(&done);
    let report = json(&done);
    for i in 0..2 {
        assert_eq!(report["runs"][i]["operator"], "Ada");
        assert_eq!(report["runs"][i]["specimen"], "<stomach>, specimen 2");
    }
    for session in ["day/press/01", "day/press-again/01"] {
        let session = palpate_sessions::log::Session::open(&at.join(session)).unwrap();
        let (manifest, about) = (&session.manifest, &session.manifest.about);
        assert_eq!(manifest.operator, "Ada");
        assert_eq!(manifest.indenter, "blunt 12 mm probe");
        assert_eq!(about.get("specimen.storage"), Some(&"saline".into()));
        assert_eq!(about.get("specimen.temperature_c"), Some(&4.0.into()));
    }
    let page = fs::read_to_string(at.join("day/summary.html")).unwrap();
    for words in
        ["operator", "&lt;stomach&gt;, specimen 2, with the blunt", "specimen.storage: saline"]
    {
        assert!(page.contains(words), "{words}: {page}");
    }
}

#[test]
fn check_looks_at_a_programme_whole() {
    let folder = with_mine();
    let at = folder.path();
    let check = |text: String| {
        fs::write(at.join("asking.toml"), text).unwrap();
        palpate(at, &["protocol", "check", "asking.toml"])
    };
    let about = "[about]\noperator = \"Ada\"\nspecimen.storage = \"saline\"\n\n[[task]]";
    let printed = ASKING.replacen("[[task]]", about, 1);
    let sound = check(printed.replace("DEPTH", "5 mm"));
    succeeded(&sound);
    assert_prints(&sound, "asking.toml: sound, about");
    let shown = palpate(at, &["protocol", "preview", "asking.toml"]);
    assert_refused(&shown, 2, "'palpate run asking.toml --preview'");
    // What a run would refuse, line by line.
    for (text, words) in [
        (printed.replace("DEPTH", "12 mm"), "line 17: parameter 'depth'"),
        (
            printed.replace("DEPTH", "5 mm").replace("\"mine.toml\"\nset", "\"theirs.toml\"\nset"),
            "line 16: 'theirs.toml'",
        ),
        (
            printed.replace("mine.toml", "ramp-hold").replace("DEPTH", "200 mm"),
            "task 'press-again': step 5",
        ),
        (
            printed.replace("DEPTH", "5 mm").replace("palpate-programme = 1\n", ""),
            "palpate-programme",
        ),
    ] {
        let refused = check(text);
        assert_eq!(refused.status.code(), Some(2));
        assert!(stdout(&refused).contains(words), "{words}: {}", stdout(&refused));
        let run = palpate(at, &["run", "asking.toml", "--out", "day"]);
        assert_eq!(run.status.code(), Some(2));
        assert!(stderr(&run).contains(words), "{words}: {}", stderr(&run));
    }
    let deep = printed.replace("mine.toml", "ramp-hold").replace("DEPTH", "45 mm");
    let warned = check(deep);
    succeeded(&warned);
    assert!(
        stdout(&warned).contains("line 14: warning: ")
            && stdout(&warned).contains("acknowledge = true"),
        "{}",
        stdout(&warned)
    );
}

#[test]
fn a_rig_that_failed_its_check_refuses_a_programme_before_its_first_task() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let failed = split_words(
        "daily-check --time-scale max --operator Ada --profile ideal --calibration thesis",
    );
    assert_eq!(palpate(at, &failed).status.code(), Some(1));
    fs::write(at.join("two.toml"), TWO.replace("DEPTH", "10 mm")).unwrap();
    let refused = typed(at, "run two.toml --out day --time-scale max");
    assert_eq!(refused.status.code(), Some(2));
    let printed = stderr(&refused);
    assert!(
        printed.contains("line 6: task 'look'") && printed.contains("daily check"),
        "{printed}"
    );
    assert!(!at.join("day").exists(), "something ran");
}

const PAIR: &str = r#"
palpate-programme = 1
name = "pair"
title = "Two tasks, one compared with the other"

[[task]]
name = "first"
protocol = "ramp-hold"
set = { depth = "10 mm", hold = "1 s", speed = "3 mm/s" }
repeats = 2

[[task]]
name = "second"
protocol = "ramp-hold"
set = { depth = "10 mm", hold = "1 s", speed = "3 mm/s" }
validates = "first"
"#;

#[test]
fn the_page_tells_the_calibrations_part_and_what_is_rejected_missing_or_damaged() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("pair.toml"), PAIR).unwrap();
    let run = ["run", "pair.toml", "--out", "day", "--time-scale", "max"];
    let as_json = || palpate(at, &[&run[..], &["--json"]].concat());
    let page = || fs::read_to_string(at.join("day/summary.html")).unwrap();
    let done = as_json();
    succeeded(&done);
    let report = json(&done);
    let predictions = |report: &serde_json::Value| {
        let lines = report["tasks"][1]["predictions"].as_array();
        lines.map_or(0, Vec::len)
    };
    assert_eq!(predictions(&report), 1, "{report}");
    // Number for number what 'palpate fit' says, the calibration's part among it.
    let fit = palpate(at, &["fit", "day/first/01", "--json"]);
    succeeded(&fit);
    let (alone, own) = (json(&fit), &report["tasks"][0]["fits"][0]);
    assert!(alone["parameters"][0]["systematic_error"].as_f64() > Some(0.0));
    assert_eq!(own["parameters"], alone["parameters"]);
    let text = report["tasks"][0]["text"].as_str().unwrap();
    for words in [", total [", "uncertainty budget, in shares", "systematic standard uncertainty"] {
        assert!(text.contains(words) && page().contains(words), "{words}: {text}");
    }

    // Without a session to compare with the page says why it does not.
    for session in ["day/first/01", "day/first/02"] {
        let verdict = ["verdict", session, "rejected", "--reason", "a hair"];
        succeeded(&palpate(at, &verdict));
    }
    let again = as_json();
    succeeded(&again);
    assert_eq!(predictions(&json(&again)), 0);
    let words = "first/01: rejected";
    assert!(page().contains(words), "{}", page());

    // One is gone, and one is noise; the edits of it belonged to another recording.
    fs::remove_dir_all(at.join("day/first/02")).unwrap();
    let log = at.join("day/second/01").join(palpate_sessions::LOG_FILE);
    let length = fs::metadata(&log).unwrap().len() as usize;
    let noise: Vec<u8> = (0..length).map(|i| (i * 7919 % 251) as u8).collect();
    let sound = fs::read(&log).unwrap();
    for damaged in [noise.clone(), [&sound[..length / 2], &noise[length / 2..]].concat()] {
        fs::write(&log, damaged).unwrap();
        let printed = palpate(at, &run);
        assert_eq!(printed.status.code(), Some(1), "{}", stdout(&printed));
        let row = |start: &str| {
            let text = stdout(&printed);
            let mut rows = text.lines().map(str::to_owned);
            rows.find(|row| row.starts_with(start) && !row.contains("first/01"))
        };
        assert!(row("first").unwrap().contains("finish, now missing  -"));
        let second = row("second").unwrap();
        assert!(second.contains("now damaged") && !second.contains("valid"), "{second}");
        assert!(
            stderr(&printed).contains("first/02") && stderr(&printed).contains("second/01"),
            "{}",
            stderr(&printed)
        );
        for words in ["first/02 is missing", "first/02: missing", "second/01: damaged"] {
            assert!(page().contains(words), "{words}: {}", page());
        }
        let printed = palpate(at, &[&run[..], &["--json"]].concat());
        let line = stdout(&printed).lines().next().unwrap().to_owned();
        let report: serde_json::Value = serde_json::from_str(&line).unwrap();
        let run = &report["runs"][1];
        assert_eq!((&run["lost"], run["duration_s"].is_null()), (&"missing".into(), true));
        assert_eq!(report["runs"][2]["lost"], "damaged");
        assert!(report["runs"][2]["verdict"].is_null(), "{report}");
    }
}

#[test]
fn a_programme_goes_on_only_on_the_rig_and_with_the_protocols_it_was_begun_with() {
    const JOGS: &str = r#"
palpate-programme = 1
name = "jogs"
title = "Jogs"

[[task]]
name = "jog"
protocol = "jog.toml"
"#;
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let shown = palpate(at, &["protocol", "show", "free-jog"]);
    succeeded(&shown);
    fs::write(at.join("jog.toml"), stdout(&shown)).unwrap();
    fs::write(at.join("jogs.toml"), JOGS).unwrap();
    let run = |more: &[&str]| {
        let run = ["run", "jogs.toml", "--out", "day", "--time-scale"];
        palpate(at, &[&run[..], more].concat())
    };
    succeeded(&run(&["max"]));
    // Pace and operator change no sample.
    succeeded(&run(&["50", "--operator", "Ada"]));
    for (more, words) in [
        (["max", "--profile", "ideal"], "profile was 'lab'"),
        (["max", "--seed", "2"], "seed was '1'"),
        (["max", "--clock", "galil"], "clock was"),
        (["max", "--compliance", "100"], "compliance was"),
    ] {
        let refused = run(&more);
        assert_eq!(refused.status.code(), Some(2), "{words}");
        let printed = stderr(&refused);
        assert!(printed.contains(words) && printed.trim_end().lines().count() == 1, "{printed}");
    }
    let longer = stdout(&shown).replace("default = \"5 mm\"", "default = \"6 mm\"");
    fs::write(at.join("jog.toml"), longer).unwrap();
    let refused = run(&["max"]);
    assert_eq!(refused.status.code(), Some(2));
    let printed = stderr(&refused);
    assert!(printed.contains("task 'jog'"), "{printed}");
}
