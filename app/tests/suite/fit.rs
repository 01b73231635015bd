//! `palpate fit`: one source, many, pictures, tables of all kinds.

use crate::support::{
    assert_refused, command, json, palpate, short_run, split_words, stderr, stdout, succeeded,
    typed,
};
use palpate_analysis::fit::{FitIntervals, SourceFit};
use palpate_analysis::report::fit_json::FitOverlay;
use palpate_analysis::report::text;
use palpate_analysis::source::read;
use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
use palpate_model::{Depth, Seconds};
use palpate_rheology::fit::FitOptions;
use serde_json::Value;
use std::fmt::Write as _;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Command, Stdio};

/// Rows of a ramp and hold of the thesis body, 0.75 mm/s to 30 mm, for as long as `count` says.
fn rows(count: usize, step_secs: f64, stiffness: f64) -> String {
    let mut body = ModifiedKelvin::THESIS;
    body.mu[2] *= stiffness;
    let mut state = KelvinState::at_rest();
    let mut text = String::new();
    for i in 0..count {
        let t = i as f64 * step_secs;
        let depth = Depth((0.75 * t).min(30.0));
        let dt = Seconds(if i == 0 { 0.0 } else { step_secs });
        // A little ripple, so that there is something to be uncertain about.
        let force = state.step(&body, depth, dt).0 + 1e-3 * (i as f64 * 2.4).sin();
        writeln!(text, "{t},{},{force}", depth.0).expect("a string takes any text");
    }
    text
}

fn table(path: &Path, rows: &str) {
    std::fs::write(path, format!("t_s,x_mm,F_N\n{rows}")).expect("a table is written");
}

#[test]
fn a_batch_prints_the_same_bytes_with_any_number_of_jobs() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::create_dir_all(at.join("lib/deep")).unwrap();
    succeeded(&short_run(at, "lib/session", &[]));
    for i in 0..6usize {
        // The first is the longest, so that with several jobs it ends after others.
        let rows = rows(900 * (6 - i).max(2), 0.1, 1.0 + 0.1 * i as f64);
        table(&at.join(format!("lib/deep/t{i}.csv")), &rows);
    }
    table(&at.join("lib/ramp.csv"), &rows(300, 0.1, 1.0));
    std::fs::write(at.join("lib/words.csv"), "t_s,x_mm,F_N\n0,0,zero\n").unwrap();
    for kind in [&[][..], &["--json"]] {
        let outputs = ["1", "2", "9"].map(|jobs| {
            let args = [&["fit", "lib", "--jobs", jobs], kind].concat();
            let output = palpate(at, &args);
            assert_refused(&output, 1, "2 of 9");
            stdout(&output)
        });
        assert_eq!(outputs[0], outputs[1]);
        assert_eq!(outputs[0], outputs[2]);
        let lines: Vec<&str> = outputs[0].lines().collect();
        if kind.is_empty() {
            assert_eq!(lines.len(), 10, "{}", outputs[0]);
            assert!(lines[0].starts_with("source") && lines[0].contains("tau_sig (N·s/mm²)"));
            assert!(lines[1].starts_with("lib/deep/t0.csv") && lines[1].contains("1.023"));
            assert!(lines[9].contains("failed: ") && lines[9].contains("line 2"));
            continue;
        }
        let objects: Vec<Value> =
            lines.iter().map(|line| serde_json::from_str(line).unwrap()).collect();
        let sources: Vec<&str> =
            objects.iter().filter_map(|object| object["source"].as_str()).collect();
        let expected: Vec<String> = (0..6)
            .map(|i| format!("lib/deep/t{i}.csv"))
            .chain(["lib/ramp.csv", "lib/session", "lib/words.csv"].map(String::from))
            .collect();
        assert_eq!(sources, expected);
        // Each line is its own table: the stiffest one has the highest mu3.
        let mu3 = |i: usize| objects[i]["parameters"][3]["value"].as_f64().unwrap();
        for i in 0..6 {
            let truth = ModifiedKelvin::THESIS.mu[2] * (1.0 + 0.1 * i as f64);
            // The ripple of 1 mN under 15 N.
            assert!((mu3(i) / truth - 1.0).abs() < 1e-3, "{i}: {}", mu3(i));
        }
        assert!(objects[6]["error"].as_str().unwrap().contains("tau_sig"));
        assert_eq!((&objects[6]["exit"], &objects[8]["exit"]), (&1.into(), &2.into()));
        assert_eq!(objects[9]["exit"], 1);
    }
}

#[test]
fn one_source_prints_what_the_window_shows() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    table(&at.join("t.csv"), &rows(900, 0.1, 1.0));
    let output = palpate(at, &["fit", "t.csv"]);
    succeeded(&output);
    let fitted = SourceFit::of(read(&at.join("t.csv")).unwrap(), &FitOptions::default());
    let report = fitted.result.as_ref().unwrap();
    let (overlay, intervals) = (FitOverlay::of(report, &fitted.samples), FitIntervals::default());
    let page = text::fit_text(report, fitted.details(&overlay, &intervals));
    assert_eq!(stdout(&output).trim_end(), page);
    // Whether its family is named or not: the same body, the same page.
    let named = palpate(at, &["fit", "t.csv", "--family", "series-3"]);
    assert_eq!(stdout(&named).trim_end(), page);
    assert!(stdout(&output).contains("tau_eps    1.0"));
}

#[test]
fn pictures_show_the_fit_or_why_there_is_none_and_overwrite_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    table(&at.join("t.csv"), &rows(900, 0.1, 1.0));
    table(&at.join("ramp.csv"), &rows(300, 0.1, 1.0));
    let output = palpate(at, &["fit", "t.csv", "--picture", "t.svg"]);
    succeeded(&output);
    let picture = std::fs::read_to_string(at.join("t.svg")).unwrap();
    let first = stdout(&output).lines().nth(2).unwrap().to_owned();
    let interval = first.split("95 % ").nth(1).unwrap();
    assert!(picture.starts_with("<svg") && picture.contains(interval), "{interval}");

    let again = palpate(at, &["fit", "t.csv", "--picture", "t.csv"]);
    assert_refused(&again, 2, "exists already");

    let refused = palpate(at, &["fit", "ramp.csv", "--picture", "ramp.svg"]);
    assert_eq!(refused.status.code(), Some(1));
    let picture = std::fs::read_to_string(at.join("ramp.svg")).unwrap();
    let message = stderr(&refused);
    let words: Vec<&str> = message.split_whitespace().skip(1).take(6).collect();
    assert!(picture.contains(&words.join(" ")), "{message}");

    let many = palpate(at, &["fit", "t.csv", "ramp.csv", "--picture", "x.svg"]);
    assert_eq!(many.status.code(), Some(2));
    let nowhere = palpate(at, &["fit", "t.csv", "--picture", "no/x.svg"]);
    assert_eq!(nowhere.status.code(), Some(2), "{}", stderr(&nowhere));
}

#[test]
fn tables_without_header_or_unit_are_read_when_reported_how() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let rows = rows(900, 0.1, 1.0);
    std::fs::write(at.join("bare.csv"), &rows).unwrap();
    std::fs::write(at.join("time.csv"), format!("Time,x_mm,F_N\n{rows}")).unwrap();
    let unnamed = palpate(at, &["fit", "bare.csv"]);
    assert_refused(&unnamed, 2, "--columns");
    let named = typed(at, "fit bare.csv --columns t_s,x_mm,F_N --json");
    succeeded(&named);
    let time = palpate(at, &["fit", "time.csv", "--json"]);
    succeeded(&time);
    assert!(stderr(&time).contains("seconds"));
    assert_eq!(json(&named)["parameters"], json(&time)["parameters"]);
    let wrong = palpate(at, &["fit", "bare.csv", "--columns", "t_s,x_mm"]);
    assert_refused(&wrong, 2, "recognised as the force");
}

#[test]
fn a_batch_that_is_asked_to_end_keeps_what_it_has() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::create_dir(at.join("many")).unwrap();
    let rows = rows(9000, 0.01, 1.0);
    for i in 0..40 {
        table(&at.join(format!("many/t{i:02}.csv")), &rows);
    }
    let mut batch = command(at, &["fit", "many", "--jobs", "1", "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut reader = BufReader::new(batch.stdout.take().unwrap());
    let mut text = String::new();
    reader.read_line(&mut text).unwrap();
    let kill = format!("kill -INT {}", batch.id());
    assert!(Command::new("sh").args(["-c", &kill]).status().unwrap().success());
    reader.read_to_string(&mut text).unwrap();
    assert_eq!(batch.wait().unwrap().code(), Some(1));
    let objects: Vec<Value> =
        text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    // One line for every source, then why the command failed.
    assert_eq!(objects.len(), 41);
    let fitted = objects.iter().filter(|object| object["r2"].is_f64()).count();
    let not_begun = |object: &&Value| {
        let error = object["error"].as_str();
        error.is_some_and(|error| error.starts_with("the fit was not started"))
    };
    let left = objects.iter().filter(not_begun).count();
    assert!(fitted >= 1 && left >= 1, "{fitted} {left}");
    assert_eq!(fitted + left, 40);
}

#[test]
fn recordings_are_fitted_together_and_say_what_they_share() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    table(&at.join("a.csv"), &rows(900, 0.1, 1.0));
    table(&at.join("b.csv"), &rows(600, 0.1, 1.2));
    let joint = typed(at, "fit a.csv b.csv --share tau_eps,tau_sig --json");
    succeeded(&joint);
    let object = json(&joint);
    assert_eq!(object["shared"], serde_json::json!(["tau_eps", "tau_sig"]));
    let value = |record: usize, parameter: usize| {
        object["records"][record]["report"]["parameters"][parameter]["value"].as_f64().unwrap()
    };
    assert_eq!(value(0, 0), value(1, 0));
    // The second specimen is a fifth stiffer in its cubic term, and labelled so.
    assert!((value(1, 3) / value(0, 3) - 1.2).abs() < 0.01);
    let text = stdout(&palpate(at, &["fit", "a.csv", "b.csv", "--share", "body"]));
    assert!(text.contains("2 records together"), "{text}");
    let taus = text.lines().filter(|line| line.starts_with("  tau_eps "));
    assert_eq!(taus.count(), 1, "{text}");
    for (arguments, words) in [
        (&["fit", "a.csv", "b.csv", "--share", "f0"][..], "cannot be shared"),
        (&["fit", "a.csv", "b.csv", "--share", "mu9"], "'mu9'"),
        (&["fit", "a.csv", "--share", "body"], "at least two"),
        (&["fit", "a.csv", "--seed", "3"], "--bootstrap"),
        (&["fit", "a.csv", "--bootstrap", "3"], "too few"),
        (&["fit", "a.csv", "b.csv", "--profile"], "one fit"),
    ] {
        let refused = palpate(at, arguments);
        assert_eq!(refused.status.code(), Some(2), "{arguments:?}");
        assert!(stderr(&refused).contains(words), "{}", stderr(&refused));
    }
}

#[test]
fn more_intervals_come_on_request_and_repeat_with_their_seed() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    table(&at.join("a.csv"), &rows(900, 0.1, 1.0));
    let asked = split_words("fit a.csv --profile --bootstrap 50 --seed 4 --json");
    let (first, second) = (json(&palpate(at, &asked)), json(&palpate(at, &asked)));
    assert_eq!(first["bootstrap"], second["bootstrap"]);
    assert_eq!(first["bootstrap_seed"], 4);
    assert_eq!(first["profile"].as_array().unwrap().len(), 7);
    for (profile, parameter) in
        first["profile"].as_array().unwrap().iter().zip(first["parameters"].as_array().unwrap())
    {
        let value = parameter["value"].as_f64().unwrap();
        assert!(profile["low"].as_f64().unwrap() < value);
        assert!(value < profile["high"].as_f64().unwrap());
    }
    let text = stdout(&palpate(at, &asked[..7]));
    assert!(text.contains("profile likelihood"), "{text}");
    assert!(text.contains("bootstrap, seed 4"), "{text}");
}

#[test]
fn any_family_is_fitted_and_unloading_where_it_was_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let run = "run ramp-hold --speed 3 --depth 20 --hold 5 --unload 0.3 --softening 40 --profile ideal \
               --time-scale max --out loop";
    succeeded(&palpate(at, &run.split_whitespace().collect::<Vec<_>>()));
    let picture = ["--picture", "loop.svg", "--json"];
    let args = ["fit", "loop", "--family", "unloading-3", "--unload"];
    let output = palpate(at, &[&args[..], &picture].concat());
    succeeded(&output);
    let found = json(&output);
    assert_eq!(found["family"], "unloading-3");
    let names: Vec<&str> = found["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .map(|one| {
            assert!(one["value"].is_f64() && one["unit"].is_string());
            one["name"].as_str().unwrap()
        })
        .collect();
    assert_eq!(
        names,
        [
            "tau_eps",
            "mu1",
            "mu2",
            "mu3",
            "tau_sig",
            "s1",
            "s2",
            "s3",
            "f0",
            "f_offset",
            "x_contact"
        ]
    );
    assert!(found["noise"].is_object() && found["parameters"][0]["ci95"].is_array());
    let record = &found;
    let number = |name: &str| record[name].as_f64().unwrap();
    assert!(number("r2") > 0.9 && number("rmse_n") < 0.03, "{record}");
    // Energy is lost over the loop, and the fit knows how much to a hundredth.
    let (measured, fitted) = (number("work_measured_n_mm"), number("work_fitted_n_mm"));
    assert!(measured > 0.5 && (fitted / measured - 1.0).abs() < 0.01, "{record}");
    let drawn = std::fs::read_to_string(at.join("loop.svg")).unwrap();
    assert!(drawn.contains("depth (mm)") && drawn.contains("softer"));
    assert!(!drawn.contains("NaN"));
    // Text says the same; two sources are two records of one body.
    succeeded(&palpate(at, &["export", "loop", "--format", "csv"]));
    let output = palpate(at, &["fit", "loop", "loop.csv", "--family", "maxwell"]);
    succeeded(&output);
    let text = stdout(&output);
    assert!(text.starts_with("Maxwell") && text.matches("rmse").count() == 2, "{text}");

    // By itself, with some of it shared, kept beside its session, in a lake: like any other fit.
    let both = ["fit", "loop", "loop.csv", "--family", "kelvin", "--json"];
    let each = palpate(at, &[&both[..], &["--each"]].concat());
    succeeded(&each);
    assert_eq!(stdout(&each).lines().count(), 2);
    let joint = json(&palpate(at, &[&both[..], &["--share", "tau_eps"]].concat()));
    assert_eq!(joint["shared"], serde_json::json!(["tau_eps"]));
    assert_eq!(joint["records"].as_array().unwrap().len(), 2);
    let kept = "fit loop --family kelvin --profile --save straight --json";
    let kept = json(&palpate(at, &kept.split_whitespace().collect::<Vec<_>>()));
    assert_eq!(kept["profile"].as_array().unwrap().len(), 5);
    let kept = stdout(&palpate(at, &["info", "loop", "--json"]));
    assert!(kept.contains("straight"), "{kept}");
    succeeded(&palpate(at, &["export", "loop", "--lake", "lake"]));
    let lake = json(&typed(at, "fit lake --family kelvin --json"));
    assert_eq!((&lake["model"], &lake["made"]), (&"kelvin".into(), &1.into()));

    for (args, code, words) in [
        (&["--family", "unloading-3"][..], 1, "record the unloading"),
        (&["--family", "spring"], 2, "'spring'"),
        (&["--unload"], 2, "--family"),
        (&["--family", "voigt", "--free", "f0"], 2, "'f0'"),
        (&["--family", "voigt", "--share", "k"], 2, "two recordings"),
        (&["--each"], 2, "--family"),
        (&["--family", "voigt", "--picture", "loop.svg"], 2, "exists already"),
    ] {
        let output = palpate(at, &[&["fit", "loop"][..], args].concat());
        assert_eq!(output.status.code(), Some(code), "{args:?}");
        assert!(stderr(&output).contains(words), "{args:?}: {}", stderr(&output));
    }
    let output = palpate(at, &["run", "ramp-hold", "--softening", "95"]);
    assert_refused(&output, 2, "0 to 90");
}
