//! Times of ticks, and of the computer alone: what examples that measure share.

use std::hint::black_box;
use std::time::Instant;

/// Products of a measurement of the computer alone: as long as a tick of a surface.
const ROUNDS: usize = 10_000;

/// The median, 99 %, 99.9 % and the longest.
pub fn percentiles(times: &mut [f64]) -> [f64; 4] {
    times.sort_by(f64::total_cmp);
    let at = |share: f64| times[((share * times.len() as f64) as usize).min(times.len() - 1)];
    [at(0.5), at(0.99), at(0.999), at(1.0)]
}

/// What the machine alone adds: the same few instructions each time, without memory.
pub fn measure_machine(ticks: usize) {
    let mut times: Vec<f64> = Vec::with_capacity(ticks);
    for _ in 0..ticks {
        let start = Instant::now();
        let mut state = black_box(1u64);
        for _ in 0..ROUNDS {
            state = state.wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(17);
        }
        black_box(state);
        times.push(start.elapsed().as_secs_f64() * 1e6);
    }
    let [p50, p99, p999, max] = percentiles(&mut times);
    println!("the machine alone, {ROUNDS} products: {p50:.1}, {p99:.1}, {p999:.1}, {max:.1}");
}
