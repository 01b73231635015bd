//! The classical Runge-Kutta rule of fourth order (Kutta 1901), its four stages joined: the equation is
//! linear in the force, so they are three weights of the forcing and one of the force.

use super::rule::{Rule, Weights};

/// Stable below `h = 2.785`. Fourth order. Needs the depth in mid-step, which a sampled path does not
/// have: taken from the straight line between the samples.
#[derive(Clone, Copy, Debug)]
pub struct RungeKutta;

impl Rule for RungeKutta {
    const USES: [bool; 3] = [true, true, true];

    fn weights(h: f64) -> Weights {
        Weights {
            forcing: [
                h / 6.0 * (1.0 - h + h * h / 2.0 - h * h * h / 4.0),
                h / 6.0 * (4.0 - 2.0 * h + h * h / 2.0),
                h / 6.0,
            ],
            share: h * (1.0 - h / 2.0 * (1.0 - h / 3.0 * (1.0 - h / 4.0))),
        }
    }
}
