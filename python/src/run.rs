//! A run of a protocol in progress.

use crate::error::refused;
use palpate_cli::HostedRun;
use palpate_protocols::engine::{Operator, PauseView};
use palpate_runner::{RunView, RunnerSnapshot};
use pyo3::prelude::*;
use serde_json::{Value, json};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Time after which a waiting call looks whether Python was interrupted.
const PATIENCE: Duration = Duration::from_millis(50);

/// A run in progress. When it is dropped the rig stops and the session is closed.
#[pyclass(frozen, module = "palpate._native")]
pub struct NativeRun {
    run: Mutex<HostedRun>,
}

impl NativeRun {
    fn run(&self) -> MutexGuard<'_, HostedRun> {
        self.run.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// A snapshot in words and numbers, units in the names.
fn object(view: &RunView) -> Value {
    let derived = &view.derived;
    let pause = match view.pause {
        PauseView::None => None,
        PauseView::Pending { .. } => Some("pending"),
        PauseView::Paused { .. } => Some("paused"),
    };
    let prompt = view.prompt.as_ref();
    json!({
        "plan": view.plan_name,
        "session": view.folder.display().to_string(),
        "t_s": view.now.seconds().0,
        "phase": view.phase.name(),
        "fraction": view.fraction,
        "time_left_s": view.time_left.0,
        "samples": view.samples,
        "position_mm": derived.position.0,
        "depth_mm": derived.depth.map(|depth| depth.0),
        "force_n": derived.force.map(|force| force.0),
        "force_peak_n": view.force_peak.map(|force| force.0),
        "contact_mm": view.contact.map(|contact| contact.position.0),
        "cycle": view.cycle,
        "cycles": view.cycles,
        "pause": pause,
        "prompt": prompt.map(|one| json!({ "message": one.message, "time_left_s": one.time_left.0 })),
        "live": view.live,
        "ending": view.outcome.as_ref().map(|outcome| outcome.ending.name()),
    })
}

fn choice(word: &str) -> PyResult<Operator> {
    Ok(match word {
        "stop" => Operator::Stop,
        "abort" => Operator::Abort,
        "halt" => Operator::Halt,
        "pause" => Operator::Pause,
        "resume" => Operator::Resume,
        "confirm" => Operator::Confirm,
        "decline" => Operator::Decline,
        _ => return Err(refused(format!("'{word}' is no choice of an operator"))),
    })
}

#[pymethods]
impl NativeRun {
    /// Starts the run; arguments are those of `palpate run`.
    #[new]
    fn new(py: Python<'_>, arguments: Vec<String>) -> PyResult<Self> {
        let run = py.detach(|| HostedRun::start(&arguments));
        let run = run.map_err(|err| refused(err.sentence()))?;
        Ok(Self { run: Mutex::new(run) })
    }

    /// Remarks made before the start.
    fn notes(&self) -> Vec<String> {
        self.run().notes.clone()
    }

    /// The next snapshot as JSON and, once the run has ended, its report as JSON, remarks, and the sentence of a failure.
    #[expect(clippy::type_complexity, reason = "read once, in Python")]
    fn next(
        &self,
        py: Python<'_>,
    ) -> PyResult<(String, Option<(String, Vec<String>, Option<String>)>)> {
        loop {
            py.check_signals()?;
            let found = py.detach(|| self.run().next(PATIENCE));
            let found: Option<Arc<RunnerSnapshot>> =
                found.map_err(|err| refused(err.sentence()))?;
            let Some(snapshot) = found else { continue };
            let Some(view) = &snapshot.run else { continue };
            let ended = view.outcome.is_some().then(|| {
                let report = py.detach(|| self.run().report(view));
                let failure = report.failure.map(|failure| failure.sentence().to_owned());
                (report.object.to_string(), report.notes, failure)
            });
            return Ok((object(view).to_string(), ended));
        }
    }

    /// Passes on a choice of the operator.
    fn choose(&self, py: Python<'_>, word: &str) -> PyResult<()> {
        let choice = choice(word)?;
        py.detach(|| self.run().choose(choice)).map_err(|err| refused(err.sentence()))
    }
}
