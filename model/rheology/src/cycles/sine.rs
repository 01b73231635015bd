//! The force that answers a sine of depth: in phase, out of phase, and how much of it is no sine.

use super::{CycleSample, Estimate};
use palpate_model::linalg::Triangle;
use palpate_model::units::{Depth, Newtons};
use std::f64::consts::TAU;
use thiserror::Error;

/// Harmonics fitted: a cubic body answers a sine with three, the rest shows what is more.
const HARMONICS: usize = 5;
/// A constant, a drift, two for each harmonic, and the response.
const COLUMNS: usize = 3 + 2 * HARMONICS;
/// Samples a cycle needs so that the highest harmonic is no alias of another.
const PER_CYCLE_MIN: f64 = 12.0;
/// Cycles left out at the start, where as many again and one more remain: what the start from rest leaves decays
/// with the relaxation time.
const SETTLING: f64 = 1.0;
/// Least share of the depth's motion that has the frequency.
const MOTION_MIN: f64 = 0.05;
/// A force is no more than zero below so many standard deviations of the noise, as where a probe leaves on its way back,
const NOISE: f64 = 3.0;
/// or below this share of its amplitude: a zero that has drifted a little is zero all the same.
const ZERO_SHARE: f64 = 0.05;
/// Share of samples at zero above which contact was lost. Where the lowest force is six standard deviations, one sample
/// in 700 at the very bottom is that low by its noise.
const LOST_SHARE: f64 = 0.01;
/// A force that swings by this share of its amplitude below zero is of a specimen that is held and pulls back.
const PULL_SHARE: f64 = 0.5;

/// Response to a sine at one frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sinusoid {
    /// The frequency, in Hz.
    pub frequency: f64,
    pub cycles: u32,
    pub depth_mean: Depth,
    /// Amplitude of the depth at the frequency.
    pub depth_amplitude: Depth,
    pub force_mean: Newtons,
    /// Amplitude of the force at the frequency.
    pub force_amplitude: Estimate<Newtons>,
    /// How far the force leads the depth, in degrees.
    pub phase_degrees: Estimate<f64>,
    /// Force in phase with depth, per depth, in N/mm.
    pub storage: Estimate<f64>,
    /// Force a quarter of a cycle ahead of depth, per depth, in N/mm.
    pub loss: Estimate<f64>,
    /// Degrees of freedom of all standard errors.
    pub freedom: f64,
    /// Total harmonic distortion of the force: the root of the sum of squares of harmonics 2 to 5 over the first, in
    /// percent.
    pub distortion_percent: f64,
    /// Share of the samples evaluated whose force is zero within its noise; 0 where the specimen pulls as well.
    pub zero_share: f64,
}

impl Sinusoid {
    /// A warning that the numbers are not those of the tissue, because contact is lost.
    pub fn remark(&self) -> Option<String> {
        (self.zero_share > LOST_SHARE).then(|| {
            format!(
                "at {} Hz the force is zero within its noise for {:.0} % of the samples: the probe loses contact, so stiffness, loss and phase are not those of the tissue, however small their errors; press deeper or reduce the amplitude",
                self.frequency,
                100.0 * self.zero_share
            )
        })
    }
}

/// A record holds no sine that could be evaluated.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SinusoidError {
    #[error("a frequency of {frequency} Hz is not possible; give a positive number")]
    Frequency { frequency: f64 },
    #[error(
        "the record holds {cycles:.2} cycles at {frequency} Hz; record at least one cycle, better five"
    )]
    TooShort { cycles: f64, frequency: f64 },
    #[error(
        "{per_cycle:.1} samples per cycle do not resolve the harmonics; take at least 12 samples per cycle"
    )]
    TooSparse { per_cycle: f64 },
    #[error("the depth does not move at {frequency} Hz; check the frequency")]
    NoMotion { frequency: f64 },
}

/// Coefficients of one response, the standard error of those at the frequency with its degrees of freedom, and the
/// standard deviation of what is left.
struct HarmonicFit {
    coefficients: [f64; COLUMNS],
    error: f64,
    freedom: f64,
    noise: f64,
}

/// Evaluates a record of a sine of known frequency in Hz, by least squares over whole cycles up to its end.
pub fn fit_sinusoid(samples: &[CycleSample], frequency: f64) -> Result<Sinusoid, SinusoidError> {
    if !(frequency > 0.0 && frequency.is_finite()) {
        return Err(SinusoidError::Frequency { frequency });
    }
    let (start, whole) = whole_cycles(samples, frequency)?;
    let used = || samples.iter().filter(move |one| one.t.0 >= start);
    let span = whole / frequency;
    let fitted = |value: fn(&CycleSample) -> f64| {
        fit(used().map(|one| (one.t.0 - start, value(one))), frequency, span)
            .ok_or(SinusoidError::NoMotion { frequency })
    };
    let (depth, force) = (fitted(|one| one.depth.0)?, fitted(|one| one.force.0)?);
    let x = phasor(&depth.coefficients, 1);
    let f = phasor(&force.coefficients, 1);
    let amplitude = x[0].hypot(x[1]);
    let depths = || used().map(|one| one.depth.0);
    let range = depths().fold(f64::MIN, f64::max) - depths().fold(f64::MAX, f64::min);
    // With so little motion at the frequency the force is not a response to it.
    if amplitude <= MOTION_MIN * 0.5 * range {
        return Err(SinusoidError::NoMotion { frequency });
    }
    // f / x in complex numbers.
    let storage = (f[0] * x[0] + f[1] * x[1]) / (amplitude * amplitude);
    let loss = (f[1] * x[0] - f[0] * x[1]) / (amplitude * amplitude);
    let force_amplitude = f[0].hypot(f[1]);
    let error = force.error / amplitude;
    let harmonics = (2..=HARMONICS)
        .map(|k| phasor(&force.coefficients, k))
        .map(|[re, im]| re * re + im * im)
        .sum::<f64>();
    Ok(Sinusoid {
        frequency,
        cycles: whole as u32,
        depth_mean: Depth(depth.coefficients[0]),
        depth_amplitude: Depth(amplitude),
        force_mean: Newtons(force.coefficients[0]),
        force_amplitude: Estimate {
            value: Newtons(force_amplitude),
            std_error: Newtons(force.error),
        },
        phase_degrees: Estimate {
            value: loss.atan2(storage).to_degrees(),
            std_error: (force.error / force_amplitude).to_degrees(),
        },
        storage: Estimate { value: storage, std_error: error },
        loss: Estimate { value: loss, std_error: error },
        freedom: force.freedom,
        distortion_percent: 100.0 * harmonics.sqrt() / force_amplitude,
        zero_share: zero_share(used().map(|one| one.force.0), force_amplitude, force.noise),
    })
}

/// When the whole cycles begin that are evaluated, in s, and how many they are.
fn whole_cycles(samples: &[CycleSample], frequency: f64) -> Result<(f64, f64), SinusoidError> {
    let (from, last) = match samples {
        [first, .., last] => (first.t.0, last.t.0),
        _ => (0.0, 0.0),
    };
    // A sample's own interval counts to the record.
    let interval = (last - from) / (samples.len() as f64 - 1.0).max(1.0);
    let cycles = (last - from + interval) * frequency;
    let per_cycle = samples.len() as f64 / cycles;
    // A millionth forgives the rounding of times.
    if cycles + 1e-6 < 1.0 || samples.len() < 2 {
        return Err(SinusoidError::TooShort { cycles, frequency });
    }
    if per_cycle < PER_CYCLE_MIN {
        return Err(SinusoidError::TooSparse { per_cycle });
    }
    let settling = if cycles + 1e-6 >= 2.0 * SETTLING + 1.0 { SETTLING } else { 0.0 };
    let whole = (cycles - settling + 1e-6).floor();
    Ok((last + 0.5 * interval - whole / frequency, whole))
}

fn zero_share(forces: impl Iterator<Item = f64>, amplitude: f64, noise: f64) -> f64 {
    let zero = (NOISE * noise).max(ZERO_SHARE * amplitude);
    let (mut count, mut zeros, mut lowest) = (0usize, 0usize, f64::INFINITY);
    for force in forces {
        count += 1;
        zeros += usize::from(force <= zero);
        lowest = lowest.min(force);
    }
    if lowest < -(PULL_SHARE * amplitude + NOISE * noise) {
        return 0.0;
    }
    zeros as f64 / count.max(1) as f64
}

/// `a cos + b sin` of a harmonic as the complex number `a - ib`.
fn phasor(coefficients: &[f64; COLUMNS], harmonic: usize) -> [f64; 2] {
    [coefficients[2 * harmonic], -coefficients[2 * harmonic + 1]]
}

fn fit(points: impl Iterator<Item = (f64, f64)>, frequency: f64, span: f64) -> Option<HarmonicFit> {
    let mut triangle = Triangle::<COLUMNS>::default();
    let mut count = 0usize;
    for (t, y) in points {
        let mut row = [0.0; COLUMNS];
        row[0] = 1.0;
        row[1] = t / span - 0.5;
        for k in 1..=HARMONICS {
            let (sin, cos) = (TAU * (k as f64 * frequency * t).fract()).sin_cos();
            (row[2 * k], row[2 * k + 1]) = (cos, sin);
        }
        row[COLUMNS - 1] = y;
        triangle.push(row);
        count += 1;
    }
    let coefficients = triangle.solve(COLUMNS - 1)?;
    let free = count.checked_sub(COLUMNS - 1).filter(|free| *free > 0)?;
    let variance = triangle.residual_sum() / free as f64;
    let errors =
        triangle.inverse_diagonal(2, COLUMNS - 1)? + triangle.inverse_diagonal(3, COLUMNS - 1)?;
    Some(HarmonicFit {
        coefficients,
        error: (variance * 0.5 * errors).sqrt(),
        freedom: free as f64,
        noise: variance.sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::random::SplitMix;
    use palpate_model::rig::Phase;
    use palpate_model::units::Seconds;

    /// A sine of depth about 10 mm from its turning point, and a force of it.
    fn record(f: f64, seconds: f64, force: impl Fn(f64) -> f64) -> Vec<CycleSample> {
        (0..(seconds * 1e3).round() as u32)
            .map(|i| f64::from(i) * 1e-3)
            .map(|t| CycleSample {
                t: Seconds(t),
                depth: Depth(10.0 - 0.5 * (TAU * f * t).cos()),
                force: Newtons(force(t)),
                phase: Phase::Hold,
                cycle: 1,
                step: 0,
            })
            .collect()
    }

    #[test]
    fn the_linear_kelvin_body_answers_by_its_formula() {
        // F + tau F' = mu (x + s x'): stiffness mu (1 + i w s) / (1 + i w tau).
        let (mu, s, tau) = (0.5, 3.0, 1.0);
        for f in [0.05, 0.5, 2.0] {
            let w = TAU * f;
            let under = 1.0 + (w * tau).powi(2);
            let (storage, loss) =
                (mu * (1.0 + w * w * s * tau) / under, mu * w * (s - tau) / under);
            // x = 10 - 0.5 cos: its answer, and what the start leaves, which decays with tau.
            let force = |t: f64| {
                5.0 - 0.5 * (storage * (w * t).cos() - loss * (w * t).sin())
                    + 1.0 * (-t / tau).exp()
            };
            let seconds = (20.0 / f).max(40.0);
            let all = record(f, seconds, force);
            let found = fit_sinusoid(&all[20_000.min(all.len() / 2)..], f).unwrap();
            assert!((found.storage.value - storage).abs() < 1e-8, "{f}: {found:?}");
            assert!((found.loss.value - loss).abs() < 1e-8, "{f}: {found:?}");
            let degrees = (loss / storage).atan().to_degrees();
            assert!((found.phase_degrees.value - degrees).abs() < 1e-6);
            assert!((found.depth_amplitude.0 - 0.5).abs() < 1e-12);
            assert!(found.distortion_percent < 1e-5);
        }
    }

    #[test]
    fn distortion_is_the_root_of_squares() {
        let f = 1.0;
        let found = fit_sinusoid(
            &record(f, 5.0, |t| {
                let w = TAU * f * t;
                2.0 + w.cos() + 0.03 * (2.0 * w).sin() + 0.04 * (3.0 * w).cos() + 0.1 * t
            }),
            f,
        )
        .unwrap();
        assert!((found.distortion_percent - 5.0).abs() < 1e-9);
        assert_eq!(found.cycles, 4);
        // The depth starts at its least, the force at its most.
        assert!((found.phase_degrees.value.abs() - 180.0).abs() < 1e-9);
    }

    #[test]
    fn force_that_returns_to_zero_gives_a_remark() {
        // The swing of 0.2 N about so much, cut at zero: nothing is pulled. With noise, without, and with a zero that has
        // drifted by half a standard deviation.
        let mut random = SplitMix::seeded(9);
        let noise: Vec<f64> = (0..10_000).map(|_| random.normal()).collect();
        for (mean, is_lost) in [(0.1, true), (0.18, true), (0.3, false), (1.0, false)] {
            for (rms, drift) in [(0.0, 0.0), (0.01, 0.0), (0.01, 0.005)] {
                let force = |t: f64| {
                    let pressed = (mean - 0.2 * (TAU * t + 0.3).cos()).max(0.0);
                    pressed + drift + rms * noise[(t * 1e3).round() as usize % noise.len()]
                };
                let found = fit_sinusoid(&record(1.0, 10.0, force), 1.0).unwrap();
                let remark = found.remark();
                assert_eq!(remark.is_some(), is_lost, "{mean} {rms} {drift}: {found:?}");
                if mean == 0.1 {
                    // Below a cosine of one half it is cut for a third of the swing.
                    assert!((0.32..0.40).contains(&found.zero_share), "{found:?}");
                    assert!(remark.unwrap().contains("loses contact"));
                }
            }
        }
        // A glued specimen pulls as much as it presses.
        let found = fit_sinusoid(&record(1.0, 10.0, |t| 0.2 * (TAU * t).cos()), 1.0).unwrap();
        assert!(found.remark().is_none(), "{found:?}");
    }

    #[test]
    fn errors_are_those_of_the_noise() {
        let (mut storages, mut phases) = (0.0, 0.0);
        for seed in 0..100 {
            let mut random = SplitMix::seeded(seed);
            let noise: Vec<f64> = (0..6000).map(|_| 0.02 * random.normal()).collect();
            let force = |t: f64| {
                let w = TAU * t;
                5.0 - 0.5 * (0.4 * w.cos() - 0.1 * w.sin()) + noise[(t * 1e3).round() as usize]
            };
            let found = fit_sinusoid(&record(1.0, 6.0, force), 1.0).unwrap();
            storages += ((found.storage.value - 0.4) / found.storage.std_error).powi(2);
            let miss = found.phase_degrees.value - 0.25f64.atan().to_degrees();
            phases += (miss / found.phase_degrees.std_error).powi(2);
        }
        // chi-squared of 100: four standard deviations are 57.
        assert!((storages - 100.0).abs() < 57.0, "{storages}");
        assert!((phases - 100.0).abs() < 57.0, "{phases}");
    }

    #[test]
    fn refusals_say_what_is_missing() {
        let all = record(1.0, 2.0, |_| 1.0);
        let message =
            |samples: &[CycleSample], f: f64| fit_sinusoid(samples, f).unwrap_err().to_string();
        assert!(message(&all, 0.1).contains("0.20 cycles"));
        assert!(message(&all, 200.0).contains("5.0 samples"));
        assert!(message(&all, f64::NAN).contains("is not possible"));
        assert!(message(&all, 7.0).contains("does not move"));
        assert!(message(&[], 7.0).contains("cycles"));
    }
}
