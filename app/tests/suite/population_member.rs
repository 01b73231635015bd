//! Specimens of a saved population on the simulated rig, in scenes and in the haptic loop.

use crate::population::record_study;
use crate::scene::BOX;
use crate::support::{answer, assert_refused, palpate, short_run, stdout, succeeded, typed};
use serde_json::{Value, json};
use std::path::Path;

const PARAMETERS: [(&str, &str, f64); 3] =
    [("tau_eps", "s", 0.8), ("mu1", "N/mm", 0.08), ("tau_sig", "N*s/mm^2", 0.05)];

/// A population of the family series-1 in the library, as somebody could write it, and of another family.
fn write_populations(at: &Path) {
    let folder = at.join("library/populations");
    std::fs::create_dir_all(&folder).unwrap();
    for (name, family) in [("pad", "series-1"), ("gel", "maxwell")] {
        let parameters = PARAMETERS.map(|(name, unit, median)| {
            json!({ "name": name, "unit": unit, "median": median, "effects": [],
                "standard_deviations": [0.1, 0.05] })
        });
        let document = json!({
            "format": 1, "name": name, "estimated_at": "2026-03-05T10:00:00Z",
            "software_version": "0", "family": family, "method": "curves",
            "levels": ["animal", "session"], "effects": [], "parameters": parameters,
            "constants": [], "depth_max_mm": 12.0, "sessions": [],
        });
        std::fs::write(folder.join(format!("{name}.json")), document.to_string()).unwrap();
    }
}

fn read(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn a_fit_of_a_simulated_specimen_finds_the_parameters_that_were_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write_populations(at);
    let mut drawn = Vec::new();
    for number in [1, 2] {
        let (specimen, truth) = (format!("population:pad#{number}"), format!("{number}.json"));
        let session = format!("session {number}");
        let run = ["run", "ramp-hold", "--speed", "3", "--depth", "12", "--hold", "10"];
        let more = ["--profile", "ideal", "--noise", "1", "--time-scale", "max", "--out", &session];
        let own = ["--specimen", &specimen, "--truth", &truth];
        succeeded(&palpate(at, &[&run[..], &more, &own].concat()));
        let truth = read(&at.join(truth));
        let info = answer(&palpate(at, &["info", &session, "--json"]));
        assert!(info.to_string().contains(&specimen), "{info:#}");
        let found = answer(&palpate(at, &["fit", &session, "--family", "series-1", "--json"]));
        let found = found["parameters"].as_array().unwrap();
        for (name, _, median) in PARAMETERS {
            let exact = truth["parameters"][name].as_f64().unwrap();
            assert_ne!(exact, median);
            assert_eq!(truth["settings"][name], exact.to_string());
            let one = found.iter().find(|one| one["name"] == name).unwrap();
            let error = one["std_error"].as_f64().unwrap();
            let off = one["value"].as_f64().unwrap() - exact;
            // Four standard errors are passed once in 16 000 fits, and this one is always the same. Errors are of less than
            // 2 %, so that the specimen is not mistaken for another: the members differ by 11 %.
            assert!(off.abs() < 4.0 * error && error < 0.02 * exact, "{name} {exact}: {one:#}");
        }
        for name in ["mu2", "mu3"] {
            assert_eq!(truth["parameters"][name], 0.0);
        }
        drawn.push(truth["parameters"].clone());
    }
    assert_ne!(drawn[0], drawn[1]);
    // Scene and haptic loop have the same specimen, and record it.
    std::fs::write(at.join("pad.toml"), "[tissue]\nsource = \"population:pad#2\"\n").unwrap();
    let shown = stdout(&palpate(at, &["scene", "show", "pad.toml"]));
    let record = "scene record --specimen population:pad#2 --path poke --to poke --json";
    assert_eq!(answer(&typed(at, record))["name"], "population:pad#2");
    let recorded = std::fs::read_to_string(at.join("poke/settings.toml")).unwrap();
    let checked = answer(&typed(at, "haptics follow population:pad#2 --depth 5 --hold 1 --json"));
    for (name, value) in drawn[1].as_object().unwrap() {
        let line = format!("{name} = {:?}\n", value.as_f64().unwrap());
        assert!(shown.contains(&line) && recorded.contains(&line), "{line}{shown}{recorded}");
        let own = match name.strip_prefix("mu") {
            Some(index) => &checked["body"]["mu"][index.parse::<usize>().unwrap() - 1],
            None => &checked["body"][name],
        };
        assert_eq!(own, value);
    }
}

#[test]
fn materials_of_a_mesh_are_specimens_of_a_population() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write_populations(at);
    let show = |name: &str, text: &str| {
        std::fs::write(at.join(name), text).unwrap();
        answer(&palpate(at, &["scene", "show", name, "--json"]))["file"]
            .as_str()
            .unwrap()
            .to_owned()
    };
    std::fs::write(at.join("box.obj"), BOX).unwrap();
    std::fs::write(at.join("map.csv"), "vertex,material\n4,1\n5,1\n").unwrap();
    let bodies = ["population:pad#1", "population:pad#2"];
    let mesh =
        format!("[mesh]\nfile = \"box.obj\"\nmaterials = \"map.csv\"\nbodies = {bodies:?}\n");
    let shown = show("box.toml", &mesh);
    for name in bodies {
        // The same specimen as the tissue of a square.
        let square = show("square.toml", &format!("[tissue]\nsource = \"{name}\"\n"));
        let numbers = square.split("[tissue]\n").nth(1).unwrap().split("side_mm").next().unwrap();
        assert!(numbers.contains("mu1 = "), "{square}");
        assert!(shown.contains(&format!("[bodies.\"{name}\"]\n{numbers}")), "{shown}");
    }
    // The corners 4 and 5 are an edge of the upper side: between them the second specimen answers alone.
    let middle = ("start_mm = [20, 20, 40]", "start_mm = [20, 0.5, 40]");
    let force = |start: &str| {
        std::fs::write(at.join("box.toml"), format!("{mesh}{start}\n")).unwrap();
        let run = answer(&typed(at, "scene run box.toml --json"));
        assert_eq!(run["mesh"]["materials"], 2);
        run["force_max_n"].as_f64().unwrap()
    };
    assert!((force(middle.0) - force(middle.1)).abs() > 1e-3);
    std::fs::write(at.join("box.toml"), mesh.replace("pad#2", "pad")).unwrap();
    assert_refused(&palpate(at, &["scene", "run", "box.toml"]), 2, "population:NAME#NUMBER");
}

#[test]
fn specimens_that_cannot_be_simulated_are_refused_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let run = "run ramp-hold --time-scale max --out run --specimen";
    let none = typed(at, &format!("{run} population:pad#1"));
    assert_refused(&none, 2, "the library has no population \"pad\", nor any other");
    write_populations(at);
    for (line, says) in [
        (format!("{run} population:gel#1"), "family maxwell, which cannot be simulated"),
        (format!("{run} population:pad"), "population:NAME#NUMBER with a whole number"),
        (format!("{run} population:pad#1 --stiffness 90"), "--stiffness does not apply"),
        (format!("{run} population:pad#1 --rig bench.toml"), "but rig bench.toml is not"),
        ("scene run --specimen pad#1".to_owned(), "'pad#1' is no specimen of a population"),
        ("haptics check population:pad#x".to_owned(), "is no specimen of a population"),
    ] {
        assert_refused(&typed(at, &line), 2, says);
    }
    assert!(!at.join("run").exists());
    // However the specimen is named, its tissue is simulated or the run is refused.
    let about = "run ramp-hold --speed 3 --depth 6 --hold 1 --time-scale max --out named --truth named.json --about";
    succeeded(&typed(at, &format!("{about} specimen=population:pad#1")));
    assert_ne!(read(&at.join("named.json"))["parameters"]["mu1"], Value::Null);
    assert!(read(&at.join("named.json"))["settings"]["mu1"].is_string());
    std::fs::write(at.join("mounted.toml"), MOUNTED).unwrap();
    let refused = typed(at, "run mounted.toml --time-scale max --out mounted");
    assert_refused(&refused, 2, "the rig does not simulate 'population:pad#1'");
}

/// A programme whose specimen is named in it.
const MOUNTED: &str = r#"
palpate-programme = 1
name = "mounted"
title = "One press"

[about]
specimen = "population:pad#1"

[[task]]
name = "press"
protocol = "ramp-hold"
set = { depth = "6 mm", hold = "1 s", speed = "3 mm/s" }
"#;

/// What is saved is what was printed, and a specimen of it is recorded like any other.
#[test]
fn a_population_is_saved_once_under_a_name() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record_study(at);
    let line = "population study --parameters mu1,tau_eps --effect animal.treatment --two-stage";
    let plain = answer(&typed(at, &format!("{line} --json")));
    let mut found = answer(&typed(at, &format!("{line} --save stomach --json")));
    let file = found.as_object_mut().unwrap().remove("file").unwrap();
    let id = found.as_object_mut().unwrap().remove("id").unwrap();
    assert_eq!(found, plain);
    let saved = &read(Path::new(file.as_str().unwrap()))["population"];
    assert_eq!(saved["family"], "series-3");
    assert_eq!(saved["sessions"].as_array().unwrap().len(), 16);
    assert_eq!(
        saved["effects"],
        json!([{ "kind": "value", "entry": "animal.treatment", "value": "enzyme",
            "reference": "control" }])
    );
    let rows = |list: &str, parameter: &Value, key: &str| -> Vec<Value> {
        let rows = found[list].as_array().unwrap().iter();
        rows.filter(|row| row["parameter"] == *parameter).map(|row| row[key].clone()).collect()
    };
    for parameter in saved["parameters"].as_array().unwrap() {
        let name = &parameter["name"];
        assert_eq!(rows("effects", name, "factor")[0], parameter["median"]);
        assert_eq!(rows("effects", name, "value")[1..], *parameter["effects"].as_array().unwrap());
        assert_eq!(
            json!(rows("standard_deviations", name, "value")),
            parameter["standard_deviations"]
        );
    }
    let constants: Vec<&Value> =
        saved["constants"].as_array().unwrap().iter().map(|one| &one["name"]).collect();
    assert_eq!(constants, ["mu2", "mu3", "tau_sig"]);
    let again = typed(at, &format!("{line} --save stomach"));
    assert_refused(
        &again,
        2,
        &format!("already has a population 'stomach' ({})", id.as_str().unwrap()),
    );
    assert_refused(&typed(at, &format!("{line} --save a/b")), 2, "without / and #");
    let specimen = "population:stomach/animal.treatment=enzyme#3";
    succeeded(&short_run(at, "member", &["--specimen", specimen]));
}
