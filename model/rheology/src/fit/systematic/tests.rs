use super::*;
use crate::fit::FitReport;
use palpate_model::calibration::Calibration;
use palpate_model::random::SplitMix;
use palpate_model::units::{Depth, Seconds, Volts};
use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};

/// The thesis's ramp and hold, so many samples a second.
fn record(rate: f64) -> Vec<FitSample> {
    let mut state = KelvinState::at_rest();
    (0..(90.0 * rate) as usize)
        .map(|i| {
            let t = i as f64 / rate;
            let depth = Depth((0.75 * t).min(30.0));
            let dt = Seconds(if i == 0 { 0.0 } else { 1.0 / rate });
            FitSample {
                t: Seconds(t),
                depth,
                force: state.step(&ModifiedKelvin::THESIS, depth, dt),
                sigma: Newtons(0.02),
            }
        })
        .collect()
}

fn traced<'a>(
    samples: &'a [FitSample],
    name: &'a str,
    uncertainty: &'a ForceUncertainty,
) -> TracedRecord<'a> {
    TracedRecord { name, samples, calibration: Some((name, uncertainty)), compliance: None }
}

/// The thesis's table as if it were printed with a digit more: small errors, so that the draws do not
/// bend the curve.
fn calibration() -> Calibration {
    Calibration { resolution: Some(Volts(0.001)), ..Calibration::thesis() }
}

#[test]
fn systematic_error_equals_the_scatter_of_drawn_calibrations() {
    let (samples, options) = (record(5.0), FitOptions::default());
    let calibration = calibration();
    let uncertainty = ForceUncertainty::of(&calibration).unwrap();
    let found = estimate_systematic(traced(&samples, "thesis", &uncertainty), &options).unwrap();
    let curve = calibration.curve().unwrap();
    let tare = curve.volts_from_newtons(Newtons(0.0));
    let mut random = SplitMix::seeded(5);
    let values = |samples: &[FitSample]| {
        let fitted = FitSolution::of(samples, &options).unwrap();
        fitted.system.physical_values(0, &fitted.refined.points[0])
    };
    let before = values(&samples);
    let mut squares = [0.0; 8];
    let draws = 600;
    for _ in 0..draws {
        let mut drawn = calibration.clone();
        for step in &mut drawn.steps {
            step.volts.0 += 1e-3 / 12f64.sqrt() * random.normal();
        }
        let drawn = drawn.curve().unwrap();
        let zero = drawn.volts_from_newtons(Newtons(0.0));
        let read = |one: &FitSample| FitSample {
            force: drawn.newtons_from_volts(curve.volts_from_newtons(one.force) - tare + zero),
            ..*one
        };
        let again: Vec<FitSample> = samples.iter().map(read).collect();
        let after = values(&again);
        for k in 0..8 {
            squares[k] += (after[k] - before[k]).powi(2) / f64::from(draws);
        }
    }
    for (k, own) in found.parameters.iter().enumerate().take(5) {
        let digits = own.terms.iter().find(|one| one.term == UncertaintyTerm::Resolution).unwrap();
        let drawn = squares[k].sqrt();
        // 600 draws know a standard deviation to 3 %, three times that and a little bend.
        assert!(
            (digits.error / drawn - 1.0).abs() < 0.12,
            "{}: {} against {drawn}",
            own.name,
            digits.error
        );
        let sum: f64 = own.terms.iter().map(|one| one.error.powi(2)).sum();
        assert!((own.error - sum.sqrt()).abs() <= 1e-12 * own.error);
    }
}

#[test]
fn systematic_error_does_not_depend_on_thinning() {
    let options = FitOptions::default();
    let uncertainty = ForceUncertainty::of(&calibration()).unwrap();
    let of = |samples: &[FitSample]| {
        estimate_systematic(traced(samples, "thesis", &uncertainty), &options).unwrap()
    };
    // Of 18 000 samples every fifth is taken; 1800 are taken whole.
    let (long, short) = (of(&record(200.0)), of(&record(20.0)));
    for (a, b) in long.parameters.iter().zip(&short.parameters).take(5) {
        assert!((a.error / b.error - 1.0).abs() < 0.01, "{}: {} {}", a.name, a.error, b.error);
    }
}

#[test]
fn a_calibration_that_states_nothing_adds_nothing_and_says_so() {
    let line = Calibration::linear("line", Volts(1.0), 0.1, Newtons(10.0));
    let uncertainty = ForceUncertainty::of(&line).unwrap();
    let (samples, options) = (record(5.0), FitOptions::default());
    let found = estimate_systematic(traced(&samples, "line", &uncertainty), &options).unwrap();
    let report = super::super::fit(&samples, &options).unwrap().with_systematic(&found);
    assert!(report.parameters.iter().all(|one| one.systematic_error.is_none()));
    let sentence = report.findings.last().unwrap();
    assert!(sentence.contains("\"line\" states nothing"), "{sentence}");
    let uncertainty = ForceUncertainty::of(&Calibration::thesis()).unwrap();
    let found = estimate_systematic(traced(&samples, "thesis", &uncertainty), &options).unwrap();
    let report = super::super::fit(&samples, &options).unwrap().with_systematic(&found);
    let terms = &found.calibrations[0];
    assert_eq!(terms.terms, [UncertaintyTerm::Resolution, UncertaintyTerm::Interpolation]);
    assert!(terms.not_stated.contains(&UncertaintyTerm::Weights), "{terms:?}");
    let sentence = report.findings.last().unwrap();
    for term in
        [UncertaintyTerm::Resolution, UncertaintyTerm::Interpolation, UncertaintyTerm::Weights]
    {
        assert!(sentence.contains(term.name()), "{sentence}");
    }
    assert!(!found.is_extrapolated);
    for parameter in &report.parameters {
        assert_eq!(parameter.systematic_error.is_some(), parameter.std_error.is_some());
    }
}

#[test]
fn records_of_one_calibration_move_together_and_of_two_apart() {
    let (one, options) = (record(5.0), FitOptions::default());
    let uncertainty = ForceUncertainty::of(&calibration()).unwrap();
    let joint = |names: [&str; 2]| {
        let both = names.map(|name| traced(&one, name, &uncertainty));
        estimate_systematic_jointly(&both, &options, &options.body_names()).unwrap()
    };
    let alone = estimate_systematic(traced(&one, "a", &uncertainty), &options).unwrap();
    let (same, apart) = (joint(["a", "a"]), joint(["a", "b"]));
    for (k, own) in alone.parameters.iter().enumerate().take(5) {
        // Twice the same record with the same error: the same as once. Fits end within 1e-9 of a parameter, and an error is
        // a thousandth of it or less.
        let ratio = same[0].parameters[k].error / own.error;
        assert!((ratio - 1.0).abs() < 1e-5, "{}: {ratio}", own.name);
        // Each moves half of the body, and both are independent: 1 / sqrt(2). Differences of a fit that bends
        // are a few percent off.
        let ratio = apart[1].parameters[k].error / own.error;
        assert!((ratio - 0.5f64.sqrt()).abs() < 0.05, "{}: {ratio}", own.name);
    }
    let names: Vec<&str> = apart[0].calibrations.iter().map(|one| one.name.as_str()).collect();
    assert_eq!(names, ["a", "b"]);
}

#[test]
fn sentence_names_what_each_of_two_calibrations_states() {
    let (one, options) = (record(5.0), FitOptions::default());
    let drifting = Calibration {
        zero_before: Some(Volts(1.28)),
        zero_after: Some(Volts(1.29)),
        ..calibration()
    };
    let straight = Calibration::linear("line", Volts(1.28), 0.15, Newtons(50.0));
    let uncertainty = |second: &Calibration| {
        let both = [&calibration(), second].map(|one| ForceUncertainty::of(one).unwrap());
        let records = [traced(&one, "a", &both[0]), traced(&one, "b", &both[1])];
        estimate_systematic_jointly(&records, &options, &options.body_names()).unwrap()[0].clone()
    };
    let found = uncertainty(&drifting);
    // Each of them is named, and what the second alone states stands once as stated and once as not.
    let sentence = found.sentence();
    assert!(sentence.contains("\"a\"") && sentence.contains("\"b\""), "{sentence}");
    assert_eq!(sentence.matches(UncertaintyTerm::ZeroDrift.name()).count(), 2, "{sentence}");
    assert!(found.calibrations[1].terms.contains(&UncertaintyTerm::ZeroDrift));
    assert!(found.calibrations[0].not_stated.contains(&UncertaintyTerm::ZeroDrift));
    assert_eq!(uncertainty(&straight).calibrations[1].terms, []);
}

#[test]
fn every_family_reports_the_systematic_error_of_the_calibration() {
    let samples = record(5.0);
    let uncertainty = ForceUncertainty::of(&calibration()).unwrap();
    let traced = traced(&samples, "thesis", &uncertainty);
    let known = estimate_systematic(traced, &FitOptions::default()).unwrap();
    let of = |name: &str, found: &SystematicUncertainty| {
        let own = found.parameters.iter().find(|one| one.name == name);
        own.map(|one| one.error)
    };
    for key in ["series-4", "series-5", "exponential"] {
        let options = FitOptions::by_key(key).unwrap();
        let found = estimate_systematic(traced, &options).unwrap();
        // The sensor offset moves with the zero, whatever the body is.
        let [own, other] = [&found, &known].map(|one| of("f_offset", one).unwrap());
        assert!(own > 0.1 * other && own < 30.0 * other, "{key}: {own} {other}");
        let uncertainty = super::super::fit(&samples, &options).unwrap();
        for one in &uncertainty.with_systematic(&found).parameters {
            let is_known = one.std_error.is_some();
            assert_eq!(one.systematic_error.is_some(), is_known, "{key} {one:?}");
        }
    }
}

#[test]
fn uncertain_compliance_makes_stiffness_uncertain() {
    let (samples, options) = (record(5.0), FitOptions::default());
    let line = Calibration::linear("line", Volts(1.0), 0.1, Newtons(10.0));
    let uncertainty = ForceUncertainty::of(&line).unwrap();
    let with = |std_error| {
        let traced = TracedRecord {
            compliance: Some(("stand", std_error)),
            ..traced(&samples, "line", &uncertainty)
        };
        estimate_systematic(traced, &options).unwrap()
    };
    // 1 um/N moves a depth of 30 mm by some micrometres; twice of it, twice as far.
    let (one, two) = (with(1e-3), with(2e-3));
    for (one, two) in one.parameters.iter().zip(&two.parameters).take(5) {
        assert!(one.error > 0.0 && one.compliance == Some(one.error), "{one:?}");
        assert!((two.error / one.error - 2.0).abs() < 0.02, "{one:?} {two:?}");
    }
    let sentence = one.sentence();
    assert!(sentence.contains("compliance stand"), "{sentence}");
}

/// An estimate that the record itself contradicts is not passed over in silence.
#[test]
fn a_value_outside_of_its_total_interval_is_named() {
    let samples = record(5.0);
    let uncertainty = ForceUncertainty::of(&calibration()).unwrap();
    let traced = traced(&samples, "thesis", &uncertainty);
    let found = estimate_systematic(traced, &FitOptions::default()).unwrap();
    let report = super::super::fit(&samples, &FitOptions::default()).unwrap();
    let named = |report: &FitReport| {
        let mut words = report.findings.iter();
        words.find(|words| words.contains("lie outside of their total")).cloned()
    };
    assert_eq!(named(&report.clone().with_systematic(&found)), None);
    let mut moved = found;
    for own in &mut moved.parameters {
        let half = 1.96 * own.error;
        let far = if own.name == "mu1" { 3.0 } else { 0.5 };
        own.joint = Some(JointChange { change: far * half, statistical: own.error, half });
    }
    let words = named(&report.with_systematic(&moved)).unwrap();
    assert!(words.starts_with("the values of mu1 take the calibration as exact"), "{words}");
}
