//! Long records at a constant step, streamed: 1e8 samples, 24 h at 1 kHz.

use super::judge::{ExpectedAnswer, ExtremesRow, SubjectAnswer, judge};
use super::members::make_member;
use super::{ExtremesExtent, ExtremesPart};
use crate::families::{Family, RelaxationTerm, StepError};
use crate::integrators::{ExactIntegrator, Integrator, IntegratorStart, Scheme, SeriesBody};
use crate::reference::Reference;
use palpate_model::units::{Depth, Newtons, Seconds};
use palpate_model::viscoelastic::ModifiedKelvin;
use std::sync::Arc;

pub(super) const GROUP: &str = "long records";
/// Depth moves by a power of two, so that no sample is rounded and the path is as straight as it says.
const MOVE: f64 = 1.0 / 65_536.0;
/// Samples from corner to corner: 8 mm.
const LEG: u64 = 8 * 65_536;
/// Largest drift over any number of samples, relative to the peak force.
const TOLERANCE: f64 = 1e-13;
/// Terms from which on a family takes a shorter record outside a soak: each costs nanoseconds a sample.
const MANY: usize = 12;

/// Name, samples and step in s.
type Case = (&'static str, u64, f64);
const SHORTEST: Case = ("1e5 samples of 1 ms", 100_000, 1e-3);
const SHORT: Case = ("1e6 samples of 1 ms", 1_000_000, 1e-3);
const LONG: Case = ("1e7 samples of 1 ms", 10_000_000, 1e-3);
const LONGEST: [Case; 2] = [
    ("1e8 samples of 1 us", 100_000_000, 1e-6),
    ("24 h at 1 kHz, 86.4e6 samples", 86_400_000, 1e-3),
];

pub(super) fn rows(
    extent: ExtremesExtent,
    family: &Arc<dyn Family>,
    progress: &mut dyn FnMut(f64),
) -> Vec<ExtremesRow> {
    let model = make_member(&**family, 2.0, 20.0, 2.0);
    let has_many = model.terms().is_ok_and(|terms| terms.len() > MANY);
    let cases: &[Case] = match extent {
        ExtremesExtent::Quick if has_many => &[SHORTEST],
        ExtremesExtent::Quick => &[SHORT],
        ExtremesExtent::Whole if has_many => &[SHORT],
        ExtremesExtent::Whole => &[LONG],
        ExtremesExtent::Soak => &LONGEST,
    };
    case_rows(cases, &family.key(), progress, |samples, dt, progress| {
        let words = |err: &dyn std::fmt::Display| err.to_string();
        let mut body = model.at_rest_from(Depth(0.0)).map_err(|err| words(&err))?;
        let terms = model.terms().map_err(|err| words(&err))?;
        let step = |depth| body.step(Depth(depth), Seconds(dt));
        drift(&terms, samples, dt, step, progress)
    })
}

/// The same for the exact step at a constant rate, which is made for records as long as these.
pub(super) fn scheme_part(extent: ExtremesExtent) -> ExtremesPart {
    let subject = format!("{}, f64", Scheme::Exact.name());
    ExtremesPart::new(GROUP, subject.clone(), move |progress| {
        let body = SeriesBody::<3>::from(ModifiedKelvin::THESIS);
        let cases: &[Case] = match extent {
            ExtremesExtent::Quick => &[SHORT],
            ExtremesExtent::Whole | ExtremesExtent::Soak => &LONGEST,
        };
        case_rows(cases, &subject, progress, |samples, dt, progress| {
            let start = IntegratorStart { depth: 0.0, force: None };
            let mut exact = ExactIntegrator::<f64, 3>::at_any_step(&body, dt, start);
            let step = |depth| exact.step(depth).map(Newtons);
            drift(&[body.term()], samples, dt, step, progress)
        })
    })
}

fn case_rows(
    cases: &[Case],
    subject: &str,
    progress: &mut dyn FnMut(f64),
    answer: impl Fn(u64, f64, &mut dyn FnMut(f64)) -> Result<SubjectAnswer, String>,
) -> Vec<ExtremesRow> {
    let count = cases.len() as f64;
    let mut rows = Vec::new();
    for (index, &(case, samples, dt)) in cases.iter().enumerate() {
        let mut within = |share| progress((index as f64 + share) / count);
        let answer = answer(samples, dt, &mut within).unwrap_or_else(SubjectAnswer::Refused);
        rows.push(judge(GROUP, case, subject, ExpectedAnswer::Number, TOLERANCE, answer));
    }
    rows
}

/// Largest error at the corners of a path that goes in, rests, comes out and rests, again and again.
fn drift(
    terms: &[RelaxationTerm],
    samples: u64,
    dt: f64,
    mut step: impl FnMut(f64) -> Result<Newtons, StepError>,
    progress: &mut dyn FnMut(f64),
) -> Result<SubjectAnswer, String> {
    let mut reference = Reference::new(terms, Depth(0.0)).map_err(|err| err.to_string())?;
    let (mut depth, mut done, mut worst, mut peak) = (0.0, 0, 0.0f64, 0.0f64);
    for direction in [1.0, 0.0, -1.0, 0.0].into_iter().cycle() {
        let leg = LEG.min(samples - done);
        if leg == 0 {
            break;
        }
        let mut force = Newtons(0.0);
        for _ in 0..leg {
            depth += direction * MOVE;
            force = step(depth).map_err(|err| err.to_string())?;
        }
        // The duration of a leg in one product is off by half a last digit, which changes no force.
        let exact = reference
            .step(Depth(depth), Seconds(leg as f64 * dt))
            .map_err(|err| err.to_string())?;
        peak = peak.max(exact.0.abs());
        let miss = reference.error_of(force).abs();
        worst = if force.is_finite() { worst.max(miss) } else { f64::INFINITY };
        done += leg;
        progress(done as f64 / samples as f64);
    }
    Ok(SubjectAnswer::Number { error: worst / peak, warnings: Vec::new() })
}
