//! The columns against differences, single steps and each other.

use super::*;
use palpate_model::units::{Depth, Newtons, Seconds};

const AT: Coefficients = [0.7, -0.4, 0.3, 1.1, 0.2, 0.1];

fn sample(t: f64, depth: f64) -> FitSample {
    FitSample { t: Seconds(t), depth: Depth(depth), force: Newtons(0.0), sigma: Newtons(1.0) }
}

/// A path in and out of contact with uneven steps, then 200 even ones.
fn path() -> Vec<FitSample> {
    let corners =
        [(-0.2, 0.0), (0.5, 1.0), (0.5, 0.3), (0.9, 0.31), (0.9, 2.0), (-0.2, 0.7), (0.4, 0.8)];
    let mut samples = vec![sample(0.0, corners[0].0)];
    let (mut t, mut x) = (0.0, corners[0].0);
    for (to, span) in &corners[1..] {
        for part in 1..=4 {
            let share = f64::from(part) / 4.0;
            samples.push(sample(t + span * share, x + (to - x) * share));
        }
        (t, x) = (t + span, *to);
    }
    for i in 1..=200 {
        samples.push(sample(t + 0.01 * f64::from(i), x + 0.002 * f64::from(i)));
    }
    samples
}

/// Modelled force and its two derivatives at every sample.
fn force(tau: f64, contact: f64) -> Vec<[f64; 3]> {
    let scale = Scale { depth_mm: 1.0, contact };
    let mut all = Vec::new();
    walk::<true>(&path(), scale, tau, |samples, rows| {
        let mut columns = [[0.0; LANES]; 6];
        rows.values(&mut columns);
        let (tau_slope, contact_slope) = (rows.tau_slope(&AT, tau), rows.contact_slope(&AT));
        for i in 0..samples.len() {
            let force = columns.iter().zip(AT).map(|(c, a)| c[i] * a).sum();
            all.push([force, tau_slope[i], contact_slope[i]]);
        }
    });
    all
}

fn check(high: &[[f64; 3]], low: &[[f64; 3]], h: f64, here: &[[f64; 3]], which: usize) {
    for ((high, low), here) in high.iter().zip(low).zip(here) {
        let numerical = (high[0] - low[0]) / (2.0 * h);
        let exact = here[which];
        // Differences over 1e-5 or less keep about ten digits of forces of order one.
        let miss = (numerical - exact).abs();
        assert!(miss < 1e-9 * exact.abs().max(0.1), "{numerical} {exact}");
    }
}

#[test]
fn derivative_by_log_tau_is_exact() {
    for tau in [0.02, 0.4, 1.0, 30.0] {
        let h = 1e-5f64;
        let (high, low) = (force(tau * h.exp(), 0.1), force(tau * (-h).exp(), 0.1));
        check(&high, &low, h, &force(tau, 0.1), 1);
    }
}

#[test]
fn derivative_by_contact_is_exact() {
    for tau in [0.2, 1.0, 30.0] {
        // No sample lies within h of the contact, where the derivative has a kink.
        let h = 2e-6;
        let (high, low) = (force(tau, 0.11 + h), force(tau, 0.11 - h));
        check(&high, &low, h, &force(tau, 0.11), 2);
    }
}

#[test]
fn blocks_agree_with_single_steps() {
    let samples = path();
    let scale = Scale { depth_mm: 1.0, contact: 0.0 };
    let mut single = Columns::<true>::new(0.3, scale.depth(&samples[0]));
    let mut before = samples[0].t.0;
    let mut index = 0;
    walk::<true>(&samples, scale, 0.3, |block, rows| {
        for (i, sample) in block.iter().enumerate() {
            if index > 0 {
                single.advance(scale.depth(sample), sample.t.0 - before);
            }
            before = sample.t.0;
            index += 1;
            let row = single.row();
            for (lane, exact) in rows.filtered.iter().zip(row) {
                assert!((lane[i] - exact).abs() < 1e-15, "{} {exact}", lane[i]);
            }
            assert!((rows.decay[i] - row[4]).abs() < 1e-15);
            let miss = rows.tau_slopes[3][i] - single.tau_slopes[3];
            assert!(miss.abs() < 1e-14, "{miss}");
        }
    });
    assert_eq!(index, samples.len());
}

#[test]
fn nearly_equal_steps_are_corrected() {
    let mut exact = Columns::<true>::new(0.5, 0.0);
    let mut jittered = Columns::<true>::new(0.5, 0.0);
    let mut t = 0.0;
    for i in 1..=1000 {
        let next = f64::from(i) * 1e-3 * (1.0 + 4e-9 * f64::from(i % 7));
        jittered.advance(next, next - t);
        t = next;
    }
    exact.advance(t, t);
    for (one, other) in exact.row().into_iter().zip(jittered.row()) {
        assert!((one - other).abs() < 1e-14, "{one} {other}");
    }
}

#[test]
fn legendre_terms_and_powers_map_both_ways() {
    let [p1, p2, p3] = powers_from_legendre(&AT);
    let back = legendre_from_powers(&[p1, p2, p3, AT[3], AT[4], AT[5]]);
    for (one, other) in back.into_iter().zip(AT) {
        assert!((one - other).abs() < 1e-15);
    }
}
