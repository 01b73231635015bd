//! Forcing of the body at the two ends of a step.

use super::body::SeriesBody;
use super::real::Real;

/// The forcing `mu1 x + .. + muN x^N + tau_sig x x'` and where the probe is.
///
/// The speed over a step is the difference quotient of its two depths: a sampled path has no other,
/// and on a path that is straight between samples it is the true speed.
#[derive(Clone, Copy, Debug)]
pub(super) struct SeriesDrive<R, const N: usize> {
    mu: [R; N],
    tau_sig: R,
    dt: f64,
    per_dt: R,
    at: DrivePoint<R>,
}

/// A depth, at least zero, and the elastic force it settles at.
#[derive(Clone, Copy, Debug)]
pub(super) struct DrivePoint<R> {
    x: R,
    elastic: R,
}

/// The forcing over one step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Forcing<R> {
    pub left: R,
    pub right: R,
    to: DrivePoint<R>,
    speed: R,
}

impl<R: Real, const N: usize> SeriesDrive<R, N> {
    /// A probe that rests at `depth`, and steps of `dt` seconds.
    pub fn new(body: &SeriesBody<N>, dt: f64, depth: R) -> Self {
        let mut drive = Self {
            mu: body.mu.map(R::of),
            tau_sig: R::of(body.tau_sig),
            dt,
            per_dt: R::of(1.0 / dt),
            at: DrivePoint { x: R::ZERO, elastic: R::ZERO },
        };
        drive.at = drive.place(depth);
        drive
    }

    /// The force at which the present depth settles.
    pub fn settled(&self) -> R {
        self.at.elastic
    }

    /// The present depth in mm, at least zero.
    pub fn depth(&self) -> R {
        self.at.x
    }

    /// The step in s.
    pub fn dt(&self) -> f64 {
        self.dt
    }

    #[inline]
    fn place(&self, depth: R) -> DrivePoint<R> {
        let x = if depth < R::ZERO { R::ZERO } else { depth };
        let inner = self.mu.iter().rev().fold(R::ZERO, |sum, &mu| sum * x + mu);
        DrivePoint { x, elastic: inner * x }
    }

    /// The forcing of a straight move to `depth`.
    #[inline]
    pub fn forcing(&self, depth: R) -> Forcing<R> {
        let to = self.place(depth);
        let speed = (to.x - self.at.x) * self.per_dt;
        let viscous = self.tau_sig * speed;
        Forcing {
            left: self.at.elastic + viscous * self.at.x,
            right: to.elastic + viscous * to.x,
            to,
            speed,
        }
    }

    /// The forcing in the middle of that move.
    #[inline]
    pub fn middle(&self, forcing: &Forcing<R>) -> R {
        let middle = self.place((self.at.x + forcing.to.x) * R::of(0.5));
        middle.elastic + self.tau_sig * forcing.speed * middle.x
    }

    #[inline]
    pub fn arrive(&mut self, forcing: &Forcing<R>) {
        self.at = forcing.to;
    }
}
