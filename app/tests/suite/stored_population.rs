//! `palpate population` from the statistics that the fits of a lake stored.

use crate::population::record_study;
use crate::support::{answer, assert_refused, palpate, short_run, stdout, succeeded, typed};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};

const STORED: &str = "--two-stage --stored --parameters mu1,tau_eps --effect animal.treatment";

fn fits(lake: &Path) -> Vec<PathBuf> {
    let folder = lake.join("v1/fits/model=modified-kelvin");
    let mut found: Vec<PathBuf> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    found.sort();
    found
}

/// Changes every fit of a lake.
fn edit_fits(lake: &Path, edit: impl Fn(&mut Value)) {
    for path in fits(lake) {
        let mut fit: Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
        edit(&mut fit);
        fs::write(&path, format!("{fit}\n")).unwrap();
    }
}

/// Numbers of two answers by their path, all else must be equal.
fn numbers(place: &str, one: &Value, other: &Value, found: &mut Vec<(String, f64, f64)>) {
    match (one, other) {
        (Value::Object(one), Value::Object(other)) => {
            assert!(one.keys().eq(other.keys()), "{place}");
            for ((key, one), other) in one.iter().zip(other.values()) {
                numbers(&format!("{place}.{key}"), one, other, found);
            }
        }
        (Value::Array(one), Value::Array(other)) => {
            assert_eq!(one.len(), other.len(), "{place}");
            for (index, (one, other)) in one.iter().zip(other).enumerate() {
                numbers(&format!("{place}.{index}"), one, other, found);
            }
        }
        (Value::Number(one), Value::Number(other)) => {
            found.push((place.to_owned(), one.as_f64().unwrap(), other.as_f64().unwrap()));
        }
        _ => assert_eq!(one, other, "{place}"),
    }
}

#[test]
fn a_population_of_stored_fits_is_that_of_the_curves_best_values() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record_study(at);
    for lake in ["whole", "parts"] {
        succeeded(&palpate(at, &["export", "study", "--lake", lake]));
    }
    assert_refused(&typed(at, &format!("population whole {STORED}")), 2, "fit the lake first");
    succeeded(&typed(at, "fit whole"));
    for shard in ["2/3", "3/3", "1/3"] {
        succeeded(&typed(at, &format!("fit parts --shard {shard} --jobs 1")));
    }
    let of_lake = |lake: &str| typed(at, &format!("population {lake} {STORED} --json"));
    let stored = of_lake("whole");
    let mut found = answer(&stored);
    // Nothing in a lake depends on where it was fitted, and nothing in a population on the number of processors.
    assert_eq!(stdout(&of_lake("parts")), stdout(&stored));
    // As palpate stored fits before it stored statistics: all else of such a lake can be read.
    edit_fits(&at.join("whole"), |fit| {
        fit["settings"].as_object_mut().unwrap().remove("fit_version");
        fit["fit"].as_object_mut().unwrap().remove("logarithms");
    });
    assert_refused(&of_lake("whole"), 2, "of an earlier version");
    let line = format!("population whole {STORED} --json").replace(" --stored", "");
    let mut curves = answer(&typed(at, &line));
    for (answer, method) in [(&mut found, "stored"), (&mut curves, "two-stage")] {
        assert_eq!(answer.as_object_mut().unwrap().remove("method"), Some(method.into()));
    }
    let mut pairs = Vec::new();
    numbers("", &found, &curves, &mut pairs);
    assert!(pairs.len() > 100, "{}", pairs.len());
    for (place, one, other) in pairs {
        // The ends of the intervals of standard deviations are found to a thousandth, all else to rounding.
        let is_end = place.starts_with(".standard_deviations") && place.contains("interval");
        let tolerance = if is_end { 1e-3 } else { 1e-6 };
        let apart = (one - other).abs();
        assert!(apart <= tolerance * one.abs().max(1e-3), "{place}: {one} {other}");
    }

    // The sessions' samples are not read at all.
    fs::remove_dir_all(at.join("parts/v1/samples")).unwrap();
    fs::create_dir_all(at.join("parts/v1/samples")).unwrap();
    assert_eq!(stdout(&of_lake("parts")), stdout(&stored));
    let first = fits(&at.join("parts")).remove(0);
    fs::remove_file(&first).unwrap();
    let lacking = answer(&of_lake("parts"));
    let id = first.file_stem().unwrap().to_str().unwrap();
    assert!(lacking["not_fitted"][id].as_str().unwrap().contains("no fit"), "{lacking:#}");
    assert_eq!(lacking["sessions"], 15);
}

#[test]
fn stored_fits_that_are_not_those_of_the_population_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for animal in ["a", "b"] {
        let about = format!("animal.name={animal}");
        let more = ["--specimen", animal, "--about", &about];
        succeeded(&short_run(at, &format!("study/{animal}"), &more));
    }
    succeeded(&palpate(at, &["export", "study", "--lake", "lake"]));
    succeeded(&typed(at, "fit lake --fixed f_offset=0"));
    let refused = |more: &str, says: &[&str]| {
        let output = typed(at, &format!("population {more}"));
        for says in says {
            assert_refused(&output, 2, says);
        }
    };
    let stored = "lake --two-stage --stored --parameters mu1";
    refused(stored, &["f_offset=0 fixed", "no parameter fixed", "model=modified-kelvin away"]);
    refused(
        &format!("{stored} --family series-2"),
        &["no fits of series-2, but of modified-kelvin"],
    );
    refused(&stored.replace("lake", "study"), &["give one lake"]);
    refused("lake --stored", &["--two-stage"]);
    let lake = at.join("lake");
    edit_fits(&lake, |fit| {
        fit["settings"]["fixed"] = Value::Array(Vec::new());
        fit["settings"]["compliance_sha256"] = "ab12".into();
    });
    refused(stored, &["compliance of SHA-256 ab12", "raw depths"]);
    edit_fits(&lake, |fit| {
        fit["settings"]["compliance_sha256"] = Value::Null;
        fit["settings"]["fit_version"] = 3.into();
    });
    refused(stored, &["a newer version of palpate wrote the fit", "update palpate"]);
    fs::write(&fits(&lake)[0], "{}").unwrap();
    assert_refused(&typed(at, &format!("population {stored}")), 1, "move it away");
}
