//! The Maxwell fit against closed forms and a published example.

#[path = "../../examples/maxwell_fit/mod.rs"]
mod maxwell_fit;

use maxwell_fit::{Integrator, Maxwell, StrainSample, fit_maxwell};
use palpate_model::{Depth, Newtons, Seconds};
use palpate_rheology::families;
use palpate_rheology::fit::{FitError, FitOptions, FitSample, fit};
use palpate_test_support::record::Noise;
use palpate_test_support::skip;
use std::path::Path;
use std::sync::Arc;

const BODY: Maxwell = Maxwell { eta: 4.1, k: 2.05 };

/// The closed-form stress of a ramp at strain 1 per s up to `turn` s and a hold.
fn record(body: Maxwell, turn: f64, times: impl Iterator<Item = f64>) -> Vec<StrainSample> {
    let tau = body.tau().0;
    times
        .map(|t| {
            let ramp = t.min(turn);
            let stress = -body.eta * (-ramp / tau).exp_m1() * (-(t - ramp) / tau).exp();
            StrainSample { t: Seconds(t), strain: ramp, stress }
        })
        .collect()
}

fn even() -> impl Iterator<Item = f64> {
    (0..=100).map(|i| f64::from(i) * 0.1)
}

/// RHEOS.jl, `docs/src/assets/example1_data.csv`: t, strain, stress without a header.
fn rheos_example() -> Option<Vec<StrainSample>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../../shared/data/rheos_example1_ramp_hold.csv");
    if skip::lacks_file(&path) {
        return None;
    }
    let text = std::fs::read_to_string(&path).unwrap();
    let samples = text.lines().map(|line| {
        let mut fields = line.split(',').map(|field| field.trim().parse().unwrap());
        let mut next = || fields.next().unwrap();
        StrainSample { t: Seconds(next()), strain: next(), stress: next() }
    });
    Some(samples.collect())
}

#[track_caller]
fn check(value: f64, exact: f64, relative: f64) {
    assert!((value / exact - 1.0).abs() < relative, "{value} is not {exact}");
}

#[test]
fn rheos_example_gives_the_published_and_the_exact_values() {
    let Some(samples) = rheos_example() else {
        return;
    };
    let published = fit_maxwell(&samples, Integrator::BackwardDifference).unwrap();
    let exact = fit_maxwell(&samples, Integrator::Exact).unwrap();
    println!("backward difference {published:?}\nexact {exact:?}");
    // Printed by the tool's own page, where its search had stopped within 2e-5 of its optimum,
    // 4.005407 and 2.002973 to the digits given.
    check(published.body.eta, 4.005_401_7, 2e-5);
    check(published.body.k, 2.003_000_0, 2e-5);
    check(published.body.eta, 4.005_407, 2e-7);
    check(published.body.k, 2.002_973, 2e-7);
    // Six digits of the exact solution.
    check(exact.body.eta, 4.106_39, 2e-6);
    check(exact.body.k, 2.053_47, 2e-6);
    // The two describe the stress equally well, and differ by r / (1 - e^-r).
    check(exact.residual_sum, 0.022_31, 1e-3);
    check(published.residual_sum, exact.residual_sum, 1e-9);
    let r = 0.1 / exact.body.tau().0;
    let factor = r / -(-r).exp_m1();
    check(factor, 1.025_21, 5e-6);
    // Equal factors because strain turns at samples only; bisection leaves 1e-14.
    check(exact.body.eta / published.body.eta, factor, 1e-10);
    check(exact.body.k / published.body.k, factor, 1e-10);
    // So does the family, whose search knows nothing of this body: the sum of squares is flat to
    // rounding within 1e-8 of its floor.
    let rows: Vec<FitSample> = samples
        .iter()
        .map(|sample| FitSample {
            t: sample.t,
            depth: Depth(sample.strain),
            force: Newtons(sample.stress),
            sigma: Newtons(1.0),
        })
        .collect();
    let mut options = FitOptions::of(Arc::new(families::Maxwell)).at_rest();
    options.fix("f_offset", 0.0).unwrap();
    let family = fit(&rows, &options).unwrap();
    check(family.body.linear[0], exact.body.k, 1e-7);
    check(family.body.outer[0], exact.body.tau().0, 1e-7);
}

#[test]
fn closed_forms_are_recovered_exactly_and_backward_differences_are_not() {
    // The slope of the sum of squares has a relative rounding of 1e-16 on about 100 terms, and the
    // response to tau is of order one: 1e-13 leaves an order to spare.
    let mut noise = Noise::seeded(4);
    let uneven: Vec<f64> =
        std::iter::successors(Some(0.0), |t| Some(t + 0.02 + 0.2 * noise.uniform()))
            .take_while(|t| *t < 2.0)
            .collect();
    let uneven = uneven.into_iter().chain((0..80).map(|i| 2.0 + 0.1 * f64::from(i)));
    for (eta, k) in [(4.1, 2.05), (0.8, 2.0), (60.0, 3.0)] {
        let body = Maxwell { eta, k };
        for samples in [record(body, 2.0, even()), record(body, 2.0, uneven.clone())] {
            let fit = fit_maxwell(&samples, Integrator::Exact).unwrap();
            check(fit.body.eta, eta, 1e-13);
            check(fit.body.k, k, 1e-13);
        }
        let fit = fit_maxwell(&record(body, 2.0, even()), Integrator::BackwardDifference).unwrap();
        let r = 0.1 * k / eta;
        let factor = r / -(-r).exp_m1();
        check(fit.body.eta * factor, eta, 1e-12);
        check(fit.body.k * factor, k, 1e-12);
    }
}

#[test]
fn standard_errors_mean_what_they_say() {
    let clean = record(BODY, 2.0, even());
    let mut chi_square = [0.0; 2];
    for seed in 0..200 {
        let mut noise = Noise::seeded(1000 + seed);
        let noisy: Vec<StrainSample> = clean
            .iter()
            .map(|sample| StrainSample { stress: sample.stress + 0.02 * noise.normal(), ..*sample })
            .collect();
        let fit = fit_maxwell(&noisy, Integrator::Exact).unwrap();
        chi_square[0] += ((fit.body.eta - BODY.eta) / fit.eta_std_error).powi(2);
        chi_square[1] += ((fit.body.k - BODY.k) / fit.k_std_error).powi(2);
    }
    println!("chi-square of 200 draws {chi_square:.1?}");
    // 0.01 % and 99.99 % points of chi-square with 200 degrees of freedom.
    for value in chi_square {
        assert!((132.4..284.9).contains(&value), "{value}");
    }
}

#[test]
fn what_a_record_cannot_show_is_refused_in_words() {
    let refusal =
        |samples: &[StrainSample]| fit_maxwell(samples, Integrator::Exact).unwrap_err().to_string();
    let mut still = record(BODY, 2.0, even());
    still.iter_mut().for_each(|sample| sample.strain = 1.0);
    assert!(refusal(&still).contains("strain never changes"), "{}", refusal(&still));
    let elastic = Maxwell { eta: 2e6, k: 2.0 };
    let text = refusal(&record(elastic, 2.0, even()));
    assert!(text.contains("longer hold"), "{text}");
    let viscous = Maxwell { eta: 4.0, k: 4e6 };
    let text = refusal(&record(viscous, 2.0, even()));
    assert!(text.contains("sample faster"), "{text}");
    let mut twice = record(BODY, 2.0, even());
    twice[7].t = twice[6].t;
    assert!(refusal(&twice).contains("times must increase"));
    twice[3].stress = f64::NAN;
    assert!(refusal(&twice).contains("sample 3"));
    assert!(matches!(
        fit_maxwell(&twice[..2], Integrator::Exact),
        Err(FitError::TooFewSamples { .. })
    ));
}
