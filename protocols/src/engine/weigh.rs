//! One reading of a calibration: the signal under a known mass, once it has come to rest.

use super::context::{Context, Progress};
use super::input::Record;
use super::state::{Active, Activity, Pause, State};
use super::{pause, step};
use crate::plans::{Step, Weigh};
use palpate_model::calibration::{Settle, SettleRule, Settling, SettlingNow};
use palpate_model::rig::Reading;
use palpate_model::units::Volts;

/// Data of a reading in progress.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Weighing {
    plan: Weigh,
    settling: Settling,
    newest_tick: Option<u64>,
}

impl Weighing {
    pub fn begin(cx: &mut Context<'_>, plan: Weigh) -> Self {
        let rig = &cx.state.config.rig;
        let count = Volts(rig.adc.map_or(0.0, |adc| adc.volts_per_count));
        let rule = SettleRule {
            window: plan.settle.window,
            timeout: plan.settle.timeout,
            ..SettleRule::for_noise(rig.tick(), rig.noise_expected, count)
        };
        // A weight was laid on or taken off: forces before and after do not compare.
        cx.state.watch.forget_rate();
        Self {
            plan,
            settling: Settling::new(rule),
            newest_tick: None,
        }
    }

    pub fn on_reading(&mut self, cx: &mut Context<'_>, reading: &Reading) -> Progress {
        // A controller that restarted counts from zero again.
        let ticks = self
            .newest_tick
            .map_or(1, |newest| reading.tick.saturating_sub(newest));
        self.newest_tick = Some(reading.tick);
        match self.settling.push(ticks, reading.volts) {
            Settle::Waiting => Progress::Continue,
            Settle::TimedOut(unsettled) => {
                Progress::Fail(format!("weigh {} g: {unsettled}", self.plan.mass_g))
            }
            Settle::Settled(steady) => {
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
                Progress::Done
            }
        }
    }

    /// How far the signal has come to rest.
    pub fn now(&self) -> SettlingNow {
        self.settling.now()
    }
}

/// The prompt to go back to for weighing again what was weighed last, or what is being weighed; or why there is none.
pub(super) fn redo_step(state: &State) -> Result<usize, &'static str> {
    let steps = &state.config.plan.steps;
    let at = state.step_index;
    let is_weigh = |index: usize| matches!(steps[index].step, Step::Weigh(_));
    let is_prompt = |index: usize| matches!(steps[index].step, Step::Prompt(_));
    match &state.activity {
        Activity::Step(Active::Weigh(_)) if at >= 1 && is_prompt(at - 1) => Ok(at - 1),
        Activity::Step(Active::Prompt { .. })
            if at >= 2 && is_weigh(at - 1) && is_prompt(at - 2) =>
        {
            Ok(at - 2)
        }
        _ => Err("no weight was read just before"),
    }
}

/// The operator wants to read a weight again.
pub(super) fn redo(cx: &mut Context<'_>) {
    match redo_step(cx.state) {
        Ok(step_index) => {
            if cx.state.pause == Some(Pause::Extended) {
                pause::resume(cx);
            }
            step::begin(cx, step_index);
        }
        Err(reason) => {
            let reason = reason.to_owned();
            cx.record(Record::Refused { reason });
        }
    }
}
