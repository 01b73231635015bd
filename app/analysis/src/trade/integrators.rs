//! Integrators by step and precision.

use super::paths::{DepthPath, ReferencePaths, TICKS, body};
use super::timing::Job;
use super::{TradeExtent, UNMEASURED};
use palpate_rheology::integrators::{IntegratorError, Precision, Real, Scheme};
use palpate_rheology::trade::{ForceError, IntegratorRow};
use std::hint::black_box;

/// Steps in ticks of 0.1 ms, up to where the conditionally stable ones have long stopped being so.
const STEPS: [u64; 15] =
    [1, 2, 5, 10, 20, 50, 100, 200, 500, 1_000, 2_000, 5_000, 10_000, 20_000, 50_000];
const STEPS_QUICK: [u64; 4] = [10, 100, 1_000, 50_000];
/// Samples of a timed run: with their forces they stay in a first-level cache.
const RUN: usize = 1024;
/// One job for every integrator and precision: a step costs the same whatever its length.
pub(super) const JOBS: usize = 2 * Scheme::ALL.len();

pub(super) fn rows(
    extent: TradeExtent,
    paths: &ReferencePaths,
) -> Result<Vec<IntegratorRow>, String> {
    let steps = extent.choose(&STEPS[..], &STEPS_QUICK);
    let mut rows = Vec::new();
    for scheme in Scheme::ALL {
        for precision in Precision::ALL {
            for &step in steps {
                let error = match precision {
                    Precision::F64 => error::<f64>(scheme, step, paths),
                    Precision::F32 => error::<f32>(scheme, step, paths),
                };
                let (error, refused) = match error {
                    Ok(error) => (Some(error), None),
                    Err(err @ IntegratorError::Unstable { .. }) => (None, Some(err.to_string())),
                    Err(err) => return Err(err.to_string()),
                };
                rows.push(IntegratorRow {
                    scheme,
                    precision,
                    step_s: step as f64 / TICKS as f64,
                    error,
                    refused,
                    cost: UNMEASURED,
                    second_ns: 0.0,
                    front: false,
                });
            }
        }
    }
    Ok(rows)
}

fn error<R: Real>(
    scheme: Scheme,
    step: u64,
    paths: &ReferencePaths,
) -> Result<ForceError, IntegratorError> {
    let on = |path: &DepthPath| {
        let depths: Vec<R> = path.depths(step).map(R::of).collect();
        let mut forces = Vec::new();
        scheme.respond(&body(), step as f64 / TICKS as f64, &depths, &mut forces)?;
        Ok::<f64, IntegratorError>(path.error_of(step, forces.into_iter().map(R::to_f64)))
    };
    Ok(ForceError { ramp_hold_n: on(&paths.ramp_hold)?, poke_n: on(&paths.poke)? })
}

pub(super) fn jobs<'a>() -> Vec<Job<'a>> {
    let of = |scheme| [job::<f64>(scheme), job::<f32>(scheme)];
    Scheme::ALL.into_iter().flat_map(of).collect()
}

/// Index of the job that times a row.
pub(super) fn job_of(row: &IntegratorRow) -> usize {
    let scheme = Scheme::ALL.iter().position(|one| *one == row.scheme);
    let precision = Precision::ALL.iter().position(|one| *one == row.precision);
    scheme.unwrap_or(0) * Precision::ALL.len() + precision.unwrap_or(0)
}

pub(super) fn job<'a, R: Real + 'a>(scheme: Scheme) -> Job<'a> {
    let depths: Vec<R> = (0..RUN).map(|i| R::of(30.0 * i as f64 / RUN as f64)).collect();
    let mut forces = Vec::with_capacity(RUN);
    Job {
        per_call: RUN as f64,
        call: Box::new(move || {
            let done = scheme.respond(&body(), 1e-3, black_box(&depths), &mut forces);
            black_box(done.is_ok());
        }),
    }
}
