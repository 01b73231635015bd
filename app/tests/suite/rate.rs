//! A rig of 20 000 samples a second, as a user meets it.

use crate::support::{answer, assert_refused, json, palpate, short_run, succeeded};
use std::fs;

#[test]
fn a_fast_session_is_run_read_fitted_replayed_and_exported() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let run = short_run(at, "fast", &["--rate", "20000", "--json"]);
    succeeded(&run);
    let run = json(&run);
    assert!(run["late_worst_s"].is_null(), "full pace has no lateness");
    let samples = run["samples"].as_f64().unwrap();
    // Reports need 1.0 to 1.5 ms.
    let expected = 20_000.0 * run["duration_s"].as_f64().unwrap();
    assert!((samples - expected).abs() < 40.0, "{samples} {expected}");

    let report = json(&palpate(at, &["report", "fast", "--json"]));
    assert_eq!((&report["dropped"], &report["late"]), (&0.into(), &0.into()));
    assert_eq!(report["verdict"], "valid", "{report}");
    let fit = json(&palpate(at, &["fit", "fast", "--json"]));
    assert!(fit["r2"].as_f64().unwrap() > 0.99, "{fit}");
    let replay = json(&palpate(at, &["replay", "fast", "--check", "--json"]));
    assert_eq!(replay["differing"], 0, "{replay}");
    let health = json(&palpate(at, &["doctor", "fast", "--json"]));
    assert_eq!(health["sessions"][0]["health"], "healthy");
    let export = "export fast --format csv --phase hold";
    succeeded(&palpate(at, &export.split(' ').collect::<Vec<_>>()));
    // One second of hold, and the header.
    let lines = fs::read_to_string(at.join("fast.csv")).unwrap().lines().count();
    assert_eq!(lines, 20_001);
}

#[test]
fn lateness_is_reported_of_a_run_that_keeps_pace() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let args = "run ramp-hold --speed 3 --depth 6 --hold 1 --time-scale 100 --out paced --json";
    let run = answer(&palpate(at, &args.split(' ').collect::<Vec<_>>()));
    for name in ["late_worst_s", "late_given_up_s"] {
        assert!(run[name].as_f64().is_some_and(|late| late >= 0.0), "{run}");
    }
}

#[test]
fn a_rate_that_no_clock_divides_into_is_refused_everywhere() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let refused = palpate(at, &["run", "ramp-hold", "--rate", "3000", "--preview"]);
    assert_refused(&refused, 2, "give 1000, 2000");
    let programme = |rate: &str| {
        let text = format!(
            "palpate-programme = 1\nname = \"one\"\ntitle = \"One task\"\n[simulated]\nrate = {rate}\n\
             [[task]]\nname = \"look\"\nprotocol = \"free-jog\"\n"
        );
        fs::write(at.join("one.toml"), text).unwrap();
        palpate(at, &["run", "one.toml", "--preview", "--json"])
    };
    succeeded(&programme("5000"));
    let refused = programme("7000");
    assert_refused(&refused, 2, "'7000'");
}
