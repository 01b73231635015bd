//! The emulator's panel: faults on, faults off, and what the hand feels.

use super::{HapiBoard, HapiFault};
use palpate_model::Nanos;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

#[derive(Clone, Copy, Debug, Default)]
struct PanelState {
    fault: Option<HapiFault>,
    fault_at: Option<Nanos>,
    force: [f64; 2],
    torques: [f64; 2],
    is_set_up: bool,
}

/// A handle to an emulated board in use; clones operate the same one.
#[derive(Clone, Debug, Default)]
pub struct HapiPanel(Arc<Mutex<PanelState>>);

impl HapiPanel {
    fn state(&self) -> MutexGuard<'_, PanelState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins a fault, or ends it.
    pub fn set_fault(&self, fault: Option<HapiFault>) {
        self.state().fault = fault;
    }

    pub(super) fn fault(&self) -> Option<HapiFault> {
        self.state().fault
    }

    /// When the fault began on the emulator's clock; `None` while it has not.
    #[must_use]
    pub fn fault_at(&self) -> Option<Nanos> {
        self.state().fault_at
    }

    /// The force on the hand in N along the plane's x and y.
    #[must_use]
    pub fn force(&self) -> [f64; 2] {
        self.state().force
    }

    /// Torques of motors 1 and 2 in N m.
    #[must_use]
    pub fn torques(&self) -> [f64; 2] {
        self.state().torques
    }

    /// Whether the board has a set-up.
    #[must_use]
    pub fn is_set_up(&self) -> bool {
        self.state().is_set_up
    }

    pub(super) fn show(&self, board: &HapiBoard) {
        let mut state = self.state();
        state.fault_at = board.fault_at();
        state.force = board.force();
        state.torques = board.torques();
        state.is_set_up = board.is_set_up();
    }
}
