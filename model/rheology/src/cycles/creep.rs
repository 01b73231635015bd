//! The depth that grows while the force is held.

use super::local::{line, mean};
use super::{CycleSample, Estimate};
use palpate_model::units::{Depth, Newtons, Seconds};

/// Creep of one hold of a force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Creep {
    /// From the first to the last sample.
    pub duration: Seconds,
    pub force: Newtons,
    /// Standard deviation of the force about it: how well it was held, noise included.
    pub force_sd: Newtons,
    pub depth_start: Depth,
    /// Depth at the end: a line through the last tenth of the hold, read at its end. Its error has a part that no
    /// number of samples averages away where the step of the axis is known.
    pub depth_end: Estimate<Depth>,
    /// Growth of the depth, in percent of the depth at the start.
    pub percent: f64,
    /// Slope of that line in mm/s: what a longer hold would still add.
    pub rate_end: Estimate<f64>,
}

/// Last part of a hold from which its end is read.
const TAIL: f64 = 0.1;

/// Standard uncertainty of the slope of a line through a staircase, in pulses over its time. One stair met at a share u
/// of that time gives a slope of `6 u (1 - u)`; met with probability p the slope has a variance of `1.2 p - p^2`, 0.36 at
/// most. Where there are more stairs it is less.
const STAIR_RATE: f64 = 0.6;

/// Measures a hold of force; `None` for fewer than twenty samples or none in tissue. `pulse` is the least step of the
/// depth: where the tissue would be follows the staircase by up to half of one, a standard uncertainty of
/// `pulse / sqrt(12)` (JCGM 100:2008, 4.3.7) that samples on one stair share.
#[must_use]
pub fn creep(hold: &[CycleSample], pulse: Option<Depth>) -> Option<Creep> {
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
    let stair = pulse.map_or(0.0, |pulse| pulse.0 / 12f64.sqrt());
    let [depth, depth_error] = end.value;
    let [rate, rate_error] = end.slope;
    let stair_rate = STAIR_RATE * pulse.map_or(0.0, |pulse| pulse.0) / (TAIL * duration);
    let [force, error] = mean(hold.iter().map(|one| one.force.0))?;
    Some(Creep {
        duration: Seconds(duration),
        force: Newtons(force),
        force_sd: Newtons(error * (hold.len() as f64).sqrt()),
        depth_start: first.depth,
        depth_end: Estimate::of(Depth, [depth, depth_error.hypot(stair)]),
        percent: 100.0 * (depth / first.depth.0 - 1.0),
        rate_end: Estimate::of(|rate| rate, [rate, rate_error.hypot(stair_rate)]),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::rig::Phase;

    #[test]
    fn a_kelvin_voigt_body_creeps_by_its_formula() {
        // 10 mm at once and 2 mm more with 5 s.
        let at = |t: f64| CycleSample {
            t: Seconds(t),
            depth: Depth(10.0 + 2.0 * (1.0 - (-t / 5.0).exp())),
            force: Newtons(3.0),
            phase: Phase::Hold,
            cycle: 1,
            step: 0,
        };
        let hold: Vec<CycleSample> = (0..=10_000).map(|i| at(f64::from(i) * 1e-3)).collect();
        let found = creep(&hold, None).unwrap();
        let end = 2.0 * (1.0 - (-2.0f64).exp());
        assert_eq!((found.depth_start, found.force), (Depth(10.0), Newtons(3.0)));
        // A line through a second of it misses its curvature by x'' / 12 s^2.
        assert!((found.depth_end.value.0 - 10.0 - end).abs() < 1.5e-3);
        assert!((found.percent - 10.0 * end).abs() < 1.5e-2);
        let rate = 0.4 * (-2.0f64).exp();
        assert!((found.rate_end.value / rate - 1.0).abs() < 0.12);
        assert_eq!(found.force_sd, Newtons(0.0));
        assert!(creep(&hold[..19], None).is_none());
    }

    #[test]
    fn a_staircase_is_known_to_its_stairs_and_no_better() {
        // Stairs of 15 um that begin anywhere, and a last tenth of 10 s: none in it, one in some, one in most.
        let pulse = 0.015;
        for rate in [0.0, 4e-4, 9e-4] {
            let (mut depths, mut rates, count) = (0.0, 0.0, 300);
            for k in 0..count {
                let from = 20.0 + pulse * f64::from(k) / f64::from(count);
                let hold: Vec<CycleSample> = (0..=10_000)
                    .map(|i| 0.01 * f64::from(i))
                    .map(|t| CycleSample {
                        t: Seconds(t),
                        depth: Depth(((from + rate * t) / pulse).round() * pulse),
                        force: Newtons(3.0),
                        phase: Phase::Creep,
                        cycle: 1,
                        step: 0,
                    })
                    .collect();
                let found = creep(&hold, Some(Depth(pulse))).unwrap();
                let error = found.depth_end.std_error.0;
                assert!(error >= pulse / 12f64.sqrt() && error < pulse, "{found:?}");
                depths += ((found.depth_end.value.0 - from - 100.0 * rate) / error).powi(2);
                rates += ((found.rate_end.value - rate) / found.rate_end.std_error).powi(2);
            }
            // The error is that of the misses, or a little more.
            let [depths, rates] = [depths, rates].map(|sum| (sum / f64::from(count)).sqrt());
            println!("{rate}: depth {depths:.2}, rate {rates:.2} standard errors rms");
            assert!((0.4..1.2).contains(&depths), "{depths}");
            // An even staircase without a stair in it misses nothing.
            assert!(rates < 1.1 && (rate == 0.0 || rates > 0.3), "{rates}");
        }
    }
}
