//! The propagated uncertainty against draws by the thousand.

use super::tests::{Taken, document};
use super::*;
use crate::random::SplitMix;
use crate::units::{Newtons, Volts};

/// The force that `other` reads, tared, where `curve` reads `force`.
fn read(curve: &CalibrationCurve, other: &CalibrationCurve, force: f64) -> f64 {
    let zero = Newtons(0.0);
    let above = curve.volts_from_newtons(Newtons(force)) - curve.volts_from_newtons(zero);
    other.newtons_from_volts(above + other.volts_from_newtons(zero)).0
}

/// Standard deviation of the force over draws of whole calibrations.
fn scatter(
    calibration: &Calibration,
    force: f64,
    draw: impl Fn(&mut SplitMix) -> Calibration,
) -> f64 {
    let curve = calibration.curve().unwrap();
    let mut random = SplitMix::seeded(11);
    let draws = 4000;
    let mut square = 0.0;
    for _ in 0..draws {
        let error = read(&curve, &draw(&mut random).curve().unwrap(), force) - force;
        square += error * error;
    }
    (square / f64::from(draws)).sqrt()
}

/// A slightly bent cell, up and down twice, with weights of 0.5 g tolerance and a drifting zero.
fn bench() -> Calibration {
    let volts = |g: f64| 1.0 + 1.5e-3 * g + 4e-7 * g * g;
    let series: Vec<Vec<(f64, f64)>> = (0..4u32)
        .map(|k| {
            let gap = if k % 2 == 0 { 0.0 } else { 3e-3 };
            let steps = (0..6).map(|i| {
                let g = 100.0 * f64::from(i);
                let bow = gap * (g / 500.0) * (1.0 - g / 500.0);
                let scatter = 4e-4 * (f64::from(i) + 2.0 * f64::from(k)).sin();
                (g, volts(g) + bow + scatter)
            });
            steps.collect()
        })
        .collect();
    let ways = [Direction::Loading, Direction::Unloading];
    let borrowed: Vec<Taken<'_>> = (0..)
        .zip(&series)
        .map(|(k, steps)| (ways[k % 2], k as u32 / 2 + 1, steps.as_slice()))
        .collect();
    let mut calibration = document(&borrowed);
    calibration = calibration.with_stacked_weights(0.5).unwrap();
    (calibration.zero_before, calibration.zero_after) = (Some(Volts(1.0)), Some(Volts(1.002)));
    calibration
}

#[test]
fn each_term_is_what_draws_of_it_scatter() {
    let calibration = bench();
    let uncertainty = ForceUncertainty::of(&calibration).unwrap();
    assert_eq!(uncertainty.not_stated(), [UncertaintyTerm::Resolution]);
    let weights = |random: &mut SplitMix| {
        let mut drawn = calibration.clone();
        for weight in &mut drawn.weights {
            weight.mass_g += 0.5 / 3f64.sqrt() * random.normal();
        }
        for series in &mut drawn.series {
            for step in &mut series.steps {
                let on = drawn.weights.iter().filter(|one| step.weights.contains(&one.name));
                step.mass_g = on.map(|one| one.mass_g).sum();
            }
        }
        drawn
    };
    let repeatability = calibration.quality().unwrap().repeatability_v.unwrap();
    let readings = |random: &mut SplitMix| {
        let mut drawn = calibration.clone();
        for series in &mut drawn.series {
            for step in &mut series.steps {
                step.volts.0 += repeatability * random.normal();
            }
        }
        drawn
    };
    // Loading only and unloading only are the two ends of the rectangle.
    let points = calibration.points().unwrap();
    let halves: Vec<f64> = points.iter().map(|p| 0.5 * p.hysteresis().unwrap().0).collect();
    let hysteresis = |random: &mut SplitMix| {
        let share = random.normal() / 3f64.sqrt();
        let mut drawn = calibration.clone();
        for series in &mut drawn.series {
            for step in &mut series.steps {
                let i = (step.mass_g / 100.0).round() as usize;
                step.volts.0 += share * halves[i];
            }
        }
        drawn
    };
    let drift = |random: &mut SplitMix| {
        let mut drawn = calibration.clone();
        let shift = 1e-3 / 3f64.sqrt() * random.normal();
        for series in &mut drawn.series {
            for step in series.steps.iter_mut().filter(|step| step.mass_g > 0.0) {
                step.volts.0 += shift;
            }
        }
        drawn
    };
    let close = |term: UncertaintyTerm, force: f64, drawn: f64| {
        let stated = uncertainty.term_sigma(term, Newtons(force)).unwrap().0;
        // 4000 draws know a standard deviation to 1.1 %; three times that, and the curve's bend.
        assert!(
            (stated / drawn - 1.0).abs() < 0.045,
            "{term:?} at {force} N: {stated} against {drawn}"
        );
    };
    for force in [0.4, 1.3, 2.45, 3.9, 4.8] {
        close(UncertaintyTerm::Weights, force, scatter(&calibration, force, weights));
        close(UncertaintyTerm::Repeatability, force, scatter(&calibration, force, readings));
        close(UncertaintyTerm::Hysteresis, force, scatter(&calibration, force, hysteresis));
        close(UncertaintyTerm::ZeroDrift, force, scatter(&calibration, force, drift));
        // All together, in quadrature.
        let sum = UncertaintyTerm::ALL
            .iter()
            .filter_map(|&term| uncertainty.term_sigma(term, Newtons(force)));
        let sum = sum.map(|sigma| sigma.0 * sigma.0).sum::<f64>().sqrt();
        let whole = uncertainty.sigma(Newtons(force)).unwrap().0;
        assert!((whole / sum - 1.0).abs() < 0.02, "{whole} against {sum}");
    }
}

#[test]
fn the_digits_of_the_thesis_are_what_draws_of_them_scatter() {
    let thesis = Calibration::thesis();
    let uncertainty = ForceUncertainty::of(&thesis).unwrap();
    let stated = [UncertaintyTerm::Resolution, UncertaintyTerm::Interpolation];
    assert!(
        UncertaintyTerm::ALL
            .iter()
            .all(|term| stated.contains(term) != uncertainty.not_stated().contains(term))
    );
    // In the flat stretch neighbours are 0.01 V apart, so a tenth of the printed digit is drawn.
    let draw = |random: &mut SplitMix| {
        let mut drawn = thesis.clone();
        for step in &mut drawn.steps {
            step.volts.0 += 1e-3 / 12f64.sqrt() * random.normal();
        }
        drawn
    };
    for force in [0.7, 2.0, 3.0, 4.0, 5.0, 7.0, 9.0, 11.0] {
        let stated = uncertainty.term_sigma(UncertaintyTerm::Resolution, Newtons(force)).unwrap().0;
        let drawn = 10.0 * scatter(&thesis, force, draw);
        // The curve bends within a whole digit where it is flat, so the two part a little.
        assert!((stated / drawn - 1.0).abs() < 0.2, "{force} N: {stated} against {drawn}");
    }
    let sigma = |force: f64| uncertainty.sigma(Newtons(force)).unwrap().0;
    // The flat stretch is an order of magnitude worse than where the cell moves.
    assert!(sigma(4.3) > 10.0 * sigma(1.0) && sigma(4.3) > 6.0 * sigma(8.0));
    assert!(sigma(0.0) < 1e-12, "tared forces of the empty cell are exact");
    assert!(
        uncertainty.is_extrapolated(Newtons(10.3)) && !uncertainty.is_extrapolated(Newtons(10.1))
    );
}

#[test]
fn what_is_not_stated_has_no_number() {
    let line = Calibration::linear("line", Volts(0.5), 0.1, Newtons(50.0));
    let uncertainty = ForceUncertainty::of(&line).unwrap();
    assert!(!uncertainty.is_stated());
    assert_eq!(uncertainty.sigma(Newtons(3.0)), None);
    assert_eq!(uncertainty.errors().count(), 0);
    let mut too_flat = Calibration::thesis();
    too_flat.steps[4].volts = Volts(too_flat.steps[3].volts.0 + 1e-15);
    assert_eq!(ForceUncertainty::of(&too_flat), Err(CalibrationError::TooFlat));
}

#[test]
fn interpolation_is_bounded_by_the_weights_around() {
    for kind in [CurveKind::Monotone, CurveKind::Polynomial { degree: 3 }] {
        let mut calibration = Calibration::thesis();
        calibration.curve = kind.clone();
        let uncertainty = ForceUncertainty::of(&calibration).unwrap();
        let points = calibration.points().unwrap();
        for pair in points.windows(2) {
            let (from, to) = (pair[0].newtons.0, pair[1].newtons.0);
            let middle =
                uncertainty.term_sigma(UncertaintyTerm::Interpolation, Newtons(0.5 * (from + to)));
            let middle = middle.unwrap().0;
            let end =
                uncertainty.term_sigma(UncertaintyTerm::Interpolation, Newtons(to)).unwrap().0;
            match kind {
                // It meets its points, and between them it cannot leave the interval.
                CurveKind::Monotone => {
                    assert!(end < 1e-12 && middle > 0.0 && middle <= 0.5 * (to - from))
                }
                _ => assert!(end > 0.1 && middle > 0.1, "{end} {middle}"),
            }
        }
    }
}

#[test]
fn a_term_without_errors_is_zero_and_not_minus_zero() {
    let mut sampled = Calibration::thesis();
    let step = |step: WeightStep| SeriesStep {
        mass_g: step.mass_g,
        volts: step.volts,
        noise: Some(Volts(1e-3)),
        samples: Some(1000),
        ..SeriesStep::default()
    };
    sampled.series = vec![CalibrationSeries {
        direction: Direction::Loading,
        repeat: 1,
        steps: sampled.steps.drain(..).map(step).collect(),
    }];
    sampled.resolution = None;
    let uncertainty = ForceUncertainty::of(&sampled).unwrap();
    let digits = uncertainty.term_sigma(UncertaintyTerm::Resolution, Newtons(1.0)).unwrap();
    assert!(digits.0.to_bits() == 0, "{digits:?}");
}
