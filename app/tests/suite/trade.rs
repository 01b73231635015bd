//! `palpate trade` as a user meets it.

use crate::support::{
    answer, assert_refused, assert_says, json, palpate, split_words, stderr, stdout, succeeded,
};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// The one file of curves in a library.
fn stored(folder: &Path) -> PathBuf {
    let files = palpate_analysis::trade::stored::trade_files(&folder.join("library"));
    assert_eq!(files.len(), 1, "{files:?}");
    files[0].clone()
}

/// Changes stored curves with their checksum, so that only their content can be wrong.
fn resealed(file: &Path, change: impl FnOnce(&mut palpate_rheology::trade::TradeCurves)) {
    let mut curves = palpate_analysis::trade::stored::read_trade(file).expect("curves");
    change(&mut curves);
    let library = file.ancestors().nth(2).expect("a library");
    palpate_analysis::trade::stored::write_trade(library, &curves).expect("a file");
}

#[test]
fn the_trade_is_measured_stored_shown_drawn_and_checked() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let nothing = palpate(at, &["trade", "--show"]);
    assert_refused(&nothing, 2, "no curves");

    let args = split_words("trade --quick --json --plot trade.svg --tolerance 2%");
    let measured = answer(&palpate(at, &args));
    let curves = &measured["curves"];
    let rows = |table: &str| curves[table].as_array().unwrap().clone();
    // Seven integrators, two precisions, four steps.
    assert_eq!(rows("integrators").len(), 56);
    assert_eq!((rows("families").len(), rows("fit").len(), rows("live").len()), (11, 2, 5));
    let is_unstable = |row: &&Value| row["error"].is_null();
    for row in rows("integrators").iter().filter(is_unstable) {
        assert!(row["refused"].as_str().unwrap().contains("unstable"), "{row}");
        assert_eq!(row["step_s"], 5.0);
    }
    assert_eq!(rows("integrators").iter().filter(is_unstable).count(), 4);
    let exact = rows("integrators");
    let exact: Vec<f64> = exact
        .iter()
        .filter(|row| row["scheme"] == "exact" && row["precision"] == "f64")
        .map(|row| row["error"]["ramp_hold_n"].as_f64().unwrap())
        .collect();
    assert!(exact.iter().all(|error| *error < 1e-13), "{exact:?}");
    let advice = &measured["recommendation"];
    for advised in [&advice["integrator"], &advice["fit"]] {
        assert!(advised["use"]["error_of_peak"].as_f64().unwrap() <= 0.02, "{advice}");
    }
    assert_eq!(advice["families"].as_array().unwrap().len(), 5);
    assert!(advice["live"]["use"]["setting"].is_string(), "{advice}");
    // A picture never takes the place of another file, and quick curves never that of full ones.
    std::fs::write(at.join("recording.csv"), "t,x,F").unwrap();
    for to in ["recording.csv", "no-folder/trade.svg"] {
        let refused = palpate(at, &["trade", "--quick", "--plot", to]);
        assert_eq!(refused.status.code(), Some(2), "{to}");
    }
    assert!(stored(at).to_string_lossy().ends_with("-quick.json"));

    let picture = std::fs::read_to_string(at.join("trade.svg")).unwrap();
    assert!(picture.starts_with("<svg") && picture.ends_with("</svg>\n"));
    assert!(!picture.contains("NaN") && !picture.contains("inf"));
    // A dot for every row with an error, and once more for those on a front of their table.
    assert!(picture.matches("<circle").count() >= 52 + 9 + 2);
    assert!(picture.contains("series-2") && picture.contains("Runge-Kutta"));

    let shown = palpate(at, &["trade", "--show", "--json"]);
    succeeded(&shown);
    assert_eq!(json(&shown)["curves"], *curves);
    let text = palpate(at, &["trade", "--show", "--tolerance", "1e-9N"]);
    succeeded(&text);
    let text = stdout(&text);
    for words in ["trapezoid, f32", "unstable", "series-3", "10 Hz, 901 samples", "none: "] {
        assert!(text.contains(words), "{words} is not in\n{text}");
    }
    let check = palpate(at, &["trade", "--check"]);
    succeeded(&check);
    assert!(stderr(&check).contains("every stored error was reproduced"));

    // A curve that was perturbed together with its checksum is found by computing it again.
    let file = stored(at);
    let good = std::fs::read(&file).unwrap();
    resealed(&file, |curves| {
        let row = curves.integrators.iter_mut().find(|row| row.step_s == 0.01);
        let error = row.and_then(|row| row.error.as_mut()).expect("an error");
        error.poke_n *= 1.0001;
    });
    let check = palpate(at, &["trade", "--check"]);
    assert_refused(&check, 1, "explicit Euler at 0.01 s");

    // Old and foreign curves are shown, with a word of warning.
    std::fs::write(&file, good).unwrap();
    resealed(&file, |curves| curves.measured_at = "2020-01-01T00:00:00Z".into());
    let shown = palpate(at, &["trade", "--show"]);
    succeeded(&shown);
    assert_says(&shown, "stale");
    resealed(&file, |curves| curves.machine.cpu = "Elsewhere".into());
    std::fs::remove_file(&file).unwrap();
    let shown = palpate(at, &["trade", "--show"]);
    succeeded(&shown);
    assert_says(&shown, "Elsewhere");
}

#[test]
fn files_that_hold_no_curves_are_refused_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let library = at.join("library/trade");
    std::fs::create_dir_all(&library).unwrap();
    let recorded = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/trade/curves.json");
    let good = std::fs::read_to_string(recorded).unwrap();
    let cases = [
        (good.replace("\"seeds\"", "\"sedes\""), "missing field `seeds`"),
        (good.replacen("\"poke_n\": ", "\"poke_n\": NaN, \"x\": ", 1), "holds no curves"),
        (good.replace("\"format\": 1", "\"format\": 2"), "format 2"),
        (good.replacen("\"quick\": true", "\"quick\": false", 1), "changed"),
        ("[]".into(), "holds no curves"),
        (String::new(), "holds no curves"),
    ];
    for (text, words) in cases {
        assert_ne!(text, good);
        std::fs::write(library.join("curves.json"), text).unwrap();
        let output = palpate(at, &["trade", "--show"]);
        let sentence = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{sentence}");
        assert!(sentence.contains(words), "{words}: {sentence}");
        assert_eq!(sentence.lines().count(), 1, "{sentence}");
    }
}

#[test]
fn curves_of_a_newer_version_are_not_replaced() {
    use palpate_analysis::trade::stored::{TradeFileError, read_trade, write_trade};
    let folder = tempfile::tempdir().unwrap();
    let recorded = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/trade/curves.json");
    let curves = read_trade(&recorded).unwrap();
    let file = write_trade(folder.path(), &curves).unwrap();
    let newer = std::fs::read_to_string(&file).unwrap().replace("\"format\": 1", "\"format\": 2");
    std::fs::write(&file, &newer).unwrap();
    let refused = write_trade(folder.path(), &curves);
    assert!(matches!(refused, Err(TradeFileError::Newer { format: 2, .. })), "{refused:?}");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), newer);
}

#[test]
fn wrong_wishes_are_refused_before_anything_is_measured() {
    let folder = tempfile::tempdir().unwrap();
    for (more, words) in [
        (["--tolerance", "5"], "is not a tolerance"),
        (["--rate", "0"], "--rate 0"),
        (["--rate", "NaN"], "--rate NaN"),
        (["--share", "200"], "up to 100"),
        (["--check", "--quick"], "used with"),
    ] {
        let output = palpate(folder.path(), &["trade", more[0], more[1]]);
        let text = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(text.contains(words), "{text}");
    }
}
