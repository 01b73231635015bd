//! The document and its curve.

use super::*;
use crate::units::{Newtons, Volts};

fn with_step(index: usize, change: impl Fn(&mut WeightStep)) -> CalibrationError {
    let mut calibration = Calibration::thesis();
    change(&mut calibration.steps[index]);
    calibration.curve().unwrap_err()
}

/// One way up or down: direction, repeat, grams and volts.
pub(super) type Taken<'a> = (Direction, u32, &'a [(f64, f64)]);

/// A calibration of series from (direction, repeat, [(g, V)]).
pub(super) fn document(series: &[Taken<'_>]) -> Calibration {
    let step = |&(mass_g, volts): &(f64, f64)| SeriesStep {
        mass_g,
        volts: Volts(volts),
        ..SeriesStep::default()
    };
    Calibration {
        name: "bench".into(),
        format: CALIBRATION_FORMAT,
        series: series
            .iter()
            .map(|(direction, repeat, steps)| CalibrationSeries {
                direction: *direction,
                repeat: *repeat,
                steps: steps.iter().map(step).collect(),
            })
            .collect(),
        ..Calibration::default()
    }
}

#[test]
fn errors_name_the_step() {
    let err = with_step(4, |step| step.volts = Volts(1.78));
    assert!(err.to_string().contains("weight step 5 reads 1.78 V"), "{err}");
    let err = with_step(4, |step| step.mass_g = 340.0);
    assert!(err.to_string().contains("weight step 5 has 340 g"), "{err}");
    let err = with_step(0, |step| step.volts = Volts(f64::NAN));
    assert!(err.to_string().contains("weight step 1"), "{err}");
    let err = with_step(0, |step| step.mass_g = -1.0);
    assert!(err.to_string().contains("must not be negative"), "{err}");
}

#[test]
fn one_step_is_not_a_calibration() {
    let mut calibration = Calibration::thesis();
    calibration.steps.truncate(1);
    assert_eq!(calibration.curve(), Err(CalibrationError::TooFewSteps { count: 1 }));
}

#[test]
fn a_line_is_a_line_and_a_falling_line_is_refused() {
    let line = Calibration::linear("cell", Volts(0.5), 0.1, Newtons(50.0));
    let curve = line.curve().unwrap();
    for newtons in [-3.0, 0.0, 12.5, 50.0, 60.0] {
        let volts = curve.volts_from_newtons(Newtons(newtons)).0;
        assert!((volts - (0.5 + 0.1 * newtons)).abs() < 1e-13, "{newtons}");
    }
    let falling = Calibration::linear("cell", Volts(0.5), -0.1, Newtons(50.0));
    assert!(matches!(falling.curve(), Err(CalibrationError::VoltsNotIncreasing { step: 2, .. })));
}

#[test]
fn a_signal_that_falls_by_more_than_it_repeats_is_refused() {
    use Direction::{Loading, Unloading};
    let falls = |series: &[Taken<'_>]| document(series).check_rise().err();
    let wired: &[_] = &[(0.0, 1.2), (100.0, 1.1), (200.0, 1.9), (300.0, 1.7)];
    let fall = CalibrationError::SignalFalls {
        mass_g: 100.0,
        volts: 1.1,
        before_g: 0.0,
        before_volts: 1.2,
        way: "loading",
    };
    assert_eq!(falls(&[(Loading, 1, wired)]), Some(fall));
    // One line through all of them rises and would hide it.
    let line = CurveKind::Polynomial { degree: 1 };
    assert!(line.through(&document(&[(Loading, 1, wired)]).points().unwrap()).is_ok());
    // Hysteresis, and masses of one direction only, are no fall.
    let up: &[_] = &[(0.0, 1.0), (100.0, 1.2), (200.0, 1.3), (300.0, 1.31)];
    let down: &[_] = &[(200.0, 1.35), (0.0, 1.01)];
    assert_eq!(falls(&[(Loading, 1, up), (Unloading, 1, down)]), None);
    // The repeats of 0 g differ by 4 mV: 2.8 mV of spread there, 2 mV over both masses.
    let again = |fall: f64| {
        let one = [(0.0, 1.0), (100.0, 1.002 - fall)];
        let two = [(0.0, 1.004), (100.0, 1.002 - fall)];
        falls(&[(Loading, 1, &one), (Loading, 2, &two)])
    };
    assert_eq!(again(0.0019), None);
    assert!(again(0.0021).is_some());
    // The thesis's table rises everywhere, and a last digit is no fall.
    assert_eq!(Calibration::thesis().check_rise(), Ok(()));
    let mut digits = Calibration::thesis();
    digits.steps[5].volts = Volts(1.785);
    assert_eq!(digits.check_rise(), Ok(()));
    digits.steps[5].volts = Volts(1.77);
    assert!(digits.check_rise().is_err());
}

#[test]
fn old_and_new_documents_survive_json() {
    let up: &[(f64, f64)] = &[(0.0, 1.0), (100.0, 1.2), (200.0, 1.3)];
    let mut whole = document(&[(Direction::Loading, 1, up)]);
    whole.curve = CurveKind::Segments { through_g: vec![0.0, 200.0] };
    whole.weights.push(NamedWeight { name: "A".into(), mass_g: 100.0, tolerance_g: Some(0.05) });
    for calibration in [Calibration::thesis(), whole] {
        let text = serde_json::to_string(&calibration).unwrap();
        let back: Calibration = serde_json::from_str(&text).unwrap();
        assert_eq!(back, calibration);
    }
}

#[test]
fn a_document_of_recorded_sessions_gives_the_same_curve() {
    let steps: Vec<String> = Calibration::thesis()
        .steps
        .iter()
        .map(|step| format!("{{\"mass_g\":{},\"volts\":{}}}", step.mass_g, step.volts.0))
        .collect();
    let text = format!(
        "{{\"name\":\"old\",\"taken_at\":null,\"steps\":[{}],\"source\":\"\"}}",
        steps.join(",")
    );
    let old: Calibration = serde_json::from_str(&text).unwrap();
    assert_eq!(old.curve(), Calibration::thesis().curve());
    assert_eq!(old.curve, CurveKind::Monotone);
    assert_eq!(old.reading_resolution(), Some(Volts(0.01)));
    // A force as the program has computed it from the beginning, to the last bit.
    let force = old.curve().unwrap().newtons_from_volts(Volts(2.345));
    assert_eq!(force.0.to_bits(), 0x401f_4474_e456_f030, "{force}");
}

#[test]
fn facts_that_cannot_be_are_refused() {
    let thesis = Calibration::thesis;
    let nan = Some(Volts(f64::NAN));
    for (wrong, fact) in [
        (Calibration { excitation: nan, ..thesis() }, "excitation"),
        (
            Calibration { zero_after: nan, ..thesis() },
            "signal of the empty load cell after the weights",
        ),
        (Calibration { resolution: Some(Volts(-0.1)), ..thesis() }, "resolution"),
    ] {
        let refusal = wrong.curve().unwrap_err();
        assert!(
            matches!(refusal, CalibrationError::Fact { what, .. } if what == fact),
            "{refusal:?}"
        );
    }
    let mut noisy = document(&[(Direction::Loading, 1, &[(0.0, 1.0), (100.0, 1.2)])]);
    noisy.series[0].steps[1].noise = nan;
    assert!(matches!(noisy.curve(), Err(CalibrationError::Fact { what: "noise", .. })));
}

#[test]
fn a_newer_form_is_refused() {
    let mut calibration = Calibration::thesis();
    let format = CALIBRATION_FORMAT + 1;
    calibration.format = format;
    assert_eq!(calibration.curve(), Err(CalibrationError::NewerFormat { format }));
}

#[test]
fn series_are_averaged_by_direction() {
    let up: &[(f64, f64)] = &[(0.0, 1.0), (100.0, 1.20), (200.0, 1.30)];
    let again: &[(f64, f64)] = &[(0.0, 1.0), (100.0, 1.22), (200.0, 1.30)];
    let down: &[(f64, f64)] = &[(200.0, 1.30), (100.0, 1.25), (0.0, 1.01)];
    let calibration = document(&[
        (Direction::Loading, 1, up),
        (Direction::Loading, 2, again),
        (Direction::Unloading, 1, down),
    ]);
    let points = calibration.points().unwrap();
    let volts: Vec<f64> = points.iter().map(|point| point.volts.0).collect();
    // (1.21 + 1.25) / 2: three readings, two directions.
    let expected = [1.005, 1.23, 1.3];
    assert!(volts.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{volts:?}");
    let hysteresis = points[1].hysteresis().unwrap().0;
    assert!((hysteresis + 0.04).abs() < 1e-12, "{hysteresis}");
    assert!((calibration.zero_shift().unwrap().0 - 0.01).abs() < 1e-12);
    let curve = calibration.curve().unwrap();
    assert!((curve.newtons_from_volts(Volts(1.23)).0 - 0.980_665).abs() < 1e-9);
}

#[test]
fn weights_must_be_known_and_add_up() {
    let up: &[(f64, f64)] = &[(0.0, 1.0), (100.0, 1.2)];
    let mut calibration = document(&[(Direction::Loading, 1, up)]);
    calibration.series[0].steps[1].weights = vec!["A".into()];
    let name = "A".to_owned();
    assert_eq!(calibration.curve(), Err(CalibrationError::UnknownWeight { step: 2, name }));
    let weight = |mass_g| NamedWeight { name: "A".into(), mass_g, tolerance_g: None };
    calibration.weights = vec![weight(50.0)];
    let disagree = CalibrationError::WeightsDisagree { step: 2, mass_g: 100.0, sum_g: 50.0 };
    assert_eq!(calibration.curve(), Err(disagree));
    calibration.weights = vec![weight(100.0)];
    assert!(calibration.curve().is_ok());
}

#[test]
fn segments_go_through_the_given_or_the_nearest_weights() {
    let points = Calibration::thesis().points().unwrap();
    let through = |masses: &[f64]| CurveKind::Segments { through_g: masses.to_vec() };
    let curve = through(&[0.0, 340.0, 640.0, 1040.0]).through(&points).unwrap();
    let middle = curve.volts_from_newtons(newtons_of(490.0)).0;
    assert!((middle - 0.5 * (1.78 + 1.87)).abs() < 1e-12, "{middle}");
    for wrong in [
        &[0.0, 350.0, 1040.0][..],
        &[0.0, 340.0],
        &[340.0, 1040.0],
        &[0.0, 640.0, 340.0, 1040.0],
        &[],
    ] {
        assert!(matches!(
            through(wrong).through(&points),
            Err(CalibrationError::NoSuchBreak { .. })
        ));
    }
    // Against every choice of three breaks between the ends.
    let sum = |kind: &CurveKind| -> f64 {
        let curve = kind.through(&points).unwrap();
        let miss =
            |point: &CalibrationPoint| curve.volts_from_newtons(point.newtons).0 - point.volts.0;
        points.iter().map(|point| miss(point).powi(2)).sum()
    };
    let mut least = f64::INFINITY;
    for a in 1..8 {
        for b in a + 1..9 {
            for c in b + 1..10 {
                let masses = [0, a, b, c, 10].map(|i| points[i].mass_g);
                least = least.min(sum(&through(&masses)));
            }
        }
    }
    let best = CurveKind::best_segments(&points, 4).unwrap();
    assert!((sum(&best) - least).abs() < 1e-15, "{best:?}");
    assert_eq!(CurveKind::best_segments(&points, 11), None);
    assert!(CurveKind::best_segments(&points, 10).unwrap().meets_all(&points));
}

#[test]
fn a_polynomial_through_the_flat_stretch_is_refused() {
    let points = Calibration::thesis().points().unwrap();
    let refusal = CurveKind::Polynomial { degree: 6 }.through(&points);
    assert!(matches!(refusal, Err(CalibrationError::NotRising { degree: 6, .. })));
    assert!(CurveKind::Polynomial { degree: 1 }.through(&points).is_ok());
}

#[test]
fn the_flat_stretch_of_the_thesis_is_called_out() {
    let quality = Calibration::thesis().quality().unwrap();
    let flat = &quality.flat[0];
    assert_eq!((flat.from_g, flat.to_g), (340.0, 640.0));
    assert!((flat.rise_v - 0.09).abs() < 1e-12);
    // 1.47 V over 740 g elsewhere, 0.09 V over 300 g here.
    assert!((flat.ratio - (1.47 / 740.0) / (0.09 / 300.0)).abs() < 1e-9, "{flat:?}");
    let sentence = &quality.findings[0];
    for fact in ["340 g", "640 g", "3.33", "6.28 N", "0.09 V"] {
        assert!(sentence.contains(fact), "{fact}: {sentence}");
    }
    // 0.01 V for 100 g is 0.098 N per mV; between the weights the curve is flatter yet.
    assert!((0.098..0.14).contains(&flat.worst_n_per_mv), "{flat:?}");
    let extrapolated = &quality.findings[1];
    assert!(extrapolated.contains("10.20 N") && extrapolated.contains("1040 g"), "{extrapolated}");
    assert!(quality.findings[2].contains("hysteresis"), "{:?}", quality.findings);
    let straight = Calibration::linear("line", Volts(0.5), 0.1, Newtons(50.0));
    assert!(straight.quality().unwrap().flat.is_empty());
}

#[test]
fn the_curve_that_foretells_best_is_chosen() {
    // A quadratic cell: polynomials foretell it, and straight lines do not.
    let mut random = crate::random::SplitMix::seeded(7);
    let series: Vec<Vec<(f64, f64)>> = (1..=3)
        .map(|_| {
            let steps = (0..10).map(|i| {
                let grams = 100.0 * f64::from(i);
                let f = newtons_of(grams).0;
                (grams, 1.0 + 0.2 * f + 0.01 * f * f + 1e-3 * random.normal())
            });
            steps.collect()
        })
        .collect();
    let borrowed: Vec<Taken<'_>> = (1..)
        .zip(&series)
        .map(|(repeat, steps)| (Direction::Loading, repeat, steps.as_slice()))
        .collect();
    let calibration = document(&borrowed);
    let found = curve_candidates(&calibration.points().unwrap());
    assert!(matches!(found[0].curve, CurveKind::Polynomial { degree: 2.. }), "{}", found[0].name);
    // 1 + 7 + 5 kinds, all judged.
    assert_eq!(found.len(), 13);
    // One straight line is off by the square: an eighth of 0.01 * 8.8^2 V at most, over 0.29 V/N.
    let line = found.iter().find(|one| one.name == "1 straight segment").unwrap();
    assert!(line.left_out_rms_n.unwrap() > 20.0 * found[0].left_out_rms_n.unwrap());
    let score = |one: &CurveCandidate| one.left_out_rms_n.unwrap_or(f64::INFINITY);
    assert!(found.windows(2).all(|pair| score(&pair[0]) <= score(&pair[1])));
    // With three weights there is nothing to compare.
    let few = document(&[(Direction::Loading, 1, &[(0.0, 1.0), (100.0, 1.2), (200.0, 1.3)])]);
    assert_eq!(curve_candidates(&few.points().unwrap()).len(), 1);
}

#[test]
fn every_curve_of_the_thesis_table_is_shown() {
    let points = Calibration::thesis().points().unwrap();
    let found = curve_candidates(&points);
    assert_eq!(found.len(), 13);
    for one in found.iter().filter(|one| one.refused.is_none()) {
        assert_eq!(one.residuals_n.len(), 11, "{}", one.name);
        assert!(one.left_out_rms_n.is_some() && one.left_out_ends_rms_n.is_some());
        // Tared: the empty cell reads nothing.
        assert!(one.residuals_n[0].abs() < 1e-9, "{}", one.name);
    }
    let monotone = found.iter().find(|one| one.curve == CurveKind::Monotone).unwrap();
    assert!(monotone.residuals_n.iter().all(|residual| residual.abs() < 1e-11));
}

#[test]
fn hysteresis_and_repeatability_are_what_was_put_in() {
    let line = |g: f64| 1.0 + 2e-3 * g;
    let up = |error: f64| -> Vec<(f64, f64)> {
        (0..6).map(|i| 100.0 * f64::from(i)).map(|g| (g, line(g) + error * (g / 500.0))).collect()
    };
    // 4 mV apart at the top, repeats 1 mV up and down.
    let down: Vec<(f64, f64)> = up(0.004).into_iter().rev().collect();
    let (low, high) = (up(-0.001), up(0.001));
    let calibration = document(&[
        (Direction::Loading, 1, &low),
        (Direction::Loading, 2, &high),
        (Direction::Unloading, 1, &down),
    ]);
    let quality = calibration.quality().unwrap();
    let hysteresis = quality.hysteresis.unwrap();
    assert!((hysteresis.max_v - 0.004).abs() < 1e-12, "{hysteresis:?}");
    assert!((hysteresis.max_n - 0.004 / (2e-3 / 9.806_65e-3)).abs() < 2e-4, "{hysteresis:?}");
    // Shares 0, .2, .4, .6, .8, 1 of the top: mean square 2.2/6.
    assert!((hysteresis.rms_v - 0.004 * (2.2f64 / 6.0).sqrt()).abs() < 1e-12);
    // Pairs 2 mV apart times those shares: variance 2 mV^2 over one degree of freedom each.
    let expected = 1e-3 * (2.0 * 2.2f64 / 6.0).sqrt();
    assert!((quality.repeatability_v.unwrap() - expected).abs() < 1e-12);
}

#[test]
fn age_and_rig_raise_doubts() {
    let mut calibration = Calibration::thesis();
    (calibration.rig, calibration.cell) = ("bench-2".into(), "4711".into());
    calibration.excitation = Some(Volts(10.0));
    let bench = |age_days| CalibrationUse {
        rig: "bench-2",
        cell: Some("4711"),
        excitation: Some(Volts(10.001)),
        age_days,
    };
    for (age, words) in [
        (Some(0), None),
        (Some(335), None),
        (Some(336), Some("29 more")),
        (Some(365), Some("0 more")),
        (Some(366), Some("366 days")),
        (Some(-1), Some("1 days in the future")),
        (None, Some("when it was taken")),
    ] {
        let doubts = calibration.validity_warnings(&bench(age));
        assert_eq!(doubts.len(), usize::from(words.is_some()), "{age:?}: {doubts:?}");
        assert!(words.is_none_or(|words| doubts[0].contains(words)), "{doubts:?}");
    }
    let other = CalibrationUse {
        rig: "sim",
        cell: Some("9"),
        excitation: Some(Volts(5.0)),
        age_days: Some(1),
    };
    assert_eq!(calibration.validity_warnings(&other).len(), 3);
}

#[test]
fn a_known_weight_passes_within_one_percent() {
    let calibration = Calibration::linear("line", Volts(1.0), 0.1, Newtons(50.0));
    let weight = KnownWeight {
        mass_g: 1000.0,
        tolerance_g: Some(0.5),
        // The zero has drifted by 20 mV, and taring takes it out.
        volts: Volts(1.02 + 0.980_665 * 1.009),
        tare: Volts(1.02),
        limit_percent: None,
    };
    let result = calibration.check(&weight).unwrap();
    assert!(result.is_passed && (result.error_percent - 0.9).abs() < 1e-9, "{result:?}");
    assert!(result.sentence.contains("+0.90 %") && result.sentence.contains("1 %"), "{result:?}");
    let strict = KnownWeight { limit_percent: Some(0.5), ..weight };
    let result = calibration.check(&strict).unwrap();
    assert!(!result.is_passed && result.sentence.contains("0.5 %"));
    let none = KnownWeight { mass_g: 0.0, ..weight };
    assert!(calibration.check(&none).is_err());
    // In the flat stretch one percent is less than the calibration knows.
    let thesis = Calibration::thesis();
    let flat = KnownWeight { mass_g: 440.0, volts: Volts(1.79), tare: Volts(1.28), ..weight };
    let result = thesis.check(&flat).unwrap();
    assert!(result.is_passed && result.doubts.len() == 1, "{result:?}");
}

#[test]
fn a_weight_that_the_calibration_cannot_tell_is_no_check() {
    let thesis = Calibration::thesis();
    for mass_g in [200.0, 500.0] {
        let refusal = thesis.check_refusal(mass_g).unwrap().unwrap();
        assert!(refusal.contains(&format!("{mass_g} g")) && refusal.contains("950 g"), "{refusal}");
    }
    for mass_g in [800.0, 950.0] {
        assert_eq!(thesis.check_refusal(mass_g), Ok(None));
    }
    // Nothing is stated of a straight line.
    let line = Calibration::linear("line", Volts(1.0), 0.1, Newtons(50.0));
    assert_eq!(line.check_refusal(200.0), Ok(None));
    let mut coarse = thesis;
    coarse.resolution = Some(Volts(0.2));
    // No weight would do.
    let refusal = coarse.check_refusal(800.0).unwrap().unwrap();
    assert!(refusal.contains("800 g") && !refusal.contains("950 g"), "{refusal}");
}

#[test]
fn loop_between_loading_and_unloading_is_found_beside_a_steady_drift() {
    // 2 mN in the middle of 0 to 900 g, and 0.1 mV from reading to reading.
    let (half, drift, sensitivity) = (2e-3, 1e-4, 0.2);
    let lag = |g: f64| {
        let place = g / 900.0;
        sensitivity * half * 4.0 * place * (1.0 - place)
    };
    let line = |g: f64| 1.0 + sensitivity * newtons_of(g).0;
    let grams = || (0..10).map(|i| 100.0 * f64::from(i));
    let up: Vec<(f64, f64)> =
        grams().enumerate().map(|(i, g)| (g, line(g) - lag(g) + drift * i as f64)).collect();
    let down: Vec<(f64, f64)> = grams()
        .rev()
        .enumerate()
        .map(|(i, g)| (g, line(g) + lag(g) + drift * (i + 10) as f64))
        .collect();
    let both = document(&[(Direction::Loading, 1, &up), (Direction::Unloading, 1, &down)]);
    let found = HysteresisLoop::of(&both).unwrap();
    assert!((found.half.0 - half).abs() < 1e-3 * half, "{found:?}");
    assert!(found.std_error.0 < 0.01 * half, "{found:?}");
    let up_only = document(&[(Direction::Loading, 1, &up)]);
    assert_eq!(HysteresisLoop::of(&up_only), None);
}
