//! A runner from another thread.

use super::main_loop::RunnerRequest;
use super::snapshot::RunnerSnapshot;
use arc_swap::ArcSwap;
use std::sync::mpsc::SyncSender;
use std::sync::{Arc, Weak};

/// Snapshots of a runner and requests to it for another thread. It keeps no runner alive.
#[derive(Clone)]
pub struct RunnerHandle {
    pub(super) requests: SyncSender<RunnerRequest>,
    pub(super) snapshot: Arc<ArcSwap<RunnerSnapshot>>,
    pub(super) life: Weak<()>,
}

impl RunnerHandle {
    /// The newest snapshot; the last one once the runner has ended.
    pub fn snapshot(&self) -> Arc<RunnerSnapshot> {
        self.snapshot.load_full()
    }

    pub fn is_alive(&self) -> bool {
        self.life.strong_count() > 0
    }

    /// Asks for something. Fails only when the runner has ended or is swamped.
    pub fn request(&self, request: RunnerRequest) -> Result<(), String> {
        send(&self.requests, request)
    }
}

pub(super) fn send(
    requests: &SyncSender<RunnerRequest>,
    request: RunnerRequest,
) -> Result<(), String> {
    requests.try_send(request).map_err(|_| {
        "the thread that controls the rig does not answer; close palpate and check the rig"
            .to_string()
    })
}
