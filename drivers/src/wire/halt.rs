//! The immediate stop without the owner of the rig: for a program that panics.

use super::link_thread::NumberedCommand;
use palpate_model::rig::RigCommand;
use std::cell::{Cell, RefCell};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::SyncSender;
use std::thread::ThreadId;
use std::time::Duration;

/// Between two checks whether a stop has been written.
const LOOK_EVERY: Duration = Duration::from_micros(200);

#[derive(Debug, Default)]
pub(super) struct StopCounters {
    /// Handed to the link's thread.
    pub sent: AtomicU64,
    pub written: AtomicU64,
}

/// Sends the immediate stop over a link from any thread, without a lock and without the rig.
#[derive(Clone, Debug)]
pub struct HaltHandle {
    pub(super) stops: SyncSender<NumberedCommand>,
    pub(super) counters: Arc<StopCounters>,
    /// The thread that owns the link.
    pub(super) owner: ThreadId,
}

impl HaltHandle {
    /// Count of stops that are on the wire.
    pub fn written(&self) -> u64 {
        self.counters.written.load(Ordering::Acquire)
    }

    /// Hands the immediate stop to the link's thread and waits until it is written, for `patience` at most. Returns
    /// whether it is.
    ///
    /// On the link's own thread it does nothing: there the farewell stops the axis, see [`after_farewell`].
    pub fn halt(&self, patience: Duration) -> bool {
        if self.is_own_thread() {
            return false;
        }
        let number = self.counters.sent.fetch_add(1, Ordering::AcqRel) + 1;
        self.stops.try_send((number, RigCommand::Halt)).is_ok() && self.is_written(number, patience)
    }

    /// Whether this is the link's own thread, which writes nothing while it waits.
    pub fn is_own_thread(&self) -> bool {
        std::thread::current().id() == self.owner
    }

    /// Waits until so many stops are written, for `patience` at most. Returns whether they are.
    pub fn is_written(&self, number: u64, patience: Duration) -> bool {
        let looks = patience.as_micros() / LOOK_EVERY.as_micros();
        for _ in 0..=looks {
            if self.written() >= number {
                return true;
            }
            std::thread::sleep(LOOK_EVERY);
        }
        false
    }
}

/// Work to be done when the thread of a link has panicked.
type DeferredWork = Box<dyn FnOnce()>;

thread_local! {
    static OWNS_LINK: Cell<bool> = const { Cell::new(false) };
    static DEFERRED: RefCell<Option<DeferredWork>> = const { RefCell::new(None) };
}

pub(super) fn mark_link_owner() {
    OWNS_LINK.set(true);
}

/// Called when this thread panics and has written the farewell.
pub(super) fn run_deferred_work() {
    if let Some(deferred) = DEFERRED.take() {
        deferred();
    }
}

/// Does this now, or, on a thread that owns a link and panics, when the link's farewell has stopped what moves.
pub fn run_after_link_stop(work: impl FnOnce() + 'static) {
    if OWNS_LINK.get() {
        DEFERRED.set(Some(Box::new(work)));
    } else {
        work();
    }
}
