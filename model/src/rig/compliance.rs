//! Machine compliance of a rig, from a run against something stiff, and the correction of depth by it.

use crate::units::{Depth, Newtons, Position};
use thiserror::Error;

/// One sample of a run against a stiff surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StiffSample {
    /// Commanded position from home.
    pub position: Position,
    /// Force above tare.
    pub force: Newtons,
    /// Its standard uncertainty relative to that of the others: only ratios matter. Where a load cell is
    /// insensitive, forces have little weight.
    pub sigma: Newtons,
}

/// Compliance of a rig with everything that was between its axis and the stiff surface, the surface included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compliance {
    /// Way of the axis per force, in mm/N.
    pub mm_per_newton: f64,
    /// Its standard error.
    pub std_error: f64,
    /// Position from home at which the straight line has no force: the stiff surface.
    pub surface: Position,
    /// Its standard error in mm.
    pub surface_std_error_mm: f64,
    /// Standard deviation of the forces about the line in N, each by its weight.
    pub rmse_n: f64,
    /// Samples in the line.
    pub samples: usize,
}

/// No compliance follows from a run.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ComplianceError {
    /// Too little data above the seating force.
    #[error(
        "only {samples} samples are above the seating force of {seating:.2}; at least {SAMPLES_MIN} are needed, so press further or more slowly"
    )]
    TooShort {
        samples: usize,
        /// The seating force.
        seating: Newtons,
    },
    /// The force does not rise with position.
    #[error(
        "the force does not rise with position, so the probe did not touch anything stiff; check what is in front of the probe"
    )]
    NotRising,
    /// Not a straight line.
    #[error(
        "force over position is not a straight line: it deviates by {bend:.1} %, and at most {limit:.0} % are allowed; clean the stiff surface and fix it firmly, or raise the seating force"
    )]
    Curved {
        /// Greatest deviation of a parabola from the line as a share of the force range, in percent.
        bend: f64,
        limit: f64,
    },
}

/// Fewer samples do not tell a line from a parabola.
const SAMPLES_MIN: usize = 30;

/// A line is straight if a parabola leaves it by less than this share of the range of force: a correction
/// that is wrong by 2 % of itself is far below a pulse on any rig worth correcting.
const BEND_MAX: f64 = 0.02;

/// A bend counts once it is beyond noise by so many standard errors.
const BEND_SIGMAS: f64 = 3.0;

/// The line decides which samples are seated, and those decide the line: two or three rounds settle it.
const ROUNDS_MAX: usize = 8;

/// Estimates the compliance of a rig from slow runs forward onto a stiff surface, by a straight line through
/// the samples from where it reaches `seating`: before, surfaces touch at their roughest points only.
///
/// Positions are commanded and exact; forces carry the noise. So force is fitted over position,
/// `F = (x - x_0) / C`, by weighted least squares, and `C` follows with its error to first order. Samples are
/// chosen by position for the same reason: chosen by their own force, those near the seating force would be
/// the ones with positive noise, and the line would bend and tilt.
pub fn fit_compliance(
    samples: &[StiffSample],
    seating: Newtons,
) -> Result<Compliance, ComplianceError> {
    let known: Vec<WeightedSample> = samples.iter().filter_map(WeightedSample::of).collect();
    let by_force = known.iter().filter(|one| one.force >= seating.0);
    let mut line = Line::through(by_force.copied().collect(), seating)?;
    for _ in 0..ROUNDS_MAX {
        let from = line.middle + (seating.0 - line.force_mean) * line.half / line.slope;
        let seated = known.iter().filter(|one| one.position >= from);
        let next = Line::through(seated.copied().collect(), seating)?;
        let is_settled = next.samples == line.samples;
        line = next;
        if is_settled {
            break;
        }
    }
    line.check_straight()?;
    Ok(line.compliance())
}

/// A sample as the line takes it, in mm and N.
#[derive(Clone, Copy)]
struct WeightedSample {
    position: f64,
    force: f64,
    weight: f64,
}

impl WeightedSample {
    fn of(sample: &StiffSample) -> Option<Self> {
        let weight = sample.sigma.0.powi(-2);
        let is_known = sample.position.is_finite() && sample.force.is_finite();
        (is_known && weight.is_finite() && weight > 0.0).then_some(Self {
            position: sample.position.0,
            force: sample.force.0,
            weight,
        })
    }
}

/// Force over `u`, the position from its middle in halves of its range, and how a parabola would leave the line.
struct Line {
    samples: usize,
    middle: f64,
    half: f64,
    force_mean: f64,
    slope: f64,
    slope_error: f64,
    variance: f64,
    bend: f64,
    bend_error: f64,
}

impl Line {
    fn through(used: Vec<WeightedSample>, seating: Newtons) -> Result<Self, ComplianceError> {
        let (samples, count) = (used.len(), used.len() as f64);
        if samples < SAMPLES_MIN {
            return Err(ComplianceError::TooShort { samples, seating });
        }
        let weights: f64 = used.iter().map(|one| one.weight).sum();
        let mean = |of: &dyn Fn(&WeightedSample) -> f64| {
            used.iter().map(|one| one.weight * of(one)).sum::<f64>() / weights
        };
        let (middle, force_mean) = (mean(&|s| s.position), mean(&|s| s.force));
        let half = used.iter().fold(0.0f64, |max, s| max.max((s.position - middle).abs()));
        // Orthogonal polynomials over the samples: 1, u, u^2 - a u - b, with u in -1..1.
        let u = |s: &WeightedSample| (s.position - middle) / half;
        let (square, cube) = (mean(&|s| u(s).powi(2)), mean(&|s| u(s).powi(3)));
        let parabola = |s: &WeightedSample| u(s).powi(2) - cube / square * u(s) - square;
        let slope = mean(&|s| u(s) * s.force) / square;
        let parabola_square = mean(&|s| parabola(s).powi(2));
        let bend = mean(&|s| parabola(s) * s.force) / parabola_square;
        let residual = |s: &WeightedSample| s.force - force_mean - slope * u(s);
        let variance = mean(&|s| residual(s).powi(2)) * count / (count - 2.0);
        let slope_error = (variance / count / square).sqrt();
        // Three standard errors: a slope that could be noise is none.
        if !(half > 0.0 && slope > 3.0 * slope_error && slope.is_finite()) {
            return Err(ComplianceError::NotRising);
        }
        let curved = variance - bend.powi(2) * parabola_square;
        let bend_error = (curved.max(0.0) / count / parabola_square).sqrt();
        Ok(Self {
            samples,
            middle,
            half,
            force_mean,
            slope,
            slope_error,
            variance,
            bend,
            bend_error,
        })
    }

    fn check_straight(&self) -> Result<(), ComplianceError> {
        let share = self.bend.abs() / (2.0 * self.slope);
        if share > BEND_MAX && self.bend.abs() > BEND_SIGMAS * self.bend_error {
            return Err(ComplianceError::Curved { bend: 100.0 * share, limit: 100.0 * BEND_MAX });
        }
        Ok(())
    }

    fn compliance(&self) -> Compliance {
        let compliance = self.half / self.slope;
        let relative = self.slope_error / self.slope;
        Compliance {
            mm_per_newton: compliance,
            std_error: compliance * relative,
            surface: Position(self.middle - self.force_mean * compliance),
            // Mean force and slope of centred samples are independent.
            surface_std_error_mm: compliance
                * (self.variance / self.samples as f64 + (self.force_mean * relative).powi(2))
                    .sqrt(),
            rmse_n: self.variance.sqrt(),
            samples: self.samples,
        }
    }
}

/// A depth with what a rig's compliance takes from it. It never replaces the raw depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CorrectedDepth {
    /// `depth - compliance * force`.
    pub depth: Depth,
    /// Its standard uncertainty in mm from that of compliance and force; that of the raw depth is not in it.
    pub sigma_mm: f64,
}

impl Compliance {
    /// Depth of the probe itself where the axis is at a raw depth under a force.
    ///
    /// Contact is found at forces far below those of a measurement, and the rig gives way by as little there.
    pub fn correct(&self, raw: Depth, force: Newtons, force_sigma: Newtons) -> CorrectedDepth {
        let from_compliance = force.0 * self.std_error;
        let from_force = self.mm_per_newton * force_sigma.0;
        CorrectedDepth {
            depth: Depth(raw.0 - self.mm_per_newton * force.0),
            sigma_mm: from_compliance.hypot(from_force),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::SplitMix;

    /// A run onto a surface at 52.3 mm: `force` of the way past it, and white noise.
    fn run(noise: f64, seed: u64, force: impl Fn(f64) -> f64) -> Vec<StiffSample> {
        let mut random = SplitMix::seeded(seed);
        (0..4000)
            .map(|i| {
                let x = f64::from(i) * 3e-5 - 0.02;
                StiffSample {
                    position: Position(52.3 + x),
                    force: Newtons(force(x.max(0.0)) + noise * random.normal()),
                    sigma: Newtons(1.0),
                }
            })
            .collect()
    }

    #[test]
    fn a_straight_run_gives_compliance_and_surface() {
        let exact = fit_compliance(&run(0.0, 1, |x| x / 0.02), Newtons(0.5)).unwrap();
        assert!((exact.mm_per_newton / 0.02 - 1.0).abs() < 1e-10, "{exact:?}");
        assert!((exact.surface.0 - 52.3).abs() < 1e-10);
        let (mut slope, mut surface) = (0.0, 0.0);
        for seed in 0..40 {
            let found = fit_compliance(&run(0.02, seed, |x| x / 0.02), Newtons(0.5)).unwrap();
            slope += ((found.mm_per_newton - 0.02) / found.std_error).powi(2);
            surface += ((found.surface.0 - 52.3) / found.surface_std_error_mm).powi(2);
            assert!((found.rmse_n - 0.02).abs() < 0.002);
        }
        // Chi-square with 40 degrees: 16 to 76 holds all but 1e-3.
        assert!((16.0..76.0).contains(&slope), "{slope}");
        assert!((16.0..76.0).contains(&surface), "{surface}");
    }

    #[test]
    fn forces_that_are_worth_little_hardly_count() {
        // Above 3 N the cell says a tenth less than there is, and is known to be ten times as uncertain there.
        let mut samples = run(0.005, 5, |x| x / 0.02);
        let like = |samples: &[StiffSample]| fit_compliance(samples, Newtons(0.5)).unwrap();
        for sample in samples.iter_mut().filter(|one| one.force.0 > 3.0) {
            sample.force.0 -= 0.02;
        }
        let blind = like(&samples);
        for sample in samples.iter_mut().filter(|one| one.force.0 > 3.0) {
            sample.sigma = Newtons(10.0);
        }
        let weighed = like(&samples);
        let miss = |found: &Compliance| (found.mm_per_newton - 0.02).abs();
        assert!(miss(&weighed) < 0.2 * miss(&blind), "{blind:?} {weighed:?}");
        // All alike count as before, however large.
        let mut same = run(0.005, 5, |x| x / 0.02);
        let before = like(&same);
        same.iter_mut().for_each(|one| one.sigma = Newtons(4.0));
        assert_eq!(before, like(&same));
    }

    #[test]
    fn noise_at_the_seating_force_does_not_tilt_the_line() {
        // A soft rig and a short run, as a search for the base makes it: 0.12 to 0.4 N with 0.02 N of noise.
        let (mut squares, mut count) = (0.0, 0.0);
        for seed in 0..40 {
            let mut samples = run(0.02, seed, |x| x / 0.1);
            samples.retain(|one| one.position.0 < 52.34);
            // By noise alone one run in 370 is beyond three standard errors of the bend.
            if let Ok(found) = fit_compliance(&samples, Newtons(0.12)) {
                squares += ((found.mm_per_newton - 0.1) / found.std_error).powi(2);
                count += 1.0;
            }
        }
        assert!(count >= 38.0, "{count}");
        // Chi-square with 38 to 40 degrees, as above.
        assert!((16.0..76.0).contains(&squares), "{squares}");
    }

    #[test]
    fn seating_below_the_force_is_left_out() {
        // The first 10 um are ten times as soft.
        let seated = |x: f64| {
            if x < 0.01 { 5.0 * x } else { 0.05 + (x - 0.01) / 0.02 }
        };
        let found = fit_compliance(&run(0.005, 3, seated), Newtons(0.3)).unwrap();
        assert!((found.mm_per_newton - 0.02).abs() < 4.0 * found.std_error);
    }

    #[test]
    fn what_curves_or_is_soft_or_short_is_refused() {
        // Hertz: a ball on a plate, F ~ x^1.5.
        let hertz = fit_compliance(&run(0.01, 1, |x| 150.0 * x.powf(1.5)), Newtons(0.3));
        assert!(matches!(hertz, Err(ComplianceError::Curved { .. })), "{hertz:?}");
        let none = fit_compliance(&run(0.02, 1, |_| 1.0), Newtons(0.5));
        assert_eq!(none, Err(ComplianceError::NotRising));
        let short = fit_compliance(&run(0.0, 1, |x| x / 0.02), Newtons(4.99));
        assert!(matches!(short, Err(ComplianceError::TooShort { .. })));
        let still =
            vec![
                StiffSample { position: Position(1.0), force: Newtons(1.0), sigma: Newtons(1.0) };
                100
            ];
        assert_eq!(fit_compliance(&still, Newtons(0.5)), Err(ComplianceError::NotRising));
    }

    #[test]
    fn corrected_depth_stands_beside_the_raw_one() {
        let rig = Compliance {
            mm_per_newton: 0.02,
            std_error: 0.001,
            surface: Position(52.3),
            surface_std_error_mm: 0.001,
            rmse_n: 0.02,
            samples: 1000,
        };
        let corrected = rig.correct(Depth(30.0), Newtons(6.0), Newtons(0.1));
        assert!((corrected.depth.0 - 29.88).abs() < 1e-12);
        // 6 um from the compliance, 2 um from the force.
        assert!((corrected.sigma_mm - 0.006f64.hypot(0.002)).abs() < 1e-12);
    }
}
