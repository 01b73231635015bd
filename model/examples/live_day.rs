//! A day of live acquisition as the window's plots hold it: a thousand samples a second for 24 hours. Memory and the
//! points of a frame must stay what they were after the first minutes.
//!
//! `cargo run --release -p palpate-model --example live_day -- [HOURS]`
#![expect(clippy::print_stdout, reason = "a program that prints")]

use palpate_model::signal::{LiveTrace, TracePoint};
use palpate_model::units::{Depth, Newtons, Seconds};
use std::time::Instant;

/// As many as the runner keeps.
const BUCKETS: usize = 2048;
const PER_HOUR: u64 = 3_600_000;

#[expect(clippy::disallowed_methods, reason = "this program measures time")]
fn main() -> Result<(), Box<dyn std::error::Error>> {
    let hours: u64 = std::env::args().nth(1).map_or(Ok(24), |word| word.parse())?;
    let mut trace = LiveTrace::new(BUCKETS);
    println!(
        "hours  ns a sample  samples a bucket  points  bytes of points  ms for the points of a frame"
    );
    for hour in 0..hours {
        let start = Instant::now();
        for index in hour * PER_HOUR..(hour + 1) * PER_HOUR {
            let t = index as f64 * 1e-3;
            let depth = 5.0 * (1.0 - (0.1 * t).cos());
            trace.push(Seconds(t), Depth(depth), Newtons(0.05 * depth * depth));
        }
        let pushed = start.elapsed().as_secs_f64();
        let start = Instant::now();
        let points = trace.points();
        let drawn = start.elapsed().as_secs_f64();
        println!(
            "{:>5}  {:>11.1}  {:>16}  {:>6}  {:>15}  {:.3}",
            hour + 1,
            pushed * 1e9 / PER_HOUR as f64,
            trace.samples_per_bucket(),
            points.len(),
            points.len() * size_of::<TracePoint>(),
            drawn * 1e3
        );
    }
    Ok(())
}
