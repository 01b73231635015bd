//! Records that once fooled the fit: it must say so, or not be fooled.

use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_model::{Depth, Newtons, Seconds};
use palpate_rheology::families::Model;
use palpate_rheology::fit::{
    Bootstrap, FitError, FitOptions, FitSample, FitSolution, LiveFit, fit, fit_joint,
};
use palpate_test_support::record::{
    Noise, ramp_hold, respond, with_correlated_noise, with_white_noise,
};

const THESIS: ModifiedKelvin = ModifiedKelvin::THESIS;
const BODY: [&str; 5] = ["tau_eps", "mu1", "mu2", "mu3", "tau_sig"];

fn censored(mut samples: Vec<FitSample>, is_censored: impl Fn(f64) -> bool) -> Vec<FitSample> {
    for sample in &mut samples {
        if is_censored(sample.t.0) {
            sample.sigma = Newtons(f64::INFINITY);
        }
    }
    samples
}

#[test]
fn censored_stretches_do_not_pass_for_quiet_noise() {
    let clean = respond(&THESIS, &ramp_hold(0.75, 50.0, 1e-2));
    let gaps: [fn(f64) -> bool; 2] =
        [|t| (10.0..30.0).contains(&t) || t > 48.0, |t| t.rem_euclid(8.0) > 5.0];
    let draws = 100;
    for gap in gaps {
        let mut covered = 0;
        let mut found = 0;
        for seed in 0..draws {
            let slow = with_correlated_noise(&clean, 300 + seed, (0.02, 0.5, 0.0));
            let report = fit(&censored(slow, gap), &FitOptions::default()).unwrap();
            for (name, truth) in BODY.into_iter().zip([1.023, 0.05333, -0.0086, 0.0004345, 0.06]) {
                let [low, high] = report.parameter(name).unwrap().ci95.unwrap();
                covered += u64::from(low <= truth && truth <= high);
            }
            let white = censored(with_white_noise(&clean, 700 + seed), gap);
            let noise = fit(&white, &FitOptions::default()).unwrap().noise.unwrap();
            found += u64::from(noise.correlation_time_s.is_some());
        }
        let share = 100.0 * covered as f64 / (5 * draws) as f64;
        // Five parameters that agree to 0.6: chance of three deviations is 5 % of 100 draws.
        assert!((88.0..=99.5).contains(&share), "{share} %");
        // Memory is looked for at the 5 % level.
        assert!(found <= 15, "memory found in {found} of {draws} white records");
    }
}

#[test]
fn a_hold_without_forces_identifies_nothing_live() {
    let record = with_white_noise(&respond(&THESIS, &ramp_hold(0.75, 50.0, 1e-2)), 4);
    let record = censored(record, |t| t > 39.9);
    let mut live = LiveFit::new(Depth(30.0));
    for sample in &record {
        live.push(sample.t, sample.depth, sample.force, sample.sigma);
    }
    let estimate = live.estimate().unwrap();
    for name in ["mu1", "tau_sig"] {
        assert_eq!(estimate.identified_parameter(name), None, "{estimate:?}");
    }
    assert!(fit(&record, &FitOptions::default()).is_err());
}

#[test]
fn relaxation_faster_than_the_mean_interval_is_found() {
    // Every 0.1 s for 45 s, then ever farther apart; and evenly every 1.5 s.
    let mut t = 0.0;
    let mut sparse = vec![(0.0, 0.0)];
    while t < 2000.0 {
        t += if t < 45.0 { 0.1 } else { 0.1 + 0.03 * (t - 45.0) };
        sparse.push((t, (0.75f64 * t).min(30.0)));
    }
    for path in [sparse, ramp_hold(0.75, 50.0, 1.5)] {
        let report = fit(&respond(&THESIS, &path), &FitOptions::default()).unwrap();
        let miss = (report.value("tau_eps").unwrap() / 1.023 - 1.0).abs();
        assert!(miss < 1e-9, "{miss:e} of {} samples", path.len());
    }
}

#[test]
fn a_ramp_read_with_much_depth_noise_is_still_one_ramp() {
    let ramp = respond(&THESIS, &ramp_hold(0.75, 0.0, 1e-2));
    let mut noise = Noise::seeded(8);
    for micrometres in [2.0, 10.0, 20.0, 30.0] {
        for seed in 0..10 {
            let mut samples = with_white_noise(&ramp, seed);
            for sample in &mut samples {
                sample.depth = Depth(sample.depth.0 + 1e-3 * micrometres * noise.normal());
            }
            let err = fit(&samples, &FitOptions::default());
            assert!(matches!(err, Err(FitError::Inseparable { .. })), "{micrometres} um, {seed}");
        }
    }
}

#[test]
fn the_order_of_records_does_not_matter() {
    let short = with_white_noise(&respond(&THESIS, &ramp_hold(15.0, 0.5, 1e-2)), 1);
    let slow = ModifiedKelvin { tau_eps: 60.0, ..THESIS };

    let long = with_white_noise(&respond(&slow, &ramp_hold(0.75, 400.0, 1e-1)), 2);
    let fit_of = |records: [(&str, &[FitSample]); 2]| {
        let report = fit_joint(&records, &FitOptions::default(), &["tau_eps"]).unwrap();
        let tau = report.records[0].report.parameter("tau_eps").unwrap().clone();
        (tau.value, tau.std_error.unwrap())
    };
    let one = fit_of([("short", short.as_slice()), ("long", long.as_slice())]);
    let other = fit_of([("long", long.as_slice()), ("short", short.as_slice())]);
    assert!((one.0 / other.0 - 1.0).abs() < 1e-6, "{one:?} {other:?}");
    assert!((one.1 / other.1 - 1.0).abs() < 1e-2, "{one:?} {other:?}");
}

#[test]
fn records_without_content_are_refused_in_words() {
    let mut flat = respond(&THESIS, &ramp_hold(0.75, 50.0, 0.1));
    flat.iter_mut().for_each(|sample| sample.force = Newtons(3.0));
    let err = fit(&flat, &FitOptions::default()).unwrap_err();
    assert!(err.to_string().contains("3 N"), "{err}");
    let mut still = respond(&THESIS, &ramp_hold(0.75, 50.0, 0.1));
    still.iter_mut().for_each(|sample| sample.depth = Depth(5.0));
    let mut free = FitOptions::default();
    free.free("x_contact").unwrap();
    for options in [FitOptions::default(), free] {
        let err = fit(&still, &options).unwrap_err();
        assert!(err.to_string().contains("5 mm"), "{err}");
    }
}

#[test]
fn a_bootstrap_of_one_block_is_refused() {
    let clean = respond(&THESIS, &ramp_hold(0.75, 50.0, 1e-2));
    let record = with_correlated_noise(&clean, 9, (0.05, 40.0, 0.001));
    let fitted = FitSolution::of(&record, &FitOptions::default()).unwrap();
    let choice = Bootstrap { seed: 1, repeats: 50 };
    let err = fitted.bootstrap(0, choice, |_| ()).unwrap_err();
    assert!(err.to_string().contains("independent block(s)"), "{err}");
}

#[test]
fn few_samples_are_not_called_a_wrong_model() {
    let record = with_white_noise(&respond(&THESIS, &ramp_hold(0.75, 20.0, 1.5)), 3);
    let report = fit(&record, &FitOptions::default()).unwrap();
    assert!(report.samples < 70);
    let sentences: Vec<&str> = report.sentences().collect();
    assert!(!sentences.iter().any(|text| text.contains("lack of fit")), "{sentences:?}");
    assert!(sentences.iter().any(|text| text.contains("only 41 samples")), "{sentences:?}");
}

/// Where the family is wrong, the fit says by how much a richer one moves each parameter: what a fit of that one finds.
#[test]
fn lack_of_fit_says_how_far_a_richer_family_moves_the_parameters() {
    let body = Model {
        family: "series-4".into(),
        outer: vec![1.0],
        linear: vec![0.05, -0.008, 4e-4, 1e-5, 0.06],
    };
    let path: Vec<(Seconds, Depth)> = (0..6000)
        .map(|i| 0.01 * f64::from(i))
        .map(|t| (Seconds(t), Depth((0.75 * t).min(20.0))))
        .collect();
    let forces = body.along(path.iter().copied()).unwrap();
    let mut noise = Noise::seeded(3);
    let samples: Vec<FitSample> = path
        .iter()
        .zip(forces)
        .map(|(&(t, depth), force)| FitSample {
            t,
            depth,
            force: Newtons(force + 0.01 * noise.normal()),
            sigma: Newtons(0.01),
        })
        .collect();
    let fitted = FitSolution::of(&samples, &FitOptions::default()).unwrap();
    let own = fitted.report();
    let series_4 = FitOptions::by_key("series-4").unwrap();
    let richer_fit = FitSolution::of(&samples, &series_4).unwrap();
    let richer = richer_fit.report();
    let found = fitted.richer_words(0, &own).unwrap();
    assert!(found.contains("series-4"), "{found}");
    for name in ["tau_eps", "mu1", "mu2", "mu3", "tau_sig"] {
        let stated = found.split(&format!("{name} by ")).nth(1).unwrap();
        let stated: f64 = stated.split(' ').next().unwrap().parse().unwrap();
        let [before, after] = [&own, &richer].map(|report| report.value(name).unwrap());
        let expected = 100.0 * (after - before) / before.abs();
        // Thinned records are a share of a standard error away.
        let error = 100.0 * richer.parameter(name).unwrap().std_error.unwrap() / before.abs();
        assert!(
            (stated - expected).abs() < 0.5 * error + 0.01,
            "{name}: {stated} {expected} {error}"
        );
    }
    // Where the family is right, nothing is said.
    assert_eq!(richer_fit.richer_words(0, &richer), None);
}
