//! `palpate compliance` as a user meets it, and what it does to fits and tables.

use crate::support::{
    assert_refused, assert_says, json, palpate, short_run, split_words, stderr, stdout, succeeded,
    typed,
};
use std::fs;
use std::path::Path;

/// A rig that gives way by 0.1 mm/N, its base by a thousandth more; without the lab's drift.
const RIG: [&str; 4] = ["--compliance", "100", "--profile", "ideal"];

fn stiff_surface(at: &Path) {
    let run = split_words("run stiff-surface --operator Ada --time-scale max");
    let more = ["--set", "repeats=2", "--out", "stiff"];
    succeeded(&palpate(at, &[&run[..], &more, &RIG].concat()));
}

#[test]
fn a_compliance_is_found_kept_and_taken_from_depths() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    stiff_surface(at);
    succeeded(&short_run(at, "demo", &RIG));
    // Nothing is kept yet.
    let early = palpate(at, &["fit", "demo", "--compliance", "last"]);
    assert_refused(&early, 2, "rig sim");
    assert!(json(&palpate(at, &["fit", "demo", "--json"])).get("compliance").is_none());

    let found = json(&palpate(at, &["compliance", "stiff", "--json"]));
    assert!(found["id"].is_null() && !at.join("library/compliances").exists());
    let kept = json(&palpate(at, &["compliance", "stiff", "--save", "--json"]));
    let (um, error) = (&kept["um_per_n"], &kept["std_error_um_per_n"]);
    let (um, error) = (um.as_f64().unwrap(), error.as_f64().unwrap());
    assert!((um - 101.0).abs() < 4.0 * error + 0.1, "{um} ± {error}");
    assert_eq!(kept["document"]["presses"].as_array().unwrap().len(), 2);
    let id = kept["id"].as_str().unwrap();
    assert!(id.contains("-sim-"), "{id}");
    let twice = palpate(at, &["compliance", "stiff", "--save"]);
    assert_refused(&twice, 2, "already");

    // Raw depths by default, and the report says what the correction would do.
    let raw = json(&palpate(at, &["fit", "demo", "--json"]));
    let corrected = json(&typed(at, "fit demo --compliance last --json"));
    let file = kept["file"].as_str().unwrap();
    let by_file = json(&palpate(at, &["fit", "demo", "--compliance", file, "--json"]));
    assert_eq!(raw["compliance"]["is_applied"], false);
    assert_eq!(corrected["compliance"]["is_applied"], true);
    assert_eq!(corrected["compliance"]["id"], id);
    let peak = corrected["compliance"]["force_peak_n"].as_f64().unwrap();
    let less = corrected["compliance"]["at_peak_um"].as_f64().unwrap();
    assert!((less - um * peak).abs() < 1e-6);
    assert_eq!(by_file["parameters"], corrected["parameters"]);
    assert_ne!(raw["parameters"], corrected["parameters"]);
    let text = stdout(&palpate(at, &["fit", "demo", "--compliance", id]));
    assert!(text.contains("depths are corrected for machine compliance"), "{text}");

    // A table keeps the raw depth and gets two columns more.
    let export = ["export", "demo", "--compliance", "last", "--json"];
    let csv = json(&palpate(at, &[&export[..], &["--format", "csv"]].concat()));
    assert_eq!(csv["compliance"], id);
    succeeded(&palpate(at, &[&export[..], &["--format", "parquet"]].concat()));
    let table = fs::read_to_string(at.join("demo.csv")).unwrap();
    let mut lines = table.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    assert_eq!(names[8..], ["depth_corrected_mm", "depth_corrected_sigma_mm"]);
    let mut compared = 0;
    for line in lines.filter(|line| line.contains("ramp")) {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |index: usize| cells[index].parse::<f64>().unwrap();
        let wanted = number(1) - 1e-3 * um * number(2);
        assert!((number(8) - wanted).abs() < 1e-9, "{line}");
        assert!(number(9) > 0.0);
        compared += 1;
    }
    assert!(compared > 1000);
    // The footer of a Parquet file is not compressed.
    let parquet = fs::read(at.join("demo.parquet")).unwrap();
    let footer = String::from_utf8_lossy(&parquet);
    assert!(footer.contains("palpate.compliance") && footer.contains(id));
    assert!(footer.contains(r#""depth_corrected_mm":"mm""#));
}

#[test]
fn what_tells_no_compliance_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeded(&short_run(at, "demo", &RIG));
    for (args, sentence) in [
        (&["compliance", "demo"][..], "stiff surface"),
        (&["compliance", "demo", "--seating", "-1"], "above 0 N"),
        (&["fit", "demo", "--compliance", "never"], "no compliance \"never\""),
        (
            &["export", "demo", "--format", "csv", "--compliance", "last"],
            "run the protocol 'stiff-surface'",
        ),
    ] {
        let refused = palpate(at, args);
        assert_eq!(refused.status.code(), Some(2), "{args:?}");
        assert!(stderr(&refused).contains(sentence), "{}", stderr(&refused));
    }
    fs::write(at.join("table.csv"), "t_s,depth_mm,force_N\n0,0,0\n1,1,1\n2,2,2\n").unwrap();
    let table = palpate(at, &["fit", "table.csv", "--compliance", "last"]);
    assert_refused(&table, 2, "does not state its rig");
    // A document of another rig, and one that was changed by hand.
    stiff_surface(at);
    let kept = json(&palpate(at, &["compliance", "stiff", "--save", "--json"]));
    let file = Path::new(kept["file"].as_str().unwrap());
    let text = fs::read_to_string(file).unwrap();
    fs::write(at.join("changed.json"), text.replace("\"sim\"", "\"bench\"")).unwrap();
    let changed = palpate(at, &["fit", "demo", "--compliance", "changed.json"]);
    assert_says(&changed, "was changed after");
    let mut document = kept["document"].clone();
    document["rig"] = "bench".into();
    fs::write(at.join("bench.json"), document.to_string()).unwrap();
    let other = palpate(at, &["fit", "demo", "--compliance", "bench.json"]);
    assert_refused(&other, 2, "of rig bench");
}
