//! Disks without room, before and during a run.

use crate::support::{answer, assert_refused, assert_says, json, palpate, short_run, succeeded};
use palpate_test_support::skip::{CAN_MOUNT, lacks_command};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Runs a script as root of a mount namespace of its own; `$0` is palpate.
fn in_own_namespace(at: &Path, script: &str) -> Output {
    let output = Command::new("unshare")
        .args(["-Urm", "sh", "-c", script, env!("CARGO_BIN_EXE_palpate")])
        .current_dir(at)
        .stdin(Stdio::null())
        .output();
    output.expect("unshare is here")
}

/// Runs with `variables` on a 24 MB file system of its own, in a mount namespace, that fills up in mid-run: what the
/// run printed, on stdout as JSON and on stderr. The session is copied to `saved`.
fn run_on_a_disk_that_fills_up(at: &Path, variables: &str) -> (Value, String) {
    std::fs::create_dir(at.join("disk")).expect("a folder");
    let script = r#"
        mount -t tmpfs -o size=24m none disk || exit
        "$0" run ramp-hold --time-scale 20 --out disk/session --json 2>error.txt >out.json &
        run=$!
        until [ "$(wc -c 2>/dev/null <disk/session/000.mcap || echo 0)" -gt 300000 ]; do sleep 0.05; done
        cat /dev/zero >disk/filler 2>/dev/null
        wait $run; echo $? >exit.txt
        cp -r disk/session saved
    "#;
    let script = format!("{variables}\n{script}");
    succeeded(&in_own_namespace(at, &script));
    let read = |name: &str| std::fs::read_to_string(at.join(name)).expect("what the run left");
    let message = read("error.txt");
    assert_eq!(read("exit.txt").trim(), "1", "{message}");
    assert!(message.contains("No space left"), "{message}");
    // The report is the first line, the error the second.
    let out = read("out.json");
    let report = serde_json::from_str(out.lines().next().unwrap_or_default());
    (report.expect("a report"), message)
}

#[test]
fn a_full_disk_stops_the_run_and_keeps_what_was_saved() {
    if lacks_command(CAN_MOUNT) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let (report, message) = run_on_a_disk_that_fills_up(at, "");
    let info = json(&palpate(at, &["info", "saved", "--json"]));
    assert_eq!(info["is_complete"], false);
    assert!(info["samples"].as_u64().unwrap() > 1000, "{info}");
    succeeded(&palpate(at, &["replay", "saved"]));
    // The run says what is in the file, and what is not.
    assert_eq!(report["samples"], info["samples"], "{message}");
    let lost = report["samples_lost"].as_u64().unwrap();
    assert!(lost > 0, "{report}");
    assert!(message.contains(&format!("the last {lost} of ")), "{lost}: {message}");
}

#[test]
fn with_a_spare_folder_a_full_disk_costs_only_the_verdict() {
    if lacks_command(CAN_MOUNT) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let spare = "export PALPATE_SPARE=$PWD/spare";
    let (report, message) = run_on_a_disk_that_fills_up(at, spare);
    assert_eq!(report["samples_lost"], 0, "{message}");
    assert!(message.contains("without loss"), "{message}");
    for wrong in ["log cannot be written", "differs from what was recorded"] {
        assert!(!message.contains(wrong), "{message}");
    }
    assert!(message.contains("verdict") && message.contains("palpate verdict"), "{message}");
    // Segments elsewhere make it no less whole.
    succeeded(&palpate(at, &["doctor", "saved"]));
    let replayed = json(&palpate(at, &["replay", "--check", "saved", "--json"]));
    assert_eq!(replayed["sessions"][0]["samples"], report["samples"]);
}

#[test]
fn a_disk_without_room_is_refused_before_the_start() {
    if lacks_command(CAN_MOUNT) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::create_dir(at.join("disk")).unwrap();
    let script = r#"mount -t tmpfs -o size=4m none disk || exit
        exec "$0" run ramp-hold --time-scale max --out disk/session"#;
    let output = in_own_namespace(at, script);
    assert_refused(&output, 2, "free some space");
}

#[test]
fn a_library_that_may_not_be_written_is_searched() {
    if lacks_command(CAN_MOUNT) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&short_run(at, "library/sessions/one", &[]));
    // Not the folder's own file system, whose options may be locked.
    let script = r#"mkdir mounted && mount -t tmpfs none mounted && cp -r library mounted || exit
        mount -o remount,ro mounted || exit
        PALPATE_HOME=$PWD/mounted/library exec "$0" find --json"#;
    let output = in_own_namespace(at, script);
    assert_eq!(answer(&output)["count"], 1);
    assert_says(&output, "not writable");
}

#[test]
fn a_file_that_may_not_grow_does_not_end_a_run() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // 1.5 MB a file, in blocks of 512 bytes. The limit's signal is not ignored here: the program must take it.
    let script = r#"ulimit -f 3000; exec "$0" run ramp-hold --time-scale max --out session"#;
    let done = Command::new("sh")
        .args(["-c", script, env!("CARGO_BIN_EXE_palpate")])
        .current_dir(at)
        .env("PALPATE_HOME", at.join("library"))
        .stdin(Stdio::null())
        .output()
        .unwrap();
    succeeded(&done);
    assert!(at.join("session/001.mcap").exists());
    let info = json(&palpate(at, &["info", "session", "--json"]));
    assert_eq!(info["is_complete"], true, "{info}");
    succeeded(&palpate(at, &["doctor", "session"]));
}
