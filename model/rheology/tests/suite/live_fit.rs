//! The live fit agrees with the exact one, sees what it cannot know, and never grows.

use palpate_model::estimate::LiveEstimate;
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_model::{Depth, Newtons, Seconds};
use palpate_rheology::fit::{FitOptions, FitSample, LiveFit, fit};
use palpate_test_support::record::{self, ramp_hold, respond, with_white_noise};

const BODY: [&str; 5] = ["tau_eps", "mu1", "mu2", "mu3", "tau_sig"];

fn live_of(samples: &[FitSample]) -> LiveFit {
    let mut live = LiveFit::new(Depth(30.0));
    for sample in samples {
        live.push(sample.t, sample.depth, sample.force, sample.sigma);
    }
    live
}

fn value(estimate: &LiveEstimate, name: &str) -> f64 {
    let mut parameters = estimate.parameters.iter();
    parameters.find(|found| found.name == name).unwrap().value
}

fn thesis_record() -> Vec<FitSample> {
    respond(&ModifiedKelvin::THESIS, &ramp_hold(0.75, 50.0, 1e-3))
}

/// Largest relative distance of the live body from the exact fit of the same samples.
fn worst_miss(samples: &[FitSample]) -> f64 {
    let live = live_of(samples).estimate().unwrap();
    let exact = fit(samples, &FitOptions::default()).unwrap();
    let miss = |name| (value(&live, name) / exact.value(name).unwrap() - 1.0).abs();
    BODY.into_iter().map(miss).fold(0.0, f64::max)
}

#[test]
fn last_answer_is_the_exact_one_without_noise() {
    let worst = worst_miss(&thesis_record());
    println!("worst relative distance {worst:.1e}");
    // Polynomials through sixteen nodes 0.18 apart leave 4e-9.
    assert!(worst < 1e-7, "{worst:e}");
}

#[test]
fn other_bodies_too_are_the_exact_ones_without_noise() {
    for tau_eps in [0.1, 0.37, 3.0, 10.0, 40.0] {
        let body = ModifiedKelvin { tau_eps, ..ModifiedKelvin::THESIS };
        let worst = worst_miss(&respond(&body, &ramp_hold(0.75, 50.0, 5e-3)));
        println!("tau {tau_eps} s: {worst:.1e}");
        assert!(worst < 1e-6, "tau {tau_eps} s: {worst:e}");
    }
}

#[test]
fn last_answer_is_within_a_hundredth_of_a_standard_error_with_noise() {
    for seed in 1..=3 {
        let record = with_white_noise(&thesis_record(), seed);
        let live = live_of(&record).estimate().unwrap();
        let exact = fit(&record, &FitOptions::default()).unwrap();
        for parameter in &live.parameters {
            let same = exact.parameter(&parameter.name).unwrap();
            let error = same.std_error.unwrap();
            let miss = (parameter.value - same.value).abs() / error;
            assert!(miss < 0.01, "{}: {miss} standard errors", parameter.name);
            // Curvature of the projected problem against the joint Jacobian: they differ by the
            // noise in the second derivatives, here under a percent.
            let ratio = parameter.std_error.unwrap() / error;
            assert!((ratio - 1.0).abs() < 0.01, "{}: {ratio}", parameter.name);
        }
    }
}

#[test]
fn crossings_of_the_surface_are_cut_where_they_are() {
    // In, out by 4 mm, in again deeper; 13 ms steps, so that no crossing is at a sample.
    let path: Vec<(f64, f64)> = (0..4000)
        .map(|i| {
            let t = f64::from(i) * 0.013;
            let depth = match t {
                t if t < 12.0 => -1.0 + 1.3 * t,
                t if t < 20.0 => 14.6 - 2.3 * (t - 12.0),
                t if t < 40.0 => -3.8 + 1.7 * (t - 20.0),
                _ => 30.2,
            };
            (t, depth)
        })
        .collect();
    let worst = worst_miss(&respond(&ModifiedKelvin::THESIS, &path));
    assert!(worst < 1e-7, "{worst:e}");
}

#[test]
fn depth_of_a_censored_sample_counts_and_its_force_does_not() {
    let mut record = thesis_record();
    for sample in &mut record[20_000..25_000] {
        sample.sigma = Newtons(f64::INFINITY);
        sample.force = Newtons(f64::NAN);
    }
    let live = live_of(&record).estimate().unwrap();
    assert_eq!(live.samples, 85_001);
    for (name, exact) in BODY.into_iter().zip([1.023, 0.053_33, -0.0086, 0.000_434_5, 0.06]) {
        let miss = (value(&live, name) / exact - 1.0).abs();
        assert!(miss < 1e-7, "{name}: {miss:e}");
    }
}

#[test]
fn uneven_times_and_gaps_are_no_obstacle() {
    let mut noise = record::Noise::seeded(5);
    let mut t = 0.0;
    let mut path = vec![(t, 0.0)];
    while t < 90.0 {
        t += match noise.uniform() {
            share if share < 0.01 => 0.4,
            share if share < 0.5 => 0.01,
            share => 0.01 + 0.01 * share,
        };
        path.push((t, (0.75 * t).min(30.0)));
    }
    let worst = worst_miss(&respond(&ModifiedKelvin::THESIS, &path));
    assert!(worst < 1e-7, "{worst:e}");
}

#[test]
fn ramp_reports_unidentified_parameters_and_hold_identifies_all() {
    let clean = thesis_record();
    let mut noise = record::Noise::seeded(7);
    let stairs: Vec<FitSample> = clean
        .iter()
        .map(|sample| FitSample {
            depth: Depth((sample.depth.0 / 0.015).floor() * 0.015),
            ..*sample
        })
        .collect();
    let shaken: Vec<FitSample> = clean
        .iter()
        .map(|sample| FitSample {
            depth: Depth(sample.depth.0 + 0.002 * noise.normal()),
            ..*sample
        })
        .collect();
    for record in [clean, stairs, shaken].map(|record| with_white_noise(&record, 11)) {
        for end in [10_000, 25_000, 40_000] {
            let live = live_of(&record[..end]).estimate().unwrap();
            for name in ["mu1", "tau_sig"] {
                let verdict = live.verdicts.iter().find(|found| found.parameter == name);
                let reason = verdict.unwrap().reason.clone().unwrap();
                assert!(reason.contains("one speed"), "{end}: {reason}");
                assert_eq!(live.identified_parameter(name), None);
            }
        }
        let live = live_of(&record).estimate().unwrap();
        for verdict in &live.verdicts {
            assert!(verdict.is_identified, "{verdict:?}");
        }
        assert!(live.parameters.iter().all(|found| found.std_error.is_some()));
    }
}

#[test]
fn live_fit_has_no_estimate_before_enough_samples() {
    let mut live = LiveFit::new(Depth(30.0));
    assert_eq!(live.estimate(), None);
    for i in 0..1000 {
        let t = Seconds(f64::from(i) * 1e-3);
        live.push(t, Depth(-1.0), Newtons(0.0), Newtons(0.02));
        if i % 100 == 0 {
            assert_eq!(live.estimate(), None);
        }
    }
    // From the first sample in the tissue on, answers come without a panic and without a number
    // that is not one.
    for (i, sample) in with_white_noise(&thesis_record()[..3000], 2).iter().enumerate() {
        let t = Seconds(sample.t.0 + 1.0);
        live.push(t, sample.depth, sample.force, sample.sigma);
        if i % 37 == 0
            && let Some(estimate) = live.estimate()
        {
            assert!(estimate.parameters.iter().all(|found| found.value.is_finite()));
        }
    }
}

#[test]
fn answers_know_of_every_sample() {
    // Samples wait in batches; answers must not depend on where a batch ends.
    let record = with_white_noise(&thesis_record()[..60_040], 3);
    for end in 60_000..60_040 {
        let live = live_of(&record[..end]).estimate().unwrap();
        assert_eq!(live.samples, end as u64);
        let again = live_of(&record[..end]).estimate().unwrap();
        assert_eq!(live, again);
    }
    let mut heavy = live_of(&record[..60_005]);
    let before = heavy.estimate().unwrap().rmse_weighted_n;
    heavy.push(Seconds(60.006), Depth(30.0), Newtons(100.0), Newtons(0.02));
    let after = heavy.estimate().unwrap().rmse_weighted_n;
    assert!(after > 2.0 * before, "{before} {after}");
}

#[test]
fn residual_blocks_are_means_of_the_residuals() {
    let record = with_white_noise(&thesis_record(), 21);
    let live = live_of(&record);
    let exact = fit(&record, &FitOptions::default()).unwrap();
    let linear: Vec<f64> = exact.parameters[1..7].iter().map(|found| found.value).collect();
    let linear: [f64; 6] = linear.try_into().unwrap();
    let tau = exact.value("tau_eps").unwrap();
    let blocks = live.residual_blocks(Seconds(tau), &linear).unwrap();
    let length = blocks.samples_per_block as usize;
    assert!(blocks.residuals.len() <= 512 && blocks.residuals.len() > 256);
    assert!((blocks.seconds_per_block.0 - length as f64 * 1e-3).abs() < 1e-9);
    let modelled = exact.predict(&record);
    // The derivative by tau, by differences of two predictions.
    let h = 1e-5;
    let moved = live.residual_blocks(Seconds(tau + h), &linear).unwrap();
    let back = live.residual_blocks(Seconds(tau - h), &linear).unwrap();
    for (i, residual) in blocks.residuals.iter().enumerate() {
        let part = i * length..(i + 1) * length;
        let sum: f64 = record[part.clone()]
            .iter()
            .zip(&modelled[part])
            .map(|(sample, force)| sample.force.0 - force.0)
            .sum();
        let mean = sum / length as f64;
        // A thousandth of the standard error of such a mean.
        assert!((mean - residual).abs() < 1e-6, "block {i}: {mean} {residual}");
        let slope = (back.residuals[i] - moved.residuals[i]) / (2.0 * h);
        let miss = (slope - blocks.jacobian[i][0]).abs();
        assert!(miss < 1e-6, "block {i}: {slope} {:?}", blocks.jacobian[i]);
        let modelled: f64 = (0..6).map(|k| linear[k] * blocks.jacobian[i][k + 1]).sum();
        let force: f64 =
            record[i * length..(i + 1) * length].iter().map(|sample| sample.force.0).sum::<f64>()
                / length as f64;
        assert!((force - modelled - residual).abs() < 1e-9);
    }
}

#[test]
fn a_bank_may_have_more_or_fewer_relaxation_times() {
    for count in [0, 8, 20, 63, 520, usize::MAX] {
        assert!(LiveFit::with_relaxation_times(Depth(30.0), count).is_none(), "{count}");
    }
    let deep = Depth(30.0);
    assert_eq!(LiveFit::with_relaxation_times(deep, 64), Some(LiveFit::new(deep)));
    // Between nodes a polynomial in log tau is used, so closer nodes are more exact until sums of products
    // have no more digits: half a double's.
    let mut before = f64::INFINITY;
    for count in [16, 32, 64] {
        let mut live = LiveFit::with_relaxation_times(deep, count).unwrap();
        for sample in respond(&ModifiedKelvin::THESIS, &ramp_hold(0.75, 50.0, 0.01)) {
            live.push(sample.t, sample.depth, sample.force, Newtons(0.02));
        }
        let tau = live.estimate().unwrap().identified_parameter("tau_eps").unwrap().value;
        let miss = (tau / ModifiedKelvin::THESIS.tau_eps - 1.0).abs();
        assert!(miss < before, "{count}: {miss:e} after {before:e}");
        before = miss.max(1e-7);
    }
}
