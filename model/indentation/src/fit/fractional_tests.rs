use super::tests::{CONE, PUNCH, SPHERE, TEST, Test};
use super::*;

const FRACTIONAL: RelaxationFamily = RelaxationFamily::Fractional;

fn body(exponent: f64) -> RelaxationModulus {
    let terms = vec![RelaxationMode { modulus_mpa: 0.05, time_secs: 1.0 }];
    RelaxationModulus { equilibrium_mpa: 0.02, terms, exponent }
}

/// The instantaneous and the equilibrium modulus, the time and the exponent.
fn numbers(modulus: &RelaxationModulus) -> [f64; 4] {
    let RelaxationMode { modulus_mpa, time_secs } = modulus.terms[0];
    [modulus.equilibrium_mpa + modulus_mpa, modulus.equilibrium_mpa, time_secs, modulus.exponent]
}

#[test]
fn fractional_model_is_found_from_ramps_short_and_long_against_its_time() {
    let mut worst = 0.0f64;
    for (shape, exponent) in [(PUNCH, 0.5), (SPHERE, 0.7), (CONE, 0.9), (PUNCH, 0.7)] {
        for ramp in [0.01, 0.1, 1.0, 3.0] {
            let test = Test { shape, ramp, ..TEST };
            let fit = test.fit_family(&body(exponent), FRACTIONAL).unwrap();
            for (found, exact) in numbers(&fit.modulus).into_iter().zip(numbers(&body(exponent))) {
                worst = worst.max((found / exact - 1.0).abs());
            }
            for t in [0.01, 0.1, 1.0, 10.0, 60.0] {
                let off = (fit.modulus.modulus(t) / body(exponent).modulus(t) - 1.0).abs();
                assert!(off < 2e-3, "{exponent} {ramp} {t}: {off:e}");
            }
        }
    }
    println!("off: {worst:e}");
    assert!(worst < 0.01, "{worst}");
}

#[test]
fn fractional_record_without_noise_gives_the_body_back() {
    for exponent in [0.25, 0.95] {
        let test = Test { noise: 0.0, ramp: 0.3, hold: 20.0, ..TEST };
        let fit = test.fit_family(&body(exponent), FRACTIONAL).unwrap();
        for (found, exact) in numbers(&fit.modulus).into_iter().zip(numbers(&body(exponent))) {
            assert!((found / exact - 1.0).abs() < 1e-6, "{found} {exact}");
        }
    }
}

/// Over many records the squares of the errors over their standard errors are one on average.
#[test]
fn standard_errors_of_a_fractional_model_are_the_spread_of_the_fits() {
    let (draws, exact) = (60, body(0.6));
    let mut squares = [0.0; 4];
    for seed in 1..=draws {
        let test = Test { shape: PUNCH, seed, ..TEST };
        let fit = test.fit_family(&exact, FRACTIONAL).unwrap();
        // The instantaneous modulus is the sum of both.
        let of_instantaneous = fit.standard_error_along(&[1.0, 1.0, 0.0, 0.0]);
        let [_, of_equilibrium, of_time, of_exponent] = numbers(&fit.standard_errors);
        let errors = [of_instantaneous, of_equilibrium, of_time, of_exponent];
        let both = numbers(&fit.modulus).into_iter().zip(numbers(&exact)).zip(errors);
        for (sum, ((found, exact), error)) in squares.iter_mut().zip(both) {
            *sum += ((found - exact) / error).powi(2) / draws as f64;
        }
    }
    // Of 60 squares the mean has the standard deviation 0.18.
    println!("squares: {squares:?}");
    assert!(squares.iter().all(|mean| (0.45..1.55).contains(mean)), "{squares:?}");
}

#[test]
fn what_is_no_fractional_relaxation_is_refused_in_one_sentence() {
    let refusal = |test: Test, body: &RelaxationModulus| {
        test.fit_family(body, FRACTIONAL).unwrap_err().to_string()
    };
    // Exponentials relax faster at the end.
    let steep = refusal(TEST, &body(1.0));
    assert!(steep.contains("the exponent reaches 1"), "{steep}");
    let noisy = refusal(Test { noise: 0.1, hold: 5.0, ..TEST }, &body(0.6));
    assert!(noisy.contains("not identifiable in this record"), "{noisy}");
    assert!(noisy.contains("a Prony series, a faster ramp"), "{noisy}");
    let slow = refusal(Test { ramp: 30.0, ..TEST }, &body(0.7));
    assert!(slow.contains("behind a ramp of 2.940e1 s"), "{slow}");
    assert!(slow.ends_with("or take a Prony series"), "{slow}");
}

/// A fit again of forces with an error says what the error does.
#[test]
fn small_errors_of_force_move_a_fractional_fit_by_as_much_as_a_fit_of_them() {
    let test = Test { ramp: 0.3, hold: 20.0, noise: 1e-4, shape: CONE, ..TEST };
    let (law, history, forces) = test.record(&body(0.6));
    let fit = fit_relaxation(law, &history, &forces, FRACTIONAL).unwrap();
    let largest = forces.iter().copied().fold(0.0, f64::max);
    let error = |force: &f64| 1e-4 * force * (force / largest - 0.3);
    let errors: Vec<f64> = forces.iter().map(error).collect();
    let moved: Vec<f64> = forces.iter().zip(&errors).map(|(force, error)| force + error).collect();
    let again = fit_relaxation(law, &history, &moved, FRACTIONAL).unwrap();
    let number = |fit: &RelaxationFit| {
        let [instantaneous, equilibrium, time, exponent] = numbers(&fit.modulus);
        [instantaneous - equilibrium, equilibrium, time.ln(), exponent.ln()]
    };
    let changes =
        number(&again).into_iter().zip(number(&fit)).map(|(after, before)| after - before);
    for (shift, change) in fit.shift_by(&errors).into_iter().zip(changes) {
        assert!((shift / change - 1.0).abs() < 0.02, "{shift:e} {change:e}");
    }
}
