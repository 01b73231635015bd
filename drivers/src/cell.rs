//! A load cell on a wire of its own: what every such device gives, whatever it speaks.

use palpate_model::Nanos;
use palpate_model::rig::AdcDescription;
use palpate_model::units::Volts;

/// One value of a load cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CellSample {
    /// Arrival of its last byte on the host's clock.
    pub at: Nanos,
    /// The device's own clock when it was taken, where it has one; it never goes back and never wraps.
    pub device_time: Option<Nanos>,
    /// As the device counts.
    pub counts: i32,
    /// The same in volts. A gauge that tells newtons counts as one volt a newton.
    pub volts: Volts,
}

/// What a load cell is, as it was found when it was connected.
#[derive(Clone, Debug, PartialEq)]
pub struct CellDescription {
    /// Model, firmware and settings, for the operator and the log.
    pub identity: String,
    /// Range and step of its counts.
    pub adc: AdcDescription,
    /// Standard deviation of its values at rest, as far as is known.
    pub noise_expected: Volts,
    /// Values a second.
    pub rate: f64,
    /// How long before it was sent a value was felt: half of the time that its filter looks back.
    pub delay: Nanos,
    /// Newtons of a volt where the device itself is calibrated, as a force gauge is.
    pub newtons_per_volt: Option<f64>,
}

/// A load cell that sends values by itself, in progress. It must neither wait nor read a clock.
pub trait CellDialogue: Send {
    /// Bytes have arrived.
    fn received(&mut self, now: Nanos, bytes: &[u8]);

    /// The next bytes to be written, if any.
    fn take_line(&mut self, now: Nanos) -> Option<Vec<u8>>;

    /// The oldest value not taken yet.
    fn take_sample(&mut self) -> Option<CellSample>;

    /// What went wrong since this was last asked, in words: a restart, a value out of range. Garbled lines are counted,
    /// not told one by one.
    fn take_trouble(&mut self) -> Option<String>;

    /// Lines that were no values.
    fn garbled(&self) -> u64;

    /// Why the device counts as gone, if it does.
    fn is_dead(&self, now: Nanos) -> Option<String>;
}
