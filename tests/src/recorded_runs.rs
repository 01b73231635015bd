//! A ramp and hold through the runner, as a session read back from disk.

use palpate_drivers::Rig;
use palpate_model::calibration::Calibration;
use palpate_model::metadata::SessionLabels;
use palpate_model::rig::Limits;
use palpate_protocols::plans::{Plan, RampHold};
use palpate_runner::{
    AfterStop, PromptResponder, RunRequest, SharedLeadSource, StartError, StartedRun, TimeScale,
};
use palpate_sessions::Session;
use palpate_test_support::wait::PATIENCE;
use std::path::Path;

/// Runs as fast as the computer can until the run has ended, however it ended; what the preview asks to acknowledge is
/// acknowledged.
///
/// # Panics
/// If the run is not started or says nothing for minutes.
#[must_use]
pub fn record_ramp_hold(rig: Box<dyn Rig>, calibration: Calibration, params: RampHold) -> Session {
    let asked = RecordingRequest { is_acknowledged: true, ..RecordingRequest::of(params.plan()) };
    record(rig, calibration, asked).expect("a start")
}

/// Runs any plan.
///
/// # Panics
/// If the run is not started or says nothing for minutes.
#[must_use]
pub fn record_plan(rig: Box<dyn Rig>, calibration: Calibration, plan: Plan) -> Session {
    try_record_plan(rig, calibration, plan).expect("a start")
}

/// Runs a plan that may be refused.
///
/// # Errors
/// Why it is refused.
///
/// # Panics
/// If the run says nothing for minutes.
pub fn try_record_plan(
    rig: Box<dyn Rig>,
    calibration: Calibration,
    plan: Plan,
) -> Result<Session, StartError> {
    record(rig, calibration, RecordingRequest::of(plan))
}

/// Records a run on a specimen into a folder.
///
/// # Panics
/// If the run is not started or says nothing for minutes.
pub fn record_specimen(
    rig: Box<dyn Rig>,
    calibration: Calibration,
    params: RampHold,
    specimen: &str,
    out: &Path,
) {
    let labels = SessionLabels { specimen: specimen.to_owned(), ..SessionLabels::default() };
    record_labelled(rig, calibration, params, labels, out);
}

/// Records a run with all that is known of it into a folder.
///
/// # Panics
/// If the run is not started or says nothing for minutes.
pub fn record_labelled(
    rig: Box<dyn Rig>,
    calibration: Calibration,
    params: RampHold,
    labels: SessionLabels,
    out: &Path,
) {
    let request =
        RecordingRequest { is_acknowledged: true, labels, ..RecordingRequest::of(params.plan()) };
    wait_for_end(ask(rig, calibration, request, out).expect("a start"));
}

/// What is asked of the runner.
struct RecordingRequest {
    plan: Plan,
    scale: TimeScale,
    leader: Option<SharedLeadSource>,
    is_acknowledged: bool,
    labels: SessionLabels,
}

impl RecordingRequest {
    fn of(plan: Plan) -> Self {
        let labels = SessionLabels::default();
        Self { plan, scale: TimeScale::Max, leader: None, is_acknowledged: false, labels }
    }
}

fn record(
    rig: Box<dyn Rig>,
    calibration: Calibration,
    request: RecordingRequest,
) -> Result<Session, StartError> {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("session");
    wait_for_end(ask(rig, calibration, request, &out)?);
    Ok(Session::open(&out).expect("the session"))
}

/// Waits until a run that has started is over and its session closed.
///
/// # Panics
/// If the run says nothing for minutes.
pub fn wait_for_end(StartedRun { runner, woken, .. }: StartedRun) {
    let has_ended = || {
        let snapshot = runner.snapshot();
        let run = snapshot.run.as_ref();
        run.is_some_and(|run| run.outcome.is_some())
    };
    while !has_ended() {
        woken.recv_timeout(PATIENCE).expect("the run does not end");
    }
}

/// A run that has started, and what says that there is something new of it.
///
/// # Panics
/// If the run is not started.
#[must_use]
pub fn start(
    rig: Box<dyn Rig>,
    calibration: Calibration,
    plan: Plan,
    scale: TimeScale,
    out: &Path,
) -> StartedRun {
    ask(rig, calibration, RecordingRequest { scale, ..RecordingRequest::of(plan) }, out)
        .expect("a start")
}

/// A plan with a step that follows, at full pace or in real time, as a session read back from disk.
///
/// # Panics
/// If the run is not started or says nothing for minutes.
#[must_use]
pub fn record_led_plan(
    rig: Box<dyn Rig>,
    calibration: Calibration,
    plan: Plan,
    scale: TimeScale,
    leader: SharedLeadSource,
) -> Session {
    let asked = RecordingRequest { scale, leader: Some(leader), ..RecordingRequest::of(plan) };
    record(rig, calibration, asked).expect("a start")
}

fn ask(
    rig: Box<dyn Rig>,
    calibration: Calibration,
    request: RecordingRequest,
    out: &Path,
) -> Result<StartedRun, StartError> {
    let RecordingRequest { plan, scale, leader, is_acknowledged, labels } = request;
    let request = RunRequest {
        plan,
        calibration,
        limits: Limits::for_travel(rig.description().travel),
        out: Some(out.to_owned()),
        labels,
        is_acknowledged,
        to_acknowledge: Vec::new(),
        after_stop: AfterStop::Close,
        answers: PromptResponder::Confirm,
        leader,
    };
    let started = StartedRun::start(rig, scale, request)?;
    started.wait_for_start()?;
    Ok(started)
}
