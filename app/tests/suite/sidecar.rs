//! `palpate rig new` and `palpate rig conform`, on a skeleton as it was written.

use crate::support::{assert_refused, json, palpate};
use palpate_test_support::skip;
use std::fs;

#[test]
fn a_new_rig_is_a_folder_that_is_never_written_over() {
    let folder = tempfile::tempdir().unwrap();
    for (language, file) in
        [("python", "stage_2.py"), ("arduino", "Stage-2.ino"), ("rust", "src/main.rs")]
    {
        let at = folder.path().join(language);
        fs::create_dir(&at).unwrap();
        let made =
            json(&palpate(&at, &["rig", "new", "Stage-2", "--language", language, "--json"]));
        assert_eq!(made["rig_file"], "Stage-2/Stage-2.toml");
        assert!(at.join("Stage-2").join(file).is_file(), "{language}: {made}");
        assert_refused(&palpate(&at, &["rig", "new", "Stage-2"]), 2, "exists already");
        let preview = palpate(&at, &["protocol", "check", "Stage-2/first-run.toml"]);
        assert!(preview.status.success(), "{preview:?}");
    }
    let at = folder.path();
    assert_refused(&palpate(at, &["rig", "new", "../stage"]), 2, "cannot be the name of a rig");
    assert_refused(&palpate(at, &["rig", "new", "a", "--language", "perl"]), 2, "perl");
    fs::write(at.join("g.toml"), "device = \"grbl\"\n").unwrap();
    assert_refused(&palpate(at, &["rig", "conform", "g.toml"]), 2, "no sidecar");
    assert_refused(&palpate(at, &["rig", "conform", "g.toml", "--move", "100"]), 2, "0.5 to 20");
}

#[test]
#[cfg(unix)]
fn the_conformance_of_a_skeleton_is_measured_and_nothing_moves_without_permission() {
    if skip::lacks_program("python3") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    assert!(palpate(at, &["rig", "new", "stage"]).status.success());
    let found = palpate(at, &["rig", "conform", "stage/stage.toml", "--seconds", "1", "--json"]);
    let text = String::from_utf8(found.stdout).unwrap();
    let report: serde_json::Value = serde_json::from_str(text.lines().next().unwrap()).unwrap();
    let checks = report["report"]["checks"].as_array().unwrap();
    let verdict = |name: &str| {
        let check = checks.iter().find(|check| check["name"] == name);
        check.unwrap_or_else(|| panic!("no {name}: {report}"))["verdict"].clone()
    };
    for name in ["introduction", "start", "lines-garbled", "nonsense", "unknown-word", "restart"] {
        assert_eq!(verdict(name), "pass", "{name}: {report}");
    }
    for name in ["path", "stop", "silence", "lost-link"] {
        assert_eq!(verdict(name), "skipped", "{name}: {report}");
    }
    assert!(report["move_mm"].is_null() && report["report"]["trust"].is_null());
}
