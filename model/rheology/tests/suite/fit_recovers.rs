//! The fit finds the body that made the record, and its errors mean what they say.

use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_model::{Depth, Newtons, Seconds};
use palpate_rheology::fit::{FitError, FitOptions, FitReport, FitSample, fit};
use palpate_test_support::record::{self, ramp_hold, respond, with_white_noise};

const BODY: [(&str, f64); 5] =
    [("tau_eps", 1.023), ("mu1", 0.05333), ("mu2", -0.0086), ("mu3", 0.0004345), ("tau_sig", 0.06)];

fn thesis_record(dt: f64) -> Vec<FitSample> {
    respond(&ModifiedKelvin::THESIS, &ramp_hold(0.75, 50.0, dt))
}

fn worst_error(report: &FitReport) -> f64 {
    BODY.iter()
        .map(|&(name, exact)| (report.value(name).unwrap() / exact - 1.0).abs())
        .fold(0.0, f64::max)
}

fn without_offset() -> FitOptions {
    let mut options = FitOptions::default();
    options.fix("f_offset", 0.0).unwrap();
    options
}

#[test]
fn noiseless_record_gives_the_body_back() {
    let report = fit(&thesis_record(1e-3), &FitOptions::default()).unwrap();
    let worst = worst_error(&report);
    println!("worst relative error {worst:.2e}, rmse {:.2e} N", report.rmse_n);
    assert!(worst < 1e-11, "{report:#?}");
    assert!(report.value("f0").unwrap().abs() < 1e-11);
    assert!(report.value("f_offset").unwrap().abs() < 1e-11);
    assert!(report.rmse_n < 1e-12 && report.warnings.is_empty(), "{report:#?}");
}

#[test]
fn standard_errors_match_the_published_ones_of_this_protocol() {
    // Relative standard deviations in % at 1 kHz with 0.02 N white noise.
    let cases = [
        (FitOptions::default(), [0.166, 0.271, 0.126, 0.053, 0.068]),
        (without_offset(), [0.158, 0.111, 0.073, 0.036, 0.068]),
    ];
    let record = with_white_noise(&thesis_record(1e-3), 1);
    for (options, percent) in cases {
        let report = fit(&record, &options).unwrap();
        for ((name, exact), percent) in BODY.into_iter().zip(percent) {
            let found = 100.0 * report.parameter(name).unwrap().std_error.unwrap() / exact.abs();
            assert!(
                (found / percent - 1.0).abs() < 0.02,
                "{name}: {found} % where {percent} % is expected"
            );
        }
        assert!((report.rmse_n / 0.02 - 1.0).abs() < 0.01);
        assert!(report.warnings.is_empty(), "{:?}", report.warnings);
    }
}

#[test]
fn thirty_noise_draws_scatter_as_their_errors_say() {
    // 100 Hz, so that thirty fits stay quick; each z should be a standard normal deviate.
    let clean = thesis_record(1e-2);
    let draws = 30;
    let mut chi_square = [0.0; 5];
    let mut covered = 0;
    for seed in 0..draws {
        let report = fit(&with_white_noise(&clean, 100 + seed), &FitOptions::default()).unwrap();
        for (slot, (name, exact)) in chi_square.iter_mut().zip(BODY) {
            let parameter = report.parameter(name).unwrap();
            let z = (parameter.value - exact) / parameter.std_error.unwrap();
            *slot += z * z;
            let [low, high] = parameter.ci95.unwrap();
            covered += u32::from(low <= exact && exact <= high);
        }
    }
    println!("chi-square of 30 draws {chi_square:.1?}, {covered} of 150 intervals cover");
    // 0.01 % and 99.99 % points of chi-square with 30 degrees of freedom.
    for (value, (name, _)) in chi_square.iter().zip(BODY) {
        assert!((9.26..66.6).contains(value), "{name}: {value}");
    }
    assert!(covered >= 130, "{covered}");
}

#[test]
fn weights_matter_where_the_noise_is_uneven() {
    // Ten times the noise in the middle of the ramp, as on the flat stretch of a load cell.
    let mut clean = thesis_record(1e-2);
    for sample in &mut clean {
        if (15.0..32.0).contains(&sample.t.0) {
            sample.sigma = Newtons(0.2);
        }
    }
    let (mut weighted, mut unweighted) = (0.0, 0.0);
    for seed in 0..12 {
        let record = with_white_noise(&clean, 500 + seed);
        let flat: Vec<FitSample> =
            record.iter().map(|sample| FitSample { sigma: Newtons(0.02), ..*sample }).collect();
        let miss = |samples: &[FitSample]| {
            let report = fit(samples, &without_offset()).unwrap();
            (report.value("mu1").unwrap() / 0.05333 - 1.0).powi(2)
        };
        weighted += miss(&record);
        unweighted += miss(&flat);
    }
    assert!(
        weighted < 0.25 * unweighted,
        "squared errors {weighted:.3e} weighted, {unweighted:.3e} unweighted"
    );
}

#[test]
fn uneven_times_and_two_speeds_are_no_obstacle() {
    let mut noise = record::Noise::seeded(9);
    let mut t = 3.0;
    let mut path = vec![(t, 0.0)];
    while t < 63.0 {
        t += 2e-3 + 0.03 * noise.uniform();
        // 0.5 mm/s, then 2 mm/s, then back at 1 mm/s, no hold.
        let since = t - 3.0;
        let depth = if since < 20.0 {
            0.5 * since
        } else if since < 30.0 {
            10.0 + 2.0 * (since - 20.0)
        } else {
            (30.0 - (since - 30.0)).max(1.0)
        };
        path.push((t, depth));
    }
    let report = fit(&respond(&ModifiedKelvin::THESIS, &path), &FitOptions::default()).unwrap();
    let worst = worst_error(&report);
    println!("worst relative error {worst:.2e} on uneven times");
    assert!(worst < 1e-11, "{report:#?}");
}

#[test]
fn every_relaxation_time_the_record_can_show_is_found() {
    for tau_eps in [0.01, 0.05, 0.3, 4.0, 20.0, 80.0] {
        let body = ModifiedKelvin { tau_eps, ..ModifiedKelvin::THESIS };
        let record = respond(&body, &ramp_hold(0.75, 50.0, 1e-2));
        let report = fit(&record, &FitOptions::default()).unwrap();
        let relative = (report.value("tau_eps").unwrap() / tau_eps - 1.0).abs();
        assert!(relative < 1e-8, "{tau_eps}: {relative:e} {report:#?}");
        assert!((report.value("mu3").unwrap() / 0.0004345 - 1.0).abs() < 1e-8);
    }
}

#[test]
fn any_parameter_may_be_fixed() {
    let record = with_white_noise(&thesis_record(1e-2), 77);
    for (name, exact) in BODY {
        let mut options = FitOptions::default();
        options.fix(name, exact).unwrap();
        let report = fit(&record, &options).unwrap();
        let parameter = report.parameter(name).unwrap();
        assert!(parameter.is_fixed && parameter.std_error.is_none());
        assert!((parameter.value / exact - 1.0).abs() < 1e-14);
        for (other, exact) in BODY.into_iter().filter(|(other, _)| *other != name) {
            let parameter = report.parameter(other).unwrap();
            let z = (parameter.value - exact) / parameter.std_error.unwrap();
            assert!(z.abs() < 4.5, "{name} fixed, {other}: z = {z}");
        }
    }
    // Everything fixed: nothing is searched, the residuals are still reported.
    let mut options = FitOptions::default();
    for (name, exact) in BODY.into_iter().chain([("f0", 0.0), ("f_offset", 0.0)]) {
        options.fix(name, exact).unwrap();
    }
    let report = fit(&record, &options).unwrap();
    assert!((report.rmse_n / 0.02 - 1.0).abs() < 0.03, "{report:#?}");
}

#[test]
fn initial_force_and_offset_are_separated() {
    let record: Vec<FitSample> = thesis_record(1e-2)
        .into_iter()
        .map(|sample| FitSample {
            force: Newtons(sample.force.0 + 0.3 * (-sample.t.0 / 1.023).exp() - 0.11),
            ..sample
        })
        .collect();
    let report = fit(&record, &FitOptions::default()).unwrap();
    assert!((report.value("f0").unwrap() - 0.3).abs() < 1e-10);
    assert!((report.value("f_offset").unwrap() + 0.11).abs() < 1e-10);
    assert!(worst_error(&report) < 1e-9);
    let predicted = report.predict(&record);
    for (sample, force) in record.iter().zip(predicted) {
        assert!((sample.force.0 - force.0).abs() < 1e-11);
    }
}

#[test]
fn an_unknown_contact_is_found() {
    // Contact 0.37 mm beyond where depth is counted from.
    let path = ramp_hold(0.75, 50.0, 1e-2);
    let inside: Vec<(f64, f64)> = path.iter().map(|&(t, x)| (t, x - 0.37)).collect();
    let clean: Vec<FitSample> = respond(&ModifiedKelvin::THESIS, &inside)
        .into_iter()
        .zip(&path)
        .map(|(sample, &(_, x))| FitSample { depth: Depth(x), ..sample })
        .collect();
    let mut options = FitOptions::default();
    options.free("x_contact").unwrap();
    let report = fit(&clean, &options).unwrap();
    let contact = report.value("x_contact").unwrap();
    assert!((contact - 0.37).abs() < 1e-8, "{report:#?}");
    assert!(worst_error(&report) < 1e-6, "{report:#?}");

    for seed in 0..6 {
        let report = fit(&with_white_noise(&clean, 40 + seed), &options).unwrap();
        for (name, exact) in BODY.into_iter().chain([("x_contact", 0.37)]) {
            let parameter = report.parameter(name).unwrap();
            let z = (parameter.value - exact) / parameter.std_error.unwrap();
            assert!(z.abs() < 4.5, "{name}: z = {z}");
        }
    }
}

#[test]
fn one_ramp_cannot_separate_stiffness_from_viscosity_not_even_in_stairs() {
    let ramp: Vec<(f64, f64)> = ramp_hold(0.75, 0.0, 1e-3);
    let clean = respond(&ModifiedKelvin::THESIS, &ramp);
    let mut noise = record::Noise::seeded(3);
    let stairs: Vec<FitSample> = clean
        .iter()
        .map(|sample| FitSample {
            depth: Depth((sample.depth.0 / 0.015).floor() * 0.015),
            ..*sample
        })
        .collect();
    let shaken: Vec<FitSample> = clean
        .iter()
        .map(|sample| FitSample {
            depth: Depth(sample.depth.0 + 0.002 * noise.normal()),
            ..*sample
        })
        .collect();
    for record in [clean.clone(), stairs, with_white_noise(&shaken, 8)] {
        let err = fit(&record, &FitOptions::default()).unwrap_err();
        assert!(
            matches!(&err, FitError::Inseparable { names, .. } if names == &["mu1", "tau_sig"]),
            "{err:?}"
        );
    }
    // With the viscosity known the same ramp is enough.
    let mut options = FitOptions::default();
    options.fix("tau_sig", 0.06).unwrap();
    let report = fit(&with_white_noise(&clean, 5), &options).unwrap();
    let mu1 = report.parameter("mu1").unwrap();
    assert!(((mu1.value - 0.05333) / mu1.std_error.unwrap()).abs() < 4.5);
}

#[test]
fn records_that_cannot_be_fitted_are_refused_in_words() {
    let good = thesis_record(0.1);
    let refuse = |change: &dyn Fn(&mut Vec<FitSample>)| {
        let mut record = good.clone();
        change(&mut record);
        fit(&record, &FitOptions::default()).unwrap_err()
    };
    let few = refuse(&|record| record.truncate(5));
    assert!(matches!(few, FitError::TooFewSamples { samples: 5, parameters: 7 }));
    let bad = refuse(&|record| record[7].force = Newtons(f64::NAN));
    assert!(matches!(
        bad,
        FitError::NotFinite { index: 7, what: "force", value } if value.is_nan()
    ));
    let bad = refuse(&|record| record[7].sigma = Newtons(0.0));
    assert_eq!(bad, FitError::SigmaNotPositive { index: 7, sigma: 0.0 });
    for t in [good[6].t, Seconds(0.0)] {
        let bad = refuse(&|record| record[7].t = t);
        assert!(matches!(bad, FitError::TimeNotIncreasing { index: 7, .. }));
    }
    let bad = refuse(&|record| record.iter_mut().for_each(|s| s.depth = Depth(-31.0 + s.depth.0)));
    assert!(matches!(bad, FitError::NeverInTissue { .. }), "{bad:?}");
}

#[test]
fn a_body_without_relaxation_is_reported_at_the_edge() {
    let record: Vec<FitSample> = ramp_hold(0.75, 20.0, 1e-2)
        .into_iter()
        .map(|(t, depth)| FitSample {
            t: Seconds(t),
            depth: Depth(depth),
            force: Newtons(0.1 * depth),
            sigma: Newtons(0.02),
        })
        .collect();
    let report = fit(&with_white_noise(&record, 4), &FitOptions::default()).unwrap();
    let tau = report.parameter("tau_eps").unwrap();
    assert!(
        report.warnings.iter().any(|text| text.contains("tau_eps"))
            || tau.ci95.is_some_and(|[low, _]| low < 0.02),
        "{report:#?}"
    );
}
