//! The library searched, its sessions analysed and reviewed, and their history, as a user does it.

use crate::support::{
    assert_prints, assert_refused, assert_says, background, json, palpate, short_run, stderr,
    stdout, succeeded,
};
use palpate_analysis::source::calibration_of;
use palpate_model::rig::Phase;
use palpate_sessions::log::Session;
use serde_json::Value;
use std::fs;
use std::path::Path;

/// A run into the library of [`palpate`].
fn run(at: &Path, name: &str, more: &[&str]) -> String {
    let folder = format!("library/sessions/{name}");
    succeeded(&short_run(at, &folder, more));
    folder
}

fn found(at: &Path, args: &[&str]) -> Vec<String> {
    let mut all = vec!["find", "--json"];
    all.extend(args);
    let output = palpate(at, &all);
    succeeded(&output);
    let object = json(&output);
    let sessions = object["sessions"].as_array().expect("a list");
    assert_eq!(object["count"], sessions.len());
    let names = sessions.iter().map(|one| one["folder"].as_str().expect("a name").to_owned());
    let mut names: Vec<String> = names.collect();
    names.sort();
    names
}

#[test]
fn a_library_is_searched_tagged_reviewed_and_reported_over_time() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let nothing = palpate(at, &["find"]);
    succeeded(&nothing);
    assert!(stdout(&nothing).contains("no session"));
    let printed = ["--operator", "Ada", "--specimen", "liver \"3\" *"];
    let one = run(at, "one", &printed);
    let two = run(at, "two", &["--operator", "Grace", "--seed", "3"]);
    assert_eq!(found(at, &[]), ["sessions/one", "sessions/two"]);
    assert_eq!(found(at, &["--operator", "Ada"]), ["sessions/one"]);
    assert_eq!(found(at, &["LIV", "3"]), ["sessions/one"]);
    assert_eq!(found(at, &["--specimen", "liver \"3\" *"]), ["sessions/one"]);
    assert_eq!(found(at, &["specimen:liv", "ramp.depth>=6mm", "ada"]), ["sessions/one"]);
    assert_eq!(found(at, &["specimen:ada"]).len(), 0);
    assert_eq!(found(at, &["--where", "ramp.depth>=6mm"]).len(), 2);
    assert_eq!(found(at, &["--where", "ramp.depth_mm<6"]).len(), 0);
    assert_eq!(found(at, &["--verdict", "valid"]).len(), 2);
    assert_eq!(found(at, &["--until", "2001-01-01"]).len(), 0);
    // A condition that can never hold differs from one that matches no session.
    for (condition, word) in [
        ("ramp.dept>=1mm", "ramp.dept"),
        ("depth>=1kg", "have depth in mm"),
        ("ramp.depth>=100mm", ""),
    ] {
        let none = palpate(at, &["find", "--where", condition]);
        succeeded(&none);
        assert_eq!(stderr(&none).is_empty(), word.is_empty(), "{}", stderr(&none));
        assert!(stderr(&none).contains(word), "{}", stderr(&none));
    }
    let order = palpate(at, &["find", "--where", "depth~3"]);
    assert_refused(&order, 2, "depth>=2mm");
    assert_refused(&palpate(at, &["find", "specimn:liv"]), 2, "specimen, operator, protocol");

    succeeded(&palpate(at, &["tag", &one, &two, "+pilot", "-none"]));
    // A missing tag gives a note and leaves no edit.
    let nothing = palpate(at, &["tag", &two, "-nothere"]);
    succeeded(&nothing);
    assert_says(&nothing, "no tag 'nothere'");
    let edits = fs::read_to_string(at.join(&two).join("edits.jsonl")).unwrap();
    assert!(!edits.contains("nothere"), "{edits}");
    let tagged = palpate(at, &["tag", &two, "-pilot", "+good", "--json"]);
    assert_eq!(json(&tagged)["sessions"][0]["tags"][0], "good");
    assert_eq!(found(at, &["--tag", "pilot"]), ["sessions/one"]);

    let note = ["note", &one, &two, "--text", "the gel was warm", "--by", "Ada"];
    succeeded(&palpate(at, &note));
    assert_eq!(found(at, &["warm", "gel"]).len(), 2);
    let info = stdout(&palpate(at, &["info", &two]));
    assert!(info.contains("Ada: note: the gel was warm"), "{info}");
    let empty = palpate(at, &["note", &one, "--text", " ", "--json"]);
    assert_refused(&empty, 2, "a note needs a text");

    let why = ["--reason", "curve and video agree", "--by", "Mary"];
    let mut review = vec!["review", one.as_str(), "--accept"];
    review.extend(why);
    let review = palpate(at, &review);
    succeeded(&review);
    assert_prints(&review, "000.mcap");
    assert_eq!(found(at, &["--review", "accepted"]), ["sessions/one"]);
    let info = json(&palpate(at, &["info", &one, "--json"]));
    assert_eq!(info["review"]["by"], "Mary");
    assert_eq!(info["review"]["changed"], Value::Array(Vec::new()));
    // A verdict after it: it is to be looked at again.
    let doubt = ["verdict", &one, "suspect", "--reason", "hair"];
    succeeded(&palpate(at, &doubt));
    assert_eq!(found(at, &["--review", "outdated"]), ["sessions/one"]);
    let info = stdout(&palpate(at, &["info", &one]));
    assert!(info.contains("reviewed again"), "{info}");
    let undecided = palpate(at, &["review", &two, "--reason", "why"]);
    assert_eq!(undecided.status.code(), Some(2));

    let history = palpate(at, &["history", "specimen", "liver \"3\" *", "--json"]);
    let events = json(&history);
    let events = events["events"].as_array().unwrap();
    let kinds: Vec<&str> = events.iter().map(|one| one["what"].as_str().unwrap()).collect();
    let all = ["session", "verdict", "tags", "note", "review", "verdict"];
    assert_eq!(kinds, all);
    let unknown = palpate(at, &["history", "rig", "unknown"]);
    assert_eq!(unknown.status.code(), Some(2));

    // Two at a time, while one rebuilds it.
    fs::remove_file(at.join("library/catalog.sqlite")).unwrap();
    let several = ["find", "catalog rebuild", "find ada"];
    for mut one in several.map(|line| background(at, line)) {
        assert!(one.wait().unwrap().success());
    }
    succeeded(&palpate(at, &["find"]));
    succeeded(&palpate(at, &["catalog", "check"]));

    // A journal that cannot be read hides no verdict: there may be one.
    let journal = at.join(&two).join("edits.jsonl");
    fs::write(&journal, fs::read_to_string(&journal).unwrap().replace("good", "food")).unwrap();
    assert!(found(at, &["--verdict", "none"]).is_empty());
    assert!(found(at, &["--review", "none"]).is_empty());
    let listed = stdout(&palpate(at, &["find"]));
    assert!(listed.contains("edits.jsonl"), "{listed}");
}

#[test]
fn analyses_stand_beside_a_session_and_are_read_and_withdrawn() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let one = run(at, "one", &[]);
    let log = at.join(&one).join("000.mcap");
    let before = fs::read(&log).unwrap();
    let session = Session::open(&at.join(&one)).unwrap();
    let own = calibration_of(&session).unwrap();
    let file = at.join("own.json");
    fs::write(&file, serde_json::to_string(&own).unwrap()).unwrap();
    let mut heavier = own.clone();
    heavier.name = "heavier".into();
    heavier.steps.iter_mut().for_each(|step| step.mass_g *= 2.0);
    fs::write(at.join("two.json"), serde_json::to_string(&heavier).unwrap()).unwrap();

    let same = palpate(at, &["recalibrate", &one, "--calibration", "own.json", "--json"]);
    succeeded(&same);
    let change = json(&same)["sessions"][0]["max_n"].as_f64().unwrap();
    assert!(change <= 1e-9, "{change}");
    let double = ["recalibrate", &one, "--calibration", "two.json", "--name", "double"];
    succeeded(&palpate(at, &double));
    let again = palpate(at, &double);
    assert_refused(&again, 2, "never used twice");
    assert_eq!(fs::read(&log).unwrap(), before);

    // The whole model is linear in force: the same times, moduli twice as large.
    let fit = |more: &[&str]| {
        let mut args = vec!["fit", one.as_str(), "--json", "--no-systematic"];
        args.extend(more);
        let output = palpate(at, &args);
        succeeded(&output);
        json(&output)
    };
    let value = |fit: &Value, name: &str| {
        let all = fit["parameters"].as_array().unwrap();
        let one = all.iter().find(|one| one["name"] == name).unwrap();
        one["value"].as_f64().unwrap()
    };
    let plain = fit(&[]);
    let doubled = fit(&["--analysis", "double", "--save", "doubled"]);
    for (name, times) in [("tau_eps", 1.0), ("mu1", 2.0)] {
        let (old, new) = (value(&plain, name), value(&doubled, name));
        // A thousandth: how far the contact position is trusted depends on the stiffness.
        assert!((new - times * old).abs() < 1e-3 * old.abs(), "{name}: {old}, {new}");
    }
    let export = ["export", &one, "--format", "csv", "--analysis", "double"];
    succeeded(&palpate(at, &export));
    let condition = format!("fit.mu1>{}", 1.5 * value(&plain, "mu1"));
    assert_eq!(found(at, &["--where", &condition]), ["sessions/one"]);

    // A stretch left out of the hold.
    let rows = &session.rows;
    let hold = rows.iter().find(|row| row.phase == Phase::Hold).unwrap();
    let ticks = (hold.tick - rows[0].tick) as i64;
    let from = session.manifest.time_of(ticks).0 + 0.5;
    let span = format!("{from}..{}", from + 0.25);
    let mask = ["mask", &one, "--name", "tail", "--leave-out", &span];
    succeeded(&palpate(at, &mask));
    let masked = fit(&["--analysis", "tail"]);
    // 1000 samples a second, both ends included.
    let censored = masked["censored"].as_u64().unwrap() - plain["censored"].as_u64().unwrap();
    assert!((250..=251).contains(&censored), "{censored}");
    let nowhere = ["mask", &one, "--name", "none", "--leave-out", "1e6..2e6"];
    assert_eq!(palpate(at, &nowhere).status.code(), Some(2));

    // A fit reads the session as what it was based on did.
    let based = fit(&["--analysis", "doubled"]);
    assert_eq!(value(&based, "mu1"), value(&doubled, "mu1"));
    let why = ["withdraw", &one, "double", "--reason", "wrong weights"];
    succeeded(&palpate(at, &why));
    let gone = palpate(at, &["fit", &one, "--analysis", "double"]);
    assert_refused(&gone, 2, "wrong weights");
    let info = json(&palpate(at, &["info", &one, "--json"]));
    let records = info["analyses"].as_array().unwrap();
    assert_eq!(records.len(), 5);
    let inputs = records[2]["inputs"].as_array().unwrap();
    assert!(inputs.iter().any(|one| one["what"] == "analysis double"));
    assert!(inputs.iter().all(|one| one["sha256"].as_str().unwrap().len() == 64));
    let table = palpate(at, &["fit", "own.json", "--save", "x"]);
    assert_eq!(table.status.code(), Some(2));
}
