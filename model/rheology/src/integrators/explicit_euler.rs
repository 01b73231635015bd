//! The explicit Euler rule: `F(+) = F + h (u(left) - F)`, `h = dt / tau`.

use super::rule::{Rule, Weights};

/// Amplifies by `1 - h`: stable below `h = 2`, without ringing up to 1. First order.
#[derive(Clone, Copy, Debug)]
pub struct ExplicitEuler;

impl Rule for ExplicitEuler {
    const USES: [bool; 3] = [true, false, false];

    fn weights(h: f64) -> Weights {
        Weights { forcing: [h, 0.0, 0.0], share: h }
    }
}
