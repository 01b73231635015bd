//! The classical Runge-Kutta rule of fourth order (Kutta 1901), its four stages joined: the equation is
//! linear in the force, so they are three weights of the forcing and one of the force.

use super::body::SeriesBody;
use super::drive::Drive;
use super::real::{Real, Running};
use super::{Integrator, Start, finished};
use crate::families::StepError;

/// Stable below `h = 2.785`. Fourth order. Needs the depth in mid-step, which a sampled path does not
/// have: taken from the straight line between the samples.
#[derive(Clone, Copy, Debug)]
pub struct RungeKutta<R, const N: usize> {
    drive: Drive<R, N>,
    force: Running<R>,
    left: R,
    middle: R,
    right: R,
    share: R,
}

impl<R: Real, const N: usize> Integrator<R, N> for RungeKutta<R, N> {
    fn at_any_step(body: &SeriesBody<N>, dt: f64, start: Start<R>) -> Self {
        let h = dt / body.tau_eps;
        let drive = Drive::new(body, dt, start.depth);
        Self {
            force: Running::new(start.force.unwrap_or(drive.settled())),
            drive,
            left: R::of(h / 6.0 * (1.0 - h + h * h / 2.0 - h * h * h / 4.0)),
            middle: R::of(h / 6.0 * (4.0 - 2.0 * h + h * h / 2.0)),
            right: R::of(h / 6.0),
            share: R::of(h * (1.0 - h / 2.0 * (1.0 - h / 3.0 * (1.0 - h / 4.0)))),
        }
    }

    #[inline]
    fn step(&mut self, depth: R) -> Result<R, StepError> {
        let forcing = self.drive.forcing(depth);
        let middle = self.drive.middle(&forcing);
        let weighted = self.left * forcing.left + self.middle * middle + self.right * forcing.right;
        let force = self.force.relaxed(weighted, self.share);
        self.force = finished(force, [self.drive.depth(), depth], self.drive.dt())?;
        self.drive.arrive(&forcing);
        Ok(force.value)
    }
}
