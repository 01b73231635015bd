//! The trapezoid rule: `F(+) = F + h ((u(left) + u(right)) / 2 - (F + F(+)) / 2)`, `h = dt / tau`.

use super::rule::{Rule, Weights};

/// Amplifies by `(2 - h) / (2 + h)`: stable at any step, ringing above `h = 2`. Second order.
#[derive(Clone, Copy, Debug)]
pub struct Trapezoid;

impl Rule for Trapezoid {
    const USES: [bool; 3] = [true, false, true];

    fn weights(h: f64) -> Weights {
        let half = h / (2.0 + h);
        Weights { forcing: [half, 0.0, half], share: 2.0 * half }
    }
}
