//! Every way a run ends other than by finishing its plan, and what may follow.
//!
//! Stop, abort and interlock decelerate and hold; halt cuts. Nothing moves again unless the
//! operator asks for a retract, and never on a reading that was just distrusted.

use super::context::Context;
use super::input::Effect;
use super::interlock::Interlock;
use super::record::{EndingKind, Record, RunOutcome};
use super::state::{Activity, EngineState, Power};
use palpate_model::Nanos;
use palpate_model::rig::{Phase, RigCommand};
use palpate_model::units::{Depth, MmPerS, Position, Seconds};

/// Time after which an axis with a stop command counts as stopped even if no sample shows it: the
/// longest deceleration plus the longest acknowledgement.
const BRAKE_MAX: Seconds = Seconds(2.0);

/// Speed and distance of the operator's retract.
const RETRACT_SPEED: MmPerS = MmPerS(6.0);
const RETRACT_CLEARANCE_MM: f64 = 10.0;

/// Begins to end the run. A halt always cuts at once, whatever is under way.
pub(super) fn begin(cx: &mut Context<'_>, ending: EndingKind, reason: impl Into<String>) {
    let reason = reason.into();
    let is_halt = ending == EndingKind::Halt;
    let outcome = match &cx.state.activity {
        Activity::Ended(_) => return,
        // The first reason stands; a halt or interlock during braking only acts.
        Activity::Braking { ending, .. }
        | Activity::Holding { ending }
        | Activity::Retracting { ending } => ending.clone(),
        _ => {
            cx.record(Record::EndingStarted { ending, reason: reason.clone() });
            RunOutcome { ending, reason }
        }
    };
    cx.state.power = Power::Stopped;
    cx.state.in_flight = None;
    cx.state.pause = None;
    // Any operator stop reaches the rig, also when the engine believes the axis at rest.
    if is_halt {
        cut(cx);
    } else {
        cx.command(RigCommand::Stop);
    }
    cx.enter_phase(Phase::Stopped);
    let deadline = match cx.state.activity {
        Activity::Braking { deadline, .. } => deadline,
        _ => cx.now + Nanos::from_seconds(BRAKE_MAX),
    };
    cx.state.activity = Activity::Braking { ending: outcome, deadline };
}

/// The axis moves although the run has stopped: cut it and say so.
pub(super) fn on_unasked_motion(cx: &mut Context<'_>) {
    let Activity::Holding { ending } = cx.state.activity.clone() else {
        return;
    };
    let reason = "the axis moves although it was stopped; check the controller".to_owned();
    let interlock = Interlock::Path;
    cx.record(Record::InterlockTripped { interlock, reason });
    cut(cx);
    let deadline = cx.now + Nanos::from_seconds(BRAKE_MAX);
    cx.state.activity = Activity::Braking { ending, deadline };
}

/// Cuts the motion. A stepper cut at speed may lose steps, so its position is no longer known.
fn cut(cx: &mut Context<'_>) {
    cx.state.is_halted = true;
    cx.state.is_homed = false;
    cx.command(RigCommand::Halt);
}

pub(super) fn is_braking(state: &EngineState) -> bool {
    matches!(&state.activity, Activity::Braking { .. })
}

/// Time passed, or a sample came, outside the plan's steps.
pub(super) fn on_time(cx: &mut Context<'_>) {
    match cx.state.activity.clone() {
        Activity::Braking { ending, deadline } => {
            let is_late = cx.now > deadline;
            if cx.state.is_at_rest() && (cx.state.unacknowledged.is_empty() || is_late) {
                cx.state.activity = Activity::Holding { ending };
            } else if is_late && !cx.state.is_halted {
                // It should have stopped long ago: cut the motion, whatever that costs in steps.
                cut(cx);
                let deadline = cx.now + Nanos::from_seconds(BRAKE_MAX);
                cx.state.activity = Activity::Braking { ending, deadline };
            } else if is_late {
                cx.state.activity = Activity::Holding { ending };
            }
        }
        Activity::Retracting { ending } => match cx.at_rest() {
            Ok(true) if cx.state.power == Power::Enabled => end(cx, ending),
            Ok(_) => {}
            Err(reason) => begin(cx, EndingKind::Abort, reason),
        },
        // A retract that a monitor requested follows once the axis rests.
        Activity::Holding { .. } if cx.state.leaves_after_stop => {
            cx.state.leaves_after_stop = false;
            match cx.state.can_retract() {
                Ok(()) => retract(cx),
                Err(reason) => cx.refuse(format!("the probe stays where it is: {reason}")),
            }
        }
        _ => {}
    }
}

/// The operator wants the probe out of the tissue after a stop.
pub(super) fn retract(cx: &mut Context<'_>) {
    if cx.state.can_retract().is_err() {
        return;
    }
    let Activity::Holding { ending } = cx.state.activity.clone() else {
        return;
    };
    cx.state.power = Power::Reset;
    cx.state.watch.allow_retract();
    cx.enter_phase(Phase::Retract);
    cx.state.activity = Activity::Retracting { ending };
    cx.command(RigCommand::EnableMotor);
}

/// The motor is energised: a self-test goes on by itself, a retract may now move.
pub(super) fn on_motor_enabled(cx: &mut Context<'_>) {
    if !matches!(cx.state.activity, Activity::Retracting { .. }) || cx.state.power != Power::Reset {
        return;
    }
    cx.state.power = Power::Enabled;
    // Where no contact is known, a search may have stopped within the tissue: from where the probe stands.
    let here = cx.state.derived.position;
    let surface = cx.state.contact.map_or(here, |contact| contact.position);
    let target = Depth(-RETRACT_CLEARANCE_MM).position_from(surface);
    // A way out never leads further in.
    let out = target.0.clamp(0.0, here.0.max(0.0));
    if let Err(reason) = cx.move_to(Position(out), RETRACT_SPEED) {
        begin(cx, EndingKind::Abort, reason);
    }
}

/// The operator ends the session where the probe stands.
pub(super) fn close(cx: &mut Context<'_>) {
    if let Activity::Holding { ending } = cx.state.activity.clone() {
        end(cx, ending);
    }
}

pub(super) fn end(cx: &mut Context<'_>, outcome: RunOutcome) {
    cx.state.power = Power::Stopped;
    cx.enter_phase(Phase::Ended);
    cx.state.activity = Activity::Ended(outcome.clone());
    cx.effects.push(Effect::Finished(outcome));
}
