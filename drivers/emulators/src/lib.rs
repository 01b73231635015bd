//! Emulators that answer like a device on a wire, with the simulated bench behind them.
//!
//! A [`EmulatedDevice`] is a state machine: bytes and the time go in, bytes come out. It reads no
//! clock, port or file, so that equal bytes at equal times give equal answers.
//! [`serve`] puts one on a pseudo-terminal or a TCP port; [`faults`] corrupt its line on command.
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

pub mod bench;
pub mod cell;
pub mod faults;
pub mod galil;
pub mod grbl;
pub mod hapi;
pub mod hx711;
pub mod inverse;
pub mod line_cell;
pub mod mark10;
pub mod orders;
mod plant;
#[cfg(unix)]
mod pty;
#[cfg(not(unix))]
#[path = "no_pty.rs"]
mod pty;
pub mod serve;
mod served;
pub mod sidecar;
mod wire;

pub use faults::{DeviceFault, FaultError, ScheduledFault};
pub use plant::EmulatedPlant;
pub use served::ServedDevice;

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

    fn connect(&mut self, _now: Nanos, _channel: usize) {}

    fn disconnect(&mut self, _now: Nanos, _channel: usize) {}

    fn receive(&mut self, now: Nanos, channel: usize, bytes: &[u8]);

    fn advance(&mut self, now: Nanos);

    /// Bytes sent since the last call.
    fn transmit(&mut self, channel: usize) -> Vec<u8>;

    /// Whether the device has closed this connection since the last call.
    fn take_hang_up(&mut self, _channel: usize) -> bool {
        false
    }

    /// Begins or ends a fault of the device; [`DeviceFault::Reset`] only begins.
    fn apply_fault(&mut self, now: Nanos, fault: DeviceFault, is_on: bool);

    /// What a person does at the bench: weights, specimens.
    fn apply_hand_action(&mut self, now: Nanos, action: HandAction);
}
