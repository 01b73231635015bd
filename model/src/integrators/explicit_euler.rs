//! The explicit Euler rule: `F(+) = F + h (u(left) - F)`, `h = dt / tau`.

use super::body::SeriesBody;
use super::drive::Drive;
use super::real::{Real, Running};
use super::{Integrator, Start, finished};
use crate::families::StepError;

/// Amplifies by `1 - h`: stable below `h = 2`, without ringing up to 1. First order.
#[derive(Clone, Copy, Debug)]
pub struct ExplicitEuler<R, const N: usize> {
    drive: Drive<R, N>,
    force: Running<R>,
    h: R,
}

impl<R: Real, const N: usize> Integrator<R, N> for ExplicitEuler<R, N> {
    fn at_any_step(body: &SeriesBody<N>, dt: f64, start: Start<R>) -> Self {
        let h = dt / body.tau_eps;
        let drive = Drive::new(body, dt, start.depth);
        Self {
            force: Running::new(start.force.unwrap_or(drive.settled())),
            drive,
            h: R::of(h),
        }
    }

    #[inline]
    fn step(&mut self, depth: R) -> Result<R, StepError> {
        let forcing = self.drive.forcing(depth);
        let weighted = self.h * forcing.left;
        let force = self.force.relaxed(weighted, self.h);
        self.force = finished(force, [self.drive.depth(), depth], self.drive.dt())?;
        self.drive.arrive(&forcing);
        Ok(force.value)
    }
}
