//! Emulators: programs that answer like a device on a wire, with the simulated bench behind them.
//!
//! A [`EmulatedDevice`] is a state machine: bytes and the time go in, bytes come out, and nothing else happens. It
//! never reads a clock, a port or a file, so that equal bytes at equal times give equal answers.
//! [`serve`] puts one on a pseudo-terminal or a TCP port; [`faults`] spoils its line on command.
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

pub mod bench;
pub mod cell;
pub mod faults;
pub mod galil;
pub mod grbl;
pub mod hx711;
pub mod line_cell;
pub mod mark10;
pub mod orders;
mod plant;
mod pty;
pub mod serve;
mod wire;

pub use faults::{DeviceFault, FaultError, ScheduledFault};
pub use plant::EmulatedPlant;

use palpate_model::Nanos;
use palpate_model::rig::HandAction;

/// A device as seen from its wires.
///
/// A channel is one connection to it, counted from 0: a serial device has one, a device on a network has one per
/// client. Times never go backwards.
pub trait EmulatedDevice: Send {
    /// How many clients may be connected at once.
    fn channels(&self) -> usize {
        1
    }

    /// A client has connected.
    fn connect(&mut self, _now: Nanos, _channel: usize) {}

    /// A client has gone.
    fn disconnect(&mut self, _now: Nanos, _channel: usize) {}

    /// Bytes have arrived.
    fn receive(&mut self, now: Nanos, channel: usize, bytes: &[u8]);

    /// Time has passed.
    fn advance(&mut self, now: Nanos);

    /// What the device has sent since it was last asked.
    fn transmit(&mut self, channel: usize) -> Vec<u8>;

    /// Whether the device has closed this connection since it was last asked.
    fn take_hang_up(&mut self, _channel: usize) -> bool {
        false
    }

    /// A fault of the device itself begins or ends; [`DeviceFault::Reset`] only begins.
    fn apply_fault(&mut self, now: Nanos, fault: DeviceFault, is_on: bool);

    /// A person does something at the bench.
    fn apply_hand_action(&mut self, now: Nanos, action: HandAction);
}
