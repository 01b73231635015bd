//! Work that may take its time, each on a named thread of its own: the window never waits.

pub mod fit;
pub mod haptic_loop;
mod latest;
pub mod live_scene;
mod path_dialog;
pub mod player;
pub mod queue_desk;
pub mod review;
pub mod scene_tissue;
pub mod station;
mod task;
pub mod trail;

use eframe::egui::Context;
pub use latest::LatestAnswer;
pub use path_dialog::{Dialog, PathPurpose, pick};
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};
pub use task::{BackgroundTask, TaskState};

/// One job at a time on a named thread; the answer is fetched when it is there.
#[derive(Debug)]
pub struct Job<T> {
    answer: Option<Receiver<T>>,
}

impl<T> Default for Job<T> {
    fn default() -> Self {
        Self { answer: None }
    }
}

impl<T: Send + 'static> Job<T> {
    /// Whether an answer is still to come.
    pub fn is_busy(&self) -> bool {
        self.answer.is_some()
    }

    /// Starts the job, unless one is in progress. The window is drawn again when the answer is there.
    pub fn start(
        &mut self,
        name: &str,
        ctx: &Context,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> std::io::Result<()> {
        if self.is_busy() {
            return Ok(());
        }
        let (sender, receiver) = sync_channel(1);
        let ctx = ctx.clone();
        let span = tracing::info_span!("worker", name);
        std::thread::Builder::new().name(name.into()).spawn(move || {
            let _in = span.entered();
            tracing::debug!("started");
            // The receiver is gone when the window has closed.
            let _ = sender.try_send(work());
            tracing::debug!("ended");
            ctx.request_repaint();
        })?;
        self.answer = Some(receiver);
        Ok(())
    }

    /// Waits for the answer, if one is to come; none if its work failed.
    pub fn wait(&mut self) -> Option<T> {
        self.answer.take()?.recv().ok()
    }

    /// The answer, once.
    pub fn poll(&mut self) -> Option<T> {
        match self.answer.as_ref()?.try_recv() {
            Ok(answer) => {
                self.answer = None;
                Some(answer)
            }
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => {
                self.answer = None;
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_test_support::wait::until;

    #[test]
    fn an_answer_is_fetched_once_and_then_a_new_job_may_start() {
        let mut job = Job::default();
        for round in 0..2 {
            job.start("test-job", &Context::default(), move || round + 40).unwrap();
            assert!(job.is_busy());
            let answer = until(|| job.poll(), || "an answer".into());
            assert_eq!(answer, round + 40);
            assert_eq!(job.poll(), None);
            assert!(!job.is_busy());
        }
    }

    #[test]
    fn a_job_that_dies_does_not_stay_busy() {
        let mut job: Job<u32> = Job::default();
        job.start("test-job", &Context::default(), || panic!("on purpose")).unwrap();
        let is_idle = || {
            let is_idle = !job.is_busy();
            assert_eq!(job.poll(), None);
            is_idle.then_some(())
        };
        until(is_idle, || "a job that is not busy".into());
    }
}
