//! `palpate material` as a user meets it.

use crate::support::{assert_refused, json, palpate, stderr, stdout, typed};
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;

const SESSION: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/sessions/ramp-hold-lab");

/// What the force of a table is out of contact, in N.
const ZERO_N: f64 = 3e-4;

/// Hertz's law, `F = 4/3 E / (1 - nu^2) sqrt(R) d^1.5`, written out here: a second implementation, with the contact at a depth.
fn hertz_table(at: &Path, name: &str, [modulus_mpa, radius_mm, poisson, contact_mm]: [f64; 4]) {
    let mut text = String::from("t_s,depth_mm,force_N\n");
    for index in 0..=200 {
        let t = 0.005 * f64::from(index);
        let depth: f64 = 0.3 * t;
        let pressed = (depth - contact_mm).max(0.0);
        let plane = modulus_mpa / (1.0 - poisson * poisson);
        let force = 4.0 / 3.0 * plane * radius_mm.sqrt() * pressed.powf(1.5) + ZERO_N;
        // Noise of 1e-5 N that is the same on every machine.
        let noise = 1e-5 * (f64::from(index) * 12.9898).sin();
        let _ = writeln!(text, "{t},{depth},{}", force + noise);
    }
    std::fs::write(at.join(name), text).unwrap();
}

fn number(object: &Value, path: &str) -> f64 {
    object.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path}: {object}"))
}

#[test]
fn the_modulus_of_a_table_is_the_one_that_made_it() {
    let at = tempfile::tempdir().unwrap();
    hertz_table(at.path(), "press.csv", [0.0125, 8.0, 0.45, 0.05]);
    let line = "material press.csv --indenter sphere --radius 8.00±0.04 --thickness 500 --poisson 0.45±0.01 --law hertz";
    let found = json(&typed(at.path(), &format!("{line} --json")));
    assert_eq!(found["command"], "material");
    let (modulus, error) =
        (number(&found, "/modulus_mpa"), number(&found, "/standard_uncertainty_mpa"));
    // Noise of 1e-5 N against a force of 2 mN.
    assert!((modulus / 0.0125 - 1.0).abs() < 0.005, "{found}");
    assert!((number(&found, "/contact_shift_mm") - 0.05).abs() < 5e-4, "{found}");
    assert!((number(&found, "/force_zero_n") - ZERO_N).abs() < 5e-6, "{found}");
    // The modulus falls with the root of the radius and with 1 / (1 - nu^2).
    let row = |source: &str| {
        let rows = found["budget"].as_array().unwrap();
        let own = rows.iter().find(|row| row["source"] == source);
        own.unwrap_or_else(|| panic!("{source}: {found}"))["mpa"].as_f64().unwrap() / modulus
    };
    assert!((row("radius") - 0.5 * 0.005).abs() < 1e-5, "{found}");
    let of_poisson = 2.0 * 0.45 * 0.01 / (1.0 - 0.45 * 0.45);
    assert!((row("Poisson's ratio") / of_poisson - 1.0).abs() < 1e-3, "{found}");
    let all = found["budget"].as_array().unwrap().iter().map(|row| row["mpa"].as_f64().unwrap());
    assert!((all.map(|one| one * one).sum::<f64>().sqrt() / error - 1.0).abs() < 1e-12);
    assert_eq!(found["not_included"], serde_json::json!(["calibration", "machine compliance"]));
    let text = stdout(&typed(at.path(), line));
    for words in ["Young's modulus  12.", "Poisson's ratio assumed: 0.450 ± 0.010", "Hertz (1882)"]
    {
        assert!(text.contains(words), "{words}: {text}");
    }
}

#[test]
fn a_session_states_contact_calibration_and_lack_of_fit() {
    let at = tempfile::tempdir().unwrap();
    let line = format!(
        "material {SESSION} --indenter flat-punch --radius 6.00±0.02 --thickness 60.0±0.5 --poisson 0.49±0.01 --depth-max 0.9 --json"
    );
    let found = json(&typed(at.path(), &line));
    let sources: Vec<&str> = found["budget"]
        .as_array()
        .unwrap()
        .iter()
        .map(|row| row["source"].as_str().unwrap())
        .collect();
    for source in
        ["noise", "contact", "force zero", "calibration", "radius", "thickness", "Poisson's ratio"]
    {
        assert!(sources.contains(&source), "{source}: {found}");
    }
    assert!(number(&found, "/force_zero_error_n") > 0.0, "{found}");
    // A body that relaxes bends the loading otherwise than an elastic one.
    assert!(number(&found, "/lack_of_fit/residual_over_noise") > 1.1, "{found}");
    assert!(number(&found, "/contact_error_mm") > 0.0);
    assert_eq!(found["validity"][1]["ratio"], "strain");
}

#[test]
fn a_saved_modulus_is_listed_searched_and_printed_on_the_report() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let session = at.join("library/press");
    std::fs::create_dir_all(&session).unwrap();
    std::fs::copy(Path::new(SESSION).join("000.mcap"), session.join("000.mcap")).unwrap();
    let line = "material library/press --indenter flat-punch --radius 6.00±0.02 --thickness 60 --poisson 0.49 --depth-max 0.9";
    let save = format!("{line} --save <b>soft --by Ada --reason first");
    let text = stdout(&typed(at, &save));
    let (words, saved) = text.trim_end().rsplit_once('\n').unwrap();
    assert_eq!(saved, "saved as analysis '<b>soft'");
    // A name is never used twice.
    assert_refused(&typed(at, &save), 2, "already has an analysis '<b>soft'");
    let found = json(&typed(at, &format!("{line} --json")));
    let info = json(&typed(at, "info library/press --json"));
    let kept = &info["analyses"][0];
    assert_eq!((kept["analysis"].as_str(), kept["by"].as_str()), (Some("material"), Some("Ada")));
    let lines = std::fs::read_to_string(session.join("analyses.jsonl")).unwrap();
    let stored: Value = serde_json::from_str(lines.lines().next().unwrap()).unwrap();
    let stored = &stored["body"];
    assert_eq!((&stored["material_version"], &stored["words"]), (&1.into(), &words.into()));
    assert_eq!(stored["settings"]["depth_max_mm"], 0.9);
    assert_eq!(stored["results"]["modulus_mpa"], found["modulus_mpa"]);
    let kpa = 1e3 * number(&found, "/modulus_mpa");
    for (condition, count) in [("modulus_mpa>0.001", 1), ("modulus_mpa>0.1", 0)] {
        let found = json(&palpate(at, &["find", "--json", condition]));
        assert_eq!(
            found["sessions"].as_array().unwrap().len(),
            count,
            "{condition}: {kpa} kPa, {found}"
        );
    }
    stdout(&typed(at, "report library/press --html page.html"));
    let page = std::fs::read_to_string(at.join("page.html")).unwrap();
    for part in [
        "Material property &apos;&lt;b&gt;soft&apos;:",
        "Poisson&apos;s ratio assumed",
        "Young&apos;s modulus",
    ] {
        assert!(page.contains(part), "{part}");
    }
    // The session is read as before.
    stdout(&typed(at, "fit library/press --analysis <b>soft --json"));
    let table = format!("{line} --save soft").replace("press ", "press/000.mcap ");
    assert_refused(&typed(at, &table), 2, "is not a session folder");
}

#[test]
fn moduli_of_a_lake_are_those_of_its_sessions_and_made_once() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    stdout(&typed(at, &format!("export {SESSION} --lake lake")));
    let options =
        "--indenter flat-punch --radius 6.00±0.02 --thickness 60 --poisson 0.49 --depth-max 0.9";
    let line = format!("material lake {options} --json");
    for (more, refusal) in [("--save x", "--save does not apply"), ("--analysis x", "--analysis")] {
        assert_refused(&typed(at, &format!("{line} {more}")), 2, refusal);
    }
    // Which part the session is in depends on its name.
    for shard in ["1/2", "2/2"] {
        let [first, again] = [0, 1].map(|_| json(&typed(at, &format!("{line} --shard {shard}"))));
        assert_eq!(first["made"], first["sessions"], "{first}");
        assert_eq!(again["were_there"], first["sessions"], "{again}");
    }
    let stored: Vec<_> = std::fs::read_dir(at.join("lake/v1/moduli/law=layer")).unwrap().collect();
    let [Ok(file)] = stored.as_slice() else { panic!("{stored:?}") };
    let stored: Value =
        serde_json::from_str(&std::fs::read_to_string(file.path()).unwrap()).unwrap();
    let alone = json(&typed(at, &format!("material {SESSION} {options} --json")));
    assert_eq!(
        (&stored["law"], &stored["modulus"]["source"]),
        (&"layer".into(), &stored["session_id"])
    );
    for key in ["modulus_mpa", "total95_mpa", "budget", "validity", "lack_of_fit"] {
        assert_eq!(stored["modulus"][key], alone[key], "{key}");
    }
    // Files of a lake are never overwritten.
    let other = typed(at, &line.replace("0.49", "0.45"));
    assert_eq!(other.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&other.stdout).contains("different content"));
    assert_refused(
        &typed(at, &format!("material {SESSION} {options} --shard 1/2")),
        2,
        "needs a lake",
    );
}

/// The same press a thousandth as large, as that of an atomic force microscope.
#[test]
fn depth_of_a_small_press_is_suggested_in_as_many_digits() {
    let at = tempfile::tempdir().unwrap();
    hertz_table(at.path(), "press.csv", [0.0125, 1.0, 0.45, 0.0]);
    let large = std::fs::read_to_string(at.path().join("press.csv")).unwrap();
    let small = large.lines().map(|row| match row.split(',').collect::<Vec<_>>()[..] {
        [t, depth, force] if t != "t_s" => {
            let [depth, force] = [depth, force].map(|text| text.parse::<f64>().unwrap());
            format!("{t},{},{}\n", 1e-3 * depth, 1e-6 * force)
        }
        _ => format!("{row}\n"),
    });
    std::fs::write(at.path().join("small.csv"), small.collect::<String>()).unwrap();
    let refused = |table: &str, radius: &str| {
        let options =
            "--poisson 0.45 --law hertz --contact-error 0 --zero-error 0 --thickness 5000";
        let line = format!("material {table} --indenter sphere --radius {radius} {options}");
        let words = stderr(&typed(at.path(), &line));
        let (_, depth) = words.split_once("give --depth-max ").unwrap_or_else(|| panic!("{words}"));
        let depth = depth.split(' ').next().unwrap();
        let taken = typed(at.path(), &format!("{line} --depth-max {depth}"));
        assert_eq!(taken.status.code(), Some(0), "{}", stderr(&taken));
        depth.parse::<f64>().unwrap()
    };
    let [large, small] = [refused("press.csv", "1"), refused("small.csv", "0.001")];
    assert!((1e3 * small / large - 1.0).abs() < 2e-3, "{large} {small}");
}

#[test]
fn what_no_law_describes_is_refused_in_one_sentence() {
    let at = tempfile::tempdir().unwrap();
    hertz_table(at.path(), "press.csv", [0.0125, 8.0, 0.45, 0.0]);
    let sphere = "--indenter sphere --radius 8 --poisson 0.45";
    for (line, reason) in [
        (format!("press.csv {sphere}"), "give --thickness"),
        (
            format!("press.csv {sphere} --thickness 50 --law hertz"),
            "contact radius over the thickness",
        ),
        (
            "press.csv --indenter sphere --radius 1 --poisson 0.45 --thickness 50".into(),
            "give --depth-max 0.",
        ),
        (format!("press.csv {sphere} --thickness=-3"), "the thickness of the specimen is -3"),
        (
            "press.csv --indenter sphere --radius 8 --poisson 0.6 --thickness 50".into(),
            "from 0 to 0.5",
        ),
        ("press.csv --indenter cone --poisson 0.45 --thickness 50".into(), "needs --half-angle"),
        (format!("press.csv {sphere} --thickness 50 --half-angle 60"), "has no --half-angle"),
        (
            "press.csv --indenter cone --half-angle 70 --poisson 0.45 --thickness 500 --law hertz"
                .into(),
            "a sphere only",
        ),
        (
            "press.csv --indenter sphere --radius 8±9 --poisson 0.45 --thickness 50".into(),
            "standard uncertainty of the radius",
        ),
        (format!("press.csv {sphere} --thickness 50 --depth-max 0"), "give a depth above 0 mm"),
        (format!("press.csv {sphere} --thickness 50 --chamfer 0.5"), "has no --chamfer"),
        (
            "press.csv --indenter flat-punch --radius 4 --chamfer 4 --poisson 0.45 --thickness 50"
                .into(),
            "below the radius",
        ),
        (
            format!("press.csv {sphere} --thickness 500 --contact-error=-1"),
            "the standard uncertainty of the contact is -1",
        ),
        (
            format!("press.csv {sphere} --thickness 500 --zero-error=-1"),
            "the standard uncertainty of the force zero is -1",
        ),
        (format!("press.csv {sphere} --thickness 50"), "begins in contact"),
        (format!("nowhere.csv {sphere} --thickness 50"), "nowhere.csv"),
    ] {
        assert_refused(&typed(at.path(), &format!("material {line}")), 2, reason);
    }

    std::fs::write(
        at.path().join("pull.csv"),
        "t_s,depth_mm,force_N\n0,0,0\n1,0.01,-1\n2,0.02,-2\n3,0.03,-3\n4,0.04,-4\n5,0.05,-5\n",
    )
    .unwrap();
    let pull = typed(at.path(), &format!("material pull.csv {sphere} --thickness 50"));
    assert_refused(&pull, 1, "check the signs of force and depth");
}

/// A cone pressed in and drawn back, `F = 2 / pi E / (1 - nu^2) tan(alpha) d^2` both ways: nothing is left of an elastic press.
#[test]
fn the_modulus_of_an_elastic_way_back_is_the_one_that_made_it() {
    let at = tempfile::tempdir().unwrap();
    let mut text = String::from("t_s,depth_mm,force_N\n");
    for index in 0..=400 {
        let depth = 0.001 * f64::from(200 - (index - 200i32).abs());
        let plane = 0.0125 / (1.0 - 0.45 * 0.45);
        let force = std::f64::consts::FRAC_2_PI * plane * 75f64.to_radians().tan() * depth * depth;
        let _ = writeln!(text, "{},{depth},{force}", 0.01 * f64::from(index));
    }
    std::fs::write(at.path().join("back.csv"), text).unwrap();
    let line = "material back.csv --property unloading --indenter cone --half-angle 75 --poisson 0.45±0.01 --thickness 500 --contact-error 0";
    let found = json(&typed(at.path(), &format!("{line} --json")));
    assert!((number(&found, "/modulus_mpa") / 0.0125 - 1.0).abs() < 1e-5, "{found}");
    assert!((number(&found, "/exponent") - 2.0).abs() < 1e-5, "{found}");
    let missing = ["force zero", "calibration", "machine compliance"];
    assert_eq!(found["not_included"], serde_json::json!(missing));
    assert!(stdout(&typed(at.path(), line)).contains("Oliver and Pharr (1992)"));
    let free = typed(at.path(), &line.replace("error 0", "error free"));
    assert_refused(&free, 2, "does not show where depth zero is");
    let with_law = typed(at.path(), &format!("{line} --law layer"));
    assert_refused(&with_law, 2, "--law belongs to what is no unloading");
    hertz_table(at.path(), "press.csv", [0.0125, 8.0, 0.45, 0.05]);
    let only_in = typed(at.path(), &line.replace("back", "press"));
    assert_refused(&only_in, 1, "record the unloading too");
}
