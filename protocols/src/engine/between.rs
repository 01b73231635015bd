//! Between two steps: the axis comes to rest, returns to the start of a step that is retried, and the next step begins.

use super::context::Context;
use super::record::{EndingKind, FailureResponse, Record};
use super::state::{Activity, FollowUp, Power};
use super::{step, stop};
use crate::plans::OnFailure;
use palpate_model::Nanos;
use palpate_model::units::{MmPerS, Seconds};

/// Longest time a deceleration takes, acknowledgement included.
const REST_MAX: Seconds = Seconds(2.0);

/// Speed of the return to the start of a step.
const RETURN_SPEED: MmPerS = MmPerS(3.0);

/// Stops what moves; `then` follows at rest.
pub(super) fn come_to_rest(cx: &mut Context<'_>, then: FollowUp) {
    if !cx.state.is_at_rest() {
        cx.stop_move();
    }
    cx.state.in_flight = None;
    cx.state.activity =
        Activity::Between { then, deadline: cx.now + Nanos::from_seconds(REST_MAX) };
}

pub(super) fn on_reading(cx: &mut Context<'_>, then: FollowUp, deadline: Nanos) {
    if cx.state.in_flight.is_some() {
        // The axis returns to the start of the step.
        match (cx.at_rest(), then) {
            (Ok(false), _) => return,
            (Ok(true), FollowUp::Begin(index)) => return step::begin(cx, index),
            (Ok(true), _) => {}
            (Err(reason), _) => return stop::begin(cx, EndingKind::Abort, reason),
        }
    }
    if !cx.state.is_at_rest() || !cx.state.unacknowledged.is_empty() {
        if cx.now > deadline {
            let reason = "the axis did not come to rest; check the controller";
            stop::begin(cx, EndingKind::Abort, reason);
        }
        return;
    }
    match then {
        FollowUp::Begin(index) => step::begin(cx, index),
        FollowUp::Pause(next) => cx.state.activity = Activity::Paused { next },
        // At the start already, or with the motor off, there is nothing to return to.
        FollowUp::Return(index)
            if cx.state.pulses == cx.state.step_from || cx.state.power != Power::Enabled =>
        {
            step::begin(cx, index);
        }
        FollowUp::Return(index) => match cx.move_to_pulses(cx.state.step_from, RETURN_SPEED) {
            Ok(()) if cx.state.in_flight.is_some() => {
                cx.state.activity = Activity::Between { then: FollowUp::Begin(index), deadline };
            }
            Ok(()) => step::begin(cx, index),
            Err(reason) => stop::begin(cx, EndingKind::Abort, reason),
        },
    }
}

/// A step has failed: retry, skip or abort, as the plan says.
pub(super) fn fail(cx: &mut Context<'_>, reason: String) {
    let step_index = cx.state.step_index;
    let planned = cx.state.config.plan.steps.get(step_index);
    let policy = planned.map_or(OnFailure::Abort, |planned| planned.on_failure);
    let (then, next) = match policy {
        OnFailure::Retry(most) if cx.state.retries < most => {
            cx.state.retries += 1;
            (FailureResponse::Retry(cx.state.retries), FollowUp::Return(step_index))
        }
        OnFailure::Skip => (FailureResponse::Skip, FollowUp::Begin(step_index + 1)),
        _ => return stop::begin(cx, EndingKind::Abort, reason),
    };
    cx.record(Record::StepFailed { reason, then });
    come_to_rest(cx, next);
}
