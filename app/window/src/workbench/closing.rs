//! Closing: motion stops first, and what is being written is finished.

use super::{Start, Workbench};
use crate::shell::activity::is_motion_possible;
use palpate_protocols::engine::Operator;

impl Workbench {
    /// Stops motion before the window closes; true if it may close now, with the axis at rest.
    pub fn begin_to_close(&mut self) -> bool {
        // Nothing may start in a window that is about to close.
        self.is_closing = true;
        let is_safe = self.is_at_rest();
        if !is_safe {
            self.operator(Operator::Stop);
        }
        is_safe && !self.is_writing()
    }

    /// Whether a window that waited for the axis to rest may close now.
    pub fn may_close(&self) -> bool {
        let is_safe = self.is_at_rest() || !self.runner.is_alive();
        self.is_closing && is_safe && !self.is_writing()
    }

    /// Whether something is being written that would be lost with the window.
    fn is_writing(&self) -> bool {
        self.queue.is_busy() || self.latest_run.is_judging()
    }

    fn is_at_rest(&self) -> bool {
        let snapshot = self.runner.snapshot();
        !is_motion_possible(&snapshot) && matches!(self.start, Start::None)
    }
}
