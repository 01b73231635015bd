//! `palpate rig`, and a run on a rig of a file, against an emulated controller on a port of this computer.

use crate::emulate::{Emulator, emulate_galil};
use crate::support::{assert_prints, assert_refused, json, palpate, stderr, typed};
use palpate_sessions::{SampleRow, Session};
use palpate_test_support::wait::{in_time, until};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};

/// A rig file for the emulated controller.
fn rig_file(folder: &Path, at: &str, more: &str) -> String {
    let text = format!(
        "device = \"galil\"\naddress = \"{at}\"\nmm_per_pulse = 0.015\ntravel_mm = 150\n\
         speed_max_mm_s = 20\nacceleration_mm_s2 = 61.44\nconverter = \"16 bit\"\n{more}"
    );
    std::fs::write(folder.join("bench.toml"), text).expect("a folder of this test");
    "bench.toml".to_owned()
}

#[test]
fn a_rig_is_found_checked_and_watched() {
    let folder = tempfile::tempdir().unwrap();
    let (_emulator, at): (Emulator, String) = emulate_galil(&["--seed", "3"]);
    let found = palpate(folder.path(), &["rig", "detect", "--at", &at, "--json"]);
    let found = json(&found);
    assert_eq!(found["ports"][0]["device"], "galil", "{found}");
    let says = found["ports"][0]["says"].as_str().unwrap();
    assert!(says.contains("DMC4143"), "{says}");

    let file = rig_file(folder.path(), &at, "");
    let checked = palpate(folder.path(), &["rig", "check", &file, "--json"]);
    let checked = json(&checked);
    let identity = checked["rig"]["identity"].as_str().unwrap();
    assert!(identity.contains("13.3 mm"), "{identity}");
    assert!(checked["links"][0]["answers"].as_u64().unwrap() > 0, "{checked}");

    let watched = palpate(folder.path(), &["rig", "monitor", &file, "--seconds", "1", "--json"]);
    let watched = json(&watched);
    assert!(watched["samples"].as_u64().unwrap() > 0, "{watched}");
    // The free cell of the built-in bench.
    let mean = watched["signal_mean_V"].as_f64().unwrap();
    assert!((mean - 1.28).abs() < 0.01, "{watched}");
    assert!(watched["age_within_s"].as_f64().unwrap() > 0.0, "{watched}");
    let text = palpate(folder.path(), &["rig", "monitor", &file, "--seconds", "1"]);
    assert_prints(&text, "samples/s");
}

#[test]
fn what_is_not_as_the_file_says_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let (_emulator, at) = emulate_galil(&["--serial-number", "77"]);
    let file = rig_file(folder.path(), &at, "serial_number = 78\n");
    let other = palpate(folder.path(), &["rig", "check", &file]);
    assert_eq!(other.status.code(), Some(1));
    let printed = stderr(&other);
    assert!(printed.contains("77") && printed.contains("78"), "{printed}");
    let wrong = rig_file(folder.path(), &at, "travel = 3\n");
    let wrong = palpate(folder.path(), &["rig", "check", &wrong]);
    assert_refused(&wrong, 2, "bench.toml, line 8: ");
    let missing = typed(folder.path(), "rig detect --at /dev/there-is-no-such-port");
    assert_prints(&missing, "serial port");
}

/// Messages where a busy computer has ended a run, or the retract after it.
const LATE: [&str; 4] = ["sample age", "was suspended", "samples arrived", "controller answers"];

fn is_late(message: &str) -> bool {
    LATE.iter().any(|words| message.contains(words))
}

/// The samples of a session so far; none before there is one.
fn samples(session: &Path) -> Vec<SampleRow> {
    Session::open(session).map_or(Vec::new(), |session| session.rows)
}

/// Where the axis was, in mm from home, in the order of the samples.
fn positions(session: &Path) -> Vec<f64> {
    let pulses = samples(session).into_iter().filter_map(|row| row.pulses);
    pulses.map(|pulses| 0.015 * pulses as f64).collect()
}

fn furthest(positions: &[f64]) -> f64 {
    positions.iter().copied().fold(0.0, f64::max)
}

/// Lets the load cell fail for half a second once the probe is on its way from home.
fn fail_under_way(emulator: &mut Emulator, run: &mut Child, session: &Path) {
    let is_there = || {
        let has_ended = run.try_wait().expect("it is ours").is_some();
        (has_ended || furthest(&positions(session)) > 6.0).then_some(())
    };
    until(is_there, || format!("{} mm", furthest(&positions(session))));
    let orders = emulator.0.stdin.as_mut().expect("it is piped");
    writeln!(orders, "saturated").expect("the emulator listens");
}

/// Runs a check of the home switch whose load cell fails under way, and answers the question that follows; how many
/// mm from home the probe was, at most and at the end, and the messages.
///
/// A computer busy with other tests may make a sample late, which stops the run before: its message is then the error.
fn stopped_run(answer: Option<&str>) -> Result<([f64; 2], String), String> {
    let folder = tempfile::tempdir().expect("a folder");
    let (mut emulator, at) = emulate_galil(&[]);
    let rig = rig_file(folder.path(), &at, "unseen_mm = 0.5\n");
    let words = ["run", "check-home", "--set", "distance=60mm", "--rig", &rig];
    let mut run = Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(words)
        .args(["--acknowledge", "--calibration", "thesis", "--out", "session"])
        .current_dir(folder.path())
        .env("PALPATE_HOME", folder.path().join("library"))
        .stdin(match answer {
            Some(_) => Stdio::piped(),
            None => Stdio::null(),
        })
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("palpate starts");
    let session = folder.path().join("session");
    let printed = run.stderr.take().expect("it is piped");
    let mut message = String::new();
    fail_under_way(&mut emulator, &mut run, &session);
    for line in BufReader::new(printed).lines() {
        let line = line.expect("it is text");
        if let (Some(answer), true) = (answer, line.contains("press Enter to retract")) {
            // When the cell recovers, the force jumps again.
            let volts = || samples(&session).last().and_then(|row| row.volts);
            let has_recovered = || volts().filter(|volts| *volts < 2.0);
            until(has_recovered, || format!("{:?} V", volts()));
            let mut hand = run.stdin.take().expect("it is piped");
            writeln!(hand, "{answer}").expect("palpate listens");
        }
        message.push_str(&line);
        message.push('\n');
    }
    let code = run.wait().expect("it ends").code();
    if is_late(&message) {
        return Err(message);
    }
    assert!(code == Some(1) && message.contains("the force is 55"), "{message}");
    let positions = positions(&session);
    let last = positions.last().copied().expect("positions of the axis");
    Ok(([furthest(&positions), last], message))
}

#[test]
fn a_stopped_probe_leaves_where_somebody_says_so_and_stays_otherwise() {
    std::thread::scope(|scope| {
        let runs = [Some(""), Some("no"), None]
            .map(|answer| scope.spawn(move || in_time(|| stopped_run(answer))));
        let [Some(retracted), Some(left), Some(alone)] = runs.map(|run| run.join().unwrap()) else {
            return;
        };
        let ([furthest, last], message) = retracted;
        assert!(furthest > 5.0 && last < furthest - 2.0, "{furthest} {last} {message}");
        let ([furthest, last], message) = left;
        assert!(last > furthest - 0.1, "{furthest} {last} {message}");
        // Without anybody at the terminal nothing is asked.
        let ([furthest, last], message) = alone;
        assert!(last > furthest - 0.1, "{furthest} {last} {message}");
        assert!(!message.contains("no answer came"), "{message}");
    });
}
