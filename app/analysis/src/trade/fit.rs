//! The fit of a recording, thinned.

use super::paths::{ReferencePaths, TICKS, difference};
use super::timing::Job;
use super::{TradeExtent, UNMEASURED};
use palpate_model::random::SplitMix;
use palpate_model::units::{Depth, Newtons, Seconds};
use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
use palpate_rheology::fit::{FitOptions, FitSample, fit};
use palpate_rheology::integrators::Scheme;
use palpate_rheology::trade::FitRow;
use std::hint::black_box;

/// White noise of the recording in N: that of the simulated rig's straight cell.
pub(super) const NOISE: f64 = 0.02;
/// Every so many samples of the recording at 1 kHz are kept.
const THINNED: [usize; 10] = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000];
const THINNED_QUICK: [usize; 2] = [10, 100];
/// Samples per second of the recording.
const RATE: f64 = 1000.0;

pub(super) fn rows(
    extent: TradeExtent,
    [first, count]: [u64; 2],
    paths: &ReferencePaths,
) -> Result<Vec<FitRow>, String> {
    let thinned = extent.choose(&THINNED[..], &THINNED_QUICK);
    let recordings: Result<Vec<_>, String> =
        (first..first + count).map(|seed| recording(seed, NOISE, paths)).collect();
    let recordings = recordings?;
    let row = |&keep: &usize| {
        let (mut tau_square, mut force_square, mut samples) = (0.0, 0.0, 0);
        for recording in &recordings {
            let reduced = thin(recording, keep);
            let found = fit(&reduced, &FitOptions::default()).map_err(|err| err.to_string())?;
            let body = found.kelvin().ok_or("the fit is not a modified Kelvin model")?;
            tau_square += (body.tau_eps / ModifiedKelvin::THESIS.tau_eps - 1.0).powi(2);
            force_square += difference(&along(&body, paths), paths.ramp_hold.exact()).powi(2);
            samples = reduced.len();
        }
        Ok(FitRow {
            rate_hz: RATE / keep as f64,
            samples,
            tau_error: (tau_square / count as f64).sqrt(),
            error_n: (force_square / count as f64).sqrt(),
            cost: UNMEASURED,
            front: false,
        })
    };
    thinned.iter().map(row).collect()
}

/// Forces in N of a body at the moments of comparison.
fn along(body: &ModifiedKelvin, paths: &ReferencePaths) -> Vec<f64> {
    let mut state = KelvinState::at_rest();
    let mut before = Seconds(0.0);
    let points = paths.ramp_hold.checkpoints();
    points
        .map(|(t, depth)| {
            let force = state.step(body, depth, Seconds(t.0 - before.0));
            before = t;
            force.0
        })
        .collect()
}

/// The thesis protocol at 1 kHz with white noise.
pub(super) fn recording(
    seed: u64,
    noise: f64,
    paths: &ReferencePaths,
) -> Result<Vec<FitSample>, String> {
    let step = (TICKS as f64 / RATE) as u64;
    let depths: Vec<f64> = paths.ramp_hold.depths(step).collect();
    let mut forces = Vec::new();
    Scheme::Exact
        .respond(&super::paths::body(), 1.0 / RATE, &depths, &mut forces)
        .map_err(|err| err.to_string())?;
    let mut random = SplitMix::seeded(seed);
    let samples = depths.iter().zip(forces).enumerate();
    Ok(samples
        .map(|(i, (&depth, force))| FitSample {
            t: Seconds(i as f64 / RATE),
            depth: Depth(depth),
            force: Newtons(force + noise * random.normal()),
            sigma: Newtons(NOISE),
        })
        .collect())
}

fn thin(samples: &[FitSample], keep: usize) -> Vec<FitSample> {
    samples.iter().step_by(keep).copied().collect()
}

pub(super) fn jobs<'a>(
    rows: &[FitRow],
    seed: u64,
    paths: &ReferencePaths,
) -> Result<Vec<Job<'a>>, String> {
    let recording = recording(seed, NOISE, paths)?;
    let job = |row: &FitRow| {
        let reduced = thin(&recording, (RATE / row.rate_hz).round() as usize);
        Job {
            per_call: 1.0,
            call: Box::new(move || {
                black_box(fit(black_box(&reduced), &FitOptions::default()).is_ok());
            }),
        }
    };
    Ok(rows.iter().map(job).collect())
}
