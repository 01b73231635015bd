//! The immediate stop around whoever holds a rig: for a program that panics.

use super::link_thread::NumberedCommand;
use palpate_model::rig::RigCommand;
use std::cell::{Cell, RefCell};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::SyncSender;
use std::thread::ThreadId;
use std::time::Duration;

/// How often it is looked whether a stop has been written.
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
    stops: SyncSender<NumberedCommand>,
    standing: Arc<StopCounters>,
    owner: ThreadId,
}

impl HaltHandle {
    pub(super) fn new(
        stops: SyncSender<NumberedCommand>,
        standing: Arc<StopCounters>,
        owner: ThreadId,
    ) -> Self {
        Self { stops, standing, owner }
    }

    pub fn written(&self) -> u64 {
        self.standing.written.load(Ordering::Acquire)
    }

    /// Hands the immediate stop to the link's thread and waits about so long until it is written. Whether it is.
    ///
    /// On the link's own thread it does nothing: there the farewell stops the axis, see [`after_farewell`].
    pub fn halt(&self, patience: Duration) -> bool {
        if self.is_own_thread() {
            return false;
        }
        let number = self.standing.sent.fetch_add(1, Ordering::AcqRel) + 1;
        self.stops.try_send((number, RigCommand::Halt)).is_ok() && self.is_written(number, patience)
    }

    /// Whether this is the link's own thread, which writes nothing while it waits.
    pub fn is_own_thread(&self) -> bool {
        std::thread::current().id() == self.owner
    }

    /// Waits about so long until so many stops are written. Whether they are.
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

/// What is left to be done when a link's thread has panicked.
type DeferredWork = Box<dyn FnOnce()>;

thread_local! {
    static OWNS_LINK: Cell<bool> = const { Cell::new(false) };
    static DEFERRED: RefCell<Option<DeferredWork>> = const { RefCell::new(None) };
}

pub(super) fn owns_link() {
    OWNS_LINK.set(true);
}

/// The farewell was written while this thread panics.
pub(super) fn farewell_said() {
    if let Some(deferred) = DEFERRED.take() {
        deferred();
    }
}

/// Does this now, or, on a thread that owns a link and panics, when the link's farewell has stopped what moves.
pub fn after_farewell(work: impl FnOnce() + 'static) {
    if OWNS_LINK.get() {
        DEFERRED.set(Some(Box::new(work)));
    } else {
        work();
    }
}
