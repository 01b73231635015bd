//! A published Prony series, and the least squares with relaxation times laid down beforehand.

use palpate_model::{Depth, Newtons, Seconds};
use palpate_rheology::families::{Maxwell, Prony};
use palpate_rheology::fit::{FitError, FitOptions, FitSample, fit, fit_coefficients};
use palpate_test_support::skip;
use std::path::Path;
use std::sync::Arc;

/// NREL/pyvisco at 8755fc5, `verification/time_master/prony_terms_KPf_MD.csv`: moduli over their sum, one
/// term to a decade from 0.01 s on; the sum is 1739.03 MPa.
const PUBLISHED: [f64; 31] = [
    5.456514e-2,
    1.990923e-2,
    2.259133e-2,
    1.145233e-2,
    1.162351e-2,
    1.134698e-2,
    1.228268e-2,
    1.641093e-2,
    1.282291e-2,
    1.109404e-2,
    1.295433e-2,
    1.738946e-2,
    1.582369e-2,
    2.112619e-2,
    2.115868e-2,
    2.413420e-2,
    3.404660e-2,
    5.111675e-2,
    7.523961e-2,
    1.091803e-1,
    9.671928e-2,
    8.814058e-2,
    5.242764e-2,
    4.113119e-2,
    2.662922e-2,
    2.208281e-2,
    1.375225e-2,
    1.256890e-2,
    1.153754e-2,
    1.070454e-2,
    1.161637e-2,
];
const PUBLISHED_SUM: f64 = 1739.03;

fn sample(t: f64, depth: f64, force: f64, sigma: f64) -> FitSample {
    FitSample { t: Seconds(t), depth: Depth(depth), force: Newtons(force), sigma: Newtons(sigma) }
}

/// A relaxation modulus as the force after a step to 1 mm within 1 ns.
fn relaxation(curve: impl Iterator<Item = (f64, f64)>) -> Vec<FitSample> {
    let step = [sample(0.0, 0.0, 0.0, f64::INFINITY), sample(1e-9, 1.0, 0.0, f64::INFINITY)];
    let held = curve.map(|(t, modulus)| sample(t, 1.0, modulus, 1.0));
    step.into_iter().chain(held).collect()
}

/// NREL/pyvisco, `examples/time_user_master.csv`.
fn master_curve() -> Option<Vec<FitSample>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared/data/pyvisco_time_user_master.csv");
    if skip::lacks_file(&path) {
        return None;
    }
    let text = std::fs::read_to_string(&path).unwrap();
    let rows = text.lines().skip(2).map(|line| {
        let (t, modulus) = line.split_once(',').unwrap();
        (t.parse().unwrap(), modulus.parse().unwrap())
    });
    Some(relaxation(rows))
}

#[test]
fn the_published_series_is_reproduced() {
    let Some(samples) = master_curve() else {
        return;
    };
    let taus: Vec<f64> = (-2..29).map(|decade| 10f64.powi(decade)).collect();
    let family = Arc::new(Prony::of_terms(31).unwrap());
    let model = fit_coefficients(family, &taus, &[("curve", &samples)]).unwrap();
    let sum: f64 = model.linear.iter().sum();
    assert!((sum - PUBLISHED_SUM).abs() < 0.005, "{sum}");
    for (published, modulus) in PUBLISHED.iter().zip(&model.linear[1..]) {
        // All seven digits that were published.
        let share = modulus / sum;
        assert!((share / published - 1.0).abs() < 5e-7, "{share} {published}");
    }
    // Twenty-four times that are fitted leave less than thirty-one that were laid down.
    let mut options = FitOptions::by_key("prony-24").unwrap();
    options.fix("f_offset", 0.0).unwrap();
    let free = fit(&samples, &options).unwrap();
    assert!(free.rmse_n < 1.218, "{}", free.rmse_n);
}

#[test]
fn given_times_leave_a_linear_problem_with_bounds() {
    // 2 + 3 e^(-t) and a term in between that is not there.
    let times = || (1..200).map(|i| f64::from(i) * 0.05);
    let samples = relaxation(times().map(|t| (t, 2.0 + 3.0 * (-t).exp())));
    let family = Arc::new(Prony::of_terms(2).unwrap());
    let model = fit_coefficients(family.clone(), &[1.0, 10.0], &[("curve", &samples)]).unwrap();
    for (found, exact) in model.linear.iter().zip([2.0, 3.0, 0.0]) {
        // The step of 1 ns relaxes by half a billionth.
        assert!((found - exact).abs() < 1e-8, "{:?}", model.linear);
    }
    // A modulus that grows would need a negative term.
    let samples = relaxation(times().map(|t| (t, 2.0 - (-t).exp())));
    let model = fit_coefficients(family, &[1.0, 10.0], &[("curve", &samples)]).unwrap();
    assert_eq!(&model.linear[1..], [0.0, 0.0]);
    let mean = times().map(|t| 2.0 - (-t).exp()).sum::<f64>() / times().count() as f64;
    assert!((model.linear[0] / mean - 1.0).abs() < 1e-12);
}

#[test]
fn invalid_times_are_refused() {
    let samples = relaxation((1..9).map(|i| (f64::from(i), 1.0 / f64::from(i))));
    for bad in [0.0, -1.0, f64::NAN] {
        let refused =
            fit_coefficients(Arc::new(Maxwell), &[bad], &[("curve", &samples)]).unwrap_err();
        assert!(matches!(refused, FitError::Unsupported { .. }), "{refused}");
    }
    assert!(fit_coefficients(Arc::new(Maxwell), &[], &[("curve", &samples)]).is_err());
}
