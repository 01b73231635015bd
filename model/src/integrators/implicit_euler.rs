//! The implicit Euler rule: `F(+) = F + h (u(right) - F(+))`, `h = dt / tau`.

use super::body::SeriesBody;
use super::drive::Drive;
use super::real::{Real, Running};
use super::{Integrator, Start, finished};
use crate::families::StepError;

/// Amplifies by `1 / (1 + h)`: stable at any step. First order.
#[derive(Clone, Copy, Debug)]
pub struct ImplicitEuler<R, const N: usize> {
    drive: Drive<R, N>,
    force: Running<R>,
    share: R,
}

impl<R: Real, const N: usize> Integrator<R, N> for ImplicitEuler<R, N> {
    fn at_any_step(body: &SeriesBody<N>, dt: f64, start: Start<R>) -> Self {
        let h = dt / body.tau_eps;
        let drive = Drive::new(body, dt, start.depth);
        Self {
            force: Running::new(start.force.unwrap_or(drive.settled())),
            drive,
            share: R::of(h / (1.0 + h)),
        }
    }

    #[inline]
    fn step(&mut self, depth: R) -> Result<R, StepError> {
        let forcing = self.drive.forcing(depth);
        let weighted = self.share * forcing.right;
        let force = self.force.relaxed(weighted, self.share);
        self.force = finished(force, [self.drive.depth(), depth], self.drive.dt())?;
        self.drive.arrive(&forcing);
        Ok(force.value)
    }
}
