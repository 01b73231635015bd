//! A gauge on a line of its own that sends its readings by itself.

mod dialogue;
mod open;

pub(crate) use dialogue::BEYOND_RANGE;
pub use dialogue::{GaugeDialogue, GaugeScale};
pub(crate) use open::{ask_text, check, filters, set_up};

use super::protocol::GaugeLine;
use crate::devices::{DeviceKind, DeviceRole, find_line};
use crate::rig_file::{Fields, gauge};
use palpate_model::units::{Newtons, Volts};
use std::sync::Arc;

pub(crate) const KIND: DeviceKind = DeviceKind {
    word: "mark10",
    title: "a Mark-10 gauge",
    introduction: "force gauge that reads ",
    role: DeviceRole::Cell {
        read: |fields: &mut Fields| Some(Arc::new(gauge(fields)?)),
        emulation: None,
    },
    recognise: |lines| {
        find_line(lines, |line| {
            matches!(
                GaugeLine::parse(line),
                GaugeLine::Reading(_) | GaugeLine::List(_) | GaugeLine::Error
            )
        })
    },
};

/// Rates of `AOUT` (Model 7i user's guide, page 30).
pub const RATES: [u16; 8] = [1, 2, 5, 10, 25, 50, 125, 250];
/// Largest exponent of a filter: 1024 samples.
pub const FILTER_MAX: u8 = 10;
/// Ends the readings that a gauge sends by itself.
pub const FAREWELL: &[u8] = b"AOUT0\r";

/// Settings of a gauge.
#[derive(Clone, Debug, PartialEq)]
pub struct GaugeSettings {
    /// Serial number that it must have, as it reports it; any without.
    pub serial_number: Option<String>,
    /// Largest force of its range, as on its label; a gauge does not report it.
    pub capacity: Newtons,
    /// Readings a second that it is to send, one of [`RATES`].
    pub per_second: u16,
    /// Exponent of its filters, 0 to 10: 2^n of its samples are averaged. Left as they are without.
    pub filter: Option<u8>,
    /// Whether pressing pulls at the gauge, so that tension is to count as positive.
    pub is_reversed: bool,
    /// Standard deviation of its readings at rest; one step of its last digit without.
    pub noise: Option<Newtons>,
}

impl GaugeSettings {
    /// Standard deviation of readings at rest: as it was given, or the rounding to steps of the last digit alone, for a
    /// gauge's filters are mostly stronger than its noise.
    pub fn noise_expected(&self, step: Volts) -> Volts {
        self.noise.map_or(Volts(step.0 / 12.0_f64.sqrt()), |noise| Volts(noise.0))
    }
}

impl Default for GaugeSettings {
    fn default() -> Self {
        Self {
            serial_number: None,
            capacity: Newtons(25.0),
            per_second: 250,
            filter: None,
            is_reversed: false,
            noise: None,
        }
    }
}
