//! Progress of long work, and its cancellation.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

/// Receives the progress of work: a bar, a window, a test.
pub trait Progress {
    /// `done` of `of` pieces of like length are done and `what` comes next. Break cancels the rest.
    fn report(&self, done: usize, of: usize, what: &str) -> ControlFlow<()>;

    /// This share of the whole is done, 0 to 1. False cancels the rest.
    fn share(&self, share: f64, what: &str) -> bool {
        let done = (SHARES as f64 * share) as usize;
        self.report(done, SHARES, what).is_continue()
    }
}

/// Resolution of a share.
const SHARES: usize = 1000;

impl<F: Fn(usize, usize, &str) -> ControlFlow<()>> Progress for F {
    fn report(&self, done: usize, of: usize, what: &str) -> ControlFlow<()> {
        self(done, of, what)
    }
}

/// Progress that is shown nowhere and never cancelled.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoProgress;

impl Progress for NoProgress {
    fn report(&self, _: usize, _: usize, _: &str) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// The progress of a task on another thread, which may be cancelled from here.
#[derive(Debug, Default)]
pub struct TaskProgress {
    state: Mutex<(usize, usize, String)>,
    is_cancelled: AtomicBool,
}

impl Progress for TaskProgress {
    fn report(&self, done: usize, of: usize, what: &str) -> ControlFlow<()> {
        *self.state.lock().unwrap_or_else(PoisonError::into_inner) = (done, of, what.to_owned());
        if self.is_cancelled() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

impl TaskProgress {
    /// Asks the work to end at its next piece.
    pub fn cancel(&self) {
        self.is_cancelled.store(true, Ordering::Relaxed);
    }

    pub fn is_cancelled(&self) -> bool {
        self.is_cancelled.load(Ordering::Relaxed)
    }

    /// Pieces done, pieces in all, and what comes next.
    pub fn read(&self) -> (usize, usize, String) {
        self.state.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}
