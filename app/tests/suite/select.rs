//! `palpate select` as a user meets it.

use crate::support::{
    answer, assert_refused, json, palpate, split_words, stderr, stdout, succeeded,
};
use palpate_model::{Depth, Seconds};
use palpate_rheology::families::{Model, find_family};
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;

/// A press of `model` at `speed` to `depth` mm and a hold up to 30 s, with 1 % of noise that is the
/// same on every machine.
fn table(at: &Path, name: &str, model: &Model, [speed, depth]: [f64; 2]) {
    let path: Vec<(Seconds, Depth)> = (0..=600)
        .map(|i| {
            let t = 0.05 * f64::from(i);
            (Seconds(t), Depth((speed * t).min(depth)))
        })
        .collect();
    let forces = model.along(path.iter().copied()).expect("a force");
    let mut text = String::from("t_s,depth_mm,force_N\n");
    let mut state = (100.0 * speed) as u64 + depth as u64;
    for ((t, x), force) in path.iter().zip(forces) {
        // The sum of twelve uniform numbers has the variance of a normal one.
        let mut sum = -6.0;
        for _ in 0..12 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            sum += (state >> 33) as f64 / f64::from(1u32 << 31);
        }
        let _ = writeln!(text, "{},{},{}", t.0, x.0, force + 0.02 * sum);
    }
    std::fs::write(at.join(name), text).expect("a table");
}

fn kelvin() -> Model {
    let family = find_family("kelvin").expect("a family");
    family.model(&[1.5], &[0.15, 0.6]).expect("a model")
}

fn three_tables(at: &Path) {
    table(at, "slow.csv", &kelvin(), [1.0, 10.0]);
    table(at, "fast.csv", &kelvin(), [5.0, 10.0]);
    table(at, "deep.csv", &kelvin(), [5.0, 20.0]);
}

fn candidate<'a>(selection: &'a Value, family: &str) -> &'a Value {
    let all = selection["candidates"].as_array().expect("candidates");
    all.iter().find(|one| one["family"] == family).expect("the family")
}

#[test]
fn the_body_that_was_pressed_is_recommended() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    three_tables(at);
    let args = ["select", "slow.csv", "fast.csv", "deep.csv"];
    let by_criterion = palpate(at, &[&args[..], &["--json"]].concat());
    succeeded(&by_criterion);
    let found = json(&by_criterion);
    assert_eq!(found["verdict"]["outcome"], "recommended", "{}", found["verdict"]);
    assert_eq!(found["verdict"]["family"], "kelvin");
    assert_eq!(found["tolerance_n"], Value::Null);
    let kelvin = candidate(&found, "kelvin");
    assert_eq!(kelvin["bic_above"], 0.0);
    // Noise of 0.02 N, fitted and predicted; a fifth of it is what 600 samples may miss it by.
    for error in [&kelvin["rms_n"], &kelvin["prediction"]["rms_n"]] {
        assert!((error.as_f64().unwrap() - 0.02).abs() < 0.004, "{error}");
    }
    let unseen: Vec<&Value> = kelvin["prediction"]["records"]
        .as_array()
        .unwrap()
        .iter()
        .map(|one| &one["unseen"])
        .collect();
    assert_eq!(unseen, ["speed", "specimen", "depth"]);

    // A coarse hand is content with less, and the plot shows it.
    let coarse = ["--tolerance", "0.4N", "--plot", "plot.svg"];
    let text = palpate(at, &[&args[..], &coarse].concat());
    succeeded(&text);
    let text = stdout(&text);
    assert!(text.contains("use maxwell") || text.contains("use voigt"), "{text}");
    assert!(text.contains("extra term"));
    let plot = std::fs::read_to_string(at.join("plot.svg")).unwrap();
    assert!(plot.starts_with("<svg") && plot.contains("tolerance") && plot.contains("kelvin"));

    // A tolerance below the noise has no winner.
    let fine = answer(&palpate(at, &[&args[..], &["--tolerance", "0.1%", "--json"]].concat()));
    assert_eq!(fine["verdict"]["outcome"], "none-within");
    assert_eq!(fine["verdict"]["family"], Value::Null);
}

#[test]
fn one_record_is_split_in_time() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    table(at, "slow.csv", &kelvin(), [1.0, 10.0]);
    let args = split_words("select slow.csv --families maxwell,kelvin,series-2 --json");
    let found = answer(&palpate(at, &args));
    let names: Vec<&Value> =
        found["candidates"].as_array().unwrap().iter().map(|one| &one["family"]).collect();
    assert_eq!(names, ["maxwell", "kelvin", "series-2"]);
    let records = &candidate(&found, "kelvin")["prediction"]["records"];
    assert_eq!(records[0]["unseen"], "rest");
    let none = palpate(at, &[&args[..], &["--hold-out", "none"]].concat());
    succeeded(&none);
    assert_eq!(candidate(&json(&none), "kelvin")["prediction"], Value::Null);
}

#[test]
fn two_specimens_are_no_noise_and_each_is_held_out_whole() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let soft = kelvin();
    let stiff = Model { linear: soft.linear.iter().map(|one| 2.0 * one).collect(), ..soft.clone() };
    for (name, body) in [("soft", &soft), ("stiff", &stiff)] {
        table(at, &format!("{name}-slow.csv"), body, [1.0, 10.0]);
        table(at, &format!("{name}-fast.csv"), body, [5.0, 10.0]);
    }
    let args = split_words(
        "select soft-slow.csv soft-fast.csv stiff-slow.csv stiff-fast.csv --families maxwell,kelvin,series-2 --json",
    );
    // What two specimens differ by is no noise, whatever each alone would look like.
    let found = answer(&palpate(at, &args));
    assert_eq!(found["verdict"]["outcome"], "none-adequate", "{found}");
    assert!(found["effective_samples"].as_f64().unwrap() < 200.0);
    let candidates = found["candidates"].as_array().unwrap();
    let rms = |one: &&Value| one["rms_n"].as_f64().unwrap();
    let closest = candidates.iter().min_by(|a, b| rms(a).total_cmp(&rms(b))).unwrap();
    let even = format!("the residuals of {}", closest["family"].as_str().unwrap());
    let message = found["verdict"]["sentences"][0].as_str().unwrap();
    assert!(message.contains(&even), "{message}");

    let specimen = ["--hold-out", "specimen"];
    let nameless = palpate(at, &[&args[..], &specimen].concat());
    assert_eq!(nameless.status.code(), Some(2));
    assert!(stdout(&nameless).contains("does not state its specimen"));
    let few = [&args[..], &specimen, &["--specimens", "A,B"]].concat();
    assert_eq!(palpate(at, &few).status.code(), Some(2));
    let named = [&args[..], &specimen, &["--specimens", "A,A,B,B"]].concat();
    let held = answer(&palpate(at, &named));
    // The other specimen is half or twice as stiff, and one factor makes up for it.
    let prediction = &candidate(&held, "kelvin")["prediction"];
    for record in prediction["records"].as_array().unwrap() {
        let scale = record["scale"].as_f64().unwrap();
        let wanted = if record["record"].as_str().unwrap().starts_with("soft") { 0.5 } else { 2.0 };
        assert!((scale / wanted - 1.0).abs() < 0.05, "{record}");
    }
    assert!(prediction["scaled_rms_n"].as_f64().unwrap() < 0.03);
}

#[test]
fn a_sensor_offset_is_no_part_of_the_peak() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    table(at, "plain.csv", &kelvin(), [1.0, 10.0]);
    let text = std::fs::read_to_string(at.join("plain.csv")).unwrap();
    let mut raised = String::new();
    for line in text.lines() {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if let Ok(force) = cells[2].parse::<f64>() {
            cells[2] = (force + 5.0).to_string();
        }
        let _ = writeln!(raised, "{}", cells.join(","));
    }
    std::fs::write(at.join("raised.csv"), raised).unwrap();
    let tolerance = |name| {
        let args = ["select", name, "--families", "kelvin", "--tolerance", "1%", "--json"];
        let found = palpate(at, &args);
        succeeded(&found);
        json(&found)["tolerance_n"].as_f64().unwrap()
    };
    let (plain, raised) = (tolerance("plain.csv"), tolerance("raised.csv"));
    assert!((raised / plain - 1.0).abs() < 0.02, "{plain} {raised}");
}

#[test]
fn wrong_use_is_reported_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    table(at, "slow.csv", &kelvin(), [1.0, 10.0]);
    std::fs::write(at.join("empty.csv"), "t_s,depth_mm,force_N\n").unwrap();
    std::fs::write(at.join("flat.csv"), "t_s,depth_mm,force_N\n0,1,1\n1,1,2\n2,1,3\n").unwrap();
    std::fs::write(at.join("there.svg"), "").unwrap();
    let cases: [(&[&str], i32, &str); 8] = [
        (&["slow.csv", "--families", "kelvin,zener"], 2, "'zener'"),
        (&["none.csv"], 2, "none.csv"),
        (&["slow.csv", "--tolerance", "5kg"], 2, "'5kg'"),
        (&["slow.csv", "--hold-out", "weather"], 2, "'weather'"),
        (&["slow.csv", "--hold-out", "speed"], 2, "1 record(s)"),
        (&["empty.csv"], 2, "empty.csv: "),
        (&["flat.csv"], 1, "1 mm"),
        (&["slow.csv", "--plot", "there.svg"], 2, "there.svg"),
    ];
    for (args, code, fact) in cases {
        let output = palpate(at, &[&["select"], args].concat());
        assert_eq!(output.status.code(), Some(code), "{args:?}: {}", stderr(&output));
        let message = stderr(&output);
        assert!(message.starts_with("error: ") && message.contains(fact), "{args:?}: {message}");
        assert_eq!(message.lines().count(), 1, "{message}");
        assert_eq!(stdout(&output), "");
    }
    let twice = palpate(at, &["select", "slow.csv", "./slow.csv"]);
    assert_refused(&twice, 2, "is given twice");
}
