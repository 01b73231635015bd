//! What the program's log says of a run, at transitions alone: never of a sample, a force or a note.

use palpate_model::rig::Fault;
use palpate_protocols::engine::{EndingKind, Input, Outcome, Record};
use palpate_protocols::plans::Plan;
use std::mem::{Discriminant, discriminant};
use std::path::Path;
use tracing::{Span, error, info, info_span, warn};

/// Faults, each kind said once until another one comes: a broken cell can report one with every sample.
#[derive(Debug, Default)]
pub(super) struct FaultLog(Option<Discriminant<Fault>>);

impl FaultLog {
    pub fn fault(&mut self, fault: &Fault) {
        let kind = Some(discriminant(fault));
        if std::mem::replace(&mut self.0, kind) != kind {
            warn!("{fault}");
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

    pub fn input(&mut self, input: &Input) {
        match input {
            Input::Fault(fault) => self.step.in_scope(|| self.faults.fault(fault)),
            Input::Operator { choice } => info!(parent: &self.step, "operator: {choice}"),
            _ => {}
        }
    }

    pub fn record(&mut self, record: &Record) {
        match record {
            Record::PhaseStarted { step_index, .. } => {
                self.begin_step(*step_index);
                info!(parent: &self.step, "phase: {record}");
            }
            Record::EndingStarted { ending: EndingKind::Finish | EndingKind::Stop, .. }
            | Record::FinishedEarly
            | Record::PausePending { .. }
            | Record::Paused { .. }
            | Record::Resumed => info!(parent: &self.step, "{record}"),
            Record::EndingStarted { .. }
            | Record::InterlockTripped { .. }
            | Record::LeadLost { .. }
            | Record::MonitorTripped { .. }
            | Record::Refused { .. }
            | Record::StepFailed { .. } => warn!(parent: &self.step, "{record}"),
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

    /// The log of the session or the computer has something to tell.
    pub fn trouble(&self, text: &str) {
        warn!(parent: &self.step, "{text}");
    }

    pub fn closed(&self, outcome: &Outcome, log_error: Option<&str>) {
        info!(parent: &self.run, "session closed, {}: {}", outcome.ending, outcome.reason);
        if let Some(err) = log_error {
            error!(parent: &self.run, "{err}");
        }
    }
}
