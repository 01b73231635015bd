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

/// How both specimens of an animal were stored.
const STORAGES: [&str; 2] = ["fresh", "frozen"];

/// Two presses on each specimen.
pub(crate) fn record_study(at: &Path) {
    for (animal, treatment, stiffness) in STIFFNESS {
        for (specimen, percent) in stiffness.iter().enumerate() {
            for repeat in 1..=2 {
                let about = [
                    format!("animal.name={animal}"),
                    format!("animal.treatment={treatment}"),
                    format!("series.repeat={repeat}"),
                    format!("specimen.storage={}", STORAGES[specimen]),
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

/// The curves are those of the tissue: medians, effect and standard deviations are known to a few percent, the noise of short presses.
#[test]
fn a_study_has_the_deviations_and_the_effect_of_its_tissues() {
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
        let animals = row("standard_deviations", "level", "animal", "mu1");
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
    refused(
        " --by site",
        2,
        "study/one has no specimen.site, as 2 of 2 sessions; add it, or leave specimen.site out",
    );
    refused(" --by specimen,animal", 2, "from the outermost: animal, specimen, site");
    refused(" --effect animal.sex", 2, "study/one has no animal.sex, as 2 of 2 sessions");
    refused(" --effect weather", 2, "no entry 'weather'");
    refused(" --effect operator", 2, "study/one has no operator, as 2 of 2 sessions");
    refused(" --out study", 2, "study exists already; give the folder another name");
    refused(" --wanted -3", 2, "this is not a positive number");
    refused(" --parameters mu1", 1, "sessions or more, not 2");
    succeeded(&short_run(at, "study/three", &["--specimen", "three"]));
    refused(" --parameters mu1", 2, "study/three has no animal.name, as 1 of 3 sessions");
}

/// Rows of a table with a head, by the names of its columns.
fn rows(path: &Path) -> Vec<Vec<(String, String)>> {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned));
    let head: Vec<String> = lines.next().unwrap().collect();
    lines.map(|line| head.iter().cloned().zip(line).collect()).collect()
}

fn cell(row: &[(String, String)], name: &str) -> String {
    let found = row.iter().find(|(one, _)| one == name);
    found.unwrap_or_else(|| panic!("no {name} in {row:?}")).1.clone()
}

/// Everything of a paper by one command: the numbers of its tables are those of the answer, and influence and sizes of studies
/// are what their definitions say.
#[test]
fn one_command_makes_the_tables_figures_and_words_of_a_paper() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record_study(at);
    let line = "population study --family series-1 --parameters mu1 --effect animal.treatment";
    let more = " --influence --wanted 40 --out results --json";
    let found = answer(&typed(at, &format!("{line}{more}")));
    let results = at.join("results");
    let effects = rows(&results.join("effects.csv"));
    assert_eq!(effects.len(), 2);
    for (row, one) in effects.iter().zip(found["effects"].as_array().unwrap()) {
        let log: f64 = cell(row, "log").parse().unwrap();
        assert_eq!(log, one["value"].as_f64().unwrap());
    }
    let size = found["effects"][1]["effect_size"].as_f64().unwrap();
    let deviations = found["standard_deviations"].as_array().unwrap();
    let squares = deviations.iter().map(|one| one["value"].as_f64().unwrap().powi(2));
    let whole = squares.sum::<f64>().sqrt();
    let effect = found["effects"][1]["value"].as_f64().unwrap();
    assert!((size * whole - effect).abs() < 1e-12);
    // The last level differs in everything that two presses on one specimen differ in.
    let inner = deviations[2]["value"].as_f64().unwrap();
    let pair = deviations[2]["pair_factor"].as_f64().unwrap();
    assert!((pair.ln() - 1.96 * 2f64.sqrt() * inner).abs() < 1e-12);
    let sessions = rows(&results.join("sessions.csv"));
    assert_eq!(sessions.len(), 16);
    assert!(cell(&sessions[0], "cov mu1 mu1").parse::<f64>().unwrap() > 0.0);
    let paragraph = std::fs::read_to_string(results.join("paragraph.txt")).unwrap();
    assert!(paragraph.starts_with("We recorded 16 sessions of 8 specimens of 4 animals."));
    assert!(paragraph.contains("animal.treatment = enzyme"), "{paragraph}");
    let latex = std::fs::read_to_string(results.join("table.tex")).unwrap();
    assert!(latex.contains("95 \\% interval") && !latex.contains("tau\\_eps"));
    for name in ["effects.svg", "groups.svg", "residuals.svg", "table.tex", "population.html"] {
        assert!(results.join(name).is_file(), "{name}");
    }
    // One of two animals of a treatment is left out: all are possible, and the first moves most.
    let groups = found["influence"]["groups"].as_array().unwrap();
    assert_eq!(groups.len(), 4 + 8 + 16);
    let largest = |one: &serde_json::Value| {
        let changes = one["changes"].as_array().unwrap().iter();
        changes.map(|one| one.as_f64().unwrap().abs()).fold(0.0, f64::max)
    };
    assert!(groups.windows(2).all(|pair| largest(&pair[0]) >= largest(&pair[1])));
    assert_eq!(groups[0]["level"], "animal");
    let studies = found["plan"]["studies"].as_array().unwrap();
    let widths = |one: &serde_json::Value| one["effects"][1]["half_width"].as_f64().unwrap();
    let of =
        |counts: [u64; 3]| studies.iter().find(|one| one["counts"] == serde_json::json!(counts));
    // More animals help; more presses on one place hardly do.
    let [few, many, pressed] =
        [[8, 2, 1], [32, 2, 1], [8, 2, 2]].map(|counts| widths(of(counts).unwrap()));
    assert!(many < 0.6 * few && pressed > 0.75 * few, "{few} {many} {pressed}");
}

/// One operator's tissue is made stiffer by a fifth in every place: that is the bias, and presses on one place hardly scatter.
#[test]
fn two_operators_agree_but_for_their_bias() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    for (specimen, percent) in [("one", 70), ("two", 90), ("three", 100), ("four", 130)] {
        for (operator, factor) in [("ada", 1.0), ("bea", 1.2)] {
            let percent = (f64::from(percent) * factor).round().to_string();
            let seed = format!("{}", specimen.len() * 10 + operator.len());
            let more = [
                "--stiffness",
                &percent,
                "--seed",
                &seed,
                "--specimen",
                specimen,
                "--operator",
                operator,
                "--about",
                "animal.name=pig",
            ];
            succeeded(&short_run(at, &format!("study/{specimen} {operator}"), &more));
        }
    }
    let line = "agreement study --family series-1 --parameters mu1";
    let found = answer(&typed(at, &format!("{line} --between operator --plot plot.svg --json")));
    assert_eq!(found["values"], serde_json::json!(["ada", "bea"]));
    let one = &found["parameters"][0];
    assert_eq!(one["places"].as_array().unwrap().len(), 4);
    let bias = one["bias"].as_f64().unwrap();
    let [low, high] = [0, 1].map(|end: usize| one["limits"][end].as_f64().unwrap());
    assert!((bias - 1.2f64.ln()).abs() < 0.03 && low < bias && bias < high, "{one:#}");
    assert!(at.join("plot.svg").is_file());
    let refused = |more: &str, code: i32, says: &str| {
        assert_refused(&typed(at, &format!("{line}{more}")), code, says);
    };
    refused(" --between weather", 2, "two of 'weather' cannot be compared");
    refused(" --between rig", 2, "two values of rig are compared, and these sessions have 1 (sim)");
}

/// Both halves of a pair are of one animal: the effect is the mean of their ratios, and is judged by the four animals.
#[test]
fn an_effect_within_animals_is_judged_by_its_pairs() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    record_study(at);
    let line = "population study --family series-1 --parameters mu1 --effect specimen.storage";
    let found = answer(&typed(at, &format!("{line} --by animal,specimen.storage --json")));
    let levels: Vec<(&str, u64)> = found["levels"]
        .as_array()
        .unwrap()
        .iter()
        .map(|one| (one["level"].as_str().unwrap(), one["groups"].as_u64().unwrap()))
        .collect();
    assert_eq!(levels, [("animal", 4), ("specimen.storage", 8), ("session", 16)]);
    let frozen = &found["effects"][1];
    assert_eq!(frozen["effect"], "specimen.storage = frozen");
    let ratios = STIFFNESS.map(|(.., [fresh, frozen])| (f64::from(frozen) / f64::from(fresh)).ln());
    let mean = ratios.iter().sum::<f64>() / 4.0;
    let [value, error, freedom] =
        ["value", "std_error", "freedom"].map(|key| frozen[key].as_f64().unwrap());
    // The tissue of every session is drawn with its seed, to a few percent.
    assert!((value - mean).abs() < 4.0 * error && error < 0.05, "{frozen:#}");
    // Four pairs have three degrees of freedom, the treated among them as many as all.
    assert!((2.0..=14.0).contains(&freedom), "{frozen:#}");
    assert_refused(
        &typed(at, &format!("{line} --by specimen,specimen.weather")),
        2,
        "there is no level 'specimen.weather'",
    );
}
