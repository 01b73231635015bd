//! Between two steps: the axis comes to rest, goes back if the step is tried again, and what follows begins.

use super::context::Context;
use super::record::{EndingKind, Record, Recovery};
use super::state::{Activity, Power, Then};
use super::{step, stop};
use crate::plans::OnFailure;
use palpate_model::Nanos;
use palpate_model::units::{MmPerS, Seconds};

/// Longest time a deceleration takes, acknowledgement included.
const REST_MAX: Seconds = Seconds(2.0);

/// Speed of the way back to where a step began.
const RETURN_SPEED: MmPerS = MmPerS(3.0);

/// Stops what moves; `then` follows at rest.
pub(super) fn come_to_rest(cx: &mut Context<'_>, then: Then) {
    if !cx.state.is_at_rest() {
        cx.stop_move();
    }
    cx.state.in_flight = None;
    cx.state.activity =
        Activity::Between { then, deadline: cx.now + Nanos::from_seconds(REST_MAX) };
}

/// A sample came on the way to rest.
pub(super) fn on_reading(cx: &mut Context<'_>, then: Then, deadline: Nanos) {
    if cx.state.in_flight.is_some() {
        // On the way back to where the step began.
        match (cx.at_rest(), then) {
            (Ok(false), _) => return,
            (Ok(true), Then::Begin(index)) => return step::begin(cx, index),
            (Ok(true), _) => {}
            (Err(reason), _) => return stop::begin(cx, EndingKind::Abort, reason),
        }
    }
    if !cx.state.is_at_rest() || !cx.state.unacknowledged.is_empty() {
        if cx.now > deadline {
            let reason = "the axis did not come to rest; check the controller".into();
            stop::begin(cx, EndingKind::Abort, reason);
        }
        return;
    }
    match then {
        Then::Begin(index) => step::begin(cx, index),
        Then::Pause(next) => cx.state.activity = Activity::Paused { next },
        // Where the axis is already, or with the motor off, there is no way back to go.
        Then::Return(index)
            if cx.state.pulses == cx.state.step_from || cx.state.power != Power::Enabled =>
        {
            step::begin(cx, index);
        }
        Then::Return(index) => match cx.move_to_pulses(cx.state.step_from, RETURN_SPEED) {
            Ok(()) if cx.state.in_flight.is_some() => {
                cx.state.activity = Activity::Between { then: Then::Begin(index), deadline };
            }
            Ok(()) => step::begin(cx, index),
            Err(reason) => stop::begin(cx, EndingKind::Abort, reason),
        },
    }
}

/// A step cannot be done: what the plan says follows.
pub(super) fn fail(cx: &mut Context<'_>, reason: String) {
    let step_index = cx.state.step_index;
    let planned = cx.state.config.plan.steps.get(step_index);
    let policy = planned.map_or(OnFailure::Abort, |planned| planned.on_failure);
    let (then, next) = match policy {
        OnFailure::Retry(most) if cx.state.retries < most => {
            cx.state.retries += 1;
            (Recovery::Retry(cx.state.retries), Then::Return(step_index))
        }
        OnFailure::Skip => (Recovery::Skip, Then::Begin(step_index + 1)),
        _ => return stop::begin(cx, EndingKind::Abort, reason),
    };
    cx.record(Record::StepFailed { reason, then });
    come_to_rest(cx, next);
}
