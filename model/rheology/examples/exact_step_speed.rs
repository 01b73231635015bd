//! Time of a sample of the exact step at a constant rate, against the bound that memory sets.
//!
//! `cargo run --release -p palpate-rheology --example exact_step_speed`

#![expect(clippy::print_stdout, reason = "an example that prints figures")]
#![expect(clippy::disallowed_methods, reason = "it measures time")]

use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
use palpate_model::{Depth, Seconds};
use palpate_rheology::families;
use palpate_rheology::integrators::{Real, Scheme, SeriesBody};
use std::hint::black_box;
use std::time::Instant;

/// Repetitions; the least is printed, since other work on the machine only ever adds.
const ROUNDS: usize = 7;
/// Samples: 64 MB of depths and forces in f64, beyond any cache that one core has to itself.
const SAMPLES: usize = 4 << 20;
/// Samples that stay in a first-level cache of 32 kB with their forces.
const CACHED: usize = 1 << 10;
const DT: f64 = 1e-3;

/// The thesis protocol at 1 kHz, over and over.
fn depths<R: Real>(count: usize) -> Vec<R> {
    (0..count).map(|i| R::of((0.75 * DT * (i % 90_001) as f64).min(30.0))).collect()
}

/// Seconds of the fastest of some rounds, over `per`.
fn least(per: usize, mut work: impl FnMut()) -> f64 {
    let round = |work: &mut dyn FnMut()| {
        let start = Instant::now();
        work();
        start.elapsed().as_secs_f64()
    };
    let all = (0..ROUNDS).map(|_| round(&mut work));
    all.fold(f64::INFINITY, f64::min) / per as f64 * 1e9
}

fn constant_step<R: Real>(name: &str, count: usize) {
    let body = SeriesBody::from(ModifiedKelvin::THESIS);
    let depths = depths::<R>(count);
    let mut forces = Vec::with_capacity(count);
    let repeats = SAMPLES / count;
    for scheme in Scheme::ALL {
        let ns = least(count * repeats, || {
            for _ in 0..repeats {
                let done = scheme.respond(&body, DT, black_box(&depths), &mut forces);
                black_box(done.is_ok());
            }
        });
        println!("{ns:>8.2}  {}, {name}", scheme.name());
    }
}

fn main() {
    println!("ns per sample");
    constant_step::<f64>("f64, in cache", CACHED);
    constant_step::<f32>("f32, in cache", CACHED);
    constant_step::<f64>("f64, from memory", SAMPLES);

    let depths = depths::<f64>(SAMPLES);
    let body = ModifiedKelvin::THESIS;
    let ns = least(SAMPLES, || {
        let mut state = KelvinState::at_rest();
        for &depth in black_box(&depths) {
            black_box(state.step(&body, Depth(depth), Seconds(DT)));
        }
    });
    println!("{ns:>8.2}  any step, the thesis body");
    let model = families::find_family("series-3").map(|family| {
        family.model(&[body.tau_eps], &[body.mu[0], body.mu[1], body.mu[2], body.tau_sig])
    });
    if let Ok(Ok(model)) = model
        && let Ok(start) = model.at_rest_from(Depth(0.0))
    {
        let ns = least(SAMPLES, || {
            let mut state = start.clone();
            for &depth in black_box(&depths) {
                black_box(state.step(Depth(depth), Seconds(DT)).is_ok());
            }
        });
        println!("{ns:>8.2}  any step, family series-3");
    }
    // The bound: each sample reads a depth and writes a force, 16 bytes, as this copy does.
    let mut forces = vec![0.0; SAMPLES];
    let ns = least(SAMPLES, || {
        for (force, depth) in forces.iter_mut().zip(black_box(&depths)) {
            *force = 3.0 * depth;
        }
        black_box(&mut forces);
    });
    println!("{ns:>8.2}  memory alone: 16 bytes a sample at {:.1} GB/s", 16.0 / ns);
}
