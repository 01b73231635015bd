//! `palpate calibration` as a user meets it.

use crate::support::{
    answer, assert_prints, assert_refused, assert_says, json, palpate, short_run, split_words,
    stderr, stdout, succeeded, typed,
};
use palpate_model::calibration::Calibration;
use palpate_sessions::log::Session;
use std::fmt::Write;
use std::fs;
use std::path::Path;

/// A table of the simulated lab cell, up and down, with readings of five digits.
fn table(folder: &Path, name: &str, shift: f64) {
    let steps = Calibration::thesis().steps;
    let mut text = "mass_g,volts,direction\n".to_owned();
    for step in &steps {
        writeln!(text, "{},{:.5},loading", step.mass_g, step.volts.0 + shift).expect("a table");
    }
    for step in steps.iter().rev() {
        // 1 mV of hysteresis in the middle.
        let gap = 1e-3 * (step.mass_g / 1040.0) * (1.0 - step.mass_g / 1040.0) * 4.0;
        writeln!(text, "{},{:.5},unloading", step.mass_g, step.volts.0 + gap + shift)
            .expect("a table");
    }
    fs::write(folder.join(name), text).expect("a table");
}

#[test]
fn a_calibration_is_imported_listed_checked_used_and_superseded() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    table(at, "cell.csv", 0.0);
    let import = split_words("calibration import cell.csv --name bench --rig sim");
    let more = split_words("--tolerance 0.05 --taken-at 2020-01-01T00:00:00Z --json");
    let made = answer(&palpate(at, &[&import[..], &more, &["--picture", "cell.svg"]].concat()));
    let id = made["id"].as_str().unwrap().to_owned();
    assert!(id.starts_with("20200101-bench-"), "{id}");
    let finding = made["quality"]["findings"][0].as_str().unwrap();
    assert!(finding.starts_with("from 340 g to 640 g"), "{finding}");
    assert!(made["candidates"].as_array().unwrap().len() > 8);
    let worst = made["quality"]["hysteresis"]["max_v"].as_f64().unwrap();
    assert!((9e-4..1.01e-3).contains(&worst), "{worst}");
    assert!(fs::read_to_string(at.join("cell.svg")).unwrap().contains("flat stretch"));

    let again = palpate(at, &[&import[..], &more].concat());
    assert_refused(&again, 2, "already");

    // In date it is not, and every use says so.
    let run = short_run(at, "session", &["--calibration", "bench"]);
    succeeded(&run);
    assert_says(&run, "was valid for 365");
    let fit = answer(&palpate(at, &["fit", "session", "--json"]));
    assert_eq!(fit["systematic"]["calibrations"][0]["name"], "bench");
    let terms = fit["systematic"]["parameters"][0]["terms"].as_array().unwrap();
    let names: Vec<&str> = terms.iter().map(|one| one["term"].as_str().unwrap()).collect();
    assert!(names.contains(&"weights") && names.contains(&"hysteresis"), "{names:?}");
    let tau = &fit["parameters"][0];
    assert!(tau["systematic_error"].as_f64().unwrap() > 0.0, "{tau}");
    let plain = json(&typed(at, "fit session --json --no-systematic"));
    assert!(
        plain.get("systematic").is_none()
            && plain["parameters"][0].get("systematic_error").is_none()
    );
    assert_eq!(plain["parameters"][0]["std_error"], tau["std_error"]);
    // Two of the same calibration and any other family tell it too.
    succeeded(&short_run(at, "second", &["--calibration", "bench", "--seed", "5"]));
    let joint = ["fit", "session", "second", "--share", "body", "--json"];
    let joint = json(&palpate(at, &joint));
    let own = &joint["records"][1]["report"]["parameters"][0];
    let [one, both] = [tau, own].map(|one| one["systematic_error"].as_f64().unwrap());
    // The same tissue with the same weights: a second run tells nothing of their errors.
    assert!((both / one - 1.0).abs() < 0.2, "{one} {both}");
    assert_eq!(joint["systematic"][1]["calibrations"][0]["name"], "bench");
    let maxwell = ["fit", "session", "--family", "series-3", "--json"];
    let family = json(&palpate(at, &maxwell));
    let own = family["parameters"][0]["systematic_error"].as_f64().unwrap();
    let one = tau["systematic_error"].as_f64().unwrap();
    assert!((own / one - 1.0).abs() < 0.01, "{one} {own}");
    let text = stdout(&palpate(at, &["fit", "session", "--family", "series-3"]));
    assert!(
        text.contains(" systematic") && text.contains("the calibration \"bench\" adds"),
        "{text}"
    );

    table(at, "newer.csv", 0.01);
    let newer = split_words("calibration supersede bench newer.csv --name bench --rig sim");
    succeeded(&palpate(at, &newer));
    let list = json(&palpate(at, &["calibration", "list", "--json"]));
    let list = list["calibrations"].as_array().unwrap();
    assert_eq!(list.len(), 2);
    let old = list.iter().find(|one| one["id"] == id.as_str()).unwrap();
    let new = list.iter().find(|one| one["id"] != id.as_str()).unwrap();
    assert_eq!(old["superseded_by"], new["id"]);
    assert_eq!((&new["is_in_force"], &old["is_in_force"]), (&true.into(), &false.into()));
    let shown = palpate(at, &["calibration", "show", "bench"]);
    assert!(stdout(&shown).contains(&format!("supersedes   {id}")), "{}", stdout(&shown));
}

#[test]
fn a_check_passes_fails_and_refuses() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let check = |volts: &str, mass: &str| {
        let args = ["--mass", mass, "--volts", volts, "--tare", "1.28", "--json"];
        palpate(at, &[&["calibration", "check", "thesis"][..], &args].concat())
    };
    let passed = check("2.551", "840");
    succeeded(&passed);
    assert_eq!(json(&passed)["is_passed"], true);
    let failed = check("2.60", "840");
    assert_eq!(failed.status.code(), Some(1));
    let first = stdout(&failed).lines().next().unwrap_or_default().to_owned();
    let first: serde_json::Value = serde_json::from_str(&first).unwrap();
    assert_eq!(first["is_passed"], false);
    assert_eq!(check("2.55", "-1").status.code(), Some(2));
}

#[test]
fn mistakes_get_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    table(at, "cell.csv", 0.0);
    fs::write(at.join("poor.csv"), "mass_g,volts\n0,1.2\n100,lots\n").unwrap();
    for (args, words) in [
        (&["show", "nothing"][..], "no calibration \"nothing\""),
        (&["import", "cell.csv"], "has no name"),
        (&["import", "poor.csv", "--name", "p"], "line 3 has \"lots\""),
        (&["import", "none.csv", "--name", "p"], "cannot read none.csv"),
        (&["import", "cell.csv", "--name", "p", "--curve", "polynomial=5"], "not rise"),
        (&["import", "cell.csv", "--name", "p", "--curve", "segments=11"], "11 weights"),
        (&["import", "cell.csv", "--name", "p", "--curve", "spline"], "give best, monotone"),
        (&["import", "cell.csv", "--name", "p", "--tolerance=-1"], "tolerance"),
        (&["import", "cell.csv", "--name", "p", "--taken-at", "monday"], "not an RFC 3339 time"),
        (&["supersede", "none", "cell.csv", "--name", "p"], "no calibration \"none\""),
    ] {
        let output = palpate(at, &[&["calibration"][..], args].concat());
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(words), "{args:?}: {}", stderr(&output));
    }
    let list = palpate(at, &["calibration", "list"]);
    assert_prints(&list, "store one with");
}

#[test]
fn a_table_is_read_whole_or_refused_and_a_falling_signal_is_none() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let import = |rows: &str| {
        fs::write(at.join("cell.csv"), format!("mass_g,volts\n{rows}")).unwrap();
        let args = split_words("calibration import cell.csv --name bench --json");
        palpate(at, &args)
    };
    for (rows, words) in [
        ("0,1.2\n140,1,600\n", "line 3 has 3 cells"),
        ("0,1.2\n100,1.1\n200,1.9\n300,1.7\n", "check the wiring"),
    ] {
        let refused = import(rows);
        assert_eq!(refused.status.code(), Some(2), "{rows}");
        assert!(stderr(&refused).contains(words), "{}", stderr(&refused));
    }
    assert!(!at.join("library/calibrations").exists());
    let read = import(
        "0,\"1,280\"\n140,\"1,600\"\n240,\"1,830\"\n340,\"2,06\"\n440,\"2,29\"\n540,\"2,52\"\n",
    );
    succeeded(&read);
    let read = json(&read);
    let points = read["quality"]["points"].as_array().unwrap();
    let volts: Vec<f64> = points.iter().map(|one| one["signal_v"].as_f64().unwrap()).collect();
    assert_eq!(volts, [1.28, 1.6, 1.83, 2.06, 2.29, 2.52]);
}

/// What is kept in the library is what is used, in whichever way a session is recorded.
#[test]
fn the_calibration_in_force_reads_the_forces_unless_another_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    table(at, "cell.csv", 0.0);
    let import = split_words("calibration import cell.csv --name bench --rig sim --tolerance 0.05");
    succeeded(&palpate(at, &import));
    let used = |session: &str, more: &[&str]| {
        let run = short_run(at, session, more);
        succeeded(&run);
        let manifest = Session::open(&at.join(session)).unwrap().manifest;
        (manifest.calibration["name"].as_str().unwrap().to_owned(), run)
    };
    let (name, run) = used("in-force", &[]);
    assert_eq!(name, "bench");
    assert_says(&run, "forces are read with 'bench'");
    assert_ne!(used("named", &["--calibration", "thesis"]).0, "bench");
    // The straight cell of the ideal rig is another one.
    assert_ne!(used("ideal", &["--profile", "ideal"]).0, "bench");
}
