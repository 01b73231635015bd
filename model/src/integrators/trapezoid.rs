//! The trapezoid rule: `F(+) = F + h ((u(left) + u(right)) / 2 - (F + F(+)) / 2)`, `h = dt / tau`.

use super::body::SeriesBody;
use super::drive::Drive;
use super::real::{Real, Running};
use super::{Integrator, Start, finished};
use crate::families::StepError;

/// Amplifies by `(2 - h) / (2 + h)`: stable at any step, ringing above `h = 2`. Second order.
#[derive(Clone, Copy, Debug)]
pub struct Trapezoid<R, const N: usize> {
    drive: Drive<R, N>,
    force: Running<R>,
    half: R,
    share: R,
}

impl<R: Real, const N: usize> Integrator<R, N> for Trapezoid<R, N> {
    fn at_any_step(body: &SeriesBody<N>, dt: f64, start: Start<R>) -> Self {
        let h = dt / body.tau_eps;
        let drive = Drive::new(body, dt, start.depth);
        Self {
            force: Running::new(start.force.unwrap_or(drive.settled())),
            drive,
            half: R::of(h / (2.0 + h)),
            share: R::of(2.0 * h / (2.0 + h)),
        }
    }

    #[inline]
    fn step(&mut self, depth: R) -> Result<R, StepError> {
        let forcing = self.drive.forcing(depth);
        let weighted = self.half * (forcing.left + forcing.right);
        let force = self.force.relaxed(weighted, self.share);
        self.force = finished(force, [self.drive.depth(), depth], self.drive.dt())?;
        self.drive.arrive(&forcing);
        Ok(force.value)
    }
}
