//! Labels of a session, later edits of it, and the report on it.

use crate::support::{
    answer, assert_prints, assert_refused, assert_says, json, palpate, short_run, stderr, stdout,
    succeeded, typed,
};
use palpate_sessions::log::Session;
use std::fs;

#[test]
fn what_is_reported_stands_in_the_session_and_the_table() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let printed = [
        "--specimen",
        "pig 7",
        "--about",
        "specimen.source=pig stomach",
        "--about",
        "specimen.thickness_mm=11.5",
        "--about",
        "series.repeat=2",
    ];
    succeeded(&short_run(at, "printed", &printed));
    let info = palpate(at, &["info", "printed", "--json"]);
    let info = json(&info);
    assert_eq!(info["about"]["specimen.thickness_mm"], 11.5);
    assert_eq!(info["about"]["series.repeat"], 2);
    assert_eq!(info["signal"]["sample_rate_hz"], 1000.0);
    let text = stdout(&palpate(at, &["info", "printed"]));
    assert!(text.contains("specimen.source pig stomach"), "{text}");
    assert!(text.contains("filter none"), "{text}");
    // Who looks for the key finds it in the refusal.
    let unknown = short_run(at, "never", &["--about", "specimen.colour=red"]);
    assert_refused(&unknown, 2, "specimen.hydration");
    let beyond = ["--about", "series.repeat=4", "--about", "series.repeats=3"];
    let beyond = short_run(at, "never", &beyond);
    assert_refused(&beyond, 2, "repeat 4 of 3");
    assert!(!at.join("never").exists());
}

#[test]
fn a_run_ends_with_a_verdict_and_a_report_of_its_targets() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let run = json(&short_run(at, "fine", &["--unload", "1.5", "--json"]));
    assert_eq!(run["verdict"], "valid", "{run}");
    let report = json(&palpate(at, &["report", "fine", "--json"]));
    assert_eq!((&report["ending"], &report["verdict"]), (&"finish".into(), &"valid".into()));
    assert_eq!((&report["dropped"], &report["late"]), (&0.into(), &0.into()));
    let targets = report["targets"].as_array().unwrap();
    let achieved = |step: &str, quantity: &str| {
        let one = targets.iter().find(|one| one["step"] == step && one["quantity"] == quantity);
        one.unwrap_or_else(|| panic!("{step} {quantity} in {report}"))["achieved"].as_f64().unwrap()
    };
    // A whole number of 15 um pulses is 6 mm, and the clock is exact.
    assert!((achieved("ramp", "depth") - 6.0).abs() <= 0.0075);
    assert!((achieved("ramp", "speed") - 3.0).abs() < 1e-6);
    assert!((achieved("ramp", "speed by pulses") - 3.0).abs() < 0.01);
    assert!((achieved("unload", "speed") - 1.5).abs() < 1e-6);
    assert!((achieved("hold", "duration") - 1.0).abs() < 1e-9);
    let time = &report["time_use"];
    let total: f64 = ["set_up_s", "motion_s", "hold_s", "waiting_s"]
        .iter()
        .map(|name| time[name].as_f64().unwrap())
        .sum();
    assert!((total - run["duration_s"].as_f64().unwrap()).abs() < 0.01);
    assert!((time["hold_s"].as_f64().unwrap() - 1.0).abs() < 0.002);
    let text = stdout(&palpate(at, &["report", "fine"]));
    assert!(text.contains("all met") && text.contains("waiting"), "{text}");
}

#[test]
fn a_corrected_contact_moves_every_depth_by_the_difference_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&short_run(at, "run", &[]));
    let info = json(&palpate(at, &["info", "run", "--json"]));
    assert_eq!(info["edits"].as_array().unwrap().len(), 1);
    let before = Session::open(&at.join("run")).unwrap();
    let found = palpate_analysis::edited_session::contacts(&before.entries)[0].position.0;
    let log = fs::read(at.join("run/000.mcap")).unwrap();
    let position = format!("{}", found - 0.25);
    let correct = |position: &str, reason: &str| {
        palpate(
            at,
            &[
                "correct-contact",
                "run",
                "--position",
                position,
                "--reason",
                reason,
                "--by",
                "Ada",
                "--json",
            ],
        )
    };
    let corrected = correct(&position, "seen on the video");
    succeeded(&corrected);
    let change = json(&corrected)["depth_change_mm"].as_f64().unwrap();
    assert!((change - 0.25).abs() < 1e-12);
    let after = palpate_analysis::edited_session::open(&at.join("run")).unwrap().session;
    let mut moved = 0;
    for (old, new) in before.rows.iter().zip(&after.rows) {
        match (old.depth, new.depth) {
            (Some(old), Some(new)) => {
                assert_eq!(new, old + change);
                moved += 1;
            }
            (old, new) => assert_eq!(old, new),
        }
        assert_eq!((old.force, old.volts, old.pulses), (new.force, new.volts, new.pulses));
    }
    assert!(moved > 3000);
    // Every reader says so, and the log is what it was.
    for args in [
        &["fit", "run"][..],
        &["info", "run"],
        &["export", "run", "--format", "csv"],
        &["report", "run"],
    ] {
        let output = palpate(at, args);
        let all = stdout(&output) + &stderr(&output);
        assert!(
            all.contains("contact 1 was corrected") && all.contains("seen on the video"),
            "{args:?}: {all}"
        );
    }
    assert_eq!(fs::read(at.join("run/000.mcap")).unwrap(), log);
    let replay = json(&palpate(at, &["replay", "run", "--json"]));
    assert_eq!(
        (&replay["differing"], &replay["sessions"][0]["depth_difference_mm"]),
        (&0.into(), &0.0.into())
    );
    // Where it cannot have been.
    for (position, printed) in [("-1", "travel"), ("x", "not a finite number")] {
        let refused = correct(position, "why");
        assert_eq!(refused.status.code(), Some(2));
        assert!(stderr(&refused).contains(printed), "{}", stderr(&refused));
    }
    let mute = correct("41", " ");
    assert_refused(&mute, 2, "needs a reason");
}

#[test]
fn a_rejected_session_is_left_out_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for (name, seed) in [("all/a", "1"), ("all/b", "2"), ("all/c", "3")] {
        succeeded(&short_run(at, name, &["--seed", seed]));
    }
    let reject = answer(&palpate(
        at,
        &[
            "verdict",
            "all/b",
            "rejected",
            "--reason",
            "hair under the probe",
            "--by",
            "Ada",
            "--json",
        ],
    ));
    assert_eq!((&reject["was"], &reject["verdict"]), (&"valid".into(), &"rejected".into()));
    let alone = palpate(at, &["fit", "all/b"]);
    assert_refused(&alone, 2, "rejected (hair under the probe)");
    succeeded(&palpate(at, &["fit", "all/b", "--include-rejected"]));
    let batch = palpate(at, &["fit", "all", "--json"]);
    succeeded(&batch);
    let text = stdout(&batch);
    let lines: Vec<serde_json::Value> =
        text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 3);
    assert_eq!(lines[1]["rejected"], "hair under the probe");
    assert!(lines[0]["samples"].is_u64() && lines[2]["samples"].is_u64());
    assert_says(&batch, "3 sources, 1");
    let together = palpate(at, &["fit", "all", "--share", "body"]);
    succeeded(&together);
    assert_prints(&together, "2 records together");
    assert!(stderr(&together).contains("3 sources, 1"));
    // A second thought is one more line; the first stays.
    let again = ["verdict", "all/b", "suspect", "--reason", "the hair was outside"];
    succeeded(&palpate(at, &again));
    let info = json(&palpate(at, &["info", "all/b", "--json"]));
    assert_eq!((&info["verdict"], info["edits"].as_array().unwrap().len()), (&"suspect".into(), 3));
    let fit = palpate(at, &["fit", "all/b"]);
    succeeded(&fit);
    assert!(stderr(&fit).contains("the hair was outside"));
    // Every reader notices a forged edit.
    let edits = at.join("all/b/edits.jsonl");
    let changed = fs::read_to_string(&edits).unwrap().replace("hair under", "air under");
    fs::write(&edits, changed).unwrap();
    for args in
        [&["fit", "all/b"][..], &["info", "all/b"], &["verdict", "all/b", "valid", "--reason", "x"]]
    {
        let refused = palpate(at, args);
        assert_eq!(refused.status.code(), Some(1), "{args:?}");
        assert_says(&refused, "line 2 of");
    }
}

#[test]
fn a_rig_that_failed_its_check_today_runs_only_if_somebody_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let first = short_run(at, "first", &[]);
    succeeded(&first);
    assert_says(&first, "daily check");
    let check = |more: &[&str]| {
        let mut args = vec!["daily-check", "--time-scale", "max", "--operator", "Ada", "--json"];
        args.extend(more);
        palpate(at, &args)
    };
    let passed = check(&[]);
    succeeded(&passed);
    let passed = json(&passed);
    assert_eq!(passed["is_passed"], true);
    let parts: Vec<&str> = passed["parts"]
        .as_array()
        .unwrap()
        .iter()
        .filter_map(|part| part["what"].as_str())
        .collect();
    assert_eq!(parts, ["zero", "weight", "home"]);
    let open = short_run(at, "open", &[]);
    succeeded(&open);
    assert!(!stderr(&open).contains("daily check"), "{}", stderr(&open));
    // The curve of another cell: neither its zero nor its weight is right.
    let failed = check(&["--profile", "ideal", "--calibration", "thesis"]);
    assert_refused(&failed, 1, "840 g reads");
    let refused = short_run(at, "refused", &[]);
    assert_eq!(refused.status.code(), Some(2));
    let why = stderr(&refused);
    assert!(why.contains("failed its daily check") && why.contains("--acknowledge"), "{why}");
    assert!(!at.join("refused").exists());
    succeeded(&short_run(at, "acknowledged", &["--acknowledge"]));
    let info = json(&palpate(at, &["info", "acknowledged", "--json"]));
    let printed = info["acknowledgements"].to_string();
    assert!(printed.contains("failed its daily check"), "{printed}");
    // A check that passes opens the rig again; all three are kept.
    succeeded(&check(&[]));
    succeeded(&short_run(at, "again", &[]));
    let kept = fs::read_to_string(at.join("library/checks/sim.jsonl")).unwrap();
    assert_eq!(kept.lines().count(), 3);
}

#[test]
fn a_jog_is_motion_and_has_no_cycles() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let jog = ["run", "free-jog", "--time-scale", "max", "--out", "jog"];
    succeeded(&palpate(at, &jog));
    let report = palpate(at, &["report", "jog", "--json"]);
    succeeded(&report);
    // 5 mm at 3 mm/s behind a self-test of half a second.
    let motion = json(&report)["time_use"]["motion_s"].as_f64().unwrap();
    assert!((motion - 5.0 / 3.0).abs() < 0.1, "{motion}");
    let nothing = palpate(at, &["analyse", "jog"]);
    assert_eq!(nothing.status.code(), Some(1));
    let printed = stderr(&nothing);
    assert!(printed.contains("no loading and no sine") && !printed.contains("fit"), "{printed}");
}

#[test]
fn a_daily_check_asks_for_its_operator_and_a_weight_that_tells_something() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let check = ["daily-check", "--time-scale", "max"];
    for (more, words) in
        [(&[][..], "operator"), (&["--operator", "Ada", "--mass", "500"], "0.508 N")]
    {
        let refused = palpate(at, &[&check[..], more].concat());
        assert_eq!(refused.status.code(), Some(2), "{more:?}");
        assert!(stderr(&refused).contains(words), "{}", stderr(&refused));
    }
    // The same steps without a judgement keep no check, and say so.
    let run = ["run", "daily-check", "--time-scale", "max", "--operator", "Ada"];
    let run = palpate(at, &run);
    succeeded(&run);
    assert_says(&run, "'palpate daily-check'");
    assert!(!at.join("library/checks").exists());
}

#[test]
fn a_thickness_is_reported_by_the_run_and_by_its_session() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let run =
        ["run", "zeroing", "--set", "thickness=true", "--thickness", "20", "--compliance", "20"];
    let how = ["--time-scale", "max", "--out", "thick", "--json"];
    let run = answer(&palpate(at, &[&run[..], &how].concat()));
    let number = |name: &str| run[name].as_f64().unwrap();
    let (thickness, error) = (number("thickness_mm"), number("thickness_std_error_mm"));
    // Four standard errors, and a pulse for the rig that gives way at the contact.
    assert!((thickness - 20.0).abs() < 4.0 * error + 0.015, "{run}");
    let between = number("base_mm") - number("contact_mm");
    assert!((between - thickness).abs() < 1e-9, "{run}");
    let line = format!("thickness  {thickness:.3} ± {error:.3} mm");
    for command in ["info", "report"] {
        let printed = json(&palpate(at, &[command, "thick", "--json"]));
        for name in ["base_mm", "base_std_error_mm", "thickness_mm", "thickness_std_error_mm"] {
            assert_eq!(printed[name], run[name], "{command} {name}");
        }
        let text = stdout(&palpate(at, &[command, "thick"]));
        assert!(text.contains(&line), "{text}");
    }
}

/// One message per sample, selected as tables are, in a new file that is no session.
#[test]
fn samples_are_exported_as_messages() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&short_run(at, "run", &[]));
    let session = palpate_sessions::Session::open(&at.join("run")).unwrap();
    let all = json(&typed(at, "export run --mcap-full all.mcap --json"));
    assert_eq!(all["rows"].as_u64(), Some(session.rows.len() as u64));
    assert_eq!((&all["format"], &all["dictionary"]), (&"mcap".into(), &serde_json::Value::Null));
    let hold = ["--phase", "hold", "--decimate", "10", "--json"];
    let part = [&["export", "run", "--mcap-full", "hold.mcap"][..], &hold].concat();
    let part = json(&palpate(at, &part));
    let held = session.rows.iter();
    let held = held.filter(|row| row.phase == palpate_model::rig::Phase::Hold).count();
    assert_eq!(part["rows"].as_u64(), Some(held.div_ceil(10) as u64));
    for (args, code, word) in [
        (&["export", "run", "--mcap-full", "all.mcap"][..], 2, "exists already"),
        (&["export", "run", "--mcap-full", "b.mcap", "--columns", "t_s"], 2, "used with"),
        (&["export", "run", "--mcap-full", "none/b.mcap"], 1, "none"),
        (&["info", "all.mcap"], 2, "not a palpate session"),
    ] {
        let refused = palpate(at, args);
        assert_eq!(refused.status.code(), Some(code), "{args:?}: {}", stderr(&refused));
        assert!(stderr(&refused).contains(word), "{args:?}: {}", stderr(&refused));
    }
    assert!(!at.join("b.mcap").exists());
}

/// One run of Bluesky documents, selected as tables are, in a new file that is no session.
#[test]
fn samples_are_exported_as_bluesky_documents() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&short_run(at, "run", &[]));
    let session = palpate_sessions::Session::open(&at.join("run")).unwrap();
    let documents = |name: &str| -> Vec<(String, serde_json::Value)> {
        let text = std::fs::read_to_string(at.join(name)).unwrap();
        // What is not known is NaN, as in Python's JSON.
        let line = |line: &str| serde_json::from_str(&line.replace("NaN", "null")).unwrap();
        text.lines().map(line).collect()
    };
    let all = json(&typed(at, "export run --bluesky all.jsonl --json"));
    let count = session.rows.len() as u64;
    assert_eq!(all["rows"].as_u64(), Some(count));
    assert_eq!((&all["format"], &all["dictionary"]), (&"bluesky".into(), &serde_json::Value::Null));
    let run = documents("all.jsonl");
    let (start, stop) = (&run[0].1, &run.last().unwrap().1);
    assert_eq!(start["palpate"]["session_id"], session.manifest.session_id.as_str());
    assert_eq!(start["plan_name"], session.manifest.plan["name"]);
    assert_eq!((&stop["exit_status"], &stop["outcome"]), (&"success".into(), &"finish".into()));
    assert_eq!(stop["num_events"]["primary"].as_u64(), Some(count));
    assert_eq!(stop["num_events"]["entries"].as_u64(), Some(session.entries.len() as u64));
    // Another analysis of the session is another run.
    succeeded(&palpate(at, &["mask", "run", "--name", "none", "--leave-out", "0..1000"]));
    succeeded(&typed(at, "export run --bluesky masked.jsonl --analysis none"));
    let masked = documents("masked.jsonl");
    assert_ne!(masked[0].1["uid"], start["uid"]);
    assert_eq!(masked[1].1["data_keys"].get("force_N"), None);
    let hold = ["--phase", "hold", "--decimate", "10", "--json"];
    let part = [&["export", "run", "--bluesky", "hold.jsonl"][..], &hold].concat();
    let part = json(&palpate(at, &part));
    let held = session.rows.iter();
    let held = held.filter(|row| row.phase == palpate_model::rig::Phase::Hold).count();
    assert_eq!(part["rows"].as_u64(), Some(held.div_ceil(10) as u64));
    for (args, code, word) in [
        (&["export", "run", "--bluesky", "all.jsonl"][..], 2, "exists already"),
        (&["export", "run", "--bluesky", "b.jsonl", "--columns", "t_s"], 2, "used with"),
        (&["export", "run", "--bluesky", "b.jsonl", "--mcap-full", "b.mcap"], 2, "used with"),
        (&["export", "run", "run", "--bluesky", "b.jsonl"], 2, "one session"),
        (&["export", "run", "--bluesky", "none/b.jsonl"], 1, "none"),
    ] {
        let refused = palpate(at, args);
        assert_eq!(refused.status.code(), Some(code), "{args:?}: {}", stderr(&refused));
        assert!(stderr(&refused).contains(word), "{args:?}: {}", stderr(&refused));
    }
    assert!(!at.join("b.jsonl").exists());
}

#[test]
fn words_of_a_session_give_the_terminal_no_orders() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&short_run(at, "one", &["--specimen", "gel\u{1b}[2J 3"]));
    let reason = "hair\nsession    \u{1b}[31mother";
    let message = palpate(at, &["verdict", "one", "suspect", "--reason", reason]);
    succeeded(&message);
    let info = palpate(at, &["info", "one"]);
    succeeded(&info);
    for output in [&message, &info, &palpate(at, &["doctor", "one"])] {
        let text = stdout(output) + &stderr(output);
        assert!(!text.contains('\u{1b}'), "{text:?}");
        assert!(
            text.lines().all(|line| !line.contains("other") || line.contains("hair")),
            "{text}"
        );
    }
    assert_prints(&info, "gel [2J 3");
    // The object has the text unchanged.
    let object = json(&palpate(at, &["info", "one", "--json"]));
    assert_eq!(object["verdict_reason"], reason);
}

#[test]
fn an_exported_table_has_the_whole_name_of_the_folder() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&short_run(at, "depth-2.5", &[]));
    succeeded(&typed(at, "export depth-2.5 --format csv --to ."));
    assert!(at.join("depth-2.5.csv").exists());
}

#[test]
fn the_noise_of_a_run_is_judged_by_the_last_daily_check_of_its_rig() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let quality = |session: &str| json(&palpate(at, &["quality", session, "--json"]));
    let noise = |found: &serde_json::Value| found["checks"][1].clone();
    succeeded(&short_run(at, "before", &[]));
    let before = quality("before");
    assert_eq!((&before["rank"], &noise(&before)["rank"]), (&"good".into(), &"not judged".into()));
    succeeded(&typed(at, "daily-check --operator Ada --time-scale max"));
    succeeded(&short_run(at, "usual", &[]));
    assert_eq!(noise(&quality("usual"))["rank"], "good");
    let text = stdout(&palpate(at, &["quality", "usual"]));
    assert!(text.starts_with("quality") && text.lines().count() == 10, "{text}");
    // 9 mV where the check of the lab rig has 1.
    succeeded(&short_run(at, "loud", &["--profile", "ideal", "--noise", "60"]));
    let loud = noise(&quality("loud"));
    assert_eq!(loud["rank"], "doubtful", "{loud}");
    assert!(loud["sentence"].as_str().unwrap().contains("loose plug"), "{loud}");
}
