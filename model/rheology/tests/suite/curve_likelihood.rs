//! The likelihood of a record away from its best fit.

use palpate_model::random::SplitMix;
use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
use palpate_model::{Depth, Newtons, Seconds};
use palpate_rheology::fit::{CurveLikelihood, FitError, FitOptions, FitSample, FitSolution, fit};

const NAMES: [&str; 2] = ["tau_eps", "mu1"];

/// The thesis body in a ramp and hold, with noise that lasts or not.
fn record(memory: f64) -> Vec<FitSample> {
    let mut random = SplitMix::seeded(11);
    let (mut state, mut noise) = (KelvinState::at_rest(), 0.0);
    (0..900)
        .map(|i| {
            let t = f64::from(i) * 0.1;
            let depth = Depth((0.75 * t).min(30.0));
            let dt = Seconds(if i == 0 { 0.0 } else { 0.1 });
            noise = memory * noise + 0.05 * random.normal();
            let force = Newtons(state.step(&ModifiedKelvin::THESIS, depth, dt).0 + noise);
            FitSample { t: Seconds(t), depth, force, sigma: Newtons(0.05) }
        })
        .collect()
}

#[test]
fn at_the_best_fit_it_is_the_fit() {
    for memory in [0.0, 0.8] {
        let samples = record(memory);
        let solution = FitSolution::of(&samples, &FitOptions::default()).unwrap();
        let report = solution.report();
        let mut likelihood = CurveLikelihood::of(&solution, 0, &NAMES).unwrap();
        let best = likelihood.best().to_vec();
        let found = likelihood.expand(&best).unwrap();
        for (k, name) in NAMES.iter().enumerate() {
            let own = report.parameter(name).unwrap();
            let error = own.std_error.unwrap() / own.value;
            // A hundredth of a standard error: what the last step of a fit may leave of its square.
            assert!((found.centre[k] - own.value.ln()).abs() < 1e-2 * error, "{found:?}");
            assert!((found.covariance[k][k].sqrt() / error - 1.0).abs() < 1e-3, "{error}");
        }
    }
}

/// Away from it, its slope is that of the sum of squares with the parameters fixed there, found by another fit.
#[test]
fn its_slope_is_that_of_fits_with_fixed_parameters() {
    let samples = record(0.0);
    let solution = FitSolution::of(&samples, &FitOptions::default()).unwrap();
    let report = solution.report();
    let mut likelihood = CurveLikelihood::of(&solution, 0, &NAMES).unwrap();
    let best = likelihood.best().to_vec();
    let at_best = likelihood.expand(&best).unwrap();
    let shifted = best.iter().zip(&at_best.covariance).enumerate();
    let at: Vec<f64> = shifted.map(|(k, (best, row))| best + 3.0 * row[k].sqrt()).collect();
    let found = likelihood.expand(&at).unwrap();
    let squares = |at: &[f64]| {
        let mut options = FitOptions::default();
        for (name, value) in NAMES.iter().zip(at) {
            options.fix(name, value.exp()).unwrap();
        }
        fit(&samples, &options).unwrap().rmse_n.powi(2) * samples.len() as f64
    };
    let spare = (samples.len() - report.free) as f64;
    let variance = report.rmse_n.powi(2) * samples.len() as f64 / spare;
    // The covariance times the slope of the logarithm of the likelihood is the step to the centre. Noise without memory is
    // still widened a little; that is the scale of the coordinates.
    let slope = |k: usize| {
        let shifted = |by: f64| {
            let mut other = at.clone();
            other[k] += by;
            squares(&other)
        };
        -(shifted(1e-5) - shifted(-1e-5)) / 2e-5 / (2.0 * variance)
    };
    let slopes = [slope(0), slope(1)];
    for ((centre, row), at) in found.centre.iter().zip(&found.covariance).zip(&at) {
        let step = centre - at;
        let expected: f64 = row.iter().zip(&slopes).map(|(share, slope)| share * slope).sum();
        assert!((step / expected - 1.0).abs() < 0.05, "{step} {expected}");
    }
}

#[test]
fn a_parameter_that_has_no_logarithm_is_refused() {
    let samples = record(0.0);
    let mut options = FitOptions::default();
    options.fix("mu1", 0.01).unwrap();
    let solution = FitSolution::of(&samples, &options).unwrap();
    let refused = CurveLikelihood::of(&solution, 0, &NAMES).unwrap_err();
    assert!(matches!(refused, FitError::NotFitted { .. }), "{refused}");
    let unknown = CurveLikelihood::of(&solution, 0, &["mu9"]).unwrap_err();
    assert!(matches!(unknown, FitError::UnknownParameter { .. }), "{unknown}");
}
