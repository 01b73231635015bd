//! Several records together, censored forces, and the intervals that need more than one pass.

use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_model::{Depth, Newtons};
use palpate_rheology::fit::{
    Bootstrap, FitError, FitOptions, FitSample, FitSolution, fit, fit_joint,
};
use palpate_test_support::record::{
    self, ramp_hold, respond, with_correlated_noise, with_white_noise,
};

const THESIS: ModifiedKelvin = ModifiedKelvin::THESIS;
const BODY: [&str; 5] = ["tau_eps", "mu1", "mu2", "mu3", "tau_sig"];

fn record(body: &ModifiedKelvin, speed: f64, hold: f64) -> Vec<FitSample> {
    respond(body, &ramp_hold(speed, hold, 1e-2))
}

fn body_values(body: &ModifiedKelvin) -> [f64; 5] {
    let [mu1, mu2, mu3] = body.mu;
    [body.tau_eps, mu1, mu2, mu3, body.tau_sig]
}

#[test]
fn two_ramps_identify_what_neither_does_alone() {
    let (slow, fast) = (record(&THESIS, 0.75, 0.0), record(&THESIS, 1.5, 0.0));
    let options = FitOptions::default();
    assert!(matches!(fit(&slow, &options), Err(FitError::Inseparable { .. })));
    let records = [("slow", slow.as_slice()), ("fast", fast.as_slice())];
    let report = fit_joint(&records, &options, &BODY).unwrap();
    for named in &report.records {
        for (name, exact) in BODY.into_iter().zip(body_values(&THESIS)) {
            let relative = (named.report.value(name).unwrap() / exact - 1.0).abs();
            // Condition about 80, rounding 1e-16, ten thousand samples.
            assert!(relative < 1e-10, "{name} of {}: {relative:e}", named.record);
        }
    }
    // The same speed twice is still one speed.
    let records = [("one", slow.as_slice()), ("two", slow.as_slice())];
    let err = fit_joint(&records, &options, &BODY).unwrap_err();
    assert!(matches!(err, FitError::Inseparable { .. }), "{err}");
}

#[test]
fn specimens_may_share_some_parameters_and_keep_others() {
    let stiff = ModifiedKelvin { mu: [0.08, -0.011, 0.0006], ..THESIS };
    let (one, two) = (record(&THESIS, 0.75, 20.0), record(&stiff, 0.75, 20.0));
    let (one, two) = (with_white_noise(&one, 1), with_white_noise(&two, 2));
    let records = [("one", one.as_slice()), ("two", two.as_slice())];
    let options = FitOptions::default();
    let joint = fit_joint(&records, &options, &["tau_eps", "tau_sig"]).unwrap();
    for (named, body) in joint.records.iter().zip([THESIS, stiff]) {
        for (name, exact) in BODY.into_iter().zip(body_values(&body)) {
            let parameter = named.report.parameter(name).unwrap();
            let z = (parameter.value - exact) / parameter.std_error.unwrap();
            assert!(z.abs() < 4.5, "{name} of {}: z = {z}", named.record);
        }
    }
    let [first, second] = &joint.records[..] else { panic!() };
    assert_eq!(first.report.value("tau_eps"), second.report.value("tau_eps"));
    assert_ne!(first.report.value("mu1"), second.report.value("mu1"));
    // Sharing halves the information needed: both alone know tau less well.
    let alone = fit(&one, &options).unwrap();
    let error = |report: &palpate_rheology::fit::FitReport| {
        report.parameter("tau_eps").unwrap().std_error.unwrap()
    };
    let ratio = error(&first.report) / error(&alone);
    assert!((0.6..0.85).contains(&ratio), "{ratio}");
}

#[test]
fn a_joint_fit_that_shares_nothing_is_both_fits() {
    let (one, two) = (
        with_white_noise(&record(&THESIS, 0.75, 20.0), 3),
        with_white_noise(&record(&THESIS, 1.5, 20.0), 4),
    );
    let options = FitOptions::default();
    let records = [("one", one.as_slice()), ("two", two.as_slice())];
    let joint = fit_joint(&records, &options, &[]).unwrap();
    assert_eq!(joint.records.len(), 2);
    for (named, samples) in joint.records.iter().zip([&one, &two]) {
        let alone = fit(samples, &options).unwrap();
        for name in BODY {
            let (a, b) = (named.report.parameter(name).unwrap(), alone.parameter(name).unwrap());
            // Both stop within a thousandth of a standard error squared.
            assert!((a.value - b.value).abs() < 1e-4 * b.std_error.unwrap(), "{name}");
        }
    }
}

#[test]
fn sharing_is_refused_in_words() {
    let one = record(&THESIS, 0.75, 20.0);
    let records = [("one", one.as_slice()), ("two", one.as_slice())];
    let options = FitOptions::default();
    let err = fit_joint(&records, &options, &["f0"]).unwrap_err();
    assert!(matches!(&err, FitError::NotShareable { name, .. } if name == "f0"), "{err:?}");
    let err = fit_joint(&records, &options, &["mu9"]).unwrap_err();
    assert!(err.to_string().contains("'mu9'"), "{err}");
    let mut bad = one.clone();
    bad[5].force = Newtons(f64::NAN);
    let records = [("one", one.as_slice()), ("two", bad.as_slice())];
    let err = fit_joint(&records, &options, &BODY).unwrap_err();
    assert!(err.to_string().starts_with("two: "), "{err}");
}

#[test]
fn censored_forces_do_not_count_but_their_depths_do() {
    // The cell saturates at 5 N: beyond it the reading stands still.
    let clean = record(&THESIS, 0.75, 20.0);
    let saturated: Vec<FitSample> = clean
        .iter()
        .map(|sample| FitSample {
            force: Newtons(sample.force.0.min(6.0)),
            sigma: Newtons(if sample.force.0 < 6.0 { 0.02 } else { f64::INFINITY }),
            ..*sample
        })
        .collect();
    let censored = saturated.iter().filter(|sample| !sample.is_measured()).count();
    assert!(censored > 50, "{censored}");
    let report = fit(&saturated, &FitOptions::default()).unwrap();
    assert_eq!(report.censored, censored);
    for (name, exact) in BODY.into_iter().zip(body_values(&THESIS)) {
        let relative = (report.value(name).unwrap() / exact - 1.0).abs();
        assert!(relative < 1e-9, "{name}: {relative:e}");
    }
    assert!(report.findings.iter().any(|text| text.contains("censored")));
    // Taken at face value the same record is wrong by far more.
    let naive: Vec<FitSample> =
        saturated.iter().map(|sample| FitSample { sigma: Newtons(0.02), ..*sample }).collect();
    let report = fit(&naive, &FitOptions::default()).unwrap();
    assert!((report.value("tau_eps").unwrap() / THESIS.tau_eps - 1.0).abs() > 1e-3);
}

#[test]
fn profiles_agree_with_the_sum_of_squares_they_describe() {
    let samples = with_white_noise(&record(&THESIS, 0.75, 20.0), 11);
    let options = FitOptions::default();
    let fitted = FitSolution::of(&samples, &options).unwrap();
    let report = fitted.report();
    let square =
        |report: &palpate_rheology::fit::FitReport| report.rmse_n.powi(2) * samples.len() as f64;
    let smallest = square(&report);
    let mut intervals = fitted.profile(0).unwrap();
    intervals.retain(|interval| BODY.contains(&interval.name.as_str()));
    assert_eq!(intervals.len(), BODY.len());
    for (position, interval) in intervals.into_iter().enumerate() {
        let parameter = report.parameter(&interval.name).unwrap();
        let [low, high] = parameter.ci95.unwrap();
        for (end, symmetric) in [(interval.low.unwrap(), low), (interval.high.unwrap(), high)] {
            // Nearly a parabola here: the profile is close to the symmetric interval.
            assert!((end - symmetric).abs() < 0.1 * (high - low), "{position}");
            // An independent check: with the parameter fixed there, all others refitted, the sum
            // rises by Student's t squared variances.
            let mut fixed = options.clone();
            fixed.fix(&interval.name, end).unwrap();
            let rise = square(&fit(&samples, &fixed).unwrap()) - smallest;
            let variance = smallest / (samples.len() - 7) as f64;
            let wanted = 1.959_964f64.powi(2);
            assert!((rise / variance / wanted - 1.0).abs() < 2e-3, "{}", interval.name);
        }
    }
}

#[test]
fn a_relaxation_too_slow_for_the_record_has_an_open_profile() {
    let body = ModifiedKelvin { tau_eps: 400.0, ..THESIS };
    let samples = with_white_noise(&record(&body, 1.5, 2.0), 5);
    let mut options = FitOptions::default();
    options.fix("f_offset", 0.0).unwrap();
    let fitted = FitSolution::of(&samples, &options).unwrap();
    let profile = fitted.profile(0).unwrap();
    let tau = profile.iter().find(|interval| interval.name == "tau_eps").unwrap();
    assert!(tau.high.is_none(), "{tau:?}");
}

#[test]
fn bootstrap_agrees_with_the_standard_errors_and_repeats() {
    let clean = record(&THESIS, 0.75, 50.0);
    for (samples, allowed) in [
        (with_white_noise(&clean, 21), 1.35),
        (with_correlated_noise(&clean, 22, (0.02, 0.3, 0.005)), 1.8),
    ] {
        let fitted = FitSolution::of(&samples, &FitOptions::default()).unwrap();
        let report = fitted.report();
        let choice = Bootstrap { seed: 7, repeats: 100 };
        let mut heard = 0;
        let intervals = fitted.bootstrap(0, choice, |done| heard = done).unwrap();
        assert_eq!(heard, 100);
        for interval in &intervals {
            let error = report.parameter(&interval.name).unwrap().std_error.unwrap();
            let ratio = interval.std_dev / error;
            println!("{} {ratio:.2}", interval.name);
            // A hundred repeats know a deviation to 7 %, the memory to about 20 %.
            assert!((1.0 / allowed..allowed).contains(&ratio), "{} {ratio}", interval.name);
        }
        assert_eq!(fitted.bootstrap(0, choice, |_| ()).unwrap(), intervals);
    }
}

#[test]
fn depth_in_stairs_or_with_noise_never_passes_for_a_second_speed() {
    let ramp = respond(&THESIS, &ramp_hold(0.75, 0.0, 1e-3));
    let mut noise = record::Noise::seeded(3);
    for seed in 0..40 {
        let stair = seed % 2 == 0;
        let shift = noise.uniform() * 0.015;
        let samples: Vec<FitSample> = with_white_noise(&ramp, 100 + seed)
            .into_iter()
            .map(|sample| {
                let depth = if stair {
                    ((sample.depth.0 + shift) / 0.015).floor() * 0.015
                } else {
                    sample.depth.0 + 0.002 * noise.normal()
                };
                FitSample { depth: Depth(depth), ..sample }
            })
            .collect();
        let err = fit(&samples, &FitOptions::default()).unwrap_err();
        assert!(err.to_string().contains("mu1 from tau_sig"), "{seed}: {err}");
    }
}
