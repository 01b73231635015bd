//! How a Galil controller is wired to slide and load cell, which it cannot report itself.

use palpate_model::units::{MmPerS, MmPerS2, Position, Volts};

/// Pulses of the drive: the argument of `MT` (Galil application note 2446).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotorType {
    ActiveLow = 2,
    ActiveHigh = -2,
}

/// Range of an analog input: the second argument of `AQ` (RIO-47xxx user manual, page 38).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AnalogRange {
    Bipolar5 = 1,
    Bipolar10 = 2,
    Unipolar5 = 3,
    Unipolar10 = 4,
}

impl AnalogRange {
    #[must_use]
    pub const fn span(self) -> Volts {
        Volts(match self {
            Self::Bipolar5 | Self::Unipolar10 => 10.0,
            Self::Bipolar10 => 20.0,
            Self::Unipolar5 => 5.0,
        })
    }

    /// Volts of an element that `_AF` recorded: 16 bits whatever the converter has, with a sign where the range has two
    /// (DMC-1700/1800 user manual, page 77; `GalilController.cpp` of EPICS scales them so).
    #[must_use]
    pub fn volts_of_recorded(self, counts: f64) -> f64 {
        counts * self.span().0 / 65_536.0
    }

    #[must_use]
    pub const fn is_bipolar(self) -> bool {
        matches!(self, Self::Bipolar5 | Self::Bipolar10)
    }
}

/// The level of a switch's input while the switch is closed: the argument of `CN`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SwitchLevel {
    /// The switch pulls its input low, the usual wiring.
    ActiveLow = -1,
    ActiveHigh = 1,
}

impl SwitchLevel {
    /// Whether a switch with this level at its input is closed.
    #[must_use]
    pub const fn is_closed(self, is_high: bool) -> bool {
        matches!(self, Self::ActiveHigh) == is_high
    }
}

/// Settings of a slide driven by a Galil controller.
#[derive(Clone, Debug, PartialEq)]
pub struct GalilSettings {
    pub name: String,
    /// Axis the slide is on, `A` to `H`.
    pub axis: char,
    /// Analog input of the load cell, from 1.
    pub input: u8,
    /// Travel of one pulse in mm.
    pub mm_per_pulse: f64,
    /// Whether the controller's positive counts lead away from the tissue.
    pub is_reversed: bool,
    /// End of the travel, from home.
    pub travel: Position,
    pub speed_max: MmPerS,
    pub acceleration: MmPerS2,
    /// Longest way of the probe without a sample.
    pub unseen: Position,
    /// Polarity of the drive's pulses.
    pub motor_type: MotorType,
    pub limits: SwitchLevel,
    pub home: SwitchLevel,
    /// Range of the load cell's input.
    pub range: AnalogRange,
    /// Bits of the converter: 12, or 16 as an option of the controller.
    pub bits: u8,
    /// White noise of the signal at rest, standard deviation.
    pub noise: Volts,
    /// The anti-aliasing filter before the converter, in words.
    pub filter: Option<String>,
    /// Serial number that the controller must have; any without.
    pub serial_number: Option<u64>,
    /// Whether a program on the controller may stop the axis when palpate falls silent. It takes the place of a program
    /// that is there, but for one in permanent memory.
    pub has_watchdog: bool,
    pub sampling: Sampling,
    /// Period of the controller's samples as `TM` counts it, in its microseconds; left alone without.
    pub sample_us: Option<u16>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sampling {
    /// Recorded where that gives no old samples, else asked for.
    #[default]
    Auto,
    Poll,
    Record,
}

impl GalilSettings {
    /// 1 where the controller counts as palpate does, towards the tissue, else -1.
    pub const fn sign(&self) -> i64 {
        if self.is_reversed { -1 } else { 1 }
    }

    /// Volts of one count.
    pub fn volts_per_count(&self) -> f64 {
        self.range.span().0 / f64::from(1_u32 << self.bits.min(24))
    }

    /// Counts per second of a speed in mm/s, or per second squared of an acceleration in mm/s2. Rounding forgives the
    /// decimals of millimetres; the controller rounds down to its quantum.
    pub fn counts(&self, mm: f64) -> i64 {
        (mm / self.mm_per_pulse).round() as i64
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// The slide and cell of the source thesis on axis A and input 1.
    pub fn thesis() -> GalilSettings {
        GalilSettings {
            name: "bench".into(),
            axis: 'A',
            input: 1,
            mm_per_pulse: 0.015,
            is_reversed: false,
            travel: Position(150.0),
            speed_max: MmPerS(20.0),
            acceleration: MmPerS2(61.44),
            unseen: palpate_model::rig::RigDescription::UNSEEN_USUAL,
            motor_type: MotorType::ActiveLow,
            limits: SwitchLevel::ActiveLow,
            home: SwitchLevel::ActiveLow,
            range: AnalogRange::Bipolar10,
            bits: 16,
            noise: Volts(0.001),
            filter: None,
            serial_number: None,
            has_watchdog: true,
            sampling: Sampling::Poll,
            sample_us: None,
        }
    }

    #[test]
    fn counts_are_those_of_the_drive() {
        let thesis = thesis();
        assert_eq!(thesis.counts(0.75), 50);
        assert_eq!(thesis.counts(0.9), 60);
        assert_eq!(thesis.counts(61.44), 4096);
        assert_eq!(thesis.volts_per_count(), 20.0 / 65_536.0);
    }

    #[test]
    fn a_switch_is_closed_at_its_level() {
        assert!(SwitchLevel::ActiveLow.is_closed(false) && !SwitchLevel::ActiveLow.is_closed(true));
        assert!(
            SwitchLevel::ActiveHigh.is_closed(true) && !SwitchLevel::ActiveHigh.is_closed(false)
        );
    }
}
