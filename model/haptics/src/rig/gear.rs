//! From master counts to slave pulses, without drift.

use super::{Encoder, Pinion};
use crate::{Flags, Period};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Binary digits of the fraction of a ratio. With 48 a ratio is exact to 2^-49, so that after 1e10 counts
/// (150 km of rack) the slave is 2e-5 pulses from where it should be; 63 + 48 digits and a few for the ratio
/// are within an `i128`.
const FRACTION: u32 = 48;
/// Largest ratio.
const RATIO_MAX: f64 = 1e4;

/// Slave pulses per master count, as a fixed-point number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GearRatio(i128);

/// No ratio.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error(
    "{0} slave pulses per master count are not possible; choose a finite ratio other than zero, at most 10000"
)]
pub struct GearError(pub f64);

impl GearRatio {
    /// So many pulses per count; below zero they move against each other.
    pub fn of(pulses_per_count: f64) -> Result<Self, GearError> {
        let fixed = pulses_per_count * (1u64 << FRACTION) as f64;
        if pulses_per_count.abs() <= RATIO_MAX && fixed.abs() >= 1.0 {
            Ok(Self(fixed.round() as i128))
        } else {
            Err(GearError(pulses_per_count))
        }
    }

    /// One to one in way (chapter 5 of the source): `Np / Nc = pi Dp / (0.015 mm N_R)`.
    pub fn one_to_one(
        pinion: &Pinion,
        encoder: &Encoder,
        mm_per_pulse: f64,
    ) -> Result<Self, GearError> {
        Self::of(encoder.count_mm(pinion) / mm_per_pulse)
    }

    /// As a number.
    #[must_use]
    pub fn pulses_per_count(self) -> f64 {
        self.0 as f64 / (1u64 << FRACTION) as f64
    }

    /// Whole pulses at so many counts, to the nearest: of the count itself, not of its changes, so that
    /// nothing adds up.
    #[must_use]
    pub fn pulses(self, counts: i64) -> i64 {
        let half = 1i128 << (FRACTION - 1);
        let whole = (i128::from(counts) * self.0 + half) >> FRACTION;
        whole.clamp(i128::from(i64::MIN), i128::from(i64::MAX)) as i64
    }
}

/// Pulse length and rate of the slave's drive.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SlaveDrive {
    /// Way of a pulse in mm.
    pub mm_per_pulse: f64,
    /// Fastest pulses per second.
    pub pulses_per_s_max: f64,
}

impl Default for SlaveDrive {
    /// The source's slider: 0.015 mm a pulse. Its fastest rate is assumed: 40 kHz, 600 mm/s, beyond what a hand does on
    /// so short a stroke.
    fn default() -> Self {
        Self { mm_per_pulse: 0.015, pulses_per_s_max: 40e3 }
    }
}

/// Pulses of one tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GearTick {
    /// Pulses to make now.
    pub pulses: i64,
    /// Pulses made since the start.
    pub made: i64,
    /// Pulses that are due and wait for the drive.
    pub behind: i64,
    pub flags: Flags,
}

/// Turns counts into pulses, no faster than the drive takes them and losing none.
#[derive(Clone, Copy, Debug)]
pub struct Gear {
    ratio: GearRatio,
    per_tick_max: i64,
    origin: Option<i64>,
    made: i64,
}

impl Gear {
    /// At the start of both; the first count is where the slave is.
    #[must_use]
    pub fn new(ratio: GearRatio, drive: &SlaveDrive, period: Period) -> Self {
        let most = drive.pulses_per_s_max * period.seconds().0;
        Self {
            ratio,
            // A drive slower than a pulse a tick still gets there.
            per_tick_max: (most as i64).max(1),
            origin: None,
            made: 0,
        }
    }

    /// The pulses that follow a count.
    pub fn tick(&mut self, counts: i64) -> GearTick {
        let origin = *self.origin.get_or_insert(counts);
        let due = self.ratio.pulses(counts.saturating_sub(origin));
        let target = due.saturating_sub(self.made);
        let pulses = target.clamp(-self.per_tick_max, self.per_tick_max);
        self.made += pulses;
        GearTick {
            pulses,
            made: self.made,
            behind: target - pulses,
            flags: Flags::PULSE_RATE.when(pulses != target),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ratio_is_the_source_s() {
        // G1: pi 20 / (0.015 N_R).
        for (edges_per_line, target) in [(1, 4.0906), (4, 1.02265)] {
            let encoder = Encoder { edges_per_line, ..Encoder::default() };
            let ratio = GearRatio::one_to_one(&Pinion::default(), &encoder, 0.015).unwrap();
            assert!((ratio.pulses_per_count() - target).abs() < 5e-5);
            let exact = std::f64::consts::PI * 20.0 / (0.015 * encoder.counts_per_rev());
            assert!((ratio.pulses_per_count() - exact).abs() < 1e-14);
        }
        for bad in [0.0, f64::NAN, f64::INFINITY, 1e5, 1e-20] {
            assert!(GearRatio::of(bad).is_err());
        }
    }

    #[test]
    fn the_ends_of_the_numbers_are_no_end_of_the_slave() {
        let ratio = GearRatio::of(-4.09).unwrap();
        let mut gear = Gear::new(ratio, &SlaveDrive::default(), Period::MILLISECOND);
        for counts in [0, i64::MAX, i64::MIN, 0, i64::MIN, i64::MIN + 1] {
            let tick = gear.tick(counts);
            assert!(tick.pulses.abs() <= 40);
        }
        assert_eq!(ratio.pulses(i64::MAX), i64::MIN);
    }
}
