//! Force of a contact that grows and shrinks as often as it likes.
//!
//! Abel's transform turns an axisymmetric contact on a half-space into a row of springs of the specimen's relaxation modulus that
//! know nothing of each other: each is pushed where the indenter is deeper than its profile, lets go where its force ends, and
//! creeps back free of force until it is touched again (Hunter, J. Mech. Phys. Solids 8 (1960) 219-234, and Ting, J. Appl. Mech.
//! 35 (1968) 248-254, for contacts that grow again; Popov and Hess, Method of Dimensionality Reduction in Contact Mechanics and
//! Friction, 2015, for the springs).

use super::contact::PowerLaw;
use super::history::{DepthHistory, HistoryError};
use super::relaxation_modulus::RelaxationModulus;

/// Across the widest contact; a flat punch needs one. What the sum misses falls with the square.
const SPRINGS: usize = 500;

/// Forces in N at the samples of the history, whatever the contact does. Springs move straight between the samples, also where
/// they let go between two: the error falls with the square of the samples' distance and is 2e-5 of the largest force with 100
/// samples in each loading and unloading.
pub fn repeated_contact_force(
    law: PowerLaw,
    modulus: &RelaxationModulus,
    history: &DepthHistory,
) -> Result<Vec<f64>, HistoryError> {
    let knots = history.knots();
    let modes = modulus.modes(knots)?;
    // Of each interval and mode, what is left of the force and how stiff the mode is against a change over the interval.
    let step = |secs: f64| -> Vec<(f64, f64)> {
        let of_mode = |mode: &super::RelaxationMode| {
            let times = (secs / mode.time_secs).min(1e12);
            let mean = if times > 0.0 { -(-times).exp_m1() / times } else { 1.0 };
            ((-times).exp(), mode.modulus_mpa * mean)
        };
        modes.iter().map(of_mode).collect()
    };
    let steps: Vec<Vec<(f64, f64)>> =
        knots.windows(2).map(|pair| step(pair[1].time - pair[0].time)).collect();
    let mut forces = vec![0.0; steps.len()];
    for (share, profile) in springs(law, history) {
        let mut parts = vec![0.0; modes.len()];
        let mut surface = 0.0;
        for ((step, knot), force) in steps.iter().zip(&knots[1..]).zip(&mut forces) {
            let (mut left, mut stiffness) = (0.0, 0.0);
            for (part, (decay, stiff)) in parts.iter_mut().zip(step) {
                *part *= decay;
                left += *part;
                stiffness += stiff;
            }
            let (free, pushed) = (-left / stiffness, knot.depth - profile - surface);
            if pushed > free {
                *force += law.coefficient() * share * (left + stiffness * pushed);
            }
            let change = free.max(pushed);
            surface += change;
            for (part, (_, stiff)) in parts.iter_mut().zip(step) {
                *part += stiff * change;
            }
        }
    }
    Ok(forces)
}

/// The share of each spring in the force and the depth at which the indenter touches it: with `depth^n` as the force, the
/// profile is `x^(1 / (n - 1))` and the force `n` times the integral of the springs' forces over `x`.
fn springs(law: PowerLaw, history: &DepthHistory) -> Vec<(f64, f64)> {
    let order = law.exponent() - 1.0;
    if order == 0.0 {
        return vec![(1.0, 0.0)];
    }
    let deepest = history.knots().iter().map(|knot| knot.depth).fold(0.0, f64::max);
    let width = deepest.powf(order) / SPRINGS as f64;
    let spring = |index| (law.exponent() * width, (width * (index as f64 + 0.5)).powf(1.0 / order));
    (0..SPRINGS).map(spring).collect()
}
