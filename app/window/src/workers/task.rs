//! Work of seconds to minutes on a thread of its own, with progress, time left and cancel.

use super::Job;
use eframe::egui::Context;
use palpate_analysis::progress::TaskProgress;
use palpate_runner::Stopwatch;
use std::sync::Arc;

/// How far a task is.
#[derive(Clone, Debug, PartialEq)]
pub struct TaskState {
    /// Done, 0 to 1.
    pub fraction: f64,
    /// The piece of work in progress.
    pub what: String,
    /// Since the start.
    pub seconds: f64,
    /// At this pace, once a piece is done.
    pub seconds_left: Option<f64>,
}

/// One task at a time and its last answer.
pub struct BackgroundTask<T> {
    job: Job<Result<T, String>>,
    progress: Arc<TaskProgress>,
    since: Option<Stopwatch>,
    answer: Option<Result<T, String>>,
    /// The last start failed, which the next poll reports as an end.
    has_failed: bool,
}

impl<T> Default for BackgroundTask<T> {
    fn default() -> Self {
        let (job, progress) = (Job::default(), Arc::default());
        Self { job, progress, since: None, answer: None, has_failed: false }
    }
}

impl<T: Send + 'static> BackgroundTask<T> {
    /// Starts work, unless some is in progress. The last answer stays until the new one is there.
    pub fn start(
        &mut self,
        name: &str,
        ctx: &Context,
        work: impl FnOnce(&TaskProgress) -> Result<T, String> + Send + 'static,
    ) {
        if self.job.is_busy() {
            return;
        }
        self.progress = Arc::default();
        let progress = Arc::clone(&self.progress);
        match self.job.start(name, ctx, move || logged(|| work(&progress))) {
            Ok(()) => self.since = Some(Stopwatch::start()),
            Err(err) => {
                self.answer = Some(Err(format!("the work cannot be started: {err}")));
                self.has_failed = true;
            }
        }
    }

    /// Fetches the answer if it has come; true when the work has just ended.
    pub fn poll(&mut self) -> bool {
        if !self.job.is_busy() {
            return std::mem::take(&mut self.has_failed);
        }
        let answer = self.job.poll();
        if self.job.is_busy() {
            return false;
        }
        self.since = None;
        let is_cancelled = self.progress.is_cancelled();
        match answer {
            // A cancelled task has no answer; the one before stays.
            Some(Err(_)) if is_cancelled => {}
            Some(answer) => self.answer = Some(answer),
            None => {
                let gone = "the work ended unexpectedly; start it again, and report it if it happens twice";
                self.answer = Some(Err(gone.to_owned()));
            }
        }
        true
    }

    pub fn is_busy(&self) -> bool {
        self.job.is_busy()
    }

    /// Asks the work to end at its next piece.
    pub fn cancel(&self) {
        self.progress.cancel();
    }

    /// Whether it is cancelled and has not ended yet.
    pub fn is_ending(&self) -> bool {
        self.job.is_busy() && self.progress.is_cancelled()
    }

    pub fn answer(&self) -> Option<&Result<T, String>> {
        self.answer.as_ref()
    }

    /// The answer, for which there is one owner.
    pub fn take_answer(&mut self) -> Option<Result<T, String>> {
        self.answer.take()
    }

    /// None while no work is in progress.
    pub fn state(&self) -> Option<TaskState> {
        let seconds = self.since.as_ref()?.seconds();
        let (done, of, what) = self.progress.read();
        let (done, of) = (done as f64, of as f64);
        Some(TaskState {
            fraction: if of > 0.0 { (done / of).min(1.0) } else { 0.0 },
            what,
            seconds,
            seconds_left: (done > 0.0).then(|| seconds * (of - done).max(0.0) / done),
        })
    }
}

/// Work with its beginning and its end in the program's log.
fn logged<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    tracing::info!("started");
    let answer = work();
    match &answer {
        Ok(_) => tracing::info!("ended"),
        Err(err) => tracing::warn!("ended without an answer: {err}"),
    }
    answer
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_analysis::progress::Progress;
    use palpate_test_support::wait::until;
    use std::sync::mpsc::{Receiver, sync_channel};
    use std::time::Duration;

    fn finish<T: Send + 'static>(task: &mut BackgroundTask<T>) {
        let is_done = || {
            task.poll();
            task.state().is_none().then_some(())
        };
        until(is_done, || "the end of the task".into());
    }

    /// A task that does `of` pieces, each when `go` says so.
    fn stepwise(task: &mut BackgroundTask<usize>, of: usize, go: Receiver<()>) {
        task.start("test", &Context::default(), move |progress| {
            for done in 0..of {
                if progress.report(done, of, "a piece").is_break() {
                    return Err("cancelled".into());
                }
                go.recv().map_err(|err| err.to_string())?;
            }
            Ok(of)
        });
    }

    #[test]
    fn progress_is_reported_and_the_answer_stays() {
        let (step, go) = sync_channel(8);
        let mut task = BackgroundTask::default();
        stepwise(&mut task, 4, go);
        for _ in 0..2 {
            step.send(()).unwrap();
        }
        let state = loop {
            let state = task.state().unwrap();
            if state.fraction == 0.5 {
                break state;
            }
            std::thread::sleep(Duration::from_millis(1));
        };
        assert_eq!(state.what, "a piece");
        assert!(state.seconds_left.is_some());
        for _ in 0..2 {
            step.send(()).unwrap();
        }
        finish(&mut task);
        assert_eq!(task.answer(), Some(&Ok(4)));
    }

    #[test]
    fn a_cancelled_task_keeps_the_answer_before() {
        let mut task = BackgroundTask::default();
        task.start("test", &Context::default(), |_| Ok(7));
        finish(&mut task);
        let (step, go) = sync_channel(8);
        stepwise(&mut task, 4, go);
        task.cancel();
        assert!(task.is_ending());
        step.send(()).unwrap();
        finish(&mut task);
        assert_eq!(task.answer(), Some(&Ok(7)));
        assert!(!task.is_ending());
    }

    #[test]
    fn a_task_that_dies_says_so() {
        let mut task: BackgroundTask<u32> = BackgroundTask::default();
        task.start("test", &Context::default(), |_| panic!("on purpose"));
        finish(&mut task);
        assert!(matches!(task.answer(), Some(Err(text)) if text.contains("unexpectedly")));
    }
}
