//! A runner with its first run, for a front end that waits for the end of one.

use crate::{RunRequest, RunView, Runner, RunnerRequest, RunnerSnapshot, StartError, TimeScale};
use palpate_drivers::Rig;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};
use std::time::Duration;
use thiserror::Error;

/// How long a runner may be silent before it is looked at: a person sees a display of this rate as live.
const PATIENCE: Duration = Duration::from_millis(500);

/// The runner's thread ended before the run did.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("the thread that runs protocols ended unexpectedly; the session is incomplete")]
pub struct RunnerEnded;

/// A runner that was asked for a run.
pub struct StartedRun {
    pub runner: Runner,
    /// Gets a word after each snapshot.
    pub woken: Receiver<()>,
    answer: Receiver<Result<(), StartError>>,
}

impl StartedRun {
    /// Asks for a run before any time passes, so that a simulated rig does the same whenever it is repeated.
    pub fn start(
        rig: Box<dyn Rig>,
        scale: TimeScale,
        request: RunRequest,
    ) -> Result<Self, StartError> {
        let (wake, woken) = sync_channel(1);
        let (reply, answer) = sync_channel(1);
        let first = RunnerRequest::Run(Box::new(request), reply);
        let runner = Runner::start(rig, scale, Some(first), move || {
            // A full channel holds a wake-up already.
            let _ = wake.try_send(());
        });
        let runner = runner.map_err(|err| StartError::Failed(err.to_string()))?;
        Ok(Self { runner, woken, answer })
    }

    /// Waits until the run is in progress, or says why it is not.
    pub fn wait_for_start(&self) -> Result<(), StartError> {
        let ended =
            "the thread that runs protocols ended before the run began; start the run again";
        self.answer.recv().unwrap_or_else(|_| Err(StartError::Failed(ended.to_owned())))
    }

    /// Waits until the run is over, however it ended, and shows it whenever there is something new, twice a second at least.
    pub fn wait_for_end(
        &self,
        mut show: impl FnMut(&RunView),
    ) -> Result<Arc<RunnerSnapshot>, RunnerEnded> {
        loop {
            let newest = self.next(PATIENCE);
            let snapshot = self.runner.snapshot();
            if let Some(view) = &snapshot.run {
                show(view);
                if view.outcome.is_some() {
                    return Ok(snapshot);
                }
            }
            newest?;
        }
    }

    /// The newest snapshot once there is one, or `None` after so long.
    pub fn next(&self, patience: Duration) -> Result<Option<Arc<RunnerSnapshot>>, RunnerEnded> {
        if self.woken.recv_timeout(patience).is_ok() {
            return Ok(Some(self.runner.snapshot()));
        }
        if self.runner.is_alive() { Ok(None) } else { Err(RunnerEnded) }
    }
}
