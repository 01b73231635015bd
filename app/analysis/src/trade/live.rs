//! The live fit.

use super::paths::ReferencePaths;
use super::timing::Job;
use super::{UNMEASURED, fit};
use palpate_model::units::Depth;
use palpate_model::viscoelastic::ModifiedKelvin;
use palpate_rheology::fit::{FitSample, LiveFit};
use palpate_rheology::trade::LiveRow;
use std::hint::black_box;

/// Relaxation times in the bank.
const NODES: [usize; 5] = [16, 32, 64, 128, 256];

/// A live fit with so many relaxation times after all samples; none that a bank cannot have.
fn pushed(nodes: usize, samples: &[FitSample]) -> Option<LiveFit> {
    let mut live = LiveFit::with_relaxation_times(Depth(30.0), nodes)?;
    for sample in samples {
        live.push(sample.t, sample.depth, sample.force, sample.sigma);
    }
    Some(live)
}

pub(super) fn rows(paths: &ReferencePaths) -> Result<Vec<LiveRow>, String> {
    let recording = fit::recording(0, 0.0, paths)?;
    let row = |&nodes: &usize| {
        let answer = pushed(nodes, &recording).and_then(|live| live.estimate());
        let tau =
            answer.and_then(|answer| answer.identified_parameter("tau_eps").map(|tau| tau.value));
        LiveRow {
            nodes,
            tau_error: tau.map(|tau| (tau / ModifiedKelvin::THESIS.tau_eps - 1.0).abs()),
            cost: UNMEASURED,
            front: false,
        }
    };
    Ok(NODES.iter().map(row).collect())
}

pub(super) fn jobs<'a>(rows: &[LiveRow], paths: &ReferencePaths) -> Result<Vec<Job<'a>>, String> {
    let recording = fit::recording(0, 0.0, paths)?;
    let job = |row: &LiveRow| {
        let (nodes, samples) = (row.nodes, recording.clone());
        Job {
            per_call: samples.len() as f64,
            call: Box::new(move || {
                black_box(pushed(nodes, black_box(&samples)));
            }),
        }
    };
    Ok(rows.iter().map(job).collect())
}
