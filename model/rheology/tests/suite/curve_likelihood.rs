//! The likelihood of a record away from its best fit.

use palpate_model::random::SplitMix;
use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
use palpate_model::{Depth, Newtons, Seconds};
use palpate_rheology::fit::{
    CurveLikelihood, FitError, FitOptions, FitSample, FitSolution, LogarithmStatistics, fit,
};

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
        let likelihood = CurveLikelihood::of(&solution, 0, &NAMES).unwrap();
        let found = likelihood.expand(likelihood.best()).unwrap();
        for (k, name) in NAMES.iter().enumerate() {
            let own = report.parameter(name).unwrap();
            let error = own.std_error.unwrap() / own.value;
            // A hundredth of a standard error: what the last step of a fit may leave of its square.
            assert!((found.centre[k] - own.value.ln()).abs() < 1e-2 * error, "{found:?}");
            assert!((found.covariance[k][k].sqrt() / error - 1.0).abs() < 1e-3, "{error}");
        }
    }
}

/// Away from it, its slope is that of the sum of squares with the parameters fixed there, found by another fit; the distance
/// counts in shares of how much wider the intervals of the fit are than the curvature of that sum says.
#[test]
fn its_slope_is_that_of_fits_with_fixed_parameters() {
    // By how much the slope may differ: the widening is taken here from the curvature of the sum of squares, and by the fit from
    // its slopes. Residuals that last bend the sum of squares by a tenth; the difference is the same near the best fit and far
    // from it.
    for (memory, tolerance) in [(0.0, 0.05), (0.8, 0.16)] {
        check_slope(&record(memory), tolerance);
    }
}

fn check_slope(samples: &[FitSample], tolerance: f64) {
    let solution = FitSolution::of(samples, &FitOptions::default()).unwrap();
    let report = solution.report();
    let likelihood = CurveLikelihood::of(&solution, 0, &NAMES).unwrap();
    let best = likelihood.best();
    let variance =
        report.rmse_n.powi(2) * samples.len() as f64 / (samples.len() - report.free) as f64;
    // Half of the sum of squares over the variance: minus the logarithm of the likelihood of independent noise.
    let criterion = |at: [f64; 2]| {
        let mut options = FitOptions::default();
        for (name, value) in NAMES.iter().zip(at) {
            options.fix(name, value.exp()).unwrap();
        }
        let squares = fit(samples, &options).unwrap().rmse_n.powi(2) * samples.len() as f64;
        0.5 * squares / variance
    };
    let errors = NAMES.map(|name| {
        let own = report.parameter(name).unwrap();
        own.std_error.unwrap() / own.value
    });
    let moved = |from: [f64; 2], by: [f64; 2]| criterion([from[0] + by[0], from[1] + by[1]]);
    let (middle, [a, b]) = ([best[0], best[1]], errors.map(|error| 0.1 * error));
    let lowest = criterion(middle);
    let curvature =
        |step: [f64; 2]| moved(middle, step) + moved(middle, step.map(|by| -by)) - 2.0 * lowest;
    let (aa, bb) = (curvature([a, 0.0]) / (a * a), curvature([0.0, b]) / (b * b));
    let ab = (curvature([a, b]) - curvature([a, -b])) / (4.0 * a * b);
    let determinant = aa * bb - ab * ab;
    let independent = [(bb / determinant).sqrt(), (aa / determinant).sqrt()];
    let widening = [errors[0] / independent[0], errors[1] / independent[1]];

    let inside = [middle[0] + 3.0 * independent[0], middle[1] + 3.0 * independent[1]];
    let at = [0, 1].map(|k| middle[k] + (inside[k] - middle[k]) * widening[k]);
    let found = likelihood.expand(&at).unwrap();
    let step = 1e-3;
    let slope = |by: [f64; 2]| {
        let [up, down] = [by, by.map(|by| -by)].map(|by| moved(inside, by));
        -(up - down) / (2.0 * step)
    };
    let slopes = [slope([step, 0.0]) / widening[0], slope([0.0, step]) / widening[1]];
    // The covariance times the slope of the logarithm of the likelihood is the step to the centre.
    for ((centre, row), at) in found.centre.iter().zip(&found.covariance).zip(at) {
        let expected: f64 = row.iter().zip(&slopes).map(|(share, slope)| share * slope).sum();
        assert!(((centre - at) / expected - 1.0).abs() < tolerance, "{} {expected}", centre - at);
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

/// Stored statistics give what the fit itself gives of any parameters, also after they were written and read; the standard
/// errors of the report are those of values and not of logarithms.
#[test]
fn statistics_of_a_fit_are_its_likelihood_at_the_best_values() {
    for memory in [0.0, 0.8] {
        let samples = record(memory);
        let mut options = FitOptions::default();
        options.fix("mu2", ModifiedKelvin::THESIS.mu[1]).unwrap();
        let solution = FitSolution::of(&samples, &options).unwrap();
        let text = serde_json::to_string(&LogarithmStatistics::of(&solution, 0)).unwrap();
        let stored: LogarithmStatistics = serde_json::from_str(&text).unwrap();
        let report = solution.report();
        for names in [&["tau_eps", "mu1", "mu3", "tau_sig"][..], &["mu3", "tau_eps"], &["mu1"]] {
            let own: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
            let found = stored.of_parameters(&own).unwrap();
            let likelihood = CurveLikelihood::of(&solution, 0, names).unwrap();
            let expected = likelihood.expand_at_best().unwrap();
            for (k, name) in names.iter().enumerate() {
                let parameter = report.parameter(name).unwrap();
                let error = parameter.std_error.unwrap() / parameter.value;
                // Rounding, which the decomposition of the record multiplies by its condition.
                assert!((found.centre[k] - expected.centre[k]).abs() < 1e-9 * error, "{name}");
                let own = found.covariance[k][k].sqrt();
                // The errors of the report are those before the last step of the fit.
                assert!((own / error - 1.0).abs() < 1e-2, "{name}: {own} {error}");
                for (one, other) in found.covariance[k].iter().zip(&expected.covariance[k]) {
                    assert!((one / other - 1.0).abs() < 1e-9, "{name}: {one} {other}");
                }
            }
        }
        let refused = stored.of_parameters(&["mu2".to_owned()]).unwrap_err();
        assert!(refused.starts_with("mu2 is fixed"), "{refused}");
        let unknown = stored.of_parameters(&["mu9".to_owned()]).unwrap_err();
        assert!(unknown.contains("'mu9'"), "{unknown}");
    }
}
