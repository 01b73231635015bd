//! `palpate analyse` as a user meets it.

use crate::support::{json, palpate, stderr, stdout, succeeded};
use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
use palpate_model::{Depth, Seconds};
use std::fmt::Write;
use std::path::Path;

/// Thesis body behind a surface that recedes by 0.4, 0.2, 0.1 mm: in at `speed` to 30 mm, 10 s of hold, back.
fn table(at: &Path, name: &str, cycles: u32, speed: f64) {
    let mut text = String::from("t_s,depth_mm,force_N\n");
    let (count, held) = ((30.0 / speed * 50.0).round() as u32, 500);
    for cycle in 0..cycles {
        let set = 0.8 * (1.0 - 0.5f64.powi(cycle as i32));
        let mut state = KelvinState::at_rest_from(Depth(-set));
        for i in 0..=2 * count + held {
            let share = |n: u32| 30.0 * f64::from(n) / f64::from(count);
            let x = match i {
                _ if i <= count => share(i),
                _ if i <= count + held => 30.0,
                _ => share(2 * count + held - i),
            };
            let dt = if i == 0 { 0.0 } else { 0.02 };
            let force = state.step(&ModifiedKelvin::THESIS, Depth(x - set), Seconds(dt)).0;
            let t = f64::from(cycle) * 1000.0 + 0.02 * f64::from(i);
            let _ = writeln!(text, "{t},{x},{}", force.max(0.0));
        }
    }
    std::fs::write(at.join(name), text).expect("a table");
}

#[test]
fn cycles_of_a_table_are_reported_and_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    table(at, "ten.csv", 10, 1.5);
    let output = palpate(at, &["analyse", "ten.csv", "--json", "--plot", "ten.svg"]);
    succeeded(&output);
    let object = json(&output);
    let record = &object["records"][0];
    let cycles = record["cycles"].as_array().unwrap();
    assert_eq!((cycles.len(), object["command"].as_str()), (10, Some("analyse")));
    for (k, cycle) in cycles.iter().enumerate().skip(1) {
        let shift = cycle["shift_mm"].as_f64().unwrap();
        assert!((shift - 0.8 * 0.5f64.powi(k as i32)).abs() < 2e-3, "{k}: {shift}");
        let change = cycle["peak_change_percent"].as_f64().unwrap();
        assert!((-5.0..0.0).contains(&change), "{k}: {change}");
    }
    let first = &cycles[0];
    // The thesis body: 7.197303 N at 1.5 mm/s, and what it settles at.
    assert!((first["force_peak_n"][0].as_f64().unwrap() - 7.1973).abs() < 2e-3);
    let end = first["relaxation"]["equilibrium_n"][0].as_f64().unwrap();
    assert!((end - 5.5914).abs() < 1e-3, "{end}");
    assert!(record["steady_from"].as_u64().is_some_and(|cycle| (2..=5).contains(&cycle)));
    let drawn = std::fs::read_to_string(at.join("ten.svg")).unwrap();
    for word in ["depth (mm)", "peak (N)", "cycle 1 (mm)", "time of hold (s)", "cycle 10"] {
        assert!(drawn.contains(word), "{word}");
    }
    assert!(!drawn.contains("NaN"));
    let text = palpate(at, &["analyze", "ten.csv"]);
    succeeded(&text);
    let text = stdout(&text);
    assert!(text.contains("steady from cycle") && text.contains("constant depth"));
    assert!(text.contains("from the depth"));
}

#[test]
fn a_fit_predicts_a_second_speed() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    table(at, "slow.csv", 1, 0.75);
    table(at, "fast.csv", 1, 1.5);
    std::fs::write(
        at.join("thesis.json"),
        r#"{"rmse_n":0.0,"parameters":[
            {"name":"tau_eps","value":1.023,"unit":"s","std_error":0.01,"ci95":[1,1.05],"is_fixed":false},
            {"name":"mu1","value":0.05333,"unit":"N/mm","std_error":0.01,"ci95":[0,1],"is_fixed":false},
            {"name":"mu2","value":-0.0086,"unit":"N/mm^2","std_error":0.01,"ci95":[0,1],"is_fixed":false},
            {"name":"mu3","value":0.0004345,"unit":"N/mm^3","std_error":0.01,"ci95":[0,1],"is_fixed":false},
            {"name":"tau_sig","value":0.06,"unit":"N*s/mm^2","std_error":0.01,"ci95":[0,1],"is_fixed":false}]}"#,
    )
    .unwrap();
    let predicted = |args: &[&str]| {
        let output =
            palpate(at, &[&["analyse", "fast.csv", "--json", "--validate"], args].concat());
        succeeded(&output);
        let object = json(&output);
        assert_eq!(object["fitted"], args[0]);
        object["records"][0]["cycles"][0]["prediction"].clone()
    };
    let right = predicted(&["thesis.json"]);
    assert!(right["rms_n"].as_f64().unwrap() < 1e-9, "{right}");
    assert!((right["peak_n"].as_f64().unwrap() - 7.1973).abs() < 5e-3, "{right}");
    // Fitted on the fly; the table's way back is no ramp and hold, which a fit of a table without phases takes whole.
    let other = predicted(&["slow.csv"]);
    assert!(other["rms_percent"].as_f64().unwrap() < 30.0, "{other}");
    let text = palpate(at, &["analyse", "fast.csv", "--validate", "thesis.json"]);
    assert!(stdout(&text).contains("prediction minus measurement"));
}

#[test]
fn a_sine_in_a_table_needs_its_frequency() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut text = String::from("t_s,depth_mm,force_N\n");
    for i in 0..2000 {
        let t = 0.01 * f64::from(i);
        let (sin, cos) = (std::f64::consts::TAU * 0.5 * t).sin_cos();
        let _ = writeln!(text, "{t},{},{}", 10.0 - cos, 4.0 - 0.3 * cos + 0.1 * sin);
    }
    std::fs::write(at.join("sine.csv"), text).unwrap();
    let output = palpate(at, &["analyse", "sine.csv", "--frequency", "0.5", "--json"]);
    succeeded(&output);
    let sine = &json(&output)["records"][0]["sines"][0];
    assert!((sine["storage_n_per_mm"][0].as_f64().unwrap() - 0.3).abs() < 1e-9);
    assert!((sine["loss_n_per_mm"][0].as_f64().unwrap() - 0.1).abs() < 1e-9);
}

#[test]
fn wrong_use_gets_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    table(at, "one.csv", 1, 3.0);
    std::fs::write(at.join("few.csv"), "t_s,depth_mm,force_N\n0,0,0\n1,1,1\n2,0,0\n").unwrap();
    for (args, code, message) in [
        (&["analyse", "one.csv", "--steady", "0"][..], 2, "not a positive number"),
        (&["analyse", "nowhere.csv"], 2, "nowhere.csv"),
        (&["analyse", "one.csv", "one.csv", "--plot", "x.svg"], 2, "one source"),
        (&["analyse", "few.csv"], 1, "at least 20 samples"),
        (&["analyse", "one.csv", "--validate", "few.csv"], 1, "cannot be fitted"),
    ] {
        let output = palpate(at, args);
        assert_eq!(output.status.code(), Some(code), "{args:?}: {}", stderr(&output));
        assert!(stderr(&output).contains(message), "{args:?}: {}", stderr(&output));
    }
}
