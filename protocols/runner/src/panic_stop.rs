//! A panic stops every rig that a runner holds.
//!
//! The runner is asked for the immediate stop, so that the session says how it ended. Where a runner does not answer or panics
//! itself, the link's own thread sends the stop.

use super::main_loop::RunnerRequest;
use arc_swap::ArcSwap;
use palpate_drivers::wire::HaltHandle;
use palpate_protocols::engine::Operator;
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, LazyLock};
use std::thread::ThreadId;
use std::time::Duration;

/// How long a runner has to get its stop onto the wire: ten turns of its loop.
const RUNNER_PATIENCE: Duration = Duration::from_millis(20);
/// How long a link's thread has: a hundred of its reads.
const LINK_PATIENCE: Duration = Duration::from_millis(50);

/// One runner's rig.
struct OpenRig {
    runner: ThreadId,
    requests: SyncSender<RunnerRequest>,
    link: Option<HaltHandle>,
}

/// A list that is replaced and never locked: a panicking thread may hold any lock.
static OPEN: LazyLock<ArcSwap<Vec<Arc<OpenRig>>>> = LazyLock::new(ArcSwap::default);

/// Keeps a rig among those that a panic stops. Made on the runner's thread.
pub(super) struct RigRegistration(Arc<OpenRig>);

impl RigRegistration {
    pub fn new(requests: SyncSender<RunnerRequest>, link: Option<HaltHandle>) -> Self {
        let rig = Arc::new(OpenRig { runner: std::thread::current().id(), requests, link });
        OPEN.rcu(|open| [open.as_slice(), &[Arc::clone(&rig)]].concat());
        Self(rig)
    }

    pub fn relinked(self, link: Option<HaltHandle>) -> Self {
        Self::new(self.0.requests.clone(), link)
    }
}

impl Drop for RigRegistration {
    fn drop(&mut self) {
        OPEN.rcu(|open| {
            let others = open.iter().filter(|rig| !Arc::ptr_eq(rig, &self.0));
            others.cloned().collect::<Vec<_>>()
        });
    }
}

/// Sends every open rig the immediate stop and waits a moment until it is on the wire. Takes no lock.
///
/// For a panic hook. Should this thread own a link itself, that link's farewell is the stop, which comes with
/// unwinding: what may wait for it goes through [`palpate_drivers::wire::after_farewell`].
pub fn halt_open_rigs() {
    for rig in OPEN.load().iter() {
        rig.halt();
    }
}

#[cfg(test)]
pub(super) fn is_registered(runner: ThreadId) -> bool {
    OPEN.load().iter().any(|rig| rig.runner == runner)
}

impl OpenRig {
    fn halt(&self) {
        let written = self.link.as_ref().map_or(0, HaltHandle::written);
        let choice = Operator::Halt;
        let is_asked = std::thread::current().id() != self.runner
            && self.requests.try_send(RunnerRequest::Operator(choice)).is_ok();
        // A rig without wires moves only while its runner asks it; a link's own thread stops it with the farewell.
        let Some(link) = self.link.as_ref().filter(|link| !link.is_own_thread()) else {
            return;
        };
        if !(is_asked && link.is_written(written + 1, RUNNER_PATIENCE)) {
            // A dead link leaves nothing else to try.
            let _ = link.halt(LINK_PATIENCE);
        }
    }
}
