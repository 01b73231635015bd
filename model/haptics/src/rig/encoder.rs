//! The master's encoder: lines, edges and how fast they can be counted.

use super::rack::Pinion;
use crate::{Flags, Period, SettingError, SettingRange};
use serde::{Deserialize, Serialize};

/// An incremental encoder of two channels on the motor's shaft.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Encoder {
    /// Lines per revolution.
    pub lines: u32,
    /// Edges counted per line: 1, 2 or, in full quadrature, 4.
    pub edges_per_line: u32,
    /// Fastest lines per second that its channels follow.
    pub lines_per_s_max: f64,
}

impl Default for Encoder {
    /// The source's catalogue: up to 1024 lines, times four, up to 100 kHz.
    fn default() -> Self {
        Self { lines: 1024, edges_per_line: 4, lines_per_s_max: 100e3 }
    }
}

impl Encoder {
    /// Itself if it can count.
    pub fn checked(self) -> Result<Self, SettingError> {
        const ENCODER: &str = "an encoder";
        let positive = [
            ("lines", f64::from(self.lines), ""),
            ("largest rate", self.lines_per_s_max, " lines/s"),
        ];
        SettingRange::Positive.check(ENCODER, &positive)?;
        let edges = [("edges per line", f64::from(self.edges_per_line), "")];
        SettingRange::PositiveUpTo(4.0).check(ENCODER, &edges)?;
        Ok(self)
    }

    /// Counts per revolution, the source's `N_R`.
    pub fn counts_per_rev(&self) -> f64 {
        f64::from(self.lines) * f64::from(self.edges_per_line)
    }

    /// Way of the rack per count, in mm.
    pub fn count_mm(&self, pinion: &Pinion) -> f64 {
        pinion.mm_per_rev() / self.counts_per_rev()
    }

    /// Fastest counts per second.
    pub fn counts_per_s_max(&self) -> f64 {
        self.lines_per_s_max * f64::from(self.edges_per_line)
    }
}

/// Counts what an encoder reports, and tells where it turned faster than it follows.
#[derive(Clone, Copy, Debug)]
pub struct EncoderCounter {
    per_tick_max: f64,
    last: Option<i64>,
}

impl EncoderCounter {
    /// Before its first count.
    #[must_use]
    pub fn new(encoder: &Encoder, period: Period) -> Self {
        Self { per_tick_max: encoder.counts_per_s_max() * period.seconds().0, last: None }
    }

    /// Counts moved since the last call, `elapsed` ticks ago, and whether that is more than can be counted
    /// reliably. The first call has moved nothing.
    pub fn tick(&mut self, counts: i64, elapsed: u64) -> (i64, Flags) {
        let moved = counts.saturating_sub(self.last.unwrap_or(counts));
        self.last = Some(counts);
        let most = self.per_tick_max * elapsed.max(1) as f64;
        (moved, Flags::COUNT_RATE.when(moved.unsigned_abs() as f64 > most))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_count_of_the_source_is_61_um_or_15() {
        let pinion = Pinion::default();
        let one = Encoder { edges_per_line: 1, ..Encoder::default() };
        assert!((one.count_mm(&pinion) - 0.061_359_2).abs() < 1e-7);
        assert!((Encoder::default().count_mm(&pinion) - 0.015_339_8).abs() < 1e-7);
        assert!(Encoder { lines: 0, ..one }.checked().is_err());
    }

    #[test]
    fn faster_than_its_channels_is_reported() {
        // 100 kHz of lines are 400 counts a millisecond.
        let mut counter = EncoderCounter::new(&Encoder::default(), Period::MILLISECOND);
        assert_eq!(counter.tick(1_000_000, 1), (0, Flags::NONE));
        assert_eq!(counter.tick(1_000_400, 1), (400, Flags::NONE));
        assert_eq!(counter.tick(999_999, 1), (-401, Flags::COUNT_RATE));
        assert_eq!(counter.tick(1_000_799, 2), (800, Flags::NONE));
        assert_eq!(counter.tick(i64::MIN, 1).1, Flags::COUNT_RATE);
        assert_eq!(counter.tick(i64::MAX, 1).0, i64::MAX);
    }
}
