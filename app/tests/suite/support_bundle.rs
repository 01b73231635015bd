//! The program's own log, and `palpate support-bundle`.

use crate::support::{SHORT, json, palpate, short_run, stderr, stdout, succeeded};
use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::Read;
use std::path::Path;
use std::process::Command;

/// Every file of a bundle.
fn unpacked(bundle: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut zip = zip::ZipArchive::new(File::open(bundle).unwrap()).unwrap();
    let mut files = BTreeMap::new();
    for index in 0..zip.len() {
        let mut file = zip.by_index(index).unwrap();
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).unwrap();
        let name = file.name().unwrap().into_owned();
        assert!(files.insert(name, bytes).is_none());
    }
    files
}

fn log(folder: &Path) -> String {
    fs::read_to_string(folder.join("library/log/palpate.log")).unwrap_or_default()
}

#[test]
fn the_log_tells_transitions_of_a_run_and_no_samples() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&palpate(at, &["protocol", "list"]));
    assert!(!at.join("library").exists(), "a look leaves nothing behind");

    let run = short_run(at, "one", &["--json"]);
    succeeded(&run);
    let samples = json(&run)["samples"].as_u64().unwrap();
    let text = log(at);
    assert!(text.starts_with("palpate "), "{text}");
    for printed in
        ["session opened", "folder=one", "phase: ramp", ":step{number=", "session closed, finish"]
    {
        assert!(text.contains(printed), "{printed}: {text}");
    }
    let lines = text.lines().count() as u64;
    assert!(samples > 10_000 && lines < 100, "{lines} lines, {samples} samples");
    // A refusal is the user's business; a failure is support's.
    let refused = palpate(at, &["info", "nowhere"]);
    assert_eq!(refused.status.code(), Some(2));
    assert_eq!(log(at), text);
}

#[test]
fn what_is_logged_is_shown_when_asked_and_chosen_by_rust_log() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let run = |home: &Path, out: &str, wanted: &str| {
        Command::new(env!("CARGO_BIN_EXE_palpate"))
            .args(SHORT)
            .args(["--time-scale", "max", "--out", out, "--verbose"])
            .current_dir(at)
            .env("PALPATE_HOME", home)
            .env("RUST_LOG", wanted)
            .output()
            .unwrap()
    };
    let library = at.join("library");
    let usual = run(&library, "usual", "");
    succeeded(&usual);
    assert!(stderr(&usual).contains("session opened"), "{}", stderr(&usual));
    let before = log(at);
    let silent = run(&library, "silent", "palpate=off");
    succeeded(&silent);
    assert!(!stderr(&silent).contains("session opened"), "{}", stderr(&silent));
    assert_eq!(log(at), before);

    // A file where the library's folder for logs should be: the run goes on, and --verbose reports it once.
    let taken = at.join("taken");
    fs::create_dir_all(&taken).unwrap();
    fs::write(taken.join("log"), "").unwrap();
    let without = run(&taken, "without", "");
    succeeded(&without);
    let printed = stderr(&without);
    assert_eq!(printed.matches("no log is written").count(), 1, "{printed}");
    assert!(printed.contains("session closed"), "{printed}");
}

#[test]
fn a_bundle_has_log_versions_and_findings_and_nothing_that_was_measured() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let session = "library/sessions/one";
    fs::create_dir_all(at.join("library/sessions")).unwrap();
    succeeded(&short_run(at, session, &["--specimen", "kidney 7"]));
    fs::write(at.join("library/window.json"), "{\"is_dark\": true}\n").unwrap();
    let rig = "device = \"galil\"\naddress = \"lab:tulip@192.168.1.10:23\"\npassword = \"rose\"\n";
    fs::write(at.join("bench.toml"), rig).unwrap();

    let made = palpate(at, &["support-bundle", "help.zip", "--rig", "bench.toml", "--json"]);
    succeeded(&made);
    let made = json(&made);
    assert_eq!(made["command"], "support-bundle");
    let files = unpacked(&at.join("help.zip"));
    let printed: Vec<&str> =
        made["files"].as_array().unwrap().iter().map(|one| one["name"].as_str().unwrap()).collect();
    assert!(files.keys().all(|name| printed.contains(&name.as_str())), "{made}");
    let names: Vec<&str> = files.keys().map(String::as_str).collect();
    let expected =
        ["findings.txt", "log/palpate.log", "rigs/bench.toml", "versions.txt", "window.json"];
    assert_eq!(names, expected);
    let text = |name: &str| String::from_utf8_lossy(&files[name]).into_owned();
    assert!(
        text("versions.txt").contains("emulators, haptics, extremes"),
        "{}",
        text("versions.txt")
    );
    assert!(text("findings.txt").contains("sessions examined: 1; all are usable"));
    assert!(text("log/palpate.log").contains("session closed"));
    assert_eq!(text("window.json"), "{\"is_dark\": true}\n");
    let rig = text("rigs/bench.toml");
    assert!(rig.contains("192.168.1.10:23") && rig.contains("galil"), "{rig}");
    for bytes in files.values() {
        let text = String::from_utf8_lossy(bytes);
        for secret in ["tulip", "rose", "kidney 7"] {
            assert!(!text.contains(secret), "{secret}: {text}");
        }
    }
    // What is there already stays.
    let again = palpate(at, &["support-bundle", "help.zip"]);
    assert_eq!(again.status.code(), Some(2));
    assert_eq!(unpacked(&at.join("help.zip")), files);

    let more = ["support-bundle", "more.zip", "--with-manifests", "--with-session", session];
    let more = palpate(at, &more);
    succeeded(&more);
    let lines = stdout(&more);
    let files = unpacked(&at.join("more.zip"));
    assert_eq!(lines.lines().count(), files.len() + 1, "{lines}");
    for name in files.keys() {
        assert!(lines.contains(&format!("{name}: ")), "{name}: {lines}");
    }
    let manifest = String::from_utf8_lossy(&files["manifests/one.json"]);
    assert!(manifest.contains("kidney 7"), "{manifest}");
    let log = crate::support::log_file(&at.join(session));
    let name = format!("sessions/one/{}", log.file_name().unwrap().display());
    assert_eq!(files[&name], fs::read(log).unwrap());

    let none = palpate(at, &["support-bundle", "none.zip", "--with-session", "bench.toml"]);
    assert_eq!(none.status.code(), Some(2), "{}", stderr(&none));
    assert!(!at.join("none.zip").exists());
}
