//! The depth that grows while the force is held.

use super::local::{line, mean};
use super::{CycleSample, Estimate};
use crate::units::{Depth, Newtons, Seconds};

/// What one hold of a force shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Creep {
    /// From the first to the last sample.
    pub duration: Seconds,
    /// Mean force.
    pub force: Newtons,
    /// Standard deviation of the force about it: how well it was held, noise included.
    pub force_sd: Newtons,
    /// Depth at the start.
    pub depth_start: Depth,
    /// Depth at the end: a line through the last tenth of the hold, read at its end.
    pub depth_end: Estimate<Depth>,
    /// What was added, in percent of the depth at the start.
    pub percent: f64,
    /// Slope of that line in mm/s: what a longer hold would still add.
    pub rate_end: Estimate<f64>,
}

/// Last part of a hold from which its end is read.
const TAIL: f64 = 0.1;

/// Measures a hold of force; `None` for fewer than twenty samples or none in tissue.
#[must_use]
pub fn creep(hold: &[CycleSample]) -> Option<Creep> {
    let (first, last) = (hold.first()?, hold.last()?);
    let duration = last.t.0 - first.t.0;
    if hold.len() < 20 || duration <= 0.0 || first.depth.0 <= 0.0 {
        return None;
    }
    let tail: Vec<[f64; 2]> = hold
        .iter()
        .filter(|one| one.t.0 >= last.t.0 - TAIL * duration)
        .map(|one| [one.t.0, one.depth.0])
        .collect();
    let end = line(&tail, last.t.0)?;
    let [force, error] = mean(hold.iter().map(|one| one.force.0))?;
    Some(Creep {
        duration: Seconds(duration),
        force: Newtons(force),
        force_sd: Newtons(error * (hold.len() as f64).sqrt()),
        depth_start: first.depth,
        depth_end: Estimate::of(Depth, end.value),
        percent: 100.0 * (end.value[0] / first.depth.0 - 1.0),
        rate_end: Estimate::of(|rate| rate, end.slope),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::Phase;

    #[test]
    fn a_kelvin_voigt_body_creeps_by_its_formula() {
        // 10 mm at once and 2 mm more with 5 s.
        let at = |t: f64| CycleSample {
            t: Seconds(t),
            depth: Depth(10.0 + 2.0 * (1.0 - (-t / 5.0).exp())),
            force: Newtons(3.0),
            phase: Phase::Hold,
            cycle: 1,
        };
        let hold: Vec<CycleSample> = (0..=10_000).map(|i| at(f64::from(i) * 1e-3)).collect();
        let found = creep(&hold).unwrap();
        let end = 2.0 * (1.0 - (-2.0f64).exp());
        assert_eq!(
            (found.depth_start, found.force),
            (Depth(10.0), Newtons(3.0))
        );
        // A line through a second of it misses its curvature by x'' / 12 s^2.
        assert!((found.depth_end.value.0 - 10.0 - end).abs() < 1.5e-3);
        assert!((found.percent - 10.0 * end).abs() < 1.5e-2);
        let rate = 0.4 * (-2.0f64).exp();
        assert!((found.rate_end.value / rate - 1.0).abs() < 0.12);
        assert_eq!(found.force_sd, Newtons(0.0));
        assert!(creep(&hold[..19]).is_none());
    }
}
