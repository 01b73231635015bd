//! Closed forms in many digits, and the file of quadratures.

use super::*;
use crate::families::{self, Model};
use dashu_float::DBig;
use std::str::FromStr;

const DIGITS: Digits = Digits::decimal(REFERENCE_DIGITS);

fn thesis(tau: f64) -> (Model, Vec<RelaxationTerm>) {
    let family = families::find_family("series-3").unwrap();
    let model = family.model(&[tau], &[0.05333, -0.0086, 0.000_434_5, 0.06]).unwrap();
    let terms = model.terms().unwrap();
    (model, terms)
}

/// How far the reference is from a number, relative to it.
fn miss(reference: &Reference, exact: &Big) -> f64 {
    nearest(&((reference.sum() - exact) / exact)).abs()
}

/// `F = P(t) - P(0) e^(-t/tau)`, `P = sum_k a_k sum_j (-tau)^j k!/(k-j)! t^(k-j)`, on a ramp from the
/// surface at speed `v`.
fn on_a_ramp(model: &Model, v: f64, t: f64) -> Big {
    let (tau, t, v) = (DIGITS.exact(model.outer[0]), DIGITS.exact(t), DIGITS.exact(v));
    let [mu1, mu2, mu3, sigma] = [0, 1, 2, 3].map(|k| DIGITS.exact(model.linear[k]));
    let a = [mu1 * &v + sigma * &v * &v, mu2 * &v * &v, mu3 * &v * &v * &v];
    let (mut now, mut start) = (DIGITS.zero(), DIGITS.zero());
    for (k, a) in (1..).zip(&a) {
        let mut factor = a.clone();
        for j in 0..=k {
            if j > 0 {
                factor = -(factor * &tau) * DIGITS.whole(k + 1 - j);
            }
            let power = (0..k - j).fold(DIGITS.whole(1), |power, _| power * &t);
            now += &factor * power;
            if j == k {
                start += &factor;
            }
        }
    }
    now - start * (-(t / tau)).exp()
}

#[test]
fn ramps_have_their_closed_form() {
    for tau in [1e-9, 1e-3, 0.3, 1.023, 40.0, 1e6, 1e9] {
        let (model, terms) = thesis(tau);
        // Ten steps of binary fractions, so that the path is the ramp to the last digit.
        for (v, dt) in [(0.75, 0.5), (1024.0, 0.0078125), (0.75, 64.0)] {
            let mut reference = Reference::new(&terms, Depth(0.0)).unwrap();
            for i in 1..=10 {
                let t = f64::from(i) * dt;
                reference.step(Depth(v * t), Seconds(dt)).unwrap();
                let exact = on_a_ramp(&model, v, t);
                // The closed form takes a force of order t / tau from terms of order (tau / t)^3.
                let allowed = 1e-72 * (tau / t).max(1.0).powi(4);
                let worst = miss(&reference, &exact);
                assert!(worst < allowed, "{tau} {v} {dt}: {worst:e}");
            }
        }
    }
}

#[test]
fn a_jump_relaxes_exponentially() {
    let (model, terms) = thesis(1.023);
    let mut reference = Reference::new(&terms, Depth(0.0)).unwrap();
    reference.step(Depth(10.0), Seconds(0.0)).unwrap();
    let [mu1, mu2, mu3, sigma] = [0, 1, 2, 3].map(|k| DIGITS.exact(model.linear[k]));
    let settled = mu1 * DIGITS.whole(10) + mu2 * DIGITS.whole(100) + mu3 * DIGITS.whole(1000);
    let tau = DIGITS.exact(1.023);
    let jump = sigma * DIGITS.whole(50) / &tau;
    assert!(miss(&reference, &jump) < 1e-70);
    reference.step(Depth(10.0), Seconds(2.0)).unwrap();
    let left = (-(DIGITS.whole(2) / tau)).exp();
    let exact = &settled + (jump - &settled) * left;
    assert!(miss(&reference, &exact) < 1e-70);
}

#[test]
fn agrees_with_the_file_of_quadratures() {
    // Corners of the path of `scripts/family_reference.py`, in s and mm.
    let corners: [(f64, f64); 7] =
        [(0.0, 0.0), (2.5, 10.0), (6.0, 10.0), (8.0, 4.0), (9.0, -2.0), (9.5, -2.0), (12.0, 8.0)];
    let numbers = |text: &str| -> Vec<f64> {
        let fields = text.split(',').filter(|field| !field.is_empty());
        fields.map(|field| field.parse().unwrap()).collect()
    };
    let mut seen = std::collections::BTreeSet::new();
    for line in include_str!("../../tests/data/family_reference.txt").lines() {
        let fields: Vec<&str> = line.split('/').map(str::trim).collect();
        // Families with a spectrum are what their quadrature makes of them, not exact.
        let exact_kinds = ["voigt", "maxwell", "kelvin", "series", "exponential", "prony"];
        if !exact_kinds.iter().any(|kind| fields[0].starts_with(kind)) {
            continue;
        }
        let family = families::find_family(fields[0]).unwrap();
        let model = family.model(&numbers(fields[1]), &numbers(fields[2]));
        let mut reference = Reference::new(&model.unwrap().terms().unwrap(), Depth(0.0)).unwrap();
        let until: f64 = fields[3].parse().unwrap();
        for pair in corners.windows(2) {
            let ((t0, x0), (t1, x1)) = (pair[0], pair[1]);
            let end = t1.min(until);
            if t0 < until {
                let depth = x0 + (x1 - x0) * (end - t0) / (t1 - t0);
                reference.step(Depth(depth), Seconds(end - t0)).unwrap();
            }
        }
        let exact = DBig::from_str(fields[4]).unwrap();
        let exact = exact.with_base_and_precision::<2>(DIGITS.bits()).value();
        let exact: Big = exact.with_rounding();
        let miss = nearest(&(reference.sum() - exact)).abs();
        // The file shows 25 digits of a few newtons. The coefficient of a Maxwell term's rate is a
        // product, rounded before it comes here.
        let is_rounded =
            ["maxwell", "kelvin", "prony"].iter().any(|kind| fields[0].starts_with(kind));
        let allowed = if is_rounded { 1e-15 } else { 1e-23 };
        assert!(miss < allowed, "{}: {miss:e}", fields[0]);
        seen.insert(fields[0].to_owned());
    }
    assert!(seen.len() >= 10, "{seen:?}");
}

#[test]
fn splitting_changes_nothing_and_what_has_no_force_is_refused() {
    let (_, terms) = thesis(0.7);
    let mut whole = Reference::new(&terms, Depth(-1.0)).unwrap();
    let mut split = whole.clone();
    whole.step(Depth(3.0), Seconds(1.0)).unwrap();
    for depth in [0.5, 2.25, 3.0].windows(2) {
        if depth[0] == 0.5 {
            split.step(Depth(0.5), Seconds(0.375)).unwrap();
        }
        let dt = Seconds((depth[1] - depth[0]) / 4.0);
        split.step(Depth(depth[1]), dt).unwrap();
    }
    assert!(miss(&split, &whole.sum()) < 1e-70);
    let force = whole.force();
    assert!(whole.error_of(force).abs() <= 1e-16 * force.0.abs());
    assert!(whole.error_of(Newtons(force.0 + 0.5)) > 0.499);

    assert!(whole.step(Depth(f64::NAN), Seconds(1.0)).is_err());
    assert!(whole.step(Depth(1.0), Seconds(-1.0)).is_err());
    assert_eq!(whole.force(), force);
    assert!(Reference::with_digits(&terms, Depth(0.0), 5).is_err());
    // 0.1 x (1 - x / x_max) of a spring: nothing on first loading, 0.1 * 3 * (1 - 3/8) coming back.
    let softens = RelaxationTerm::spring(DepthDrive::softening(1, 0.1));
    let mut softens = Reference::new(&[softens], Depth(0.0)).unwrap();
    assert_eq!(softens.step(Depth(8.0), Seconds(1.0)).unwrap().0, 0.0);
    let back = softens.step(Depth(3.0), Seconds(1.0)).unwrap().0;
    assert!((back - 0.1875).abs() < 1e-16, "{back}");
    let dashpot = RelaxationTerm {
        tau: 0.0,
        elastic: DepthDrive::default(),
        rate: DepthDrive::power(1, 1.0),
    };
    let mut dashpot = Reference::new(&[dashpot], Depth(0.0)).unwrap();
    assert!(dashpot.step(Depth(1.0), Seconds(0.0)).is_err());
}
