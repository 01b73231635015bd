//! What the approximate integrators share: `F(+) = F - a F + w`, with `w` a weighted sum of the forcing at the
//! start, in the middle and at the end of the step.

use super::body::SeriesBody;
use super::drive::SeriesDrive;
use super::real::{CompensatedForce, Real};
use super::{Integrator, Start, check_finite};
use crate::families::StepError;
use std::marker::PhantomData;

/// The numbers of a rule for one step length.
#[derive(Clone, Copy, Debug)]
pub struct Weights {
    /// Weights of the forcing at the start, in the middle and at the end of the step.
    pub forcing: [f64; 3],
    /// The share of the force that goes, `a`.
    pub share: f64,
}

/// An integrator as its weights for a step of `h` relaxation times.
pub trait Rule {
    /// Which of the three weights are not zero at every step: the others cost nothing.
    const USES: [bool; 3];

    fn weights(h: f64) -> Weights;
}

/// A body stepped by a rule.
#[derive(Clone, Copy, Debug)]
pub struct Stepped<R, const N: usize, T> {
    drive: SeriesDrive<R, N>,
    force: CompensatedForce<R>,
    forcing: [R; 3],
    share: R,
    rule: PhantomData<T>,
}

impl<R: Real, const N: usize, T: Rule> Integrator<R, N> for Stepped<R, N, T> {
    fn at_any_step(body: &SeriesBody<N>, dt: f64, start: Start<R>) -> Self {
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
