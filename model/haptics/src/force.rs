//! The model as a force law: a depth in, a force out, tick after tick.

use super::{Flags, Period, SettingError, SettingRange};
use palpate_model::units::{Depth, MmPerS, Newtons};
use palpate_rheology::families::{POWER_MAX, StepError};
use palpate_rheology::integrators::{
    ExactIntegrator, ExplicitEuler, ExponentialFirstOrder, ExponentialLeft, ImplicitEuler,
    Integrator, IntegratorError, IntegratorStart, RuleIntegrator, RungeKutta, Scheme, SeriesBody,
    Trapezoid,
};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Number of elastic terms a law steps; bodies of fewer are [padded](SeriesBody::padded).
const N: usize = POWER_MAX;

/// Integration scheme and bounds of a force law.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LawSettings {
    /// The body; a relaxation time of zero is one without memory.
    pub body: SeriesBody<POWER_MAX>,
    pub scheme: Scheme,
    /// From tick to tick.
    pub period: Period,
    /// Deepest depth; deeper ones count as this.
    pub depth_max: Depth,
    /// Fastest the depth may move; the law follows faster ones at this speed.
    pub speed_max: MmPerS,
    pub force_max: Newtons,
    /// Whether the force may be below zero, as the model has it where the probe leaves faster than the tissue follows.
    /// Real tissue does not stick to the probe; this is for comparisons.
    pub is_pull_allowed: bool,
}

impl LawSettings {
    /// The exact step in double precision with the bounds of the 30 mm master: 10 N, below what its
    /// motor may give for long, and 1 m/s, twice what a hand reaches in so short a stroke.
    #[must_use]
    pub fn of<const M: usize>(body: impl Into<SeriesBody<M>>, period: Period) -> Self {
        Self {
            body: body.into().padded(),
            scheme: Scheme::Exact,
            period,
            depth_max: Depth(30.0),
            speed_max: MmPerS(1000.0),
            force_max: Newtons(10.0),
            is_pull_allowed: false,
        }
    }
}

/// A law cannot be made so.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LawError {
    /// The body or its step.
    #[error(transparent)]
    Integrator(#[from] IntegratorError),
    #[error(transparent)]
    Setting(#[from] SettingError),
    #[error("a force law cannot begin at a depth of {0} mm; give a finite depth")]
    Start(f64),
}

/// One answer of a law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LawTick {
    /// The force to render, bounded.
    pub force: Newtons,
    /// The force the model has, before sign and bounds; zero where it has none.
    pub model: Newtons,
    /// The depth taken, after its bounds.
    pub depth: Depth,
    pub flags: Flags,
}

/// A body at a constant tick, with its state; nothing in a tick allocates, and any input gives a finite
/// force.
///
/// The force is never below zero unless [`LawSettings::is_pull_allowed`], and zero with the probe above the surface,
/// where the model's memory goes on fading.
#[derive(Clone, Copy, Debug)]
pub struct ForceLaw {
    settings: LawSettings,
    stepper: Stepper,
    depth: f64,
    move_max: f64,
}

/// A scheme with its state, in double precision.
#[derive(Clone, Copy, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "a tick may not allocate, and there is one in each law"
)]
enum Stepper {
    ExplicitEuler(RuleIntegrator<f64, N, ExplicitEuler>),
    ImplicitEuler(RuleIntegrator<f64, N, ImplicitEuler>),
    Trapezoid(RuleIntegrator<f64, N, Trapezoid>),
    ExponentialLeft(RuleIntegrator<f64, N, ExponentialLeft>),
    ExponentialFirstOrder(RuleIntegrator<f64, N, ExponentialFirstOrder>),
    Exact(ExactIntegrator<f64, N>),
    RungeKutta(RuleIntegrator<f64, N, RungeKutta>),
    /// No relaxation time: the force is the forcing.
    Instant {
        body: SeriesBody<N>,
        dt: f64,
        depth: f64,
    },
}

impl Stepper {
    fn new(settings: &LawSettings, depth: f64) -> Result<Self, LawError> {
        let LawSettings { body, scheme, .. } = settings;
        let dt = settings.period.seconds().0;
        // So short a memory is over before any number of ticks can show it.
        if body.tau_eps >= 0.0 && (dt / body.tau_eps).is_infinite() {
            let checked = SeriesBody { tau_eps: 1.0, ..*body };
            checked.checked().map_err(IntegratorError::from)?;
            return Ok(Self::Instant { body: *body, dt, depth });
        }
        scheme.check(body, dt)?;
        let start = IntegratorStart { depth, force: None };
        Ok(match scheme {
            Scheme::ExplicitEuler => {
                Self::ExplicitEuler(RuleIntegrator::at_any_step(body, dt, start))
            }
            Scheme::ImplicitEuler => {
                Self::ImplicitEuler(RuleIntegrator::at_any_step(body, dt, start))
            }
            Scheme::Trapezoid => Self::Trapezoid(RuleIntegrator::at_any_step(body, dt, start)),
            Scheme::ExponentialLeft => {
                Self::ExponentialLeft(RuleIntegrator::at_any_step(body, dt, start))
            }
            Scheme::ExponentialFirstOrder => {
                Self::ExponentialFirstOrder(RuleIntegrator::at_any_step(body, dt, start))
            }
            Scheme::Exact => Self::Exact(ExactIntegrator::at_any_step(body, dt, start)),
            Scheme::RungeKutta => Self::RungeKutta(RuleIntegrator::at_any_step(body, dt, start)),
        })
    }

    fn step(&mut self, depth: f64) -> Result<f64, StepError> {
        match self {
            Self::ExplicitEuler(one) => one.step(depth),
            Self::ImplicitEuler(one) => one.step(depth),
            Self::Trapezoid(one) => one.step(depth),
            Self::ExponentialLeft(one) => one.step(depth),
            Self::ExponentialFirstOrder(one) => one.step(depth),
            Self::Exact(one) => one.step(depth),
            Self::RungeKutta(one) => one.step(depth),
            Self::Instant { body, dt, depth: last } => {
                let (from, to) = (last.max(0.0), depth.max(0.0));
                let inner = body.mu.iter().rev().fold(0.0, |sum, mu| sum * to + mu);
                let force = to * (inner + body.tau_sig * (to - from) * (1.0 / *dt));
                if force.is_finite() {
                    *last = depth;
                }
                Ok(force)
            }
        }
    }
}

impl ForceLaw {
    /// A body relaxed at `depth`.
    pub fn new(settings: LawSettings, depth: Depth) -> Result<Self, LawError> {
        let bounds = [
            ("deepest depth", settings.depth_max.0, " mm"),
            ("fastest speed", settings.speed_max.0, " mm/s"),
            ("largest force", settings.force_max.0, " N"),
        ];
        SettingRange::Positive.check("a force law", &bounds)?;
        if !depth.is_finite() {
            return Err(LawError::Start(depth.0));
        }
        let depth = depth.0.clamp(-settings.depth_max.0, settings.depth_max.0);
        Ok(Self {
            stepper: Stepper::new(&settings, depth)?,
            depth,
            move_max: settings.speed_max.0 * settings.period.seconds().0,
            settings,
        })
    }

    /// Moves straight to `depth` within the tick and answers with the force at its end.
    #[must_use]
    pub fn tick(&mut self, depth: Depth) -> LawTick {
        let (to, mut flags) = self.bounded(depth.0);
        let model = match self.stepper.step(to) {
            Ok(force) if force.is_finite() => {
                self.depth = to;
                force
            }
            _ => {
                flags |= Flags::NO_FORCE;
                0.0
            }
        };
        let mut force = model;
        if to <= 0.0 {
            flags |= Flags::ABOVE_SURFACE;
            force = 0.0;
        } else if force < 0.0 && !self.settings.is_pull_allowed {
            flags |= Flags::PULL;
            force = 0.0;
        }
        let most = self.settings.force_max.0;
        flags |= Flags::FORCE_MAX.when(force.abs() > most);
        LawTick {
            force: Newtons(force.clamp(-most, most)),
            model: Newtons(model),
            depth: Depth(to),
            flags,
        }
    }

    /// The depth to move to: a number, within the stroke, no further than a tick allows.
    fn bounded(&self, depth: f64) -> (f64, Flags) {
        if depth.is_nan() {
            return (self.depth, Flags::DEPTH_NAN);
        }
        let most = self.settings.depth_max.0;
        let within = depth.clamp(-most, most);
        let range = Flags::DEPTH_RANGE.when(within != depth);
        let reached = within.clamp(self.depth - self.move_max, self.depth + self.move_max);
        (reached, range | Flags::JUMP.when(reached != within))
    }
}
