//! What one sample and one answer of the live fit cost, and how close its last answer is.
//!
//! `cargo run --release -p palpate-rheology --example live_speed`

#![expect(clippy::print_stdout, reason = "an example that prints figures")]
#![expect(clippy::disallowed_methods, reason = "it measures time")]

use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
use palpate_model::{Depth, Newtons, Seconds};
use palpate_rheology::fit::{FitOptions, FitSample, LiveFit, fit};
use std::hint::black_box;
use std::time::Instant;

/// Repetitions; the best is printed, since other work on the machine only ever adds.
const ROUNDS: usize = 15;

/// The thesis protocol at 1 kHz: 0.75 mm/s to 30 mm, 50 s hold, 90 001 samples.
fn thesis_record() -> Vec<FitSample> {
    let body = ModifiedKelvin::THESIS;
    let mut state = KelvinState::at_rest();
    (0..=90_000)
        .map(|i| {
            let t = f64::from(i) * 1e-3;
            let depth = Depth((0.75 * t).min(30.0));
            let dt = Seconds(if i == 0 { 0.0 } else { 1e-3 });
            FitSample {
                t: Seconds(t),
                depth,
                force: state.step(&body, depth, dt),
                sigma: Newtons(0.02),
            }
        })
        .collect()
}

fn main() {
    let record = thesis_record();
    let (mut push_secs, mut estimate_secs) = (f64::INFINITY, f64::INFINITY);
    let mut last = None;
    for _ in 0..ROUNDS {
        let mut live = LiveFit::new(Depth(30.0));
        let start = Instant::now();
        for sample in &record {
            live.push(sample.t, sample.depth, sample.force, sample.sigma);
        }
        push_secs = push_secs.min(start.elapsed().as_secs_f64());
        let start = Instant::now();
        last = black_box(live.estimate());
        estimate_secs = estimate_secs.min(start.elapsed().as_secs_f64());
    }
    println!("samples                {}", record.len());
    println!(
        "one sample             {:.3} microseconds",
        push_secs / record.len() as f64 * 1e6
    );
    println!(
        "one answer             {:.0} microseconds",
        estimate_secs * 1e6
    );
    let (Some(live), Ok(exact)) = (last, fit(&record, &FitOptions::default())) else {
        println!("no answer");
        return;
    };
    for (live, exact) in live.parameters.iter().zip(&exact.parameters).take(5) {
        println!(
            "{:<10} live {:>16.9e}  off by {:.1e}",
            live.name,
            live.value,
            (live.value / exact.value - 1.0).abs()
        );
    }
}
