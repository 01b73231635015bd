//! Emulated load cells with a line of their own, separate from that of the axis.

use super::DeviceFault;
use super::hx711::{EmulatedHx711, EmulatedHx711Settings};
use super::line_cell::EmulatedLineCell;
use super::mark10::{EmulatedGauge, EmulatedGaugeSettings};
use palpate_drivers::devices::{DEVICES, DeviceRole};
use palpate_model::Nanos;
use palpate_model::units::{Newtons, Volts};

/// Load on an emulated cell at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellLoad {
    /// Amplified signal of the bridge, as an analog input reads it.
    pub volts: Volts,
    /// True force on the cell, without noise.
    pub force: Newtons,
}

/// A load cell with a wire of its own. Times never go backwards.
pub trait EmulatedCell: Send {
    fn receive(&mut self, now: Nanos, bytes: &[u8]);

    /// Advances by a millisecond or less; `load` holds at `now`.
    fn advance(&mut self, now: Nanos, load: CellLoad);

    /// Bytes sent since the last call.
    fn transmit(&mut self) -> Vec<u8>;

    /// Begins or ends a fault of the device.
    fn apply_fault(&mut self, now: Nanos, fault: DeviceFault, is_on: bool);
}

/// Makes an emulated load cell out of a seed.
type CellFactory = fn(u64) -> Box<dyn EmulatedCell>;

/// Load cells whose emulator is a type of its own, by their words in a rig file.
const FACTORIES: [(&str, CellFactory); 2] = [
    ("hx711", |_| Box::new(EmulatedHx711::new(EmulatedHx711Settings::default()))),
    ("mark10", |seed| {
        Box::new(EmulatedGauge::new(EmulatedGaugeSettings { seed, ..Default::default() }))
    }),
];

/// The words of all load cells that can be emulated.
pub fn emulated_cells() -> Vec<&'static str> {
    let words = DEVICES.iter().map(|kind| kind.word);
    words.filter(|word| emulated_cell(word, 0).is_some()).collect()
}

/// Makes an emulated load cell from its word in a rig file.
pub fn emulated_cell(word: &str, seed: u64) -> Option<Box<dyn EmulatedCell>> {
    if let Some((_, make)) = FACTORIES.iter().find(|(name, _)| *name == word) {
        return Some(make(seed));
    }
    let kind = DEVICES.iter().find(|kind| kind.word == word)?;
    match kind.role {
        DeviceRole::Cell { emulation, .. } => Some(Box::new(EmulatedLineCell::new(emulation?))),
        DeviceRole::Axis(_) => None,
    }
}
