//! The criterion of passivity for a sampled wall, evaluated at every frequency.
//!
//! A mass with damping `b`, a force held over ticks of `T` and computed as `H(z)` from the sampled place absorb energy
//! with any passive hand if and only if `b > T/2 / (1 - cos th) Re{(1 - e^{-j th}) H(e^{j th})}` for `0 <= th <= pi`
//! (Colgate & Schenkel, Journal of Robotic Systems 14 (1997) 37-47). A delay of `d` ticks is a factor `e^{-j th d}`.
//!
//! Without delay and for any one-step scheme the right side is a ratio of two straight lines in `cos th`, so that its
//! largest value is at one of the two ends, [`SampledStep::slow`] and [`SampledStep::fast`]. The tests check that against this.

use super::linear::SampledStep;
use std::f64::consts::PI;

/// Frequencies looked at, evenly in the logarithm of `th` and again evenly in `th`.
const GRID: u32 = 400;
/// Smallest `th` looked at: 1e-7 of a tick's motion; below it the limit stands.
const SMALLEST: f64 = 1e-7;

/// The right side of the criterion at `th` in `(0, pi]`, in N s/mm.
#[must_use]
pub fn damping_needed_at(sampled: &SampledStep, delay_ticks: f64, th: f64) -> f64 {
    // q = e^{-j th} = 1 - u, with u = 2 sin^2(th/2) + j sin th: small numbers without cancellation.
    let (half_sin, half_cos) = (0.5 * th).sin_cos();
    let u = [2.0 * half_sin * half_sin, 2.0 * half_sin * half_cos];
    let keep = 1.0 - sampled.share;
    let above = [sampled.both - sampled.before * u[0], -sampled.before * u[1]];
    let below = [sampled.share + keep * u[0], keep * u[1]];
    let size = below[0] * below[0] + below[1] * below[1];
    let h = [
        (above[0] * below[0] + above[1] * below[1]) / size,
        (above[1] * below[0] - above[0] * below[1]) / size,
    ];
    let (sin, cos) = (delay_ticks * th).sin_cos();
    let delayed = [h[0] * cos + h[1] * sin, h[1] * cos - h[0] * sin];
    // Re{(1 - q) H} / (1 - cos th) = Re H - cot(th/2) Im H.
    0.5 * sampled.tick * (delayed[0] - half_cos / half_sin * delayed[1])
}

/// The largest value of the right side over all frequencies, in N s/mm, and the `th` it is at.
#[must_use]
pub fn damping_needed(sampled: &SampledStep, delay_ticks: f64) -> (f64, f64) {
    let at_rest = sampled.both / sampled.share;
    let mut best = (sampled.slow() + at_rest * delay_ticks * sampled.tick, 0.0);
    let mut look = |th: f64| {
        let value = damping_needed_at(sampled, delay_ticks, th);
        if value > best.0 {
            best = (value, th);
        }
    };
    let span = (PI / SMALLEST).ln();
    for i in 0..=GRID {
        let share = f64::from(i) / f64::from(GRID);
        look(SMALLEST * (span * share).exp());
        look(PI * share.max(1.0 / f64::from(GRID)));
    }
    // The top of the hill between the neighbours of the best of the grid, by golden sections.
    let (mut low, mut high) = (best.1 * (-span / f64::from(GRID)).exp(), 0.0);
    high += (best.1 + PI / f64::from(GRID)).min(PI);
    if best.1 > 0.0 {
        const SECTION: f64 = 0.618_033_988_749_894_9;
        for _ in 0..80 {
            let (a, b) = (high - SECTION * (high - low), low + SECTION * (high - low));
            let [at_a, at_b] = [a, b].map(|th| damping_needed_at(sampled, delay_ticks, th));
            if at_a > at_b {
                high = b
            } else {
                low = a
            }
            for (value, th) in [(at_a, a), (at_b, b)] {
                if value > best.0 {
                    best = (value, th);
                }
            }
        }
    }
    best
}
