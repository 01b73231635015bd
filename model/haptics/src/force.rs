//! The model as a force law: a depth in, a force out, tick after tick.

use super::{Flags, Period};
use palpate_model::time::Nanos;
use palpate_model::units::{Depth, MmPerS, Newtons};
use palpate_rheology::families::{POWER_MAX, StepError};
use palpate_rheology::integrators::{
    Exact, ExplicitEuler, ExponentialFirstOrder, ExponentialLeft, ImplicitEuler, Integrator,
    IntegratorError, Precision, Real, RungeKutta, Scheme, SeriesBody, Start, Stepped, Trapezoid,
};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Number of elastic terms a law steps; bodies of fewer are [padded](SeriesBody::padded).
const N: usize = POWER_MAX;

/// What becomes of a force below zero, which the model has where the probe leaves faster than the
/// tissue follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum PullPolicy {
    /// Zero: tissue does not stick to the probe.
    Never,
    /// As the model has it, for comparisons.
    AsModel,
}

/// How a law is stepped and what bounds it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LawSettings {
    /// The body; a relaxation time of zero is one without memory.
    pub body: SeriesBody<POWER_MAX>,
    /// How it is stepped.
    pub scheme: Scheme,
    /// In which numbers.
    pub precision: Precision,
    /// From tick to tick.
    pub period: Period,
    /// Deepest depth; deeper ones count as this.
    pub depth_max: Depth,
    /// Fastest the depth may move; the law follows faster ones at this speed.
    pub speed_max: MmPerS,
    /// Largest force.
    pub force_max: Newtons,
    /// What becomes of a force below zero.
    pub pull: PullPolicy,
}

impl LawSettings {
    /// The exact step in double precision with the bounds of the 30 mm master: 10 N, below what its
    /// motor may give for long, and 1 m/s, twice what a hand reaches in so short a stroke.
    #[must_use]
    pub fn of<const M: usize>(body: impl Into<SeriesBody<M>>, period: Period) -> Self {
        Self {
            body: body.into().padded(),
            scheme: Scheme::Exact,
            precision: Precision::F64,
            period,
            depth_max: Depth(30.0),
            speed_max: MmPerS(1000.0),
            force_max: Newtons(10.0),
            pull: PullPolicy::Never,
        }
    }
}

/// A law cannot be made so.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LawError {
    /// The body or its step.
    #[error(transparent)]
    Integrator(#[from] IntegratorError),
    /// A bound that bounds nothing.
    #[error(
        "a force law with {name} = {value} {unit} is not possible; {name} is a finite number above zero"
    )]
    Bound {
        /// Which.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// The first depth.
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
    /// What was special.
    pub flags: Flags,
}

/// A body at a constant tick, with its state; nothing in a tick allocates, and any input gives a finite
/// force.
///
/// The force is never below zero unless [`PullPolicy::AsModel`], and zero with the probe above the surface,
/// where the model's memory goes on fading.
#[derive(Clone, Copy, Debug)]
pub struct ForceLaw {
    settings: LawSettings,
    stepper: Stepper,
    depth: f64,
    move_max: f64,
    ticks: u64,
}

#[derive(Clone, Copy, Debug)]
enum Stepper {
    F64(Schemes<f64>),
    F32(Schemes<f32>),
    /// No relaxation time: the force is the forcing.
    Instant {
        speed_per_move: f64,
    },
}

#[derive(Clone, Copy, Debug)]
enum Schemes<R> {
    ExplicitEuler(Stepped<R, N, ExplicitEuler>),
    ImplicitEuler(Stepped<R, N, ImplicitEuler>),
    Trapezoid(Stepped<R, N, Trapezoid>),
    ExponentialLeft(Stepped<R, N, ExponentialLeft>),
    ExponentialFirstOrder(Stepped<R, N, ExponentialFirstOrder>),
    Exact(Exact<R, N>),
    RungeKutta(Stepped<R, N, RungeKutta>),
}

impl<R: Real> Schemes<R> {
    fn new(scheme: Scheme, body: &SeriesBody<N>, dt: f64, depth: f64) -> Self {
        let start = Start { depth: R::of(depth), force: None };
        match scheme {
            Scheme::ExplicitEuler => Self::ExplicitEuler(Stepped::at_any_step(body, dt, start)),
            Scheme::ImplicitEuler => Self::ImplicitEuler(Stepped::at_any_step(body, dt, start)),
            Scheme::Trapezoid => Self::Trapezoid(Stepped::at_any_step(body, dt, start)),
            Scheme::ExponentialLeft => Self::ExponentialLeft(Stepped::at_any_step(body, dt, start)),
            Scheme::ExponentialFirstOrder => {
                Self::ExponentialFirstOrder(Stepped::at_any_step(body, dt, start))
            }
            Scheme::Exact => Self::Exact(Exact::at_any_step(body, dt, start)),
            Scheme::RungeKutta => Self::RungeKutta(Stepped::at_any_step(body, dt, start)),
        }
    }

    fn step(&mut self, depth: f64) -> Result<f64, StepError> {
        let depth = R::of(depth);
        let force = match self {
            Self::ExplicitEuler(one) => one.step(depth),
            Self::ImplicitEuler(one) => one.step(depth),
            Self::Trapezoid(one) => one.step(depth),
            Self::ExponentialLeft(one) => one.step(depth),
            Self::ExponentialFirstOrder(one) => one.step(depth),
            Self::Exact(one) => one.step(depth),
            Self::RungeKutta(one) => one.step(depth),
        };
        force.map(R::to_f64)
    }
}

impl ForceLaw {
    /// A body relaxed at `depth`.
    pub fn new(settings: LawSettings, depth: Depth) -> Result<Self, LawError> {
        let bounds = [
            ("the deepest depth", settings.depth_max.0, "mm"),
            ("the fastest speed", settings.speed_max.0, "mm/s"),
            ("the largest force", settings.force_max.0, "N"),
        ];
        for (name, value, unit) in bounds {
            if !(value > 0.0 && value.is_finite()) {
                return Err(LawError::Bound { name, value, unit });
            }
        }
        if !depth.is_finite() {
            return Err(LawError::Start(depth.0));
        }
        let depth = depth.0.clamp(-settings.depth_max.0, settings.depth_max.0);
        Ok(Self {
            stepper: stepper(&settings, depth)?,
            depth,
            move_max: settings.speed_max.0 * settings.period.seconds().0,
            ticks: 0,
            settings,
        })
    }

    /// How it was made.
    pub fn settings(&self) -> &LawSettings {
        &self.settings
    }

    /// Ticks since the start.
    pub fn ticks(&self) -> u64 {
        self.ticks
    }

    /// Time since the start.
    pub fn time(&self) -> Nanos {
        self.settings.period.time_of(self.ticks)
    }

    /// Moves straight to `depth` within the tick and answers with the force at its end.
    #[must_use]
    pub fn tick(&mut self, depth: Depth) -> LawTick {
        self.ticks += 1;
        let (to, mut flags) = self.bounded(depth.0);
        let model = match &mut self.stepper {
            Stepper::F64(schemes) => schemes.step(to),
            Stepper::F32(schemes) => schemes.step(to),
            Stepper::Instant { speed_per_move } => {
                Ok(instant(&self.settings.body, *speed_per_move, self.depth, to))
            }
        };
        let model = match model {
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
        } else if force < 0.0 && self.settings.pull == PullPolicy::Never {
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

fn stepper(settings: &LawSettings, depth: f64) -> Result<Stepper, LawError> {
    let LawSettings { body, scheme, .. } = settings;
    let dt = settings.period.seconds().0;
    // So short a memory is over before any number of ticks can tell.
    if body.tau_eps >= 0.0 && (dt / body.tau_eps).is_infinite() {
        let checked = SeriesBody { tau_eps: 1.0, ..*body };
        checked.checked().map_err(IntegratorError::from)?;
        let speed_per_move = 1.0 / dt;
        return Ok(Stepper::Instant { speed_per_move });
    }
    scheme.check(body, dt)?;
    Ok(match settings.precision {
        Precision::F64 => Stepper::F64(Schemes::new(*scheme, body, dt, depth)),
        Precision::F32 => Stepper::F32(Schemes::new(*scheme, body, dt, depth)),
    })
}

/// The forcing itself at the end of a move.
fn instant(body: &SeriesBody<N>, speed_per_move: f64, from: f64, to: f64) -> f64 {
    let (from, to) = (from.max(0.0), to.max(0.0));
    let inner = body.mu.iter().rev().fold(0.0, |sum, mu| sum * to + mu);
    to * (inner + body.tau_sig * (to - from) * speed_per_move)
}
