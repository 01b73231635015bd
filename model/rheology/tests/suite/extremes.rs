//! The extremes: nothing is wrong, and the judge can tell what is.

use palpate_model::{Depth, Newtons, Seconds};
use palpate_rheology::extremes::{
    ExpectedAnswer, ExtremesExtent, ExtremesSubject, ExtremesVerdict, FamilyBody, PathCase,
    SubjectAnswer, judge, list_extremes, make_member,
};
use palpate_rheology::families::{self, Family, Model, OuterParameter, RelaxationTerm};
use palpate_rheology::fit::{FitOptions, FitSample, fit};
use std::collections::BTreeSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

#[test]
fn nothing_is_wrong_at_the_extremes() {
    let mut groups = BTreeSet::new();
    let mut subjects = BTreeSet::new();
    for part in list_extremes(ExtremesExtent::Quick, None).unwrap() {
        let mut heard = 0.0;
        let rows = part.rows(|share| {
            assert!(share >= heard && share <= 1.0);
            heard = share;
        });
        assert!(!rows.is_empty(), "{} {}", part.group, part.subject);
        for row in rows {
            assert_ne!(row.verdict, ExtremesVerdict::Wrong, "{row:?}");
            match row.verdict {
                ExtremesVerdict::Right => {
                    assert!(row.relative_error.unwrap() <= row.tolerance, "{row:?}");
                }
                _ => assert!(row.sentence.len() > 20, "{row:?}"),
            }
            groups.insert(row.group);
            subjects.insert(row.subject);
        }
    }
    assert_eq!(groups.len(), 8, "{groups:?}");
    for family in families::all_families() {
        assert!(
            subjects.contains(&family.key())
                && subjects.contains(&format!("fit of {}", family.key()))
        );
    }
    assert!(list_extremes(ExtremesExtent::Quick, Some("no such family")).is_err());
}

type Forces = Result<Vec<f64>, String>;

/// A family's exact step, spoilt.
struct Spoilt {
    right: FamilyBody,
    spoil: fn(Forces) -> Forces,
}

impl ExtremesSubject for Spoilt {
    fn name(&self) -> String {
        "spoilt".into()
    }

    fn terms(&self) -> Result<Vec<RelaxationTerm>, String> {
        self.right.terms()
    }

    fn forces(&self, path: &PathCase) -> Result<Vec<f64>, String> {
        (self.spoil)(self.right.forces(path))
    }
}

fn poke(depth: f64) -> PathCase {
    PathCase {
        group: "test",
        case: "poke".into(),
        start: 0.0,
        steps: vec![(0.1, 0.5 * depth), (0.1, depth), (1.0, depth), (1.0, 0.6 * depth)],
    }
}

fn kelvin() -> Model {
    make_member(&families::Kelvin, 1.0, 20.0, 2.0)
}

#[test]
fn a_broken_step_is_judged_wrong() {
    let verdict = |spoil, path: &PathCase| {
        let right = FamilyBody(kelvin());
        path.run_on(&Spoilt { right, spoil }).verdict
    };
    let good = poke(10.0);
    assert_eq!(verdict(|forces| forces, &good), ExtremesVerdict::Right);
    // Off by little more than the tolerance, in one sample.
    let off = |forces: Forces| {
        forces.map(|mut all| {
            all[1] *= 1.0 + 3e-13;
            all
        })
    };
    assert_eq!(verdict(off, &good), ExtremesVerdict::Wrong);
    let nan = |forces: Forces| {
        forces.map(|mut all| {
            all[0] = f64::NAN;
            all
        })
    };
    assert_eq!(verdict(nan, &good), ExtremesVerdict::Wrong);
    let short = |forces: Forces| {
        forces.map(|mut all| {
            all.pop();
            all
        })
    };
    assert_eq!(verdict(short, &good), ExtremesVerdict::Wrong);
    // A refusal of what has an answer, an answer to what has none, a refusal without a reason.
    assert_eq!(verdict(|_| Err("no".into()), &good), ExtremesVerdict::Wrong);
    let bad = poke(f64::NAN);
    assert_eq!(verdict(|_| Ok(vec![0.0; 4]), &bad), ExtremesVerdict::Wrong);
    assert_eq!(verdict(|_| Err(String::new()), &bad), ExtremesVerdict::Wrong);
    assert_eq!(verdict(|forces| forces, &bad), ExtremesVerdict::Refused);
}

#[test]
fn a_broken_weight_is_judged_wrong() {
    // The step of another body. The slowest time of six terms moves this force by a millionth of its own
    // change, which is to be seen.
    struct OtherFamily(FamilyBody, FamilyBody);
    impl ExtremesSubject for OtherFamily {
        fn name(&self) -> String {
            "other".into()
        }

        fn terms(&self) -> Result<Vec<RelaxationTerm>, String> {
            self.0.terms()
        }

        fn forces(&self, path: &PathCase) -> Result<Vec<f64>, String> {
            self.1.forces(path)
        }
    }
    for family in families::all_families() {
        let right = make_member(&*family, 1.0, 20.0, 2.0);
        for index in 0..right.outer.len() + right.linear.len() {
            let mut other = right.clone();
            match other.outer.get_mut(index) {
                Some(outer) => *outer *= 1.0 + 1e-5,
                None => other.linear[index - right.outer.len()] *= 1.0 + 1e-5,
            }
            let row = poke(10.0).run_on(&OtherFamily(FamilyBody(right.clone()), FamilyBody(other)));
            assert_eq!(row.verdict, ExtremesVerdict::Wrong, "{} {index}: {row:?}", family.key());
        }
    }
}

#[test]
fn a_fit_is_judged_by_its_parameters_and_warnings() {
    let verdict = |expected, error, warnings: &[&str]| {
        let warnings = warnings.iter().map(|&text| text.to_owned()).collect();
        let answer = SubjectAnswer::Number { error, warnings };
        judge("test", "case", "fit", expected, 1e-6, answer).verdict
    };
    assert_eq!(verdict(ExpectedAnswer::Number, 1e-7, &["slow"]), ExtremesVerdict::Right);
    assert_eq!(verdict(ExpectedAnswer::Number, 1e-5, &["slow"]), ExtremesVerdict::Flagged);
    assert_eq!(verdict(ExpectedAnswer::Number, 1e-5, &[]), ExtremesVerdict::Wrong);
    assert_eq!(verdict(ExpectedAnswer::Either, f64::NAN, &["slow"]), ExtremesVerdict::Wrong);
    assert_eq!(verdict(ExpectedAnswer::Refusal, 0.0, &["slow"]), ExtremesVerdict::Wrong);
}

/// A family that counts how often a fit asks for its columns.
#[derive(Debug)]
struct CountingFamily {
    family: Arc<dyn Family>,
    calls: AtomicUsize,
}

impl Family for CountingFamily {
    fn key(&self) -> String {
        self.family.key()
    }
    fn name(&self) -> String {
        self.family.name()
    }
    fn equation(&self) -> &'static str {
        self.family.equation()
    }
    fn cannot_represent(&self) -> &'static str {
        self.family.cannot_represent()
    }
    fn outer(&self) -> Vec<OuterParameter> {
        self.family.outer()
    }
    fn linear(&self) -> Vec<(String, &'static str)> {
        self.family.linear()
    }
    fn columns(&self, outer: &[f64]) -> Vec<Vec<RelaxationTerm>> {
        self.calls.fetch_add(1, Ordering::Relaxed);
        self.family.columns(outer)
    }
    fn is_non_negative(&self, coefficient: usize) -> bool {
        self.family.is_non_negative(coefficient)
    }
    fn fading(&self, outer: &[f64]) -> Option<f64> {
        self.family.fading(outer)
    }
}

/// Columns a fit may ask for: a grid of 392 cells, then four valleys and the whole record, each 80 steps
/// that ask once for a trial and twice for every outer parameter, and little else.
fn bound(outers: usize) -> usize {
    500 + 5 * 80 * (2 + 2 * outers)
}

#[test]
fn every_fit_returns_after_a_bounded_number_of_evaluations() {
    // Records no family explains: noise, a step, a spike, alternating forces of odd sizes.
    let noise = |i: u32| f64::from(i.wrapping_mul(2_654_435_761) >> 8) / 16_777_216.0 - 0.5;
    let records: [fn(u32, f64) -> f64; 4] = [
        |_, noise| noise,
        |i, _| if i > 40 { 1e6 } else { 0.0 },
        |i, noise| if i == 33 { 1e9 } else { 1e-9 * noise },
        |i, _| f64::from(i).powi(5) * if i % 2 == 0 { 1.0 } else { -1.0 },
    ];
    for family in families::all_families() {
        let counted = Arc::new(CountingFamily { family, calls: AtomicUsize::new(0) });
        let options = FitOptions::of(counted.clone());
        let limit = bound(counted.outer().len());
        for (number, force) in records.iter().enumerate() {
            let samples: Vec<FitSample> = (0..80)
                .map(|i| FitSample {
                    t: Seconds(0.1 * f64::from(i)),
                    depth: Depth((0.4 * f64::from(i)).min(12.0) + noise(i)),
                    force: Newtons(force(i, noise(i + 1000))),
                    sigma: Newtons(0.02),
                })
                .collect();
            counted.calls.store(0, Ordering::Relaxed);
            let fit = fit(&samples, &options);
            let calls = counted.calls.load(Ordering::Relaxed);
            assert!(calls < limit, "{} {number}: {calls}", counted.key());
            match fit {
                Ok(fit) => {
                    let values = fit.parameters.iter().map(|one| one.value);
                    assert!(values.chain([fit.r2, fit.rmse_n]).all(f64::is_finite), "{fit:?}");
                }
                Err(err) => assert!(err.to_string().len() > 20, "{err}"),
            }
        }
    }
}
