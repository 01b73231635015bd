//! The exact decay with the forcing held at the left edge: `F(+) = e^-h F + (1 - e^-h) u(left)`.

use super::rule::{Rule, Weights};
use palpate_model::viscoelastic::psi;

/// Amplifies by `e^-h`: stable at any step. First order, and on a ramp worse than explicit Euler.
#[derive(Clone, Copy, Debug)]
pub struct ExponentialLeft;

impl Rule for ExponentialLeft {
    const USES: [bool; 3] = [true, false, false];

    fn weights(h: f64) -> Weights {
        let share = psi(0, h);
        Weights { forcing: [share, 0.0, 0.0], share }
    }
}
