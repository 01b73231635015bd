//! The fit finds the body that made the record, and its errors mean what they say.

mod support;

use palpate_model::fit::{FitError, FitOptions, FitReport, FitSample, fit};
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_model::{Depth, Newtons, Seconds};
use support::{noisy, ramp_hold, respond};

const BODY: [(&str, f64); 5] = [
    ("tau_eps", 1.023),
    ("mu1", 0.05333),
    ("mu2", -0.0086),
    ("mu3", 0.0004345),
    ("tau_sig", 0.06),
];

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
    println!(
        "worst relative error {worst:.2e}, rmse {:.2e} N",
        report.rmse_n
    );
    assert!(worst < 1e-11, "{report:#?}");
    assert!(report.value("f0").unwrap().abs() < 1e-11);
    assert!(report.value("f_offset").unwrap().abs() < 1e-11);
    assert!(
        report.rmse_n < 1e-12 && report.warnings.is_empty(),
        "{report:#?}"
    );
}

#[test]
fn standard_errors_match_the_published_ones_of_this_protocol() {
    // Relative standard deviations in % at 1 kHz with 0.02 N white noise.
    let cases = [
        (FitOptions::default(), [0.166, 0.271, 0.126, 0.053, 0.068]),
        (without_offset(), [0.158, 0.111, 0.073, 0.036, 0.068]),
    ];
    let record = noisy(&thesis_record(1e-3), 1);
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
