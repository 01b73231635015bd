//! Long records at a constant step, streamed: 1e8 samples, 24 h at 1 kHz.

use super::judge::{Answer, Expected, Row, judged};
use super::members::member;
use super::{Extent, Part};
use crate::families::{Model, by_key};
use crate::reference::Reference;
use crate::units::{Depth, Newtons, Seconds};

/// Name of the group.
pub(super) const GROUP: &str = "long records";
/// Depth moves by a power of two, so that no sample is rounded and the path is as straight as it says.
const MOVE: f64 = 1.0 / 65536.0;
/// Samples from corner to corner: 8 mm.
const LEG: u64 = 8 * 65536;
/// Largest drift over any number of samples, relative to the peak force.
const TOLERANCE: f64 = 1e-13;
/// Terms up to which a family takes the longest records outside a soak: a nanosecond or ten each.
const CHEAP: usize = 2;

pub(super) fn parts(extent: Extent, key: &str) -> Vec<Part> {
    let key = key.to_owned();
    vec![Part::new(GROUP, key.clone(), move |progress| {
        let Ok(family) = by_key(&key) else {
            return Vec::new();
        };
        let model = member(&*family, 2.0, 20.0, 2.0);
        let is_cheap = model
            .terms()
            .is_ok_and(|terms| terms.len() <= CHEAP && family.outer().len() <= 1);
        let cases: &[(&str, u64, f64)] = match extent {
            Extent::Quick => &[("1e6 samples of 1 ms", 1_000_000, 1e-3)],
            Extent::Whole if !is_cheap => &[("1e7 samples of 1 ms", 10_000_000, 1e-3)],
            Extent::Whole | Extent::Soak => &[
                ("1e8 samples of 1 us", 100_000_000, 1e-6),
                ("24 h at 1 kHz, 86.4e6 samples", 86_400_000, 1e-3),
            ],
        };
        let count = cases.len() as f64;
        let rows = cases
            .iter()
            .enumerate()
            .map(|(index, &(case, samples, dt))| {
                let answer = drift(&model, samples, dt, |share| {
                    progress((index as f64 + share) / count);
                });
                judged(
                    GROUP,
                    case.to_owned(),
                    &key,
                    Expected::Number,
                    TOLERANCE,
                    answer,
                )
            });
        rows.collect::<Vec<Row>>()
    })]
}

/// Largest error at the corners of a path that goes in, rests, comes out and rests, again and again.
fn drift(model: &Model, samples: u64, dt: f64, mut progress: impl FnMut(f64)) -> Answer {
    let words = |err: &dyn std::fmt::Display| Answer::Refused(err.to_string());
    let (mut body, terms) = match (model.at_rest_from(Depth(0.0)), model.terms()) {
        (Ok(body), Ok(terms)) => (body, terms),
        (Err(err), _) => return words(&err),
        (_, Err(err)) => return words(&err),
    };
    let mut reference = match Reference::new(&terms, Depth(0.0)) {
        Ok(reference) => reference,
        Err(err) => return words(&err),
    };
    let (mut depth, mut done, mut worst, mut peak) = (0.0, 0, 0.0f64, 0.0f64);
    for direction in [1.0, 0.0, -1.0, 0.0].into_iter().cycle() {
        let leg = LEG.min(samples - done);
        if leg == 0 {
            break;
        }
        let mut force = Newtons(0.0);
        for _ in 0..leg {
            depth += direction * MOVE;
            force = match body.step(Depth(depth), Seconds(dt)) {
                Ok(force) => force,
                Err(err) => return words(&err),
            };
        }
        // The duration of a leg in one product is off by half a last digit, which changes no force.
        let exact = match reference.step(Depth(depth), Seconds(leg as f64 * dt)) {
            Ok(exact) => exact,
            Err(err) => return words(&err),
        };
        peak = peak.max(exact.0.abs());
        let miss = reference.error_of(force).abs();
        worst = if force.is_finite() {
            worst.max(miss)
        } else {
            f64::INFINITY
        };
        done += leg;
        progress(done as f64 / samples as f64);
    }
    Answer::Number {
        error: worst / peak,
        warnings: Vec::new(),
    }
}
