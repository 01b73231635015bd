//! `palpate population` on recorded sessions whose tissue is known.

use crate::support::{answer, assert_refused, short_run, succeeded, typed};
use std::path::Path;

/// Stiffness of each specimen in percent, two of an animal.
const STIFFNESS: [(&str, &str, [u32; 2]); 4] = [
    ("pig-1", "control", [70, 77]),
    ("pig-2", "enzyme", [110, 121]),
    ("pig-3", "control", [85, 92]),
    ("pig-4", "enzyme", [140, 150]),
];

/// Two presses on each specimen.
pub(crate) fn record_study(at: &Path) {
    for (animal, treatment, stiffness) in STIFFNESS {
        for (specimen, percent) in stiffness.iter().enumerate() {
            for repeat in 1..=2 {
                let about = [
                    format!("animal.name={animal}"),
                    format!("animal.treatment={treatment}"),
                    format!("series.repeat={repeat}"),
                ];
                let specimen = format!("{animal} liver {specimen}");
                let (percent, seed) = (percent.to_string(), (percent * 10 + repeat).to_string());
                let more = ["--stiffness", &percent, "--seed", &seed, "--specimen", &specimen];
                let about = about.iter().flat_map(|one| ["--about", one.as_str()]);
                let more: Vec<&str> = more.into_iter().chain(about).collect();
                succeeded(&short_run(at, &format!("study/{specimen} {repeat}"), &more));
            }
        }
    }
}

/// The curves are those of the tissue: medians, effect and spreads are known to a few percent, the noise of short presses.
#[test]
fn a_study_has_the_spreads_and_the_effect_of_its_tissues() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record_study(at);
    let line = "population study --parameters mu1,tau_eps --effect animal.treatment";
    let logarithms = |treatment: &str| {
        let own = STIFFNESS.iter().filter(|(_, one, _)| *one == treatment);
        let means = own
            .map(|(.., percent)| percent.map(|one| f64::from(one).ln()).iter().sum::<f64>() / 2.0);
        means.collect::<Vec<f64>>()
    };
    let (control, enzyme) = (logarithms("control"), logarithms("enzyme"));
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let effect = mean(&enzyme) - mean(&control);
    let spread = ((control[1] - control[0]).powi(2) + (enzyme[1] - enzyme[0]).powi(2)).sqrt() / 2.0;
    for method in ["", " --two-stage"] {
        let found = answer(&typed(at, &format!("{line}{method} --json")));
        let levels = found["levels"].as_array().unwrap().iter();
        let groups: Vec<u64> = levels.map(|one| one["groups"].as_u64().unwrap()).collect();
        assert_eq!(groups, [4, 8, 16]);
        let row = |list: &str, key: &str, value: &str, parameter: &str| {
            let rows = found[list].as_array().unwrap().iter();
            let mut own = rows.filter(|row| row[key] == value && row["parameter"] == parameter);
            own.next().unwrap_or_else(|| panic!("{found:#}")).clone()
        };
        let treated = row("effects", "effect", "animal.treatment = enzyme", "mu1");
        let error = treated["value"].as_f64().unwrap() - effect;
        assert!(error.abs() < 0.05, "{treated:#}");
        let animals = row("spreads", "level", "animal", "mu1");
        let ends = [0, 1].map(|end: usize| animals["interval"][end].as_f64().unwrap());
        assert!(ends[0] < spread && spread < ends[1], "{animals:#}");
        let time = row("effects", "effect", "mean", "tau_eps");
        let ends = [0, 1].map(|end: usize| time["factor_interval"][end].as_f64().unwrap());
        assert!(ends[0] < 1.023 && 1.023 < ends[1], "{time:#}");
    }
}

#[test]
fn what_says_nothing_of_a_population_is_refused_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for (name, about) in [("one", "animal.name=a"), ("two", "animal.name=b")] {
        let more = ["--specimen", name, "--about", about];
        succeeded(&short_run(at, &format!("study/{name}"), &more));
    }
    let refused = |more: &str, code: i32, says: &str| {
        assert_refused(&typed(at, &format!("population study{more}")), code, says);
    };
    refused(" --parameters mu9", 2, "the model has no parameter 'mu9'");
    refused(" --by site", 2, "2 of 2 sessions lack specimen.site");
    refused(" --by specimen,animal", 2, "from the outermost: animal, specimen, site");
    refused(" --effect animal.sex", 2, "2 of 2 sessions lack animal.sex");
    refused(" --effect operator", 2, "no entry 'operator'");
    refused(" --parameters mu1", 1, "the study has 2 sessions for");
    succeeded(&short_run(at, "study/three", &["--specimen", "three"]));
    refused(" --parameters mu1", 2, "1 of 3 sessions lack animal.name");
}
