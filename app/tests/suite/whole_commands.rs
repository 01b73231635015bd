//! Whole commands, their exit codes and their sentences.

use crate::support::{
    SHORT, answer, assert_prints, assert_refused, assert_says, background, json, log_file, palpate,
    short_run, stderr, stdout, succeeded, typed,
};
use palpate_test_support::wait::{in_time, until};
use std::path::Path;
use std::process::Command;

#[test]
fn a_run_says_that_its_live_errors_leave_the_calibration_out() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let run = short_run(at, "short", &[]);
    succeeded(&run);
    let words = "'palpate fit short'";
    let printed = stdout(&run);
    let live = printed.split_once(words).map(|(_, live)| live);
    assert!(live.is_some_and(|live| live.contains("tau_eps")), "{printed}");
    let fit = palpate(at, &["fit", "short"]);
    succeeded(&fit);
    assert_prints(&fit, ", total [");
}

#[test]
fn the_main_job_works_as_the_readme_writes_it() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let run = answer(&typed(at, "run ramp-hold --time-scale max --out demo --json"));
    assert_eq!((run["ending"].as_str(), run["command"].as_str()), (Some("finish"), Some("run")));

    let fit = answer(&palpate(at, &["fit", "demo", "--json"]));
    let parameters = fit["parameters"].as_array().unwrap();
    let value = |name: &str| {
        let one = parameters.iter().find(|one| one["name"] == name);
        one.and_then(|one| one["value"].as_f64()).unwrap_or_else(|| panic!("{name} in {fit}"))
    };
    // The simulated specimen varies by some percent around the thesis body.
    for (name, thesis) in [("tau_eps", 1.023), ("mu3", 0.000_434_5), ("tau_sig", 0.06)] {
        assert!((value(name) / thesis - 1.0).abs() < 0.25, "{name} = {}", value(name));
    }
    assert!(fit["r2"].as_f64().unwrap() > 0.999);
    assert_eq!(fit["samples"].as_u64().unwrap() / 1000, 90);

    let replay = answer(&palpate(at, &["replay", "demo", "--json"]));
    assert_eq!(replay["differing"], 0);
    assert!(replay["sessions"][0]["decisions"].as_u64().unwrap() > 30);
    assert_eq!(replay["sessions"][0]["force_difference_n"], 0.0);

    succeeded(&palpate(at, &["export", "demo", "--format", "parquet"]));
    succeeded(&typed(at, "export demo --format csv --to ."));
    assert!(at.join("demo.parquet").metadata().unwrap().len() > 100_000);

    // The exported table gives the fit of the session, within what equal weights change.
    let table = palpate(at, &["fit", "demo.csv", "--json"]);
    succeeded(&table);
    assert_eq!(json(&table)["samples"], fit["samples"]);

    let info = palpate(at, &["info", "demo", "--json"]);
    succeeded(&info);
    assert_eq!(json(&info)["ending"], "finish");
}

#[test]
fn one_seed_gives_one_session_at_any_pace() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&short_run(at, "max", &["--seed", "7"]));
    let mut paced = SHORT.to_vec();
    paced.extend(["--time-scale", "300", "--out", "paced", "--seed", "7"]);
    succeeded(&palpate(at, &paced));
    succeeded(&short_run(at, "other", &["--seed", "8"]));
    let open = |name: &str| palpate_sessions::log::Session::open(&at.join(name)).unwrap();
    let (max, paced, other) = (open("max"), open("paced"), open("other"));
    assert_eq!(max.manifest.rig.as_ref().unwrap().settings["seed"], "7");
    // Not assert_eq: a hundred thousand rows do not help a reader of the failure.
    assert!(max.rows == paced.rows, "{:?}", first_difference(&max.rows, &paced.rows));
    assert!(max.entries == paced.entries, "{:?}", first_difference(&max.entries, &paced.entries));
    assert!(max.rows != other.rows);
    // The recorded seed rebuilds the rig: run again with what the manifest says.
    let recorded = &max.manifest.rig.as_ref().unwrap().settings;
    succeeded(&short_run(
        at,
        "again",
        &[
            "--seed",
            &recorded["seed"],
            "--profile",
            &recorded["profile"],
            "--clock",
            &recorded["clock"],
        ],
    ));
    let again = open("again").rows;
    assert!(again == max.rows, "{:?}", first_difference(&again, &max.rows));
}

fn first_difference<T: PartialEq + std::fmt::Debug>(a: &[T], b: &[T]) -> Option<String> {
    let place = a.iter().zip(b).position(|(a, b)| a != b);
    place.map(|i| format!("{i}: {:?} {:?}", a[i], b[i])).or(Some(format!(
        "{} {}",
        a.len(),
        b.len()
    )))
}

#[test]
fn wrong_use_gets_one_sentence_and_exit_code_two() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::create_dir(at.join("full")).unwrap();
    std::fs::write(at.join("full/notes.txt"), "mine").unwrap();
    std::fs::write(at.join("noforce.csv"), "t_s,depth_mm\n0,0\n1,1\n").unwrap();
    std::fs::write(at.join("words.csv"), "t_s,depth_mm,force_N\n0,0,0\n1,one,1\n").unwrap();
    std::fs::write(at.join("nounits.csv"), "time,depth,force\n0,0,0\n1,1,1\n").unwrap();
    std::fs::write(at.join("random.mcap"), "this is no session").unwrap();
    std::fs::write(at.join("a-file"), "").unwrap();
    let run = |more: &[&'static str]| {
        let mut args = vec!["run", "ramp-hold", "--time-scale", "max"];
        args.extend(more);
        args
    };
    let cases: &[(Vec<&str>, &str)] = &[
        (run(&["--depth", "200", "--out", "x"]), "beyond the travel"),
        (run(&["--depth", "-3", "--out", "x"]), "give more than 0"),
        (run(&["--depth", "nan", "--out", "x"]), "not a finite number"),
        (run(&["--speed", "inf", "--out", "x"]), "not a finite number"),
        (run(&["--speed", "500", "--out", "x"]), "rig sim"),
        (run(&["--speed", "0.76", "--out", "x"]), "0.7500 and 0.7800 mm/s"),
        (run(&["--hold", "-1", "--out", "x"]), "give 0 s or more"),
        (vec!["run", "ramp-hold", "--time-scale", "fast"], "time scale"),
        (run(&["--profile", "perfect", "--out", "x"]), "perfect"),
        (run(&["--rig", "robot", "--out", "x"]), "'robot'"),
        (run(&["--depth", "45", "--out", "x"]), "calibrated"),
        (run(&["--out", "full"]), "not empty"),
        (run(&["--out", "a-file/x"]), "a-file"),
        (run(&["--out", "/proc/x"]), "/proc"),
        (vec!["fit", "nowhere"], "nowhere"),
        (vec!["fit", "noforce.csv"], "force"),
        (vec!["fit", "words.csv"], "line 3"),
        (vec!["fit", "nounits.csv"], "unit"),
        (vec!["fit", "random.mcap"], "random.mcap"),
        (vec!["fit", "noforce.csv", "--fixed", "f_offset"], "NAME=VALUE"),
        (vec!["fit", "noforce.csv", "--fixed", "gravity=9.8"], "gravity"),
        (vec!["replay", "full"], "full"),
        (vec!["export", "full", "--format", "csv"], "full"),
        (vec!["info", "nowhere"], "nowhere"),
        (vec!["dance"], "dance"),
    ];
    let mut failures = Vec::new();
    for (args, expected) in cases {
        let output = palpate(at, args);
        let message = stderr(&output);
        let is_right = output.status.code() == Some(2)
            && message.contains(expected)
            && !message.contains("panicked");
        if !is_right {
            failures.push(format!("{args:?} exit {:?}: {message}", output.status.code()));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    assert!(!at.join("x").exists(), "a refused run must not leave a folder");
}

#[test]
fn errors_reach_machines_as_one_object() {
    let folder = tempfile::tempdir().unwrap();
    let output = palpate(folder.path(), &["fit", "nowhere", "--json"]);
    let object = json(&output);
    assert_eq!(object["exit"], 2);
    assert!(object["error"].as_str().unwrap().contains("nowhere"));
}

#[test]
fn an_acknowledged_force_band_is_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let output = typed(
        at,
        "run ramp-hold --depth 45 --speed 6 --hold 1 --acknowledge --time-scale max --out deep",
    );
    // The specimen is stiffer than the interlock allows at that depth: the run ends, data kept.
    assert_refused(&output, 1, "interlock");
    let info = json(&palpate(at, &["info", "deep", "--json"]));
    assert_eq!(info["ending"], "interlock");
    assert!(info["acknowledgements"][0].as_str().unwrap().contains("calibrated"));
    succeeded(&palpate(at, &["replay", "deep"]));
}

#[test]
fn a_newer_a_truncated_and_a_damaged_session_are_reported_apart() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&short_run(at, "whole", &[]));
    let log = log_file(&at.join("whole"));
    let bytes = std::fs::read(&log).unwrap();

    let mut manifest = palpate_sessions::Session::open(&log).unwrap().manifest;
    manifest.record_version = palpate_sessions::RECORD_VERSION + 1;
    let newer = palpate_sessions::SessionFolder::create(&at.join("newer")).unwrap();
    let pace = palpate_sessions::RecordingPace::Virtual;
    drop(palpate_sessions::SessionWriter::start(newer, None, &manifest, pace).unwrap());
    let output = palpate(at, &["info", "newer"]);
    assert_refused(&output, 2, "update palpate");

    let truncated = at.join("truncated.mcap");
    std::fs::write(&truncated, &bytes[..bytes.len() * 2 / 3]).unwrap();
    let info = answer(&palpate(at, &["info", "truncated.mcap", "--json"]));
    assert_eq!(info["is_complete"], false);
    assert!(info["notes"][0].as_str().unwrap().contains("no end record"));

    let mut damaged = bytes.clone();
    damaged[bytes.len() / 2] ^= 0x10;
    std::fs::write(at.join("damaged.mcap"), damaged).unwrap();
    for command in
        [vec!["info", "damaged.mcap"], vec!["fit", "damaged.mcap"], vec!["replay", "damaged.mcap"]]
    {
        let output = palpate(at, &command);
        assert_eq!(output.status.code(), Some(1), "{command:?}: {}", stderr(&output));
        assert_says(&output, "damaged");
    }
}

#[test]
fn a_held_session_and_a_held_rig_name_their_holder() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut holder = background(at, "run ramp-hold --rig sim:bench --out held");
    let lock = at.join("held/lock");
    let has_holder = || {
        let text = std::fs::read_to_string(&lock).ok()?;
        (!text.is_empty()).then_some(())
    };
    until(has_holder, || "a lock of the holder".into());
    let pid = holder.id().to_string();
    for args in [
        vec!["run", "ramp-hold", "--rig", "sim:bench", "--out", "other"],
        vec!["run", "ramp-hold", "--out", "held"],
    ] {
        let output = palpate(at, &args);
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        assert!(stderr(&output).contains(&pid), "{pid} in: {}", stderr(&output));
    }
    // Asked to end, the holder stops the slider, closes the session and reports failure.
    // The shell has its own kill; a minimal system has no other.
    let killed = Command::new("sh").args(["-c", &format!("kill -TERM {pid}")]).status().unwrap();
    assert!(killed.success());
    assert_eq!(holder.wait().unwrap().code(), Some(1));
    let info = json(&palpate(at, &["info", "held", "--json"]));
    assert_eq!(info["ending"], "stop");
}

/// A run that stands still twice for 0.7 s while it records, and how it ended; an error if it was over before.
fn sleeping_run(at: &Path) -> Result<std::process::ExitStatus, String> {
    let mut child = background(at, "run ramp-hold --hold 5 --time-scale 50 --out slept");
    let pid = child.id();
    let signal = |name: &str| {
        let command = format!("kill -{name} {pid}");
        let sent = Command::new("sh").args(["-c", &command]).status();
        assert!(sent.unwrap().success(), "{command}");
    };
    // Twice. Its clock goes on meanwhile, unlike that of a laptop whose lid is closed, which ends the run.
    let log = at.join("slept/000.mcap");
    let length = || log.metadata().map_or(0, |found| found.len());
    for _ in 0..2 {
        let before = length();
        let mut has_ended = || child.try_wait().unwrap().is_some();
        let mut is_longer = || (length() > before || has_ended()).then_some(());
        until(&mut is_longer, || format!("more than {before} bytes"));
        if has_ended() {
            std::fs::remove_dir_all(at.join("slept")).unwrap();
            return Err("the run was over before it was put to sleep".into());
        }
        signal("STOP");
        std::thread::sleep(std::time::Duration::from_millis(700));
        signal("CONT");
    }
    Ok(child.wait().unwrap())
}

#[test]
fn a_run_that_was_put_to_sleep_goes_on_and_nothing_of_it_is_missing() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let Some(status) = in_time(|| sleeping_run(at)) else {
        return;
    };
    assert_eq!(status.code(), Some(0));
    let session = palpate_sessions::Session::open(&at.join("slept")).unwrap();
    assert!(session.end.is_some());
    let ticks: Vec<u64> = session.rows.iter().map(|row| row.tick).collect();
    assert!(ticks.windows(2).all(|pair| pair[1] == pair[0] + 1));
    let worst = session.auxiliary.health.worst.expect("a state");
    assert!(worst.lateness_s > 0.6, "{worst:?}");
    let info = stdout(&palpate(at, &["info", "slept"]));
    assert!(info.contains("ms late"), "{info}");
    succeeded(&palpate(at, &["replay", "--check", "slept"]));
}

/// A run that is killed once its log has so many bytes; whether it was, rather than over before.
fn is_killed(at: &Path, name: &str, bytes: u64) -> bool {
    let mut child = background(at, &format!("run ramp-hold --time-scale 30 --out {name}"));
    let log = at.join(name).join("000.mcap");
    let mut is_over = || {
        let length = log.metadata().map_or(0, |found| found.len());
        let has_ended = child.try_wait().unwrap().is_some();
        (length >= bytes || has_ended).then_some(())
    };
    until(&mut is_over, || format!("{bytes} bytes in {name}"));
    child.kill().unwrap();
    // A run that ended of its own accord has a code.
    child.wait().unwrap().code().is_none()
}

#[test]
fn a_killed_run_leaves_a_session_that_opens() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut samples = Vec::new();
    for bytes in [1, 20_000, 100_000, 300_000] {
        // A computer that looks up only when the run is over has killed none.
        let name = (0..20)
            .map(|attempt| format!("killed-{bytes}-{attempt}"))
            .find(|name| is_killed(at, name, bytes));
        let name = name.expect("one run of twenty is killed before its end");
        let info = answer(&palpate(at, &["info", &name, "--json"]));
        assert_eq!(info["is_complete"], false, "{name}");
        samples.push(info["samples"].as_u64().unwrap());
        succeeded(&palpate(at, &["replay", &name]));
    }
    // More of the run is in a log that was longer.
    assert!(samples.is_sorted() && samples[3] > 1_000, "{samples:?}");
}

#[test]
fn version_with_verbose_tells_what_the_program_was_built_from() {
    let folder = tempfile::tempdir().unwrap();
    let short = stdout(&palpate(folder.path(), &["--version"]));
    assert_eq!(short.lines().count(), 1, "{short}");
    let long = palpate(folder.path(), &["--version", "--verbose"]);
    succeeded(&long);
    for fact in ["palpate 0", "commit ", "target ", "features window, emulators"] {
        assert_prints(&long, fact);
    }
    let object = json(&palpate(folder.path(), &["-V", "--verbose", "--json"]));
    assert_eq!(object["is_release"], !cfg!(debug_assertions));
}
