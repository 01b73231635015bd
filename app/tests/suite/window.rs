//! The real window on a virtual display: opens, starts on F5, draws, stops on F12, closes.

use crate::support::{palpate, stderr};
use palpate_test_support::skip;
use std::path::Path;
use std::process::{Command, Stdio};

#[test]
fn the_window_runs_and_stops_on_a_virtual_display() {
    if ["Xvfb", "xdotool", "import", "convert"].into_iter().any(skip::lacks_program) {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let picture = folder.path().join("window.png");
    let report = folder.path().join("frames.json");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scripts/screenshot");
    let output = Command::new(script)
        .args(["--binary", env!("CARGO_BIN_EXE_palpate"), "--at", "3", "--out"])
        .arg(&picture)
        .env("PALPATE_FRAME_REPORT", &report)
        .stdin(Stdio::null())
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    // An empty window compresses to a few kB; one with plots and panels does not.
    assert!(picture.metadata().unwrap().len() > 20_000);
    let text = std::fs::read_to_string(&report).unwrap();
    let report: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert!(report["frames"].as_u64().unwrap() > 0, "{report}");
    // It is noted when a frame shows a run.
    assert!(report["late_worst_s"].is_number(), "{report}");
}

#[test]
fn a_path_that_is_not_there_opens_no_window() {
    let folder = tempfile::tempdir().unwrap();
    let refused = palpate(folder.path(), &["window", "none"]);
    assert_eq!(refused.status.code(), Some(2), "{}", stderr(&refused));
}
