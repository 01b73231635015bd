//! The exact decay with the forcing straight between the edges (first-order hold):
//! `F(+) = e^-h F + psi_0 u(left) + psi_1 (u(right) - u(left))`.

use super::body::SeriesBody;
use super::drive::Drive;
use super::real::{Real, Running};
use super::{Integrator, Start, finished};
use crate::families::StepError;
use crate::viscoelastic::psi;

/// Amplifies by `e^-h`: stable at any step. Second order, since the powers of a straight depth are not
/// straight.
#[derive(Clone, Copy, Debug)]
pub struct ExponentialFirstOrder<R, const N: usize> {
    drive: Drive<R, N>,
    force: Running<R>,
    psi_0: R,
    psi_1: R,
}

impl<R: Real, const N: usize> Integrator<R, N> for ExponentialFirstOrder<R, N> {
    fn at_any_step(body: &SeriesBody<N>, dt: f64, start: Start<R>) -> Self {
        let h = dt / body.tau_eps;
        let drive = Drive::new(body, dt, start.depth);
        Self {
            force: Running::new(start.force.unwrap_or(drive.settled())),
            drive,
            psi_0: R::of(psi(0, h)),
            psi_1: R::of(psi(1, h)),
        }
    }

    #[inline]
    fn step(&mut self, depth: R) -> Result<R, StepError> {
        let forcing = self.drive.forcing(depth);
        let change = forcing.right - forcing.left;
        let weighted = self.psi_0 * forcing.left + self.psi_1 * change;
        let force = self.force.relaxed(weighted, self.psi_0);
        self.force = finished(force, [self.drive.depth(), depth], self.drive.dt())?;
        self.drive.arrive(&forcing);
        Ok(force.value)
    }
}
