//! How work that takes a while says how far it is, and learns that nobody wants the rest.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// What a worker tells while it works.
#[derive(Debug, Default)]
pub struct Progress {
    done: AtomicUsize,
    of: AtomicUsize,
    what: Mutex<String>,
    is_cancelled: AtomicBool,
}

impl Progress {
    /// `done` of `of` pieces of like length are done and `what` comes next. Break: nobody wants the rest.
    pub fn tell(&self, done: usize, of: usize, what: &str) -> ControlFlow<()> {
        self.done.store(done, Ordering::Relaxed);
        self.of.store(of, Ordering::Relaxed);
        let mut text = self.what.lock().unwrap_or_else(PoisonError::into_inner);
        text.clear();
        text.push_str(what);
        if self.is_cancelled.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }

    /// Asks the work to end at its next piece.
    pub fn cancel(&self) {
        self.is_cancelled.store(true, Ordering::Relaxed);
    }

    /// Whether the work was asked to end.
    #[must_use]
    pub fn is_cancelled(&self) -> bool {
        self.is_cancelled.load(Ordering::Relaxed)
    }

    /// Pieces done, pieces in all, and what comes next.
    #[must_use]
    pub fn read(&self) -> (usize, usize, String) {
        let what = self.what.lock().unwrap_or_else(PoisonError::into_inner);
        let count = |pieces: &AtomicUsize| pieces.load(Ordering::Relaxed);
        (count(&self.done), count(&self.of), what.clone())
    }
}
