//! Seven ways to step the modified Kelvin body at a constant rate, in `f64` or `f32`.
//!
//! The exact one is what palpate uses. The others are what programs without it use, and what the
//! measured trade compares: error against time. All have the form `F(+) = F - a F + w`, their
//! coefficients made once for a step length, the sum compensated; they differ in `a` and in what they
//! make of the depth between two samples. The approximate ones are no more than their weights
//! ([`Rule`]). With `h = dt / tau` the textbook properties are (Hairer &
//! Wanner, "Solving Ordinary Differential Equations II", chapter IV; Hochbruck & Ostermann, Acta
//! Numerica 19 (2010) 209-286):
//!
//! | | a force alone is multiplied by | stable | order |
//! |---|---|---|---|
//! | explicit Euler | 1 - h | h < 2 | 1 |
//! | implicit Euler | 1 / (1 + h) | always | 1 |
//! | trapezoid | (2 - h) / (2 + h) | always | 2 |
//! | exponential, forcing held | e^-h | always | 1 |
//! | exponential, forcing straight | e^-h | always | 2 |
//! | exact, depth straight | e^-h | always | exact |
//! | Runge-Kutta | 1 - h + h²/2 - h³/6 + h⁴/24 | h < 2.785 | 4 |
//!
//! Depth below zero is out of contact and counts as zero. The exact step is cut where the path crosses
//! the surface; the others see only the depths at the ends of the step.

mod body;
mod drive;
mod exact;
mod real;
mod rule;

pub use body::SeriesBody;
pub use exact::ExactIntegrator;
pub use real::Real;
pub use rule::{
    ExplicitEuler, ExponentialFirstOrder, ExponentialLeft, ImplicitEuler, Rule, RuleIntegrator,
    RuleWeights, RungeKutta, Trapezoid,
};

use crate::families::StepError;
use palpate_model::viscoelastic::BodyError;
use real::CompensatedForce;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// One way to step a body of `N` elastic terms in precision `R`, `dt` apart.
pub trait Integrator<R: Real, const N: usize>: Sized {
    /// With its coefficients ready, even where it would be unstable; [`Scheme::check`] refuses that.
    fn at_any_step(body: &SeriesBody<N>, dt: f64, start: IntegratorStart<R>) -> Self;

    /// Moves to `depth` mm in the step's time and returns the force in N. On an error nothing moved.
    fn step(&mut self, depth: R) -> Result<R, StepError>;
}

/// Where an integration begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IntegratorStart<R> {
    /// Depth in mm.
    pub depth: R,
    /// Force in N; `None` for a body relaxed at that depth.
    pub force: Option<R>,
}

palpate_model::named! {
    /// Width of the numbers an integrator computes with.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "lowercase")]
    pub enum Precision {
        /// 53 binary digits.
        F64 = "f64",
        /// 24 binary digits.
        F32 = "f32",
    }
}

palpate_model::named! {
    #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
    #[serde(rename_all = "kebab-case")]
    pub enum Scheme {
        ExplicitEuler = "explicit Euler",
        ImplicitEuler = "implicit Euler",
        Trapezoid = "trapezoid",
        ExponentialLeft = "exponential, forcing held",
        ExponentialFirstOrder = "exponential, forcing straight",
        Exact = "exact, depth straight",
        RungeKutta = "Runge-Kutta 4",
    }
}

/// A body cannot be integrated so.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum IntegratorError {
    #[error(transparent)]
    Body(#[from] BodyError),
    #[error(transparent)]
    Step(#[from] StepError),
    #[error("a time step of {0} s is not possible; give a finite step greater than zero")]
    Time(f64),
    #[error(
        "{name} is unstable at steps of {dt} s, which are {h:.3} relaxation times; use steps below {limit:.3} relaxation times"
    )]
    Unstable { name: &'static str, dt: f64, h: f64, limit: f64 },
}

/// Where the fourth-order polynomial of Runge-Kutta reaches one: the real root of
/// `h^3 / 24 - h^2 / 6 + h / 2 = 1`.
const RUNGE_KUTTA_LIMIT: f64 = 2.785_293_563_405_282;

impl Scheme {
    /// Power of the step with which its error falls; `None` for the exact step.
    #[must_use]
    pub fn order(self) -> Option<u32> {
        match self {
            Self::ExplicitEuler | Self::ImplicitEuler | Self::ExponentialLeft => Some(1),
            Self::Trapezoid | Self::ExponentialFirstOrder => Some(2),
            Self::RungeKutta => Some(4),
            Self::Exact => None,
        }
    }

    /// Steps, in relaxation times, from which on errors grow; `None` if they never do.
    #[must_use]
    pub fn stability_limit(self) -> Option<f64> {
        match self {
            Self::ExplicitEuler => Some(2.0),
            Self::RungeKutta => Some(RUNGE_KUTTA_LIMIT),
            _ => None,
        }
    }

    /// Weights, in a step of `h` relaxation times, of the force and of the forcing at its start, middle and
    /// end. The exact step of a linear forcing is the exponential one with the forcing straight.
    #[must_use]
    pub fn weights(self, h: f64) -> RuleWeights {
        match self {
            Self::ExplicitEuler => ExplicitEuler::weights(h),
            Self::ImplicitEuler => ImplicitEuler::weights(h),
            Self::Trapezoid => Trapezoid::weights(h),
            Self::ExponentialLeft => ExponentialLeft::weights(h),
            Self::ExponentialFirstOrder | Self::Exact => ExponentialFirstOrder::weights(h),
            Self::RungeKutta => RungeKutta::weights(h),
        }
    }

    /// Whether a body can be stepped `dt` seconds at a time.
    pub fn check<const N: usize>(
        self,
        body: &SeriesBody<N>,
        dt: f64,
    ) -> Result<(), IntegratorError> {
        body.checked()?;
        let h = dt / body.tau_eps;
        // A quotient beyond the numbers has no coefficients either.
        if !(dt > 0.0 && dt.is_finite() && (1.0 / dt).is_finite() && h.is_finite()) {
            return Err(IntegratorError::Time(dt));
        }
        match self.stability_limit() {
            Some(limit) if h >= limit => {
                Err(IntegratorError::Unstable { name: self.name(), dt, h, limit })
            }
            _ => Ok(()),
        }
    }

    /// The forces in N along depths `dt` seconds apart, from a body relaxed at the first of them.
    pub fn respond<R: Real, const N: usize>(
        self,
        body: &SeriesBody<N>,
        dt: f64,
        depths: &[R],
        forces: &mut Vec<R>,
    ) -> Result<(), IntegratorError> {
        self.check(body, dt)?;
        forces.clear();
        match self {
            Self::ExplicitEuler => {
                run::<R, N, RuleIntegrator<R, N, ExplicitEuler>>(body, dt, depths, forces)
            }
            Self::ImplicitEuler => {
                run::<R, N, RuleIntegrator<R, N, ImplicitEuler>>(body, dt, depths, forces)
            }
            Self::Trapezoid => {
                run::<R, N, RuleIntegrator<R, N, Trapezoid>>(body, dt, depths, forces)
            }
            Self::ExponentialLeft => {
                run::<R, N, RuleIntegrator<R, N, ExponentialLeft>>(body, dt, depths, forces)
            }
            Self::ExponentialFirstOrder => {
                run::<R, N, RuleIntegrator<R, N, ExponentialFirstOrder>>(body, dt, depths, forces)
            }
            Self::Exact => run::<R, N, ExactIntegrator<R, N>>(body, dt, depths, forces),
            Self::RungeKutta => {
                run::<R, N, RuleIntegrator<R, N, RungeKutta>>(body, dt, depths, forces)
            }
        }
    }
}

fn run<R: Real, const N: usize, I: Integrator<R, N>>(
    body: &SeriesBody<N>,
    dt: f64,
    depths: &[R],
    forces: &mut Vec<R>,
) -> Result<(), IntegratorError> {
    let Some((&depth, rest)) = depths.split_first() else {
        return Ok(());
    };
    if !depth.is_finite() {
        return Err(StepError::Depth(depth.to_f64()).into());
    }
    let start = IntegratorStart { depth, force: None };
    let mut integrator = I::at_any_step(body, dt, start);
    // A step of no movement from rest changes nothing; the first force is where the body rests.
    forces.push(drive::SeriesDrive::new(body, dt, depth).settled());
    for &depth in rest {
        forces.push(integrator.step(depth)?);
    }
    Ok(())
}

/// The new force if it is a number, else why it is none.
#[inline]
fn check_finite<R: Real>(
    force: CompensatedForce<R>,
    ends: [R; 2],
    dt: f64,
) -> Result<CompensatedForce<R>, StepError> {
    if force.value.is_finite() && ends[1].is_finite() {
        Ok(force)
    } else {
        Err(step_error(ends.map(R::to_f64), dt))
    }
}

#[cold]
fn step_error([from, to]: [f64; 2], dt: f64) -> StepError {
    if to.is_finite() { StepError::Overflow { from, to, dt } } else { StepError::Depth(to) }
}

#[cfg(test)]
#[cfg(feature = "extremes")]
mod tests;
