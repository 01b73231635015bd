//! The plan's own conditions, judged on every sample after the interlocks.

use super::context::Context;
use super::pause::PauseRequester;
use super::record::{EndingKind, Record};
use super::state::Activity;
use super::{pause, stop};
use crate::plans::{MonitorAction, MonitorSource};
use palpate_model::Nanos;
use palpate_model::rig::Reading;

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct MonitorState {
    is_tripped: bool,
    past_since: Option<Nanos>,
    /// How often it has paused the step of this index.
    pauses: (usize, u32),
}

/// A condition that pauses one step more often comes back with the step, and each time the tissue is touched again.
const PAUSES_MAX: u32 = 3;

/// Judges all of them. They act only while the plan runs or is paused.
pub(super) fn judge(cx: &mut Context<'_>, reading: &Reading) {
    for index in 0..cx.state.monitors.len() {
        if !matches!(
            cx.state.activity,
            Activity::Step(_) | Activity::Between { .. } | Activity::Paused { .. }
        ) {
            return;
        }
        let monitor = &cx.state.config.plan.monitors[index];
        let derived = &cx.state.derived;
        let value = match &monitor.source {
            MonitorSource::Force => derived.force.map(|force| force.0),
            MonitorSource::Depth => derived.depth.map(|depth| depth.0),
            MonitorSource::Volts => Some(reading.volts.0),
            MonitorSource::Position => cx.state.is_homed.then_some(derived.position.0),
            MonitorSource::Channel(name) => {
                let number = cx.state.config.rig.sensors.channel_number(name);
                number.and_then(|number| cx.state.sensors.channel(number))
            }
        };
        let Some(value) = value else { continue };
        let condition = &cx.state.monitors[index];
        if condition.is_tripped {
            judge_past(cx, index, value);
        } else if monitor.is_tripped_by(value) {
            trip(cx, index, value);
        }
    }
}

fn trip(cx: &mut Context<'_>, index: usize, value: f64) {
    let monitor = &cx.state.config.plan.monitors[index];
    let (action, message) = (monitor.action, monitor.message.clone());
    let step_index = cx.state.step_index;
    let condition = &mut cx.state.monitors[index];
    condition.is_tripped = true;
    condition.past_since = None;
    if condition.pauses.0 != step_index {
        condition.pauses = (step_index, 0);
    }
    condition.pauses.1 += u32::from(action == MonitorAction::Pause);
    let is_endless = condition.pauses.1 > PAUSES_MAX;
    cx.record(Record::MonitorTripped { index, value, message: message.clone() });
    match action {
        MonitorAction::Note => {}
        MonitorAction::Pause if is_endless => {
            let reason = format!(
                "{message}; the run ends, because this condition has already paused the step {PAUSES_MAX} times"
            );
            stop::begin(cx, EndingKind::Stop, reason);
        }
        MonitorAction::Pause => pause::now(cx, PauseRequester::Monitor, message),
        MonitorAction::Stop => stop::begin(cx, EndingKind::Stop, message),
        MonitorAction::Retract => {
            cx.state.leaves_after_stop = true;
            stop::begin(cx, EndingKind::Stop, message);
        }
        MonitorAction::Halt => stop::begin(cx, EndingKind::Halt, message),
    }
}

/// A tripped monitor is past once its value has been for the settle time.
fn judge_past(cx: &mut Context<'_>, index: usize, value: f64) {
    let monitor = &cx.state.config.plan.monitors[index];
    let (settle, action) = (monitor.settle, monitor.action);
    let is_past = monitor.is_past_at(value);
    let now = cx.now;
    let condition = &mut cx.state.monitors[index];
    if !is_past {
        condition.past_since = None;
        return;
    }
    let since = *condition.past_since.get_or_insert(now);
    if now.since(since).seconds() < settle {
        return;
    }
    condition.is_tripped = false;
    condition.past_since = None;
    cx.record(Record::MonitorPast { index, value });
    let is_another_tripped = cx
        .state
        .monitors
        .iter()
        .zip(&cx.state.config.plan.monitors)
        .any(|(one, monitor)| one.is_tripped && monitor.action == MonitorAction::Pause);
    if action == MonitorAction::Pause && !is_another_tripped {
        pause::resume_by_itself(cx);
    }
}
