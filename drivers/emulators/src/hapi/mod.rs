//! Haply's 2DIY on a hAPI board: packets, encoders, motors, an arm with a hand on it, and faults.
//!
//! The board behaves as its public firmware does (HaplyHaptics/Haply-Arduino-Firmware-Versions on GitHub, M0 V0.3), also where that
//! is dangerous: a torque stays until the next packet, a reset does not end it, and the rest of a cut packet is waited for. The
//! mechanics of the arm, the sense of its turns and what happens without a cable are assumed. No real board was compared.

mod arm;
mod board;
mod fault;
mod panel;

pub use arm::{HapiArm, HapiArmSettings};
pub use board::{HapiBoard, HapiBoardSettings};
pub use fault::{HapiFault, HapiLie};
pub use panel::HapiPanel;

use crate::EmulatedDevice;
use crate::faults::DeviceFault;
use palpate_haptics::SettingError;
use palpate_model::Nanos;
use palpate_model::rig::HandAction;

/// The board behind its port.
pub struct EmulatedHapi {
    board: HapiBoard,
    panel: HapiPanel,
    has_hung_up: bool,
}

impl EmulatedHapi {
    /// The board and a panel to operate it from another thread.
    pub fn new(settings: HapiBoardSettings) -> Result<(Self, HapiPanel), SettingError> {
        let panel = HapiPanel::default();
        let emulated =
            Self { board: HapiBoard::new(settings)?, panel: panel.clone(), has_hung_up: false };
        Ok((emulated, panel))
    }

    /// Takes what the panel asks for, and shows it what is.
    fn look_at_panel(&mut self, now: Nanos) {
        let fault = self.panel.fault();
        if self.board.fault() != fault {
            self.board.set_fault(now, fault);
        }
        self.has_hung_up = fault == Some(HapiFault::Cut);
        self.panel.show(&self.board);
    }
}

impl EmulatedDevice for EmulatedHapi {
    fn receive(&mut self, now: Nanos, _channel: usize, bytes: &[u8]) {
        self.board.receive(now, bytes);
        self.look_at_panel(now);
    }

    fn advance(&mut self, now: Nanos) {
        self.board.advance(now);
        self.look_at_panel(now);
    }

    fn transmit(&mut self, _channel: usize) -> Vec<u8> {
        self.board.transmit()
    }

    fn take_hang_up(&mut self, _channel: usize) -> bool {
        std::mem::take(&mut self.has_hung_up)
    }

    fn apply_fault(&mut self, now: Nanos, fault: DeviceFault, is_on: bool) {
        // A wrong device is one whose firmware stands still; the others are of load cells.
        match fault {
            DeviceFault::Reset if is_on => self.board.restart(now),
            DeviceFault::WrongDevice => self.panel.set_fault(is_on.then_some(HapiFault::Hung)),
            DeviceFault::Reset | DeviceFault::Stuck | DeviceFault::Saturated => {}
        }
    }

    fn apply_hand_action(&mut self, _now: Nanos, _action: HandAction) {}
}
