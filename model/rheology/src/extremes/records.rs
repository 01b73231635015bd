//! Records of few samples, of too little movement, of odd sizes.

use super::fits::{DEFAULT_FIT, fit_answer};
use super::judge::{ExpectedAnswer, ExtremesRow, SubjectAnswer, judge};
use super::members::make_member;
use super::{ExtremesExtent, ExtremesPart, rows_of};
use crate::families::{Family, Model, OuterParameter, OuterRange, PowerSeries};
use crate::fit::FitSample;
use palpate_model::units::{Depth, Newtons, Seconds};
use palpate_model::viscoelastic::ModifiedKelvin;
use std::sync::Arc;

pub(super) const GROUP: &str = "records";
/// Largest relative error of a parameter from a record without noise: rounding times the condition of
/// the worst design.
const TOLERANCE: f64 = 1e-6;

/// Changes a sample into an extreme one.
type Spoiler = fn(&mut FitSample);

/// A record without noise of any size.
struct RecordCase {
    case: &'static str,
    expected: ExpectedAnswer,
    /// Depth over time at a scale of 1 s and 20 mm.
    path: Vec<(f64, f64)>,
    time: f64,
    depth: f64,
    force: f64,
    offset: f64,
    tolerance: f64,
    /// A change of every sample, after which no body is the true one.
    spoil: Option<Spoiler>,
}

impl RecordCase {
    fn new(case: &'static str, expected: ExpectedAnswer, path: Vec<(f64, f64)>) -> Self {
        Self {
            case,
            expected,
            path,
            time: 1.0,
            depth: 1.0,
            force: 1.0,
            offset: 0.0,
            tolerance: TOLERANCE,
            spoil: None,
        }
    }

    /// Its record of a body, with `force` filled in along `(t, depth)`.
    fn samples(&self, force: impl Fn(&[(Seconds, Depth)]) -> Option<Vec<f64>>) -> Vec<FitSample> {
        let path: Vec<(Seconds, Depth)> = self
            .path
            .iter()
            .map(|&(t, depth)| (Seconds(self.time * t), Depth(self.depth * depth)))
            .collect();
        let forces = force(&path).unwrap_or_default();
        let mut samples: Vec<FitSample> = path
            .iter()
            .zip(forces)
            .map(|(&(t, depth), force)| FitSample {
                t,
                depth,
                force: Newtons(force + self.offset),
                sigma: Newtons(0.02 * self.force),
            })
            .collect();
        if let Some(spoil) = self.spoil {
            samples.iter_mut().for_each(spoil);
        }
        samples
    }

    fn judge(&self, subject: &str, answer: SubjectAnswer) -> ExtremesRow {
        judge(GROUP, self.case, subject, self.expected, self.tolerance, answer)
    }
}

/// A ramp to 20 mm in 5 s, a hold of 15 s, half the way back in 1 s and a hold of 4 s, in `count`
/// samples.
fn path(count: u32) -> Vec<(f64, f64)> {
    let at = |t: f64| {
        let back = 10.0 * (t - 20.0).clamp(0.0, 1.0);
        4.0 * t.min(5.0) - back
    };
    (0..count).map(|i| 25.0 * f64::from(i) / f64::from(count - 1)).map(|t| (t, at(t))).collect()
}

/// A record of the thesis body along that path.
pub(super) fn ramp_hold(count: u32) -> Vec<FitSample> {
    let case = RecordCase::new("", ExpectedAnswer::Number, path(count));
    case.samples(|path| thesis(ModifiedKelvin::THESIS).along(path.iter().copied()).ok())
}

/// A thesis body as a model of the third order.
fn thesis(body: ModifiedKelvin) -> Model {
    let [mu1, mu2, mu3] = body.mu;
    Model {
        family: "series-3".to_owned(),
        outer: vec![body.tau_eps],
        linear: vec![mu1, mu2, mu3, body.tau_sig],
    }
}

fn cases(extent: ExtremesExtent) -> Vec<RecordCase> {
    use ExpectedAnswer::{Either, Number, Refusal};
    let full = || path(161);
    let ramp: Vec<(f64, f64)> =
        (0..100).map(|i| f64::from(i) * 0.05).map(|t| (t, 4.0 * t)).collect();
    let stairs: Vec<(f64, f64)> =
        full().chunks(2).flat_map(|pair| pair.iter().map(|&(t, _)| (t, pair[0].1))).collect();
    let mut cases = vec![
        RecordCase::new("0 samples", Refusal, Vec::new()),
        RecordCase::new("1 sample", Refusal, path(161)[..1].to_vec()),
        RecordCase::new("2 samples", Refusal, path(2)),
        RecordCase::new("5 samples", Either, path(5)),
        RecordCase::new(
            "constant depth",
            Refusal,
            (0..100).map(|i| (0.1 * f64::from(i), 8.0)).collect(),
        ),
        RecordCase::new("ramp only", Either, ramp),
        RecordCase::new("every depth twice", Number, stairs),
        RecordCase::new("ramp, hold, then retraction to half the depth", Number, full()),
        RecordCase {
            offset: 2e6,
            tolerance: 1e-3,
            ..RecordCase::new("an offset of 1e6 times the signal", Number, full())
        },
    ];
    let subnormal: [(&str, Spoiler); 4] = [
        ("subnormal depths", |one| one.depth.0 *= 1e-310),
        ("subnormal forces", |one| one.force.0 *= 1e-310),
        ("subnormal uncertainties", |one| one.sigma.0 *= 1e-310),
        ("subnormal times", |one| one.t.0 *= 1e-310),
    ];
    cases.extend(subnormal.map(|(case, spoil)| RecordCase {
        spoil: Some(spoil),
        ..RecordCase::new(case, Refusal, full())
    }));
    cases.push(RecordCase {
        // Seconds since 1970, which a double holds to 2.4e-7 s: two millionths of a step.
        spoil: Some(|one| one.t.0 += 1.8e9),
        tolerance: 1e-3,
        ..RecordCase::new("times since 1970", Number, full())
    });
    if extent == ExtremesExtent::Quick {
        return cases;
    }
    let sized = |case: &'static str, expected, [time, depth, force]: [f64; 3]| RecordCase {
        time,
        depth,
        force,
        ..RecordCase::new(case, expected, full())
    };
    cases.extend([
        sized("forces of 1e-6 N", Number, [1.0, 1.0, 1e-6]),
        sized("forces of 1e6 N", Number, [1.0, 1.0, 1e6]),
        sized("forces of 1e-100 N", Either, [1.0, 1.0, 1e-100]),
        sized("forces of 1e100 N", Either, [1.0, 1.0, 1e100]),
        sized("forces of 1e290 N", Either, [1.0, 1.0, 1e290]),
        sized("depths of 1e-6 mm", Number, [1.0, 1e-6, 1.0]),
        sized("depths of 1e3 mm", Number, [1.0, 50.0, 1.0]),
        sized("depths of 1e100 mm", Either, [1.0, 1e100, 1.0]),
        sized("relaxation in 1e-9 s, steps of 1e-10 s", Number, [1e-9, 1.0, 1.0]),
        sized("relaxation in 1e4 s, steps of 1e3 s", Number, [1e4, 1.0, 1.0]),
        sized("relaxation in 1e9 s, steps of 1e8 s", Number, [1e9, 1.0, 1.0]),
        sized("relaxation in 1e-100 s", Either, [1e-100, 1.0, 1.0]),
        sized("relaxation in 1e100 s", Either, [1e100, 1.0, 1.0]),
    ]);
    cases
}

pub(super) fn rows(
    extent: ExtremesExtent,
    family: &Arc<dyn Family>,
    progress: &mut dyn FnMut(f64),
) -> Vec<ExtremesRow> {
    let mut cases = cases(extent);
    if times(&**family) > TIMES_SHOWN {
        for case in &mut cases {
            if case.expected == ExpectedAnswer::Number {
                case.expected = ExpectedAnswer::Either;
            }
        }
    }
    let subject = format!("fit of {}", family.key());
    rows_of(cases, progress, |case| case.judge(&subject, family_answer(family, &case)))
}

fn family_answer(family: &Arc<dyn Family>, case: &RecordCase) -> SubjectAnswer {
    // Relaxation times around a second on the record's scale.
    let first = if times(&**family) > 1 { 0.2 } else { 1.0 };
    let body = make_member(&**family, first * case.time, 20.0 * case.depth, 2.0 * case.force);
    let samples = case.samples(|path| body.along(path.iter().copied()).ok());
    fit_answer(Arc::clone(family), &samples, Some(&body))
}

fn times(family: &dyn Family) -> usize {
    let outer = family.outer();
    let is_time = |one: &&OuterParameter| one.range == OuterRange::Time;
    outer.iter().filter(is_time).count()
}

/// More relaxation times than these, a decade apart, are beyond what a record of 25 s can show.
const TIMES_SHOWN: usize = 2;

/// The same records for the fit of the thesis body.
pub(super) fn thesis_part(extent: ExtremesExtent) -> ExtremesPart {
    ExtremesPart::new(GROUP, DEFAULT_FIT.to_owned(), move |progress| {
        rows_of(cases(extent), progress, |case| {
            let known = ModifiedKelvin::THESIS;
            let scale = |power: i32| case.force / case.depth.powi(power);
            let body = ModifiedKelvin {
                tau_eps: known.tau_eps * case.time,
                mu: [1, 2, 3].map(|power| known.mu[power as usize - 1] * scale(power)),
                tau_sig: known.tau_sig * scale(2) * case.time,
            };
            let model = thesis(body);
            let samples = case.samples(|path| model.along(path.iter().copied()).ok());
            let answer = fit_answer(Arc::new(PowerSeries::THESIS), &samples, Some(&model));
            case.judge(DEFAULT_FIT, answer)
        })
    })
}
