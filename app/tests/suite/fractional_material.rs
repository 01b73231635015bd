//! `palpate material --family fractional`, against the closed forms of the exponent one half, which are written out here.

use crate::support::{answer, assert_refused, stdout, typed};
use crate::viscoelastic_material::{PUNCH, number, press_table};
use serde_json::Value;
use std::f64::consts::PI;

const EQUILIBRIUM_MPA: f64 = 0.02;
const RELAXING_MPA: f64 = 0.05;

/// `exp(x^2) erfc(x)`, which is `E_(1/2)(-x)`, by series or continued fraction (Abramowitz & Stegun, 7.1.6 and 7.1.14).
fn scaled_erfc(x: f64) -> f64 {
    if x < 2.0 {
        let (mut term, mut sum) = (x, x);
        for n in 1..80 {
            term *= 2.0 * x * x / f64::from(2 * n + 1);
            sum += term;
        }
        return (x * x).exp() - 2.0 / PI.sqrt() * sum;
    }
    let fraction = (1..200).rev().fold(x, |below, n| x + 0.5 * f64::from(n) / below);
    1.0 / (PI.sqrt() * fraction)
}

/// With the time of one second.
fn modulus(t: f64) -> f64 {
    EQUILIBRIUM_MPA + RELAXING_MPA * scaled_erfc(t.sqrt())
}

/// Of the modulus, from zero.
fn integral(t: f64) -> f64 {
    EQUILIBRIUM_MPA * t + RELAXING_MPA * (scaled_erfc(t.sqrt()) - 1.0 + 2.0 * (t / PI).sqrt())
}

#[test]
fn fractional_model_comes_back_from_ramps_short_and_long() {
    let at = tempfile::tempdir().unwrap();
    let instantaneous = EQUILIBRIUM_MPA + RELAXING_MPA;
    for ramp in [0.01, 0.1, 1.0, 3.0] {
        let relaxed = |t: f64, moved: f64| integral(t) - integral(t - moved);
        press_table(at.path(), "press.csv", [ramp, 60.0, 2e-4], relaxed);
        let line = format!("material press.csv --property relaxation {PUNCH} --family fractional");
        let found = answer(&typed(at.path(), &format!("{line} --json")));
        assert_eq!(found["family"], "fractional");
        let check = |name: &str, exact: f64| {
            let value = |part: &str| number(&found, &format!("{name}/{part}"));
            let off = (value("value") - exact).abs();
            assert!(off < 0.01 * exact, "{ramp} {name}: {found}");
            assert!(off < 4.5 * value("standard_uncertainty"), "{ramp} {name}: {found}");
        };
        check("/instantaneous_mpa", instantaneous);
        check("/equilibrium_mpa", EQUILIBRIUM_MPA);
        check("/terms/0/modulus_mpa", RELAXING_MPA);
        check("/terms/0/time_s", 1.0);
        check("/exponent", 0.5);
        // J of the same solid: its time is longer by the square of G(0) over the equilibrium.
        let retardation = (instantaneous / EQUILIBRIUM_MPA).powi(2);
        check("/creep/terms/0/time_s", retardation);
        for (index, row) in found["modulus"].as_array().unwrap().iter().enumerate() {
            let t = number(row, "/t_s");
            check(&format!("/modulus/{index}/mpa"), modulus(t));
            let crept = 1.0 / EQUILIBRIUM_MPA - 1.0 / instantaneous;
            let exact = 1.0 / EQUILIBRIUM_MPA - crept * scaled_erfc((t / retardation).sqrt());
            check(&format!("/creep/compliance/{index}/per_mpa"), exact);
        }
        assert!(found["term_choice"].is_null());
        let text = stdout(&typed(at.path(), &line));
        assert!(text.contains("of the fractional Zener model"), "{text}");
        assert!(text.contains("what is faster is extrapolated"), "{text}");
    }
}

#[test]
fn prony_series_of_a_fractional_record_has_no_exponent() {
    let at = tempfile::tempdir().unwrap();
    let relaxed = |t: f64, moved: f64| integral(t) - integral(t - moved);
    press_table(at.path(), "press.csv", [0.1, 5.0, 2e-4], relaxed);
    let line = format!("material press.csv --property relaxation {PUNCH} --family prony --json");
    let found = answer(&typed(at.path(), &line));
    assert_eq!(found["family"], "prony");
    assert_eq!(found["exponent"], Value::Null);
    assert!(found["term_choice"].is_object());
}

#[test]
fn what_is_no_fractional_model_is_refused_in_one_sentence() {
    let at = tempfile::tempdir().unwrap();
    let of_ramp = |t: f64, moved: f64| (-(t - moved)).exp() - (-t).exp();
    press_table(at.path(), "press.csv", [0.1, 20.0, 2e-4], |t, moved| {
        0.02 * moved + 0.05 * of_ramp(t, moved)
    });
    let relaxation = format!("material press.csv --property relaxation {PUNCH}");
    for (line, code, reason) in [
        (format!("{relaxation} --family fractional"), 1, "the exponent reaches 1"),
        (
            format!("{relaxation} --family fractional --terms 2"),
            2,
            "--terms belongs to --family prony",
        ),
        (
            format!("material press.csv {PUNCH} --family prony"),
            2,
            "--family belongs to a relaxation modulus",
        ),
    ] {
        assert_refused(&typed(at.path(), &line), code, reason);
    }
}
