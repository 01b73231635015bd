//! Disks without room, before and during a run.

use super::{json, palpate, stderr, succeeded};
use std::process::{Command, Output, Stdio};

/// Whether this machine gives no namespace or no mount in it; anything else is palpate's doing.
fn has_no_namespace(done: &std::io::Result<Output>) -> bool {
    match done {
        Err(_) => true,
        Ok(output) => output.status.code() == Some(77) || stderr(output).starts_with("unshare:"),
    }
}

/// A disk that fills up in mid-run: a 24 MB file system of its own, in a mount namespace.
#[test]
fn a_full_disk_stops_the_run_and_keeps_what_was_saved() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::create_dir(at.join("disk")).unwrap();
    let script = r#"
        mount -t tmpfs -o size=24m none disk || exit 77
        "$0" run ramp-hold --time-scale 50 --out disk/session 2>error.txt >/dev/null &
        run=$!
        until [ -s disk/session/000.mcap ]; do sleep 0.05; done
        sleep 0.3
        cat /dev/zero >disk/filler 2>/dev/null
        wait $run; echo $? >exit.txt
        cp -r disk/session saved
    "#;
    let done = Command::new("unshare")
        .args(["-Urm", "sh", "-c", script, env!("CARGO_BIN_EXE_palpate")])
        .current_dir(at)
        .stdin(Stdio::null())
        .output();
    match done {
        Ok(output) if output.status.code() == Some(0) => {}
        other if has_no_namespace(&other) => {
            println!("skipped: no mount namespace here ({other:?})");
            return;
        }
        other => panic!("{other:?}"),
    }
    let said = std::fs::read_to_string(at.join("error.txt")).unwrap();
    assert_eq!(
        std::fs::read_to_string(at.join("exit.txt")).unwrap().trim(),
        "1",
        "{said}"
    );
    assert!(said.contains("No space left on device"), "{said}");
    let info = json(&palpate(at, &["info", "saved", "--json"]));
    assert_eq!(info["is_complete"], false);
    assert!(info["samples"].as_u64().unwrap() > 1000, "{info}");
    succeeded(&palpate(at, &["replay", "saved"]));
}

#[test]
fn a_disk_without_room_is_refused_before_the_start() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::create_dir(at.join("disk")).unwrap();
    let script = r#"mount -t tmpfs -o size=4m none disk || exit 77
        exec "$0" run ramp-hold --time-scale max --out disk/session"#;
    let output = Command::new("unshare")
        .args(["-Urm", "sh", "-c", script, env!("CARGO_BIN_EXE_palpate")])
        .current_dir(at)
        .stdin(Stdio::null())
        .output();
    match output {
        Ok(output) if output.status.code() == Some(2) => {
            assert!(
                stderr(&output).contains("free some space"),
                "{}",
                stderr(&output)
            );
        }
        other if has_no_namespace(&other) => {
            println!("skipped: no mount namespace here ({other:?})");
        }
        other => panic!("it was not refused on a disk of 4 MB: {other:?}"),
    }
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
