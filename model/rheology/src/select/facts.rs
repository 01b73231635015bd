//! Depth, speed and force of a record, from its samples.

use crate::fit::FitSample;
use serde::Serialize;

/// Two records differ in depth or in speed if one is this many times the other: more than rigs and
/// specimens vary under the same protocol.
const UNLIKE: f64 = 1.1;
/// Depth within this share of the stroke of the peak is the peak.
const AT_PEAK: f64 = 0.005;

/// One record in a few numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RecordFacts {
    pub record: String,
    /// The specimen pressed, where it is known.
    pub specimen: Option<String>,
    /// Samples whose force counts.
    pub samples: usize,
    /// Greatest depth in mm.
    pub depth_mm: f64,
    /// Mean speed from a tenth to nine tenths of the way to it, in mm/s.
    pub speed_mm_per_s: f64,
    /// Largest size of the force in N, above the sensor offset that the best family finds.
    pub peak_n: f64,
    /// First sample at the greatest depth.
    #[serde(skip)]
    pub(super) arrival: usize,
}

impl RecordFacts {
    /// The facts of a record whose samples were checked.
    pub(super) fn of(name: &str, samples: &[FitSample]) -> Self {
        let deepest = samples.iter().fold(f64::NEG_INFINITY, |all, one| all.max(one.depth.0));
        let start = samples.first().map_or(0.0, |one| one.depth.0);
        let stroke = deepest - start;
        let first = |level: f64| {
            let found = samples.iter().position(|one| one.depth.0 >= level);
            found.unwrap_or(samples.len().saturating_sub(1))
        };
        let high = first(start + 0.9 * stroke);
        let low = samples[..high]
            .iter()
            .rposition(|one| one.depth.0 <= start + 0.1 * stroke)
            .unwrap_or(0);
        let took = samples[high].t.0 - samples[low].t.0;
        let forces = samples.iter().filter(|one| one.is_measured());
        Self {
            record: name.to_owned(),
            specimen: None,
            samples: forces.count(),
            depth_mm: deepest,
            speed_mm_per_s: if took > 0.0 {
                (samples[high].depth.0 - samples[low].depth.0) / took
            } else {
                0.0
            },
            peak_n: peak_force(samples, 0.0),
            arrival: first(deepest - AT_PEAK * stroke),
        }
    }
}

/// Largest size of the measured force above `offset`, in N.
pub(super) fn peak_force(samples: &[FitSample], offset: f64) -> f64 {
    let forces = samples.iter().filter(|one| one.is_measured());
    forces.fold(0.0, |all, one| all.max((one.force.0 - offset).abs()))
}

/// Whether two depths or two speeds are not meant to be the same.
pub(super) fn are_unlike(a: f64, b: f64) -> bool {
    a.max(b) > UNLIKE * a.min(b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::units::{Depth, Newtons, Seconds};

    #[test]
    fn facts_of_a_ramp_and_hold_after_a_wait_are_right() {
        let samples: Vec<FitSample> = (0..200)
            .map(|i| {
                let t = 0.1 * f64::from(i);
                FitSample {
                    t: Seconds(t),
                    depth: Depth((2.0 * (t - 3.0)).clamp(0.0, 10.0)),
                    force: Newtons(-0.1 * t),
                    sigma: Newtons(0.01),
                }
            })
            .collect();
        let facts = RecordFacts::of("run", &samples);
        assert!((facts.speed_mm_per_s - 2.0).abs() < 1e-9);
        assert!((facts.depth_mm - 10.0).abs() < 1e-12);
        assert!((facts.peak_n - 1.99).abs() < 1e-12);
        assert_eq!(facts.arrival, 80);
        assert!(are_unlike(1.0, 1.2) && are_unlike(1.2, 1.0) && !are_unlike(1.0, 1.05));
    }
}
