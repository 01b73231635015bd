//! The contact position from two touches, for bodies unlike the one that is fitted: integrated here by small steps.

use palpate_model::signal::{ContactSearchPoint, TouchEstimate, fit_touch};
use palpate_model::units::{Newtons, Position, Seconds};
use palpate_test_support::record::Noise;

/// Where the surface is, in mm.
const SURFACE: f64 = 14.0;
/// Of one point: a good cell at 80 readings a second.
const NOISE: f64 = 0.7e-3;
/// Points are means of so much.
const POINT_S: f64 = 0.0125;
/// Steps of the integration in one point.
const STEPS: usize = 50;

/// `F + tau F' = mu1 x + mu2 x^2 + (by_speed + by_both x) x'`, all in N, mm and s.
struct Body {
    tau: f64,
    mu: [f64; 2],
    by_speed: f64,
    by_both: f64,
}

/// A standard linear solid of springs 0.12 and 0.08 N/mm, `F + tau F' = k1 (x + tau_sig x')`.
const LINEAR: Body = Body { tau: 4.0, mu: [0.12, 0.0], by_speed: 0.2 * 4.0, by_both: 0.0 };
/// The body of the thesis, equation 3.5.
const THESIS: Body = Body { tau: 1.023, mu: [0.05333, -0.0086], by_speed: 0.0, by_both: 0.06 };
/// Quasi-linear (Fung 1981): an elastic response `0.1 x + 0.04 x^2`, 40 % of which relax.
const QUASI_LINEAR: Body =
    Body { tau: 2.0, mu: [0.06, 0.024], by_speed: 0.1 * 2.0, by_both: 2.0 * 0.04 * 2.0 };

/// Out to a press, a dwell, back, a rest and a slow pass with another dwell: way in mm and speed in mm/s, or a time.
const WAY: [(f64, f64); 6] =
    [(16.4, 1.5), (5.0, 0.0), (11.7, 1.5), (10.0, 0.0), (14.9, 0.18), (5.0, 0.0)];

/// What the two touches feel if the surface is elsewhere by `apart` mm at the second.
fn touched(body: &Body, apart: f64, seed: u64) -> Vec<ContactSearchPoint> {
    let mut noise = Noise::seeded(seed);
    let (mut t, mut place, mut force, mut points) = (0.0, 4.0f64, 0.0, Vec::new());
    for (number, (amount, speed)) in WAY.into_iter().enumerate() {
        let seconds = if speed > 0.0 { (amount - place).abs() / speed } else { amount };
        let velocity = (amount - place).signum() * speed;
        for _ in 0..(seconds / POINT_S) as usize {
            let (mut sum, mut at) = (0.0, 0.0);
            for _ in 0..STEPS {
                let step = POINT_S / STEPS as f64;
                place += velocity * step;
                let surface = SURFACE + if number > 2 { apart } else { 0.0 };
                let x = (place - surface).max(0.0);
                let inside = if x > 0.0 { velocity } else { 0.0 };
                let [mu1, mu2] = body.mu;
                let driven = x * (mu1 + mu2 * x) + (body.by_speed + body.by_both * x) * inside;
                force += (driven - force) * (-(-step / body.tau).exp_m1());
                sum += if x > 0.0 { force } else { 0.0 };
                at += place;
            }
            t += POINT_S;
            let felt = sum / STEPS as f64 + NOISE * noise.normal();
            points.push(ContactSearchPoint {
                t: Seconds(t),
                position: Position(at / STEPS as f64),
                force: (number != 2).then_some(Newtons(felt)),
            });
        }
    }
    points
}

fn found(body: &Body, apart: f64, seed: u64) -> TouchEstimate {
    fit_touch(&touched(body, apart, seed)).expect("a contact")
}

#[test]
fn bodies_of_every_kind_are_met_where_they_are() {
    for (name, body) in [("linear", LINEAR), ("thesis", THESIS), ("quasi-linear", QUASI_LINEAR)] {
        for seed in 0..8 {
            let TouchEstimate { contact, separation_mm } = found(&body, 0.0, seed);
            let off = contact.position.0 - SURFACE;
            // Five standard errors: 24 of a hundred million searches.
            assert!(
                off.abs() < 5.0 * contact.std_error_mm + 0.002 && contact.std_error_mm < 0.05,
                "{name}, seed {seed}: {off} +- {}",
                contact.std_error_mm
            );
            assert!(contact.rmse_n < 1.2 * NOISE, "{name}: {}", contact.rmse_n);
            // Noise is taken for a distance once in three hundred; never for one that matters.
            assert!(
                separation_mm.is_none_or(|apart| apart.abs() < 0.02),
                "{name}: {separation_mm:?}"
            );
        }
    }
}

#[test]
fn a_surface_that_moved_between_the_touches_is_reported() {
    for (name, body) in [("linear", LINEAR), ("thesis", THESIS), ("quasi-linear", QUASI_LINEAR)] {
        for apart in [-0.3, 0.2] {
            let found = found(&body, apart, 1).separation_mm.unwrap_or(0.0);
            assert!((found - apart).abs() < 0.02, "{name}: {found} for {apart}");
        }
    }
}
