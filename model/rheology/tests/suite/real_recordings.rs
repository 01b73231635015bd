//! Recordings of real tissue, kept outside the repository because of their licences. Each test says
//! so and passes when its file is absent.

use palpate_model::{Depth, Newtons, Seconds};
use palpate_rheology::fit::{FitOptions, FitSample, fit};
use palpate_rheology::select::{SelectOptions, SelectionOutcome, select};
use palpate_test_support::skip;
use std::ops::ControlFlow;
use std::path::Path;

/// Samples of a CSV file with columns t_s, F_N, x_mm.
fn recording(name: &str) -> Option<Vec<FitSample>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data").join(name);
    if skip::lacks_file(&path) {
        return None;
    }
    let text = std::fs::read_to_string(&path).unwrap();
    let samples = text.lines().skip(1).map(|line| {
        let mut fields = line.split(',').map(|field| field.trim().parse().unwrap());
        let mut next = || fields.next().unwrap();
        let (t, force, depth) = (next(), next(), next());
        FitSample {
            t: Seconds(t),
            depth: Depth(depth),
            force: Newtons(force),
            sigma: Newtons(1e-3),
        }
    });
    Some(samples.collect())
}

#[test]
fn perineal_indentation_is_explained() {
    // SarahIaquinta/perineal_indentation, P002, ramp of 0.167 mm/s to 10 mm and hold, 10 Hz.
    let Some(samples) = recording("perineal_P002_laser9.csv") else {
        return;
    };
    let mut options = FitOptions::default();
    options.fix("f_offset", 0.0).unwrap();
    let report = fit(&samples, &options).unwrap();
    println!("{report:#?}");
    assert!(report.r2 >= 0.9998 && report.rmse_n <= 5.4e-3, "{report:#?}");
    // Tissue is not this model: what is left over has memory, and the report says so.
    assert!(report.warnings.iter().any(|text| text.contains("lack of fit")));
    assert!(report.noise.unwrap().effective_samples < 30.0);

    let report = fit(&samples, &FitOptions::default()).unwrap();
    println!("{report:#?}");
    assert!(report.rmse_n <= 3.45e-3, "{report:#?}");
}

#[test]
fn no_family_wins_on_tissue_and_a_tolerance_decides() {
    let Some(samples) = recording("perineal_P002_laser9.csv") else {
        return;
    };
    let records = [("press", samples.as_slice())];
    let tolerated = |tolerance: Option<&str>| {
        let options = SelectOptions {
            tolerance: tolerance.map(|text| text.parse().unwrap()),
            ..SelectOptions::default()
        };
        select(&records, &options, &|_| ControlFlow::Continue(())).unwrap()
    };
    let plain = tolerated(None);
    // What the best family leaves wanders over the record: a criterion proves nothing.
    assert_eq!(plain.verdict.outcome, SelectionOutcome::NoneAdequate, "{:?}", plain.verdict);
    assert_eq!(plain.verdict.family, None);
    // Tighter than any family predicts the hold, and as wide as a press shallower than a hand feels.
    let tight = tolerated(Some("0.5%")).verdict;
    assert_eq!(tight.outcome, SelectionOutcome::NoneWithin, "{tight:?}");
    let wide = tolerated(Some("10%")).verdict;
    assert!(wide.family.is_some(), "{wide:?}");
}
