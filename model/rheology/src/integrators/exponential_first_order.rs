//! The exact decay with the forcing straight between the edges (first-order hold):
//! `F(+) = e^-h F + psi_0 u(left) + psi_1 (u(right) - u(left))`.

use super::rule::{Rule, Weights};
use palpate_model::viscoelastic::psi;

/// Amplifies by `e^-h`: stable at any step. Second order, since the powers of a straight depth are not
/// straight.
#[derive(Clone, Copy, Debug)]
pub struct ExponentialFirstOrder;

impl Rule for ExponentialFirstOrder {
    const USES: [bool; 3] = [true, false, true];

    fn weights(h: f64) -> Weights {
        let (psi_0, psi_1) = (psi(0, h), psi(1, h));
        Weights { forcing: [psi_0 - psi_1, 0.0, psi_1], share: psi_0 }
    }
}
