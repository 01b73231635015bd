//! palpate's own timings.

use crate::record::{self, Records};
use crate::result::{BODY, Fit, median, seconds};
use palpate_model::Depth;
use palpate_rheology::fit::{FitOptions, FitReport, FitSample, Fitted, LiveFit, fit};
use serde::Serialize;
use std::hint::black_box;

/// Repeats of the profile intervals.
const PROFILE_REPEATS: usize = 7;

/// A cold fit with covariance, seven free parameters, no guess: the median of `repeats`.
pub fn cold_fit(samples: &[FitSample], repeats: usize) -> Result<Fit, String> {
    let options = FitOptions::default();
    let mut times = Vec::new();
    let mut last: Option<FitReport> = None;
    for _ in 0..repeats {
        let (time, report) = seconds(|| fit(black_box(samples), &options));
        times.push(time);
        last = Some(report.map_err(|err| err.to_string())?);
    }
    let report = last.ok_or("no repeats")?;
    let value = |name: &str| report.value(name).unwrap_or(f64::NAN);
    let error = |name: &str| report.parameter(name).and_then(|p| p.std_error);
    Ok(Fit {
        seconds: median(&mut times),
        values: BODY.map(|(name, _)| value(name)),
        std_errors: Some(BODY.map(|(name, _)| error(name).unwrap_or(f64::NAN))),
    })
}

/// Five 95 % profile intervals after a fit, f0 and f_offset fixed at 0, as `conf_interval` of lmfit
/// is asked for them: median seconds without the fit, as lmfit's are, and low and high of each.
pub fn profile_intervals(samples: &[FitSample]) -> Result<(f64, [[f64; 2]; 5]), String> {
    let text = |err: palpate_rheology::fit::FitError| err.to_string();
    let mut options = FitOptions::default();
    options.fix("f0", 0.0).map_err(text)?;
    options.fix("f_offset", 0.0).map_err(text)?;
    let fitted = Fitted::of(samples, &options).map_err(text)?;
    let mut times = Vec::new();
    let mut bounds = [[f64::NAN; 2]; 5];
    for _ in 0..PROFILE_REPEATS {
        let (time, intervals) = seconds(|| black_box(&fitted).profile(0));
        times.push(time);
        let intervals = intervals.map_err(text)?;
        for (slot, (name, _)) in bounds.iter_mut().zip(BODY) {
            if let Some(found) = intervals.iter().find(|interval| interval.name == name) {
                *slot = [found.low, found.high].map(|end| end.unwrap_or(f64::NAN));
            }
        }
    }
    Ok((median(&mut times), bounds))
}

/// What the live fit costs.
#[derive(Debug, Serialize)]
pub struct Live {
    /// Seconds for one sample, the mean over a record.
    pub push_s: f64,
    /// Seconds for one estimate, the median.
    pub estimate_s: f64,
    /// Largest difference to the exact fit of the noiseless record, relative.
    pub off_noiseless: f64,
    /// Largest difference to the exact fit of the noisy record, in standard errors.
    pub off_noisy_sigmas: f64,
}

/// Feeds both records to the live fit.
pub fn live(records: &Records, exact: [&Fit; 2]) -> Result<Live, String> {
    let mut costs = Vec::new();
    let mut estimates = Vec::new();
    let mut off = [0.0f64; 2];
    for (which, samples) in [&records.noiseless, &records.noisy].into_iter().enumerate() {
        let mut live = LiveFit::new(Depth(30.0));
        let (time, ()) = seconds(|| {
            for sample in samples {
                live.push(sample.t, sample.depth, sample.force, sample.sigma);
            }
        });
        costs.push(time / samples.len() as f64);
        for _ in 0..50 {
            estimates.push(seconds(|| black_box(live.estimate())).0);
        }
        let estimate = live.estimate().ok_or("the live fit has no estimate")?;
        for (k, (name, _)) in BODY.into_iter().enumerate() {
            let found = estimate.parameters.iter().find(|p| p.name == name);
            let found = found.map_or(f64::NAN, |p| p.value);
            let unit = match which {
                0 => exact[0].values[k].abs(),
                _ => exact[1].std_errors.map_or(f64::NAN, |errors| errors[k]),
            };
            off[which] = off[which].max((found - exact[which].values[k]).abs() / unit);
        }
    }
    Ok(Live {
        push_s: median(&mut costs),
        estimate_s: median(&mut estimates),
        off_noiseless: off[0],
        off_noisy_sigmas: off[1],
    })
}

/// Seconds of a cold fit against the number of samples, and the exponents of cost.
#[derive(Debug, Serialize)]
pub struct Scaling {
    /// Number of samples and seconds.
    pub points: Vec<(usize, f64)>,
    /// Exponent of a power law through all points.
    pub exponent: f64,
    /// The same from 1e5 samples on, where the part that does not grow no longer shows.
    pub exponent_large: f64,
}

/// Cold fits of the noiseless record at 1e3 to `10^largest` samples.
pub fn scaling(largest: u32) -> Result<Scaling, String> {
    let mut points = Vec::new();
    for power in 3..=largest {
        let intervals = 10u32.pow(power);
        let samples = record::noiseless(intervals);
        let repeats = if power < 6 { 7 } else { 3 };
        points.push((samples.len(), cold_fit(&samples, repeats)?.seconds));
    }
    let large: Vec<(usize, f64)> = points.iter().copied().filter(|p| p.0 >= 100_000).collect();
    Ok(Scaling {
        exponent: slope(&points),
        exponent_large: slope(&large),
        points,
    })
}

/// Slope of the least-squares line through the logarithms; NaN for fewer than two points.
fn slope(points: &[(usize, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = points
        .iter()
        .map(|&(samples, time)| ((samples as f64).ln(), time.ln()))
        .collect();
    let count = logs.len() as f64;
    let mean_x = logs.iter().map(|p| p.0).sum::<f64>() / count;
    let mean_y = logs.iter().map(|p| p.1).sum::<f64>() / count;
    let xy: f64 = logs.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum();
    let xx: f64 = logs.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
    xy / xx
}
