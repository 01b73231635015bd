//! The approximate integrators: `F(+) = F - a F + w`, with `w` a weighted sum of the forcing at the
//! start, in the middle and at the end of the step.

use super::body::SeriesBody;
use super::drive::SeriesDrive;
use super::real::{CompensatedForce, Real};
use super::{Integrator, IntegratorStart, check_finite};
use crate::families::StepError;
use palpate_model::viscoelastic::psi;
use std::marker::PhantomData;

/// The numbers of a rule for one step length.
#[derive(Clone, Copy, Debug)]
pub struct RuleWeights {
    /// Weights of the forcing at the start, in the middle and at the end of the step.
    pub forcing: [f64; 3],
    /// The share of the force that goes, `a`.
    pub share: f64,
}

/// An integrator as its weights for a step of `h` relaxation times.
pub trait Rule {
    /// Which of the three weights are not zero at every step: the others cost nothing.
    const USES: [bool; 3];

    fn weights(h: f64) -> RuleWeights;
}

/// A body stepped by a rule.
#[derive(Clone, Copy, Debug)]
pub struct RuleIntegrator<R, const N: usize, T> {
    drive: SeriesDrive<R, N>,
    force: CompensatedForce<R>,
    forcing: [R; 3],
    share: R,
    rule: PhantomData<T>,
}

impl<R: Real, const N: usize, T: Rule> Integrator<R, N> for RuleIntegrator<R, N, T> {
    fn at_any_step(body: &SeriesBody<N>, dt: f64, start: IntegratorStart<R>) -> Self {
        let weights = T::weights(dt / body.tau_eps);
        let drive = SeriesDrive::new(body, dt, start.depth);
        Self {
            force: CompensatedForce::new(start.force.unwrap_or(drive.settled())),
            drive,
            forcing: weights.forcing.map(R::of),
            share: R::of(weights.share),
            rule: PhantomData,
        }
    }

    #[inline]
    fn step(&mut self, depth: R) -> Result<R, StepError> {
        let forcing = self.drive.forcing(depth);
        let [left, middle, right] = self.forcing;
        let mut weighted = R::ZERO;
        if T::USES[0] {
            weighted = weighted + left * forcing.left;
        }
        if T::USES[1] {
            weighted = weighted + middle * self.drive.middle(&forcing);
        }
        if T::USES[2] {
            weighted = weighted + right * forcing.right;
        }
        let force = self.force.relaxed(weighted, self.share);
        self.force = check_finite(force, [self.drive.depth(), depth], self.drive.dt())?;
        self.drive.arrive(&forcing);
        Ok(force.value)
    }
}

/// The explicit Euler rule: `F(+) = F + h (u(left) - F)`, `h = dt / tau`.
///
/// Amplifies by `1 - h`: stable below `h = 2`, without ringing up to 1. First order.
#[derive(Clone, Copy, Debug)]
pub struct ExplicitEuler;

impl Rule for ExplicitEuler {
    const USES: [bool; 3] = [true, false, false];

    fn weights(h: f64) -> RuleWeights {
        RuleWeights { forcing: [h, 0.0, 0.0], share: h }
    }
}

/// The implicit Euler rule: `F(+) = F + h (u(right) - F(+))`, `h = dt / tau`.
///
/// Amplifies by `1 / (1 + h)`: stable at any step. First order.
#[derive(Clone, Copy, Debug)]
pub struct ImplicitEuler;

impl Rule for ImplicitEuler {
    const USES: [bool; 3] = [false, false, true];

    fn weights(h: f64) -> RuleWeights {
        let share = h / (1.0 + h);
        RuleWeights { forcing: [0.0, 0.0, share], share }
    }
}

/// The trapezoid rule: `F(+) = F + h ((u(left) + u(right)) / 2 - (F + F(+)) / 2)`, `h = dt / tau`.
///
/// Amplifies by `(2 - h) / (2 + h)`: stable at any step, ringing above `h = 2`. Second order.
#[derive(Clone, Copy, Debug)]
pub struct Trapezoid;

impl Rule for Trapezoid {
    const USES: [bool; 3] = [true, false, true];

    fn weights(h: f64) -> RuleWeights {
        let half = h / (2.0 + h);
        RuleWeights { forcing: [half, 0.0, half], share: 2.0 * half }
    }
}

/// The exact decay with the forcing held at the left edge: `F(+) = e^-h F + (1 - e^-h) u(left)`.
///
/// Amplifies by `e^-h`: stable at any step. First order, and on a ramp worse than explicit Euler.
#[derive(Clone, Copy, Debug)]
pub struct ExponentialLeft;

impl Rule for ExponentialLeft {
    const USES: [bool; 3] = [true, false, false];

    fn weights(h: f64) -> RuleWeights {
        let share = psi(0, h);
        RuleWeights { forcing: [share, 0.0, 0.0], share }
    }
}

/// The exact decay with the forcing straight between the edges (first-order hold): `F(+) = e^-h F + psi_0 u(left) + psi_1 (u(right) - u(left))`.
///
/// Amplifies by `e^-h`: stable at any step. Second order, since the powers of a straight depth are not
/// straight.
#[derive(Clone, Copy, Debug)]
pub struct ExponentialFirstOrder;

impl Rule for ExponentialFirstOrder {
    const USES: [bool; 3] = [true, false, true];

    fn weights(h: f64) -> RuleWeights {
        let (psi_0, psi_1) = (psi(0, h), psi(1, h));
        RuleWeights { forcing: [psi_0 - psi_1, 0.0, psi_1], share: psi_0 }
    }
}

/// The classical Runge-Kutta rule of fourth order (Kutta 1901), its four stages joined: the equation is linear in the force, so they are three weights of the forcing and one of the force.
///
/// Stable below `h = 2.785`. Fourth order. Needs the depth in mid-step, which a sampled path does not
/// have: taken from the straight line between the samples.
#[derive(Clone, Copy, Debug)]
pub struct RungeKutta;

impl Rule for RungeKutta {
    const USES: [bool; 3] = [true, true, true];

    fn weights(h: f64) -> RuleWeights {
        RuleWeights {
            forcing: [
                h / 6.0 * (1.0 - h + h * h / 2.0 - h * h * h / 4.0),
                h / 6.0 * (4.0 - 2.0 * h + h * h / 2.0),
                h / 6.0,
            ],
            share: h * (1.0 - h / 2.0 * (1.0 - h / 3.0 * (1.0 - h / 4.0))),
        }
    }
}
