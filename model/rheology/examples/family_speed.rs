//! Seconds that each family takes to fit two records of one representative body.
//!
//! `cargo run --release -p palpate-model --example family_speed`

#![expect(
    clippy::print_stdout,
    clippy::unwrap_used,
    clippy::disallowed_methods,
    reason = "a measurement prints, reads a clock and may fail"
)]

use palpate_model::{Depth, Newtons, Seconds};
use palpate_rheology::families;
use palpate_rheology::fit::{FitOptions, FitSample, fit_joint};
use std::sync::Arc;
use std::time::Instant;

fn main() {
    for truth in [
        (
            "series-3",
            vec![1.023],
            vec![0.05333, -0.0086, 0.0004345, 0.06],
        ),
        ("fung", vec![0.1, 300.0, 0.15], vec![0.15, 0.06]),
    ] {
        let model = families::by_key(truth.0)
            .unwrap()
            .model(&truth.1, &truth.2)
            .unwrap();
        let records: Vec<Vec<FitSample>> = [0.8, 4.0]
            .map(|speed| {
                let path: Vec<_> = (0..2500)
                    .map(|i| {
                        let t = f64::from(i) * 0.02;
                        (Seconds(t), Depth((speed * t).min(20.0)))
                    })
                    .collect();
                let forces = model.along(path.iter().copied()).unwrap();
                path.iter()
                    .zip(forces)
                    .enumerate()
                    .map(|(i, (&(t, depth), force))| FitSample {
                        t,
                        depth,
                        force: Newtons(
                            force + 0.02 * (((i * i * 37 + i * 11) % 101) as f64 / 29.0 - 1.7),
                        ),
                        sigma: Newtons(0.02),
                    })
                    .collect()
            })
            .into();
        let mut total = 0.0;
        for family in families::all() {
            let start = Instant::now();
            let options = FitOptions::of(Arc::clone(&family));
            let both = [
                ("slow", records[0].as_slice()),
                ("fast", records[1].as_slice()),
            ];
            let fit = fit_joint(&both, &options, &options.body_names());
            let seconds = start.elapsed().as_secs_f64();
            total += seconds;
            match fit {
                Ok(fit) => println!(
                    "{:<12} {:8.1} ms  rms {:.5} N",
                    family.key(),
                    1e3 * seconds,
                    fit.rmse_n
                ),
                Err(err) => println!("{:<12} {:8.1} ms  {err}", family.key(), 1e3 * seconds),
            }
        }
        println!("{:<12} {:8.1} ms", "all", 1e3 * total);
    }
}
