//! Recordings of real tissue, kept outside the repository because of their licences. Each test says
//! so and passes when its file is absent.

use palpate_model::{Depth, Newtons, Seconds};
use palpate_rheology::fit::{FitOptions, FitSample, FitSolution, fit};
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

/// Two presses of one person's tissue: the band of the force that a fit of one predicts, on the other one until it unloads.
/// No interval of a wrong model is right, and this says by how much.
#[test]
fn bands_of_one_press_are_compared_with_the_other() {
    let (Some(one), Some(other)) =
        (recording("perineal_P002_laser9.csv"), recording("perineal_P002_load_hold_unload.csv"))
    else {
        return;
    };
    let loaded = |samples: Vec<FitSample>| -> Vec<FitSample> {
        let deepest = samples.iter().map(|one| one.depth.0).fold(0.0, f64::max);
        let last = samples.iter().rposition(|one| one.depth.0 > 0.999 * deepest).unwrap();
        samples[..=last].to_vec()
    };
    let presses = [loaded(one), loaded(other)];
    let of_deep = FitSolution::of(&presses[0], &FitOptions::default()).unwrap();
    println!("{}", of_deep.richer_words(0, &of_deep.report()).unwrap());
    for (fitted, held, documented) in [(0, 1, 0.13), (1, 0, 0.01)] {
        let known = FitSolution::of(&presses[fitted], &FitOptions::default()).unwrap();
        let path: Vec<_> = presses[held].iter().map(|one| (one.t, one.depth)).collect();
        let band = known.predict_band(0, &path).unwrap();
        // The other record's own offset is none of the body's: the first force, at depth 0.
        let offset = presses[held][0].force.0;
        let holds = band.iter().zip(&presses[held]).filter(|(band, sample)| {
            let [low, high] = band.ci95;
            (low.0..=high.0).contains(&(sample.force.0 - offset))
        });
        let count = holds.count();
        println!(
            "fit of press {fitted}: the band holds {count} of {} forces of press {held}",
            path.len()
        );
        // As in docs/explanation/accuracy.md; a few samples near an end of the band may change sides with the rounding.
        let share = count as f64 / path.len() as f64;
        assert!((share - documented).abs() < 0.02, "{share}");
    }
}
