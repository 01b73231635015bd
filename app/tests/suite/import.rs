//! `palpate import`: foreign files become sessions that other commands take.

use crate::support::{
    assert_prints, assert_refused, assert_says, json, palpate, stderr, stdout, succeeded, typed,
};
use std::fs;

/// A ramp and hold of a body that relaxes, 0.1 s a row, in gf and µm with decimal commas.
fn table() -> String {
    let mut text = "Weg in µm;Kraft in gf;Zeit in ms\n".to_owned();
    for i in 0..200 {
        let t = 0.1 * f64::from(i);
        let depth = t.min(5.0);
        let relaxed = 1.0 + (-(t - 5.0).max(0.0) / 3.0).exp();
        let line = format!("{:.1};{:.4};{:.1}\n", depth * 1e3, 20.0 * depth * relaxed, t * 1e3);
        text += &line.replace('.', ",");
    }
    text
}

#[test]
fn an_imported_table_is_a_session_for_every_command() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("zug.csv"), table()).unwrap();
    let dry = palpate(at, &["import", "zug.csv", "--into", "in", "--dry-run"]);
    succeeded(&dry);
    assert!(!at.join("in").exists());
    assert_prints(&dry, "decimal sign  comma, from '");
    let args = ["import", "zug.csv", "--into", "in", "--specimen", "gel 3", "--json"];
    let made = palpate(at, &args);
    succeeded(&made);
    let part = &json(&made)["files"][0]["parts"][0];
    assert_eq!((&part["session"], &part["samples"]), (&"in/zug".into(), &200.into()));
    assert_eq!(part["readings"][0]["found"], "table");
    let original = at.join("in/zug/original/zug.csv");
    assert_eq!(fs::read_to_string(original).unwrap(), table());

    let none = palpate(at, &["compliance", "in/zug"]);
    assert_says(&none, "no rig");
    let info = json(&palpate(at, &["info", "in/zug", "--json"]));
    assert_eq!(
        (&info["imported"]["file"], &info["specimen"]),
        (&"zug.csv".into(), &"gel 3".into())
    );
    assert!(info["rig"].is_null());
    fs::create_dir(at.join("out")).unwrap();
    succeeded(&typed(at, "export in/zug --format csv --to out"));
    let exported = fs::read_to_string(at.join("out/zug.csv")).unwrap();
    // Time, depth and 4 gf as force, and nothing in the columns of a rig.
    assert_eq!(exported.lines().nth(2), Some("0.1,0.1,0.0392266,,,,imported,0"));
}

#[test]
fn fits_agree_and_replay_has_nothing_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("zug.csv"), table()).unwrap();
    succeeded(&palpate(at, &["import", "zug.csv", "--into", "in"]));
    let plain: String = std::iter::once("t_s,x_mm,F_N\n".to_owned())
        .chain(table().lines().skip(1).map(|line| {
            let line = line.replace(',', ".");
            let cells: Vec<f64> = line.split(';').map(|cell| cell.parse().unwrap()).collect();
            format!("{},{},{}\n", cells[2] / 1e3, cells[0] / 1e3, cells[1] * 980_665.0 / 1e8)
        }))
        .collect();
    fs::write(at.join("plain.csv"), plain).unwrap();
    let fit = |source: &str| json(&palpate(at, &["fit", source, "--json"]));
    let (session, table) = (fit("in/zug"), fit("plain.csv"));
    assert_eq!(session["samples"], table["samples"]);
    let values = |fit: &serde_json::Value| -> Vec<f64> {
        let all = fit["parameters"].as_array().unwrap();
        all.iter().map(|one| one["value"].as_f64().unwrap()).collect()
    };
    for (session, table) in values(&session).iter().zip(values(&table)) {
        // The same numbers but for the last digit of a time.
        assert!((session - table).abs() <= 1e-9 * table.abs().max(1e-3), "{session} {table}");
    }
    for (command, printed) in [("replay", "no decisions"), ("report", "no record of a run")] {
        let output = palpate(at, &[command, "in/zug"]);
        assert_eq!(output.status.code(), Some(2), "{command}");
        assert!(stderr(&output).contains(printed), "{command}: {}", stderr(&output));
    }
    succeeded(&palpate(at, &["analyse", "in/zug"]));
}

#[test]
fn a_refusal_is_one_sentence_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("good.csv"), "t_s,x_mm,F_N\n0,0,0\n1,1,1\n").unwrap();
    fs::write(at.join("bad.csv"), "t_s;x_mm;F_N\n1;1,234;5\n2;2,345;6\n").unwrap();
    let check = |args: &[&str], printed: &str| {
        let output = palpate(at, args);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {}", stdout(&output));
        assert!(stderr(&output).contains(printed), "{args:?}: {}", stderr(&output));
        assert!(!at.join("in").exists(), "{args:?}");
    };
    check(&["import", "good.csv", "bad.csv", "--into", "in"], "decimal sign");
    check(&["import", "good.csv", "good.csv", "--into", "in"], "two parts of the import");
    check(&["import", "good.csv", "--unit", "force=stone"], "give one of N, mN");
    check(&["import", "good.csv", "--column", "colour=x"], "time, depth, force, signal");
    check(&["import", "."], "not a file");
    succeeded(&palpate(at, &["import", "good.csv", "--into", "in"]));
    let again = palpate(at, &["import", "good.csv", "--into", "in"]);
    assert_refused(&again, 2, "exists already");
}

/// A Mach-1's contact at 2 mm, and a press of 1 mm from there that relaxes.
fn press() -> String {
    let block = |name: &str, clock: &str| {
        format!(
            "<INFO>\nTime:\t{clock}\n<END INFO>\n<{name}>\n<DATA>\nTime, s\tPosition (z), mm\tFz, N\n"
        )
    };
    let mut text = format!("<Mach-1 File>\n{}", block("Find Contact", "10:00:00.000"));
    for i in 0..20 {
        let t = 0.1 * f64::from(i);
        text += &format!("{t:.3}\t{:.6}\t0.000\n", 0.1 + t);
    }
    text += &format!("<END DATA>\n{}", block("Stress Relaxation", "10:00:20.000"));
    for i in 0..200 {
        let t = 0.05 * f64::from(i);
        let depth = t.min(1.0);
        let relaxed = 1.0 + (-(t - 1.0).max(0.0) / 3.0).exp();
        text += &format!("{t:.3}\t{:.6}\t{:.6}\n", 2.0 + depth, 0.2 * depth * relaxed);
    }
    text + "<END DATA>\n"
}

#[test]
fn press_of_a_mach1_is_fitted_as_its_relaxation_alone() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("gel.txt"), press()).unwrap();
    succeeded(&typed(at, "import gel.txt --into in"));
    assert!(!at.join("in/gel-Stress-Relaxation-1").exists());
    succeeded(&typed(at, "import gel.txt --into in --part 2 --zero depth=2"));
    let [press, alone] = ["in/gel-Press-1", "in/gel-Stress-Relaxation-1"]
        .map(|session| json(&palpate(at, &["fit", session, "--json"])));
    assert_eq!((&press["samples"], &alone["samples"]), (&200.into(), &200.into()));
    let values = |fit: &serde_json::Value| -> Vec<f64> {
        let all = fit["parameters"].as_array().unwrap();
        all.iter().map(|one| one["value"].as_f64().unwrap()).collect()
    };
    for (press, alone) in values(&press).iter().zip(values(&alone)) {
        assert!((press - alone).abs() <= 1e-6 * alone.abs().max(1e-3), "{press} {alone}");
    }
    let material = |session: &str| {
        let options =
            "--indenter sphere --radius 5 --thickness 20 --poisson 0.5 --zero-error 0 --json";
        let report = json(&typed(at, &format!("material {session} {options}")));
        report["modulus_mpa"].as_f64().unwrap()
    };
    let [press, alone] = ["in/gel-Press-1", "in/gel-Stress-Relaxation-1"].map(material);
    assert!((press / alone - 1.0).abs() < 1e-9, "{press} {alone}");
}
