//! Lines of a run in the program's log, at transitions only: the kind of event and the step, never a sample, a force or a
//! note. Reasons quote measured values, so they are in the session's own log only.

use palpate_model::Nanos;
use palpate_model::rig::Fault;
use palpate_protocols::engine::{EndingKind, EngineInput, FailureResponse, Record, RunOutcome};
use palpate_protocols::plans::Plan;
use std::mem::{Discriminant, discriminant};
use std::path::Path;
use tracing::{Span, error, info, info_span, warn};

/// Between two lines of one kind of fault.
const QUIET: Nanos = Nanos::from_millis(60_000);

/// Faults, of each kind one line a minute: a broken cell can report one with every sample, and a bad link several kinds in
/// turn.
#[derive(Debug, Default)]
pub(super) struct FaultLog(Vec<FaultCount>);

/// A kind of fault, session time of its last line, and how often it came since.
#[derive(Debug)]
struct FaultCount {
    kind: Discriminant<Fault>,
    logged: Nanos,
    since: u64,
}

impl FaultLog {
    pub fn log_fault(&mut self, now: Nanos, fault: &Fault) {
        let kind = discriminant(fault);
        match self.0.iter_mut().find(|one| one.kind == kind) {
            None => {
                warn!("{fault}");
                self.0.push(FaultCount { kind, logged: now, since: 0 });
            }
            Some(one) if now.since(one.logged) < QUIET => one.since += 1,
            Some(one) => {
                match std::mem::take(&mut one.since) {
                    0 => warn!("{fault}"),
                    more => warn!("{fault}; {more} more faults of this kind since the last line"),
                }
                one.logged = now;
            }
        }
    }
}

/// The spans of a run and of its step in progress.
#[derive(Debug)]
pub(super) struct RunLog {
    run: Span,
    step: Span,
    /// Kinds of the plan's steps, in order.
    kinds: Vec<&'static str>,
    step_index: Option<usize>,
    faults: FaultLog,
}

impl RunLog {
    pub fn new(session_id: &str, folder: &Path, plan: &Plan) -> Self {
        let run = info_span!("run", session = session_id);
        info!(parent: &run, plan = plan.name, folder = %folder.display(), "session opened");
        Self {
            step: run.clone(),
            run,
            kinds: plan.steps.iter().map(|planned| planned.step.word()).collect(),
            step_index: None,
            faults: FaultLog::default(),
        }
    }

    pub fn log_input(&mut self, now: Nanos, input: &EngineInput) {
        match input {
            EngineInput::Fault(fault) => self.step.in_scope(|| self.faults.log_fault(now, fault)),
            EngineInput::Operator { choice } => info!(parent: &self.step, "operator: {choice}"),
            _ => {}
        }
    }

    pub fn log_record(&mut self, record: &Record) {
        match record {
            Record::PhaseStarted { step_index, .. } => {
                self.begin_step(*step_index);
                info!(parent: &self.step, "phase: {record}");
            }
            Record::FinishedEarly | Record::PausePending { .. } | Record::Resumed => {
                info!(parent: &self.step, "{record}");
            }
            Record::Paused { .. } => info!(parent: &self.step, "paused"),
            Record::EndingStarted {
                ending: ending @ (EndingKind::Finish | EndingKind::Stop),
                ..
            } => {
                info!(parent: &self.step, "ending: {ending}");
            }
            Record::EndingStarted { ending, .. } => warn!(parent: &self.step, "ending: {ending}"),
            Record::InterlockTripped { interlock, .. } => {
                warn!(parent: &self.step, "interlock tripped: {interlock}");
            }
            Record::LeadLost { .. } => warn!(parent: &self.step, "no position from the master"),
            Record::MonitorTripped { index, .. } => {
                warn!(parent: &self.step, "monitor {} tripped", index + 1);
            }
            Record::Refused { .. } => warn!(parent: &self.step, "request refused"),
            Record::StepFailed { then: FailureResponse::Retry(count), .. } => {
                warn!(parent: &self.step, "step failed, trying again ({count})");
            }
            Record::StepFailed { then: FailureResponse::Skip, .. } => {
                warn!(parent: &self.step, "step failed, skipped");
            }
            _ => {}
        }
    }

    fn begin_step(&mut self, index: usize) {
        if self.step_index.replace(index) == Some(index) {
            return;
        }
        let kind = self.kinds.get(index).copied().unwrap_or_default();
        self.step = info_span!(parent: &self.run, "step", number = index + 1, kind);
    }

    pub fn log_trouble(&self, text: &str) {
        warn!(parent: &self.step, "{text}");
    }

    pub fn log_end(&self, outcome: &RunOutcome, log_error: Option<&str>) {
        info!(parent: &self.run, "session closed, {}", outcome.ending);
        if let Some(err) = log_error {
            error!(parent: &self.run, "{err}");
        }
    }
}
