//! A load cell bridge on an HX711 converter, with palpate's sketch on the Arduino that reads it.
//!
//! Read [`protocol`] first: lines that the sketch sends. `open.rs` checks the identity of the board,
//! [`Hx711Dialogue`] goes on.
//!
//! # Volts
//!
//! The chip compares the bridge's signal with the voltage that feeds the bridge, so its count stands for mV/V
//! whatever the supply: the whole range, 2^23 counts, is half the supply over the gain (HX711 data sheet, Avia
//! Semiconductor, page 3: 19.5 mV at 5 V and gain 128). palpate and its limits speak of amplified volts. The rule is:
//! the whole range at gain 128 is [`Hx711Settings::full_scale`], usually 5 V, which is what an amplifier of 256 times
//! would make of the bridge with a supply of 5 V. A cell of 2 mV/V under its rated load is then at 2.56 V, a signal
//! beyond the chip's range is at 5 V, above the 2.80 V at which every run stops, and gains 128 and 64 give the same
//! volts.

mod dialogue;
mod open;
pub mod protocol;

pub use dialogue::Hx711Dialogue;

use crate::cell::CellDevice;
use crate::devices::{DeviceKind, DeviceRole, find_line};
use crate::rig_file::Fields;
use palpate_model::units::Volts;
use std::sync::Arc;

pub(crate) const KIND: DeviceKind = DeviceKind {
    word: "hx711",
    title: "an HX711 board",
    introduction: "load cell on an HX711, ",
    role: DeviceRole::Cell { read, emulation: None },
    recognise: |lines| {
        find_line(lines, |line| line.contains("palpate-hx711") || protocol::parse(line).is_some())
    },
};

/// Settings of an HX711 board.
#[derive(Clone, Debug, PartialEq)]
pub struct Hx711Settings {
    /// Name that the board must have, as it stands in its sketch; any without.
    pub board: Option<String>,
    /// Volts that the chip's whole range at gain 128 stands for. Calibrations belong to it.
    pub full_scale: Volts,
    pub noise: Volts,
}

impl Default for Hx711Settings {
    fn default() -> Self {
        Self {
            board: None,
            full_scale: Volts(5.0),
            // 90 nV at 80 samples a second (data sheet, page 3) are 23 uV behind 256 times; bridges and cables
            // bring ten times that.
            noise: Volts(0.3e-3),
        }
    }
}

impl Hx711Settings {
    /// Volts of one count at a gain of channel A.
    pub fn volts_per_count(&self, gain: u8) -> f64 {
        self.full_scale.0 / f64::from(1_u32 << 23) * 128.0 / f64::from(gain)
    }
}

fn read(fields: &mut Fields) -> Option<Arc<dyn CellDevice>> {
    let usual = Hx711Settings::default();
    Some(Arc::new(Hx711Settings {
        board: fields.text("cell.board"),
        full_scale: fields
            .number("cell.full_scale_v", 1e-3, 1000.0)
            .map_or(usual.full_scale, Volts),
        noise: fields.number("cell.noise_v", 1e-9, 1.0).map_or(usual.noise, Volts),
    }))
}
