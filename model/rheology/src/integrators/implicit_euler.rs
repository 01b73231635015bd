//! The implicit Euler rule: `F(+) = F + h (u(right) - F(+))`, `h = dt / tau`.

use super::rule::{Rule, Weights};

/// Amplifies by `1 / (1 + h)`: stable at any step. First order.
#[derive(Clone, Copy, Debug)]
pub struct ImplicitEuler;

impl Rule for ImplicitEuler {
    const USES: [bool; 3] = [false, false, true];

    fn weights(h: f64) -> Weights {
        let share = h / (1.0 + h);
        Weights { forcing: [0.0, 0.0, share], share }
    }
}
