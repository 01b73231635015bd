//! Recovery without a guess: the fit finds any body whose record can show it.
//!
//! Relaxation time log-uniform in 0.01..100 s, the other parameters log-uniform over two decades
//! around the thesis's with its signs; a ramp of 40 s to 30 mm, then a hold of five relaxation times
//! or 50 s, whichever is longer; 100 Hz, no noise. `PALPATE_RANDOM_BODIES=1000` draws a thousand
//! bodies instead of sixty, the first sixty the same.

use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_rheology::fit::{FitOptions, fit};
use palpate_test_support::record::{Noise, ramp_hold, respond};

/// What every parameter of every body is recovered to, relative. The worst body drawn moves its
/// parameters by 1e5 times a relative change of the force, and the force is rounded to 1e-16.
const EACH: f64 = 1e-9;
/// What at least [`MOST_SHARE`] of the bodies are recovered to.
const MOST: f64 = 1e-11;
/// Share of the bodies that reach [`MOST`]: the claim of the README.
const MOST_SHARE: f64 = 0.99;

fn body(seed: u64) -> ModifiedKelvin {
    let mut noise = Noise::seeded(seed);
    let mut around = |value: f64| value * 10f64.powf(2.0 * noise.uniform() - 1.0);
    let thesis = ModifiedKelvin::THESIS;
    let mu = thesis.mu.map(&mut around);
    let tau_sig = around(thesis.tau_sig);
    ModifiedKelvin { tau_eps: 10f64.powf(4.0 * noise.uniform() - 2.0), mu, tau_sig }
}

/// The largest relative error of the five parameters, or why there is none.
fn error_of(body: &ModifiedKelvin) -> Result<f64, String> {
    let hold = (5.0 * body.tau_eps).max(50.0);
    let record = respond(body, &ramp_hold(0.75, hold, 0.01));
    let found =
        fit(&record, &FitOptions::default()).map_err(|err| err.to_string())?.kelvin().unwrap();
    let pairs = [
        (found.tau_eps, body.tau_eps),
        (found.mu[0], body.mu[0]),
        (found.mu[1], body.mu[1]),
        (found.mu[2], body.mu[2]),
        (found.tau_sig, body.tau_sig),
    ];
    Ok(pairs.iter().map(|(found, exact)| (found / exact - 1.0).abs()).fold(0.0, f64::max))
}

#[test]
fn random_bodies_are_recovered_without_a_guess() {
    let count: u64 = match std::env::var("PALPATE_RANDOM_BODIES") {
        Ok(text) => text.parse().unwrap(),
        Err(_) => 60,
    };
    let mut errors: Vec<(f64, u64)> = Vec::new();
    let mut failures = Vec::new();
    for seed in 1..=count {
        let body = body(seed);
        match error_of(&body) {
            Ok(error) => {
                if error > MOST {
                    println!("seed {seed}: {error:.1e} {body:?}");
                }
                if error > EACH || error.is_nan() {
                    failures.push(format!("seed {seed}: error {error:.1e}, {body:?}"));
                }
                errors.push((error, seed));
            }
            Err(text) => failures.push(format!("seed {seed}: {text}, {body:?}")),
        }
    }
    errors.sort_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((worst, seed)) = errors.last() {
        let median = errors[errors.len() / 2].0;
        println!("{count} bodies: median error {median:.1e}, worst {worst:.1e} (seed {seed})");
    }
    assert!(failures.is_empty(), "{failures:#?}");
    let most = errors.iter().filter(|(error, _)| *error <= MOST).count();
    assert!(
        most as f64 >= MOST_SHARE * count as f64,
        "{most} of {count} bodies are within {MOST:e}"
    );
}
