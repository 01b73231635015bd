//! The exact decay with the forcing held at the left edge: `F(+) = e^-h F + (1 - e^-h) u(left)`.

use super::body::SeriesBody;
use super::drive::Drive;
use super::real::{Real, Running};
use super::{Integrator, Start, finished};
use crate::families::StepError;
use crate::viscoelastic::psi;

/// Amplifies by `e^-h`: stable at any step. First order, and on a ramp worse than explicit Euler.
#[derive(Clone, Copy, Debug)]
pub struct ExponentialLeft<R, const N: usize> {
    drive: Drive<R, N>,
    force: Running<R>,
    psi_0: R,
}

impl<R: Real, const N: usize> Integrator<R, N> for ExponentialLeft<R, N> {
    fn at_any_step(body: &SeriesBody<N>, dt: f64, start: Start<R>) -> Self {
        let h = dt / body.tau_eps;
        let drive = Drive::new(body, dt, start.depth);
        Self {
            force: Running::new(start.force.unwrap_or(drive.settled())),
            drive,
            psi_0: R::of(psi(0, h)),
        }
    }

    #[inline]
    fn step(&mut self, depth: R) -> Result<R, StepError> {
        let forcing = self.drive.forcing(depth);
        let weighted = self.psi_0 * forcing.left;
        let force = self.force.relaxed(weighted, self.psi_0);
        self.force = finished(force, [self.drive.depth(), depth], self.drive.dt())?;
        self.drive.arrive(&forcing);
        Ok(force.value)
    }
}
