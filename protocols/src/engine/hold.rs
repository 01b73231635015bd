//! A hold that may end early: decided from the recorded answer of the live fit and nothing else.

use super::context::Context;
use super::input::Record;
use super::state::{Active, Activity};
use crate::plans::{HoldUntil, Step};
use palpate_model::fit::LiveEstimate;
use palpate_model::units::Seconds;

/// Lets the hold end with the next sample if its rule is met by the newest answer.
pub(super) fn on_live_fit(cx: &mut Context<'_>) {
    let Some(Step::Hold {
        duration,
        until: Some(rule),
    }) = cx.state.current_step().copied()
    else {
        return;
    };
    let Activity::Step(Active::Hold { until_tick }) = cx.state.activity else {
        return;
    };
    let Some(reached) = cx.state.live.as_ref().and_then(|live| reached(live, &rule)) else {
        return;
    };
    let (now_tick, span) = (cx.state.tick, cx.state.ticks(duration));
    let held_ticks = (now_tick + span).saturating_sub(until_tick);
    if now_tick >= until_tick || held_ticks < cx.state.ticks(rule.at_least) {
        return;
    }
    cx.state.activity = Activity::Step(Active::Hold {
        until_tick: now_tick,
    });
    cx.record(Record::HoldEndedEarly {
        parameter: rule.parameter,
        relative: reached,
        wanted: rule.relative,
        held: Seconds(held_ticks as f64 * cx.state.config.rig.tick().0),
    });
}

/// Half of the parameter's 95 % interval as a share of its value, if that is narrow enough and the
/// parameter identified.
fn reached(live: &LiveEstimate, rule: &HoldUntil) -> Option<f64> {
    let parameter = live.identified(rule.parameter.name())?;
    let [low, high] = parameter.ci95?;
    let relative = 0.5 * (high - low) / parameter.value.abs();
    (relative <= rule.relative).then_some(relative)
}
