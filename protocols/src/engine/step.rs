//! The one entry point: interlocks first, then the plan.

use super::context::Context;
use super::input::{Effect, EngineInput, Operator};
use super::interlock::{self, Interlock, Trip};
use super::record::{EndingKind, PromptAnswer, Record, RunOutcome};
use super::state::{Activity, DerivedValues, EngineState, Pause, PauseView, Power};
use super::{between, monitor, pause, stop};
use crate::steps::{ActiveStep, Progress, Step, StepEvent};
use palpate_model::Nanos;
use palpate_model::rig::{Ack, AxisStatus, Fault, PathTracker, Phase, Reading, RigCommand};
use palpate_model::units::{Position, Seconds};

/// Reason of a run that completed its plan.
pub const PLAN_COMPLETE: &str = "the plan is complete";

/// Longest time a controller may take to acknowledge a command.
const ACK_MAX: Seconds = Seconds(1.0);

/// Advances a run by one input. Pure: the same arguments give the same answer, for ever.
#[must_use]
pub fn step(mut state: EngineState, now: Nanos, input: EngineInput) -> (EngineState, Vec<Effect>) {
    let mut effects = Vec::new();
    let mut cx = Context { state: &mut state, now, effects: &mut effects };
    match input {
        EngineInput::Reading(reading) => on_reading(&mut cx, &reading),
        EngineInput::Tick => on_tick(&mut cx),
        EngineInput::Ack(ack) => on_ack(&mut cx, ack),
        EngineInput::Fault(fault) => on_fault(&mut cx, &fault),
        EngineInput::Operator { choice } => on_operator(&mut cx, choice),
        EngineInput::HostLate { late } => cx.state.watch.excuse(late),
        EngineInput::Note { text } => cx.record(Record::Noted { text }),
        EngineInput::LiveFit(estimate) => {
            cx.state.live = Some(estimate);
            pass_event(&mut cx, &StepEvent::LiveFit);
        }
        EngineInput::Sensor { value } => cx.state.sensors.update(&value),
        EngineInput::Lead { depth } => {
            pass_event(&mut cx, &StepEvent::Lead(depth));
        }
    }
    (state, effects)
}

fn on_reading(cx: &mut Context<'_>, reading: &Reading) {
    if cx.state.watch.is_clock_restarted(reading.tick) {
        return on_fault(cx, &Fault::ControllerReset);
    }
    let path_error = derive(cx.state, reading);
    if cx.state.holding().is_some() && reading.status.has(AxisStatus::MOVING) {
        return stop::on_unasked_motion(cx);
    }
    let trip = interlock::judge(cx.state, cx.now, reading, path_error);
    if let Some(trip) = trip.or_else(|| acknowledgement_trip(cx)) {
        return on_trip(cx, trip);
    }
    if cx.state.activity == Activity::Starting {
        return begin(cx, 0);
    }
    monitor::judge(cx, reading);
    match cx.state.activity {
        Activity::Between { then, deadline } => between::on_reading(cx, then, deadline),
        _ => match cx.state.activity.take_step() {
            Some(active) => run_step(cx, active, reading),
            None => stop::on_time(cx),
        },
    }
}

/// Computes what a sample means; the error is the path tracker's.
fn derive(state: &mut EngineState, reading: &Reading) -> Option<String> {
    state.tick = reading.tick;
    state.pulses = reading.pulses;
    state.status = reading.status;
    let (position, path_error) = match state.path.on_reading(reading) {
        Ok(position) => (position, None),
        Err(err) => {
            (Position(reading.pulses as f64 * state.config.rig.mm_per_pulse), Some(err.to_string()))
        }
    };
    let tare = state.tare.filter(|_| reading.volts.is_finite());
    let force = tare.map(|_| state.force_from_volts(reading.volts));
    state.derived = DerivedValues {
        position,
        velocity: state.path.velocity(),
        force,
        force_sigma: force
            .zip(tare)
            .map(|(force, tare)| state.config.curve.force_sigma(force, tare.noise)),
        depth: state.contact.map(|contact| position.depth_from(contact.position)),
    };
    path_error
}

fn run_step(cx: &mut Context<'_>, mut active: ActiveStep, reading: &Reading) {
    match active.in_progress().on_reading(cx, reading) {
        Ok(progress) => keep_or_end(cx, active, progress),
        Err(reason) => {
            let label = cx.state.current_step().map_or("", |step| step.kind().facts().label);
            let reason = match label {
                "" => reason,
                label => format!("{label}: {reason}"),
            };
            between::fail(cx, reason);
        }
    }
}

/// Passes an event to the step in progress; whether the step handled it.
fn pass_event(cx: &mut Context<'_>, event: &StepEvent) -> bool {
    let Some(mut active) = cx.state.activity.take_step() else {
        return false;
    };
    let progress = active.in_progress().on_event(cx, event);
    let is_noticed = progress.is_some();
    keep_or_end(cx, active, progress.unwrap_or(Progress::Continue));
    is_noticed
}

fn keep_or_end(cx: &mut Context<'_>, active: ActiveStep, progress: Progress) {
    match progress {
        Progress::Continue => cx.state.activity = Activity::Step(active),
        // A wait that is paused stays what it is until the operator goes on.
        Progress::Done if cx.is_extended() => cx.state.activity = Activity::Step(active),
        Progress::Done => next(cx),
        Progress::Stop(reason) => stop::begin(cx, EndingKind::Stop, reason),
    }
}

/// The step in progress is done: a pause that was asked for begins, or the next step.
pub(super) fn next(cx: &mut Context<'_>) {
    let step_index = cx.state.step_index;
    if cx.state.pause == Some(Pause::After(step_index)) {
        pause::at_checkpoint(cx, step_index);
    } else {
        begin(cx, step_index + 1);
    }
}

/// Begins a step of the plan, skipping what is already done, or finishes the run.
pub(super) fn begin(cx: &mut Context<'_>, step_index: usize) {
    let config = std::sync::Arc::clone(&cx.state.config);
    let Some(step) = config.plan.steps.get(step_index).map(|planned| &planned.step) else {
        cx.state.power = Power::Stopped;
        let is_early = cx.state.is_finished_early;
        let reason = if is_early { "finished early by the operator" } else { PLAN_COMPLETE };
        return stop::end(cx, RunOutcome { ending: EndingKind::Finish, reason: reason.into() });
    };
    if step_index != cx.state.step_index || cx.state.phase == Phase::Idle {
        cx.state.retries = 0;
    }
    cx.state.step_index = step_index;
    cx.state.step_started = cx.now;
    cx.state.step_from = cx.state.pulses;
    if step.is_done_already(cx) {
        return next(cx);
    }
    cx.enter_phase(step.phase());
    match begin_active(cx, step) {
        Ok(active) => cx.state.activity = Activity::Step(active),
        Err(reason) => between::fail(cx, format!("{}: {reason}", step.phase())),
    }
}

/// Error of a step that needs the position.
pub(crate) const NOT_HOMED: &str = "the axis is not homed; home it first";

fn begin_active(cx: &mut Context<'_>, step: &Step) -> Result<ActiveStep, String> {
    if step.needs_homed_axis() && !cx.state.is_homed {
        return Err(NOT_HOMED.into());
    }
    step.begin(cx)
}

fn on_tick(cx: &mut Context<'_>) {
    let trip = interlock::age_trip(cx.state, cx.now).or_else(|| acknowledgement_trip(cx));
    match trip {
        Some(trip) => on_trip(cx, trip),
        None => stop::on_time(cx),
    }
}

fn on_ack(cx: &mut Context<'_>, ack: Ack) {
    let expected = cx.state.unacknowledged.pop_front().map(|(_, command)| command);
    if !expected.is_some_and(|sent| sent.is_answered_by(&ack.command)) {
        let reason = match expected {
            Some(command) => format!(
                "the rig acknowledged {:?} instead of the commanded {command:?}",
                ack.command
            ),
            None => format!("the rig acknowledged {:?}, which was not commanded", ack.command),
        };
        return stop::begin(cx, EndingKind::Abort, reason);
    }
    match ack.command {
        RigCommand::DefinePosition { pulses } => {
            cx.state.path.on_define(pulses);
            cx.state.pulses = pulses;
        }
        RigCommand::EnableMotor => stop::on_motor_enabled(cx),
        // A motion that waits behind the stop is not the one that was stopped.
        RigCommand::Stop if !cx.state.unacknowledged.iter().any(|(_, next)| next.is_motion()) => {
            cx.state.path.on_stop_accepted();
        }
        _ => {}
    }
}

fn on_fault(cx: &mut Context<'_>, fault: &Fault) {
    let reason = fault.to_string();
    match fault {
        Fault::LinkLost { .. } | Fault::ControllerReset => {
            cx.state.is_homed = false;
            // Without a link the path is unknown.
            cx.state.path = PathTracker::new(&cx.state.config.rig);
            on_trip(cx, Trip { interlock: Interlock::Link, reason });
        }
        Fault::SignalInvalid { .. } => on_trip(cx, Trip { interlock: Interlock::Signal, reason }),
        Fault::CommandRefused { .. } => {
            // A stop that the plan itself sent came first: the axis rests, as it should.
            let mut waiting = cx.state.unacknowledged.iter().map(|(_, command)| command);
            let is_motion = waiting.next().is_some_and(RigCommand::is_motion);
            if is_motion && waiting.any(|command| *command == RigCommand::Stop) {
                cx.state.unacknowledged.pop_front();
                cx.state.path.on_not_begun();
                return;
            }
            cx.state.unacknowledged.clear();
            // A refused stop is not repeated for ever: braking has its time limit, then the halt.
            if stop::is_braking(cx.state) {
                return;
            }
            stop::begin(cx, EndingKind::Abort, reason);
        }
        Fault::LogFailed { .. } | Fault::LogAtRisk { .. } | Fault::HostPaused { .. } => {
            stop::begin(cx, EndingKind::Abort, reason);
        }
    }
}

/// A pause of an unattended run ends it.
fn leave(cx: &mut Context<'_>) {
    let PauseView::Paused { no_resume } = cx.state.pause() else {
        return;
    };
    let reason = no_resume.unwrap_or("the condition that paused the run persists");
    let reason = format!("the run is paused and no operator can decide how it continues: {reason}");
    stop::begin(cx, EndingKind::Stop, reason);
}

fn on_trip(cx: &mut Context<'_>, trip: Trip) {
    // Nothing moves by itself on a reading that was just distrusted.
    cx.state.leaves_after_stop = false;
    // At rest after a stop there is nothing left to stop; the samples keep showing why.
    if cx.state.is_motion_possible() && !stop::is_braking(cx.state) {
        let Trip { interlock, reason } = trip;
        cx.record(Record::InterlockTripped { interlock, reason: reason.clone() });
        stop::begin(cx, EndingKind::Interlock, format!("{interlock} interlock: {reason}"));
    } else {
        stop::on_time(cx);
    }
}

fn acknowledgement_trip(cx: &Context<'_>) -> Option<Trip> {
    let (sent, command) = cx.state.unacknowledged.front()?;
    let waited = cx.now.since(*sent).seconds();
    (waited > ACK_MAX && cx.state.is_motion_possible()).then(|| Trip {
        interlock: Interlock::Link,
        reason: format!("the rig did not acknowledge {command:?} within {ACK_MAX}"),
    })
}

fn on_operator(cx: &mut Context<'_>, choice: Operator) {
    match choice {
        Operator::Start if cx.state.activity == Activity::Waiting => {
            cx.state.watch.start(cx.now);
            cx.state.activity = Activity::Starting;
        }
        Operator::Start => {}
        Operator::Stop => stop::begin(cx, EndingKind::Stop, "the operator stopped the run"),
        Operator::Abort => stop::begin(cx, EndingKind::Abort, "the operator aborted the run"),
        Operator::Halt => stop::begin(cx, EndingKind::Halt, "the operator halted the motion"),
        Operator::Retract => stop::retract(cx),
        Operator::Close => stop::close(cx),
        Operator::Pause => {
            pause::now(cx, pause::PauseRequester::Operator, "requested by the operator".into())
        }
        Operator::Leave => leave(cx),
        Operator::PauseAfter { step_index } => pause::after(cx, step_index),
        Operator::Resume => pause::resume(cx),
        Operator::Finish => pause::finish(cx),
        Operator::Confirm => answer(cx, PromptAnswer::Confirmed),
        Operator::Decline => answer(cx, PromptAnswer::Declined),
        Operator::Redo => redo(cx),
    }
}

fn answer(cx: &mut Context<'_>, answer: PromptAnswer) {
    if !pass_event(cx, &StepEvent::Answer(answer)) {
        cx.refuse("no prompt waits for an answer");
    }
}

fn redo(cx: &mut Context<'_>) {
    match cx.state.redo_step() {
        Ok(step_index) => {
            cx.end_pause();
            begin(cx, step_index);
        }
        Err(reason) => cx.refuse(reason),
    }
}

impl Activity {
    /// The step in progress, taken out so that it can change beside the state.
    fn take_step(&mut self) -> Option<ActiveStep> {
        match std::mem::replace(self, Self::Waiting) {
            Self::Step(active) => Some(active),
            other => {
                *self = other;
                None
            }
        }
    }
}
