//! One reading of a calibration: the signal under a known mass, once it has come to rest.

use super::prelude::*;
use super::table;
use crate::engine::EngineState;
use palpate_model::calibration::{
    SettleDetector, SettleProgress, SettleRule, SettleState as Settled,
};

/// Read the load cell under a known mass: one reading of a calibration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Weigh {
    /// Mass on the cell in g, the platform included.
    pub mass_g: f64,
    pub is_loading: bool,
    /// Which pass through the masses, from 1.
    pub repeat: u32,
    pub settle: SettleLimits,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SettleLimits {
    /// Length of the window that is looked at and averaged.
    pub window: Seconds,
    pub timeout: Seconds,
}

pub(super) const FACTS: StepFacts = StepFacts {
    about: "Read the load cell under a known mass, once the signal has settled.",
    keys: &[
        Key::needed("mass", QuantityKind::Mass, "total mass on the load cell, platform included")
            .zero_allowed(),
        Key::usual(
            "masses_go",
            QuantityKind::Text,
            "up",
            "`up` after weights were put on, `down` after weights were taken off",
        )
        .one_of(&["up", "down"]),
        Key::usual(
            "pass",
            QuantityKind::Count,
            "1",
            "number of the pass through the masses, from 1",
        ),
        Key::usual(
            "window",
            QuantityKind::Time,
            "2 s",
            "time over which the signal must be steady and is averaged",
        ),
        Key::usual("timeout", QuantityKind::Time, "30 s", "longest wait"),
    ],
    build: Some(|args| {
        Ok(Weigh {
            mass_g: args.number("mass")?,
            is_loading: args.text("masses_go")? == "up",
            repeat: args.count("pass")?,
            settle: SettleLimits {
                window: args.seconds("window")?,
                timeout: args.seconds("timeout")?,
            },
        }
        .into())
    }),
    may_touch: false,
    ..StepFacts::of("weigh", Phase::Weigh, PauseBehaviour::Complete)
};

impl StepKind for Weigh {
    fn warning(&self, known: &Preconditions) -> Option<&'static str> {
        known.motor.then_some(
            "while the motor is on, a mass above the force limit of the rig stops the run; remove { do = \"self-test\" } from a protocol that only weighs",
        )
    }

    fn expect(&self, walk: &mut Walk<'_>) -> DurationEstimate {
        walk.check_span(self.settle.window);
        walk.check_span(self.settle.timeout);
        let (window, timeout) = (self.settle.window.0, self.settle.timeout.0);
        walk.unknown((2.0 * window).min(timeout), timeout)
    }
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) struct WeighRun {
    plan: Weigh,
    settling: SettleDetector,
    newest_tick: Option<u64>,
}

impl Executable for Weigh {
    type Run = Box<WeighRun>;

    fn begin(&self, cx: &mut Context<'_>) -> Result<Box<WeighRun>, String> {
        let rig = cx.rig();
        let rule = SettleRule {
            window: self.settle.window,
            timeout: self.settle.timeout,
            ..SettleRule::for_noise(rig.tick(), rig.noise_expected, Volts(cx.volts_per_count()))
        };
        // A weight was laid on or taken off: forces before and after do not compare.
        cx.forget_force_rate();
        Ok(Box::new(WeighRun {
            plan: self.clone(),
            settling: SettleDetector::new(rule),
            newest_tick: None,
        }))
    }
}

impl RunningStep for WeighRun {
    fn on_reading(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Result<Progress, String> {
        // A controller that restarted counts from zero again.
        let ticks = self.newest_tick.map_or(1, |newest| reading.tick.saturating_sub(newest));
        self.newest_tick = Some(reading.tick);
        match self.settling.push(ticks, reading.volts) {
            Settled::Waiting => Ok(Progress::Continue),
            Settled::TimedOut(unsettled) => {
                Err(format!("weigh {} g: {unsettled}", self.plan.mass_g))
            }
            Settled::Settled(steady) => {
                cx.record(Record::Weighed {
                    mass_g: self.plan.mass_g,
                    is_loading: self.plan.is_loading,
                    repeat: self.plan.repeat,
                    volts: steady.mean,
                    noise: steady.noise,
                    slope_v_per_s: steady.slope_v_per_s,
                    samples: steady.samples,
                    waited: steady.waited,
                });
                Ok(Progress::Done)
            }
        }
    }
}

impl EngineState {
    /// How far the signal under a weight has come to rest; `None` where nothing is weighed.
    pub fn settling(&self) -> Option<SettleProgress> {
        match self.active() {
            Some(table::ActiveStep::Weigh(weighing)) => Some(weighing.settling.now()),
            _ => None,
        }
    }

    /// Whether the last weight can be read again now, or why not.
    pub fn can_redo(&self) -> Result<(), &'static str> {
        self.redo_step().map(|_| ())
    }

    /// The prompt to go back to for weighing again what was weighed last, or what is being weighed; or why there is
    /// none.
    pub(crate) fn redo_step(&self) -> Result<usize, &'static str> {
        let steps = &self.config().plan.steps;
        let (at, _) = self.step_progress();
        let is_weigh = |index: usize| matches!(steps[index].step, Step::Weigh(_));
        let is_prompt = |index: usize| matches!(steps[index].step, Step::Prompt(_));
        match self.active() {
            Some(table::ActiveStep::Weigh(_)) if at >= 1 && is_prompt(at - 1) => Ok(at - 1),
            Some(table::ActiveStep::Prompt(_))
                if at >= 2 && is_weigh(at - 1) && is_prompt(at - 2) =>
            {
                Ok(at - 2)
            }
            _ => Err("no weight has just been read, so none can be read again"),
        }
    }
}
