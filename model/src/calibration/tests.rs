//! The document and its curve.

use super::*;
use crate::units::{Newtons, Volts};

fn with_step(index: usize, change: impl Fn(&mut WeightStep)) -> CalibrationError {
    let mut calibration = Calibration::thesis();
    change(&mut calibration.steps[index]);
    calibration.curve().unwrap_err()
}

/// A calibration of series from (direction, repeat, [(g, V)]).
pub(super) fn document(series: &[(Direction, u32, &[(f64, f64)])]) -> Calibration {
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
            .map(|(direction, repeat, steps)| Series {
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
    assert!(
        err.to_string().contains("weight step 5 reads 1.78 V"),
        "{err}"
    );
    let err = with_step(4, |step| step.mass_g = 340.0);
    assert!(err.to_string().contains("weight step 5 has 340 g"), "{err}");
    let err = with_step(0, |step| step.volts = Volts(f64::NAN));
    assert!(err.to_string().contains("weight step 1"), "{err}");
    let err = with_step(0, |step| step.mass_g = -1.0);
    assert!(err.to_string().contains("not negative"), "{err}");
}

#[test]
fn one_step_is_not_a_calibration() {
    let mut calibration = Calibration::thesis();
    calibration.steps.truncate(1);
    assert_eq!(
        calibration.curve(),
        Err(CalibrationError::TooFewSteps { count: 1 })
    );
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
    assert!(matches!(
        falling.curve(),
        Err(CalibrationError::VoltsNotIncreasing { step: 2, .. })
    ));
}

#[test]
fn old_and_new_documents_survive_json() {
    let up: &[(f64, f64)] = &[(0.0, 1.0), (100.0, 1.2), (200.0, 1.3)];
    let mut whole = document(&[(Direction::Loading, 1, up)]);
    whole.curve = CurveKind::Segments {
        through_g: vec![0.0, 200.0],
    };
    whole.weights.push(NamedWeight {
        name: "A".into(),
        mass_g: 100.0,
        tolerance_g: Some(0.05),
    });
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
fn a_newer_form_is_refused() {
    let mut calibration = Calibration::thesis();
    calibration.format = CALIBRATION_FORMAT + 1;
    let refusal = calibration.curve().unwrap_err().to_string();
    assert!(
        refusal.contains("newer than this program knows"),
        "{refusal}"
    );
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
    assert!(
        volts
            .iter()
            .zip(expected)
            .all(|(a, b)| (a - b).abs() < 1e-12),
        "{volts:?}"
    );
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
    let refusal = calibration.curve().unwrap_err().to_string();
    assert!(
        refusal.contains("\"A\" on it, which is not in the list"),
        "{refusal}"
    );
    let weight = |mass_g| NamedWeight {
        name: "A".into(),
        mass_g,
        tolerance_g: None,
    };
    calibration.weights = vec![weight(50.0)];
    let refusal = calibration.curve().unwrap_err().to_string();
    assert!(
        refusal.contains("has 100 g but its weights add up to 50 g"),
        "{refusal}"
    );
    calibration.weights = vec![weight(100.0)];
    assert!(calibration.curve().is_ok());
}

#[test]
fn segments_go_where_they_are_told_or_nearest() {
    let points = Calibration::thesis().points().unwrap();
    let through = |masses: &[f64]| CurveKind::Segments {
        through_g: masses.to_vec(),
    };
    let curve = through(&[0.0, 340.0, 640.0, 1040.0])
        .through(&points)
        .unwrap();
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
        let miss = |point: &Point| curve.volts_from_newtons(point.newtons).0 - point.volts.0;
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
    assert!(
        CurveKind::best_segments(&points, 10)
            .unwrap()
            .meets_all(&points)
    );
}

#[test]
fn a_polynomial_through_the_flat_stretch_is_refused() {
    let points = Calibration::thesis().points().unwrap();
    let refusal = CurveKind::Polynomial { degree: 6 }.through(&points);
    assert!(refusal.unwrap_err().to_string().contains("degree 6"));
    assert!(CurveKind::Polynomial { degree: 1 }.through(&points).is_ok());
}
