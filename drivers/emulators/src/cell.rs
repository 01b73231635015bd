//! An emulated load cell beside an axis: it sees the amplifier's signal and the true force, and speaks on a line of its
//! own.

use super::DeviceFault;
use palpate_model::Nanos;
use palpate_model::units::{Newtons, Volts};

/// What an emulated load cell feels at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Felt {
    /// The emulated bridge behind the usual amplifier, as an analog input would read it.
    pub volts: Volts,
    /// Force on the cell as a calibrated gauge would feel it, without noise.
    pub force: Newtons,
}

/// A load cell with a wire of its own. Times never go backwards.
pub trait EmulatedCell: Send {
    /// Bytes have arrived.
    fn receive(&mut self, now: Nanos, bytes: &[u8]);

    /// Time has passed, in steps of a millisecond or less; `felt` holds at `now`.
    fn advance(&mut self, now: Nanos, felt: Felt);

    /// What it has sent since it was last asked.
    fn transmit(&mut self) -> Vec<u8>;

    /// A fault of the device itself begins or ends.
    fn suffer(&mut self, now: Nanos, fault: DeviceFault, is_on: bool);
}
