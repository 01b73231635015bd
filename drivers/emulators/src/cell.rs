//! An emulated load cell beside an axis: it sees the amplifier's signal and the true force, and speaks on a line of its
//! own.

use super::DeviceFault;
use super::hx711::{EmulatedHx711, EmulatedHx711Settings};
use super::line_cell::EmulatedLineCell;
use super::mark10::{EmulatedGauge, EmulatedGaugeSettings};
use palpate_drivers::devices::{DEVICES, Role};
use palpate_model::Nanos;
use palpate_model::units::{Newtons, Volts};

/// What an emulated load cell feels at an instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellLoad {
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
    fn advance(&mut self, now: Nanos, load: CellLoad);

    /// What it has sent since it was last asked.
    fn transmit(&mut self) -> Vec<u8>;

    /// A fault of the device itself begins or ends.
    fn apply_fault(&mut self, now: Nanos, fault: DeviceFault, is_on: bool);
}

/// Makes an emulated load cell out of a seed.
type CellFactory = fn(u64) -> Box<dyn EmulatedCell>;

/// Emulated load cells beside an axis that are programs of their own, by their words in a rig file.
const FACTORIES: [(&str, CellFactory); 2] = [
    ("hx711", |_| Box::new(EmulatedHx711::new(EmulatedHx711Settings::default()))),
    ("mark10", |seed| {
        let usual = EmulatedGaugeSettings::default();
        Box::new(EmulatedGauge::new(EmulatedGaugeSettings { seed, ..usual }))
    }),
];

/// The words of all load cells that can be emulated beside an axis.
#[must_use]
pub fn emulated_cells() -> Vec<&'static str> {
    let words = DEVICES.iter().map(|kind| kind.word);
    words.filter(|word| emulated_cell(word, 0).is_some()).collect()
}

/// An emulated load cell, by its word in a rig file.
#[must_use]
pub fn emulated_cell(word: &str, seed: u64) -> Option<Box<dyn EmulatedCell>> {
    if let Some((_, program)) = FACTORIES.iter().find(|(name, _)| *name == word) {
        return Some(program(seed));
    }
    let kind = DEVICES.iter().find(|kind| kind.word == word)?;
    match kind.role {
        Role::Cell { emulation, .. } => Some(Box::new(EmulatedLineCell::new(emulation?))),
        Role::Axis(_) => None,
    }
}
