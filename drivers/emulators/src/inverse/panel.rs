//! The emulator's panel: faults on, faults off, and when the force was last on the hand.

use super::{InverseFault, InverseService};
use palpate_model::Nanos;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

#[derive(Clone, Copy, Debug)]
struct PanelState {
    fault: Option<InverseFault>,
    is_held: bool,
    fault_at: Option<Nanos>,
    zero_since: Option<Nanos>,
    zero_in_fault: Option<Nanos>,
    force: [f64; 3],
    messages: u64,
}

/// A handle to an emulated service in use; clones operate the same one.
#[derive(Clone, Debug)]
pub struct InversePanel(Arc<Mutex<PanelState>>);

impl Default for InversePanel {
    fn default() -> Self {
        Self(Arc::new(Mutex::new(PanelState {
            fault: None,
            is_held: true,
            fault_at: None,
            zero_since: Some(Nanos::ZERO),
            zero_in_fault: None,
            force: [0.0; 3],
            messages: 0,
        })))
    }
}

impl InversePanel {
    fn state(&self) -> MutexGuard<'_, PanelState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Begins a fault, or ends it.
    pub fn set_fault(&self, fault: Option<InverseFault>) {
        self.state().fault = fault;
    }

    /// Presses the button of the grip, or lets it go.
    pub fn set_held(&self, is_held: bool) {
        self.state().is_held = is_held;
    }

    /// When the fault began on the emulator's clock; `None` while it has not.
    #[must_use]
    pub fn fault_at(&self) -> Option<Nanos> {
        self.state().fault_at
    }

    /// Since when there is no force on the hand, on the emulator's clock; `None` while there is one.
    #[must_use]
    pub fn zero_since(&self) -> Option<Nanos> {
        self.state().zero_since
    }

    /// When the force was first zero after the fault began, on the emulator's clock.
    #[must_use]
    pub fn zero_in_fault(&self) -> Option<Nanos> {
        self.state().zero_in_fault
    }

    /// The force on the hand in N.
    #[must_use]
    pub fn force(&self) -> [f64; 3] {
        self.state().force
    }

    /// Messages received.
    #[must_use]
    pub fn messages(&self) -> u64 {
        self.state().messages
    }

    pub(super) fn wishes(&self) -> (Option<InverseFault>, bool) {
        let state = self.state();
        (state.fault, state.is_held)
    }

    pub(super) fn show(&self, service: &InverseService) {
        let mut state = self.state();
        state.fault_at = service.fault_at();
        state.zero_since = service.zero_since();
        state.zero_in_fault = service.zero_in_fault();
        state.force = service.force();
        state.messages = service.messages();
    }
}
