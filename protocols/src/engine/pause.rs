//! Pause and go on. A pause never repeats a measurement: tissue that was indented is another specimen, so a
//! ramp that was interrupted can be finished early or given up, not resumed.

use super::context::Context;
use super::record::Record;
use super::state::{Activity, FollowUp, Pause};
use super::{between, step};
use crate::steps::{PauseBehaviour, Step};
use palpate_model::rig::Phase;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PauseRequester {
    Operator,
    Monitor,
}

pub(super) fn now(cx: &mut Context<'_>, by: PauseRequester, reason: String) {
    let is_paused =
        matches!(cx.state.activity, Activity::Paused { .. }) || cx.state.pause.is_some();
    // A pause of the operator is ended by the operator only.
    cx.state.is_paused_by_operator =
        by == PauseRequester::Operator || is_paused && cx.state.is_paused_by_operator;
    let step_index = cx.state.step_index;
    let pausing = match &cx.state.activity {
        Activity::Step(_) => pausing(cx),
        Activity::Between { then: FollowUp::Begin(index) | FollowUp::Return(index), .. } => {
            let next = Ok(*index);
            return halt_motion(cx, next, reason);
        }
        _ => return cx.refuse("no step is in progress that can be paused"),
    };
    match pausing {
        Some(PauseBehaviour::Wait | PauseBehaviour::Control) => {
            cx.state.pause = Some(Pause::Extended);
            cx.record(Record::Paused { reason, no_resume: None });
        }
        Some(PauseBehaviour::Complete) | None => await_end_of(cx, step_index),
        Some(PauseBehaviour::Repeat | PauseBehaviour::RepeatFromStart) => {
            halt_motion(cx, Ok(step_index), reason);
        }
        Some(PauseBehaviour::Measure(cause)) => halt_motion(cx, Err(cause), reason),
    }
}

fn pausing(cx: &Context<'_>) -> Option<PauseBehaviour> {
    let step = cx.state.current_step();
    step.map(|step| step.kind().facts().pausing)
}

pub(super) fn after(cx: &mut Context<'_>, step_index: usize) {
    let is_ahead = (cx.state.step_index..cx.state.config.plan.steps.len()).contains(&step_index);
    let is_running = matches!(
        cx.state.activity,
        Activity::Starting | Activity::Step(_) | Activity::Between { .. }
    );
    if !is_ahead || !is_running || cx.state.pause == Some(Pause::Extended) {
        return cx
            .refuse("the chosen checkpoint is already past, or the run is paused or has ended");
    }
    cx.state.is_paused_by_operator = true;
    await_end_of(cx, step_index);
}

fn await_end_of(cx: &mut Context<'_>, step_index: usize) {
    cx.state.pause = Some(Pause::After(step_index));
    cx.record(Record::PausePending { step_index });
}

fn halt_motion(cx: &mut Context<'_>, next: Result<usize, &'static str>, reason: String) {
    cx.record(Record::Paused { reason, no_resume: next.err().map(str::to_owned) });
    cx.state.pause = None;
    cx.enter_phase(Phase::Paused);
    between::come_to_rest(cx, FollowUp::Pause(next));
}

/// The step behind which a pause was asked for is done: the axis rests.
pub(super) fn at_checkpoint(cx: &mut Context<'_>, done_index: usize) {
    let planned = cx.state.config.plan.steps.get(done_index);
    let name = planned.and_then(|planned| planned.checkpoint.clone());
    let reason = name.unwrap_or_else(|| format!("after step {}", done_index + 1));
    cx.state.pause = None;
    cx.record(Record::Paused { reason, no_resume: None });
    cx.enter_phase(Phase::Paused);
    cx.state.activity = Activity::Paused { next: Ok(done_index + 1) };
}

pub(super) fn resume(cx: &mut Context<'_>) {
    match (&cx.state.activity, cx.state.pause) {
        (Activity::Paused { next: Ok(next), .. }, _) => {
            let next = *next;
            cx.record(Record::Resumed);
            if next == cx.state.step_index && pausing(cx) == Some(PauseBehaviour::RepeatFromStart) {
                between::come_to_rest(cx, FollowUp::Return(next));
            } else {
                step::begin(cx, next);
            }
        }
        (Activity::Paused { next: Err(cause), .. }, _) => {
            let reason = format!("{cause}; finish the run early or stop it");
            cx.refuse(reason);
        }
        (_, Some(_)) => {
            cx.state.pause = None;
            cx.record(Record::Resumed);
        }
        _ => cx.refuse("the run is not paused"),
    }
}

/// The cause of the pause is over: the run goes on where that is possible, else the operator decides.
pub(super) fn resume_by_itself(cx: &mut Context<'_>) {
    let can_resume = matches!(cx.state.activity, Activity::Paused { next: Ok(_), .. })
        || cx.state.pause == Some(Pause::Extended);
    if can_resume && !cx.state.is_paused_by_operator {
        resume(cx);
    }
}

/// The operator skips the rest of the measurement.
pub(super) fn finish(cx: &mut Context<'_>) {
    let is_at_rest = match &cx.state.activity {
        Activity::Paused { .. } => true,
        Activity::Step(_) => {
            let is_moving = pausing(cx) == Some(PauseBehaviour::Control) && !cx.state.is_at_rest();
            cx.is_extended() && !is_moving
        }
        _ => false,
    };
    if !is_at_rest {
        return cx.refuse(
            "the run can finish early only while it is paused and at rest; pause it first",
        );
    }
    cx.state.pause = None;
    cx.state.is_finished_early = true;
    cx.record(Record::FinishedEarly);
    let steps = &cx.state.config.plan.steps;
    let is_retract = |index: &usize| matches!(steps[*index].step, Step::Retract(_));
    // A paused retract counts as the last one too.
    let last = (cx.state.step_index..steps.len()).rev().find(is_retract);
    // Before contact there is nothing to leave.
    let last = last.filter(|_| cx.state.contact.is_some());
    let next = last.unwrap_or(steps.len());
    step::begin(cx, next);
}
