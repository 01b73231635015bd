//! `palpate rig`, and a run on a rig of a file, against an emulated controller on a port of this computer.

use super::emulate::{Emulator, emulate_galil};
use super::{json, palpate, stderr, stdout};
use std::path::Path;

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
    assert!(identity.contains("watchdog: at most 13.3 mm"), "{identity}");
    assert!(
        checked["links"][0]["answers"].as_u64().unwrap() > 0,
        "{checked}"
    );

    let watched = palpate(
        folder.path(),
        &["rig", "monitor", &file, "--seconds", "1", "--json"],
    );
    let watched = json(&watched);
    assert!(watched["samples"].as_u64().unwrap() > 100, "{watched}");
    // The free cell of the built-in bench.
    let mean = watched["signal_mean_V"].as_f64().unwrap();
    assert!((mean - 1.28).abs() < 0.01, "{watched}");
    assert!(watched["age_within_s"].as_f64().unwrap() > 0.0, "{watched}");
    let text = palpate(folder.path(), &["rig", "monitor", &file, "--seconds", "1"]);
    assert!(stdout(&text).contains("samples/s"), "{}", stdout(&text));
}

#[test]
fn what_is_not_as_the_file_says_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let (_emulator, at) = emulate_galil(&["--serial-number", "77"]);
    let file = rig_file(folder.path(), &at, "serial_number = 78\n");
    let other = palpate(folder.path(), &["rig", "check", &file]);
    assert_eq!(other.status.code(), Some(1));
    let told = stderr(&other);
    assert!(told.contains("77") && told.contains("78"), "{told}");
    let wrong = rig_file(folder.path(), &at, "travel = 3\n");
    let wrong = palpate(folder.path(), &["rig", "check", &wrong]);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(
        stderr(&wrong).contains("bench.toml, line 8: "),
        "{}",
        stderr(&wrong)
    );
    let nobody = palpate(
        folder.path(),
        &["rig", "detect", "--at", "/dev/there-is-no-such-port"],
    );
    assert!(
        stdout(&nobody).contains("there is no serial port"),
        "{}",
        stdout(&nobody)
    );
}
