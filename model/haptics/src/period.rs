//! The length of a tick.

use palpate_model::time::Nanos;
use palpate_model::units::Seconds;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Whole nanoseconds from tick to tick, so that time is a product of integers and never a sum of
/// rounded numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "u64", into = "u64")]
pub struct Period(u64);

/// No tick length.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum PeriodError {
    /// Beyond what a loop is made for.
    #[error("a haptic loop cannot run at {0} Hz; choose from 250 Hz to 10000 Hz")]
    Rate(f64),
    /// Zero or too long for the numbers.
    #[error("a tick of {0} ns is not possible; choose from 1 ns to 1 s")]
    Nanos(u64),
}

impl Period {
    /// A millisecond.
    pub const MILLISECOND: Self = Self(1_000_000);
    /// Slowest and fastest loop offered, in Hz: below, a hand feels steps; above, one tick of an
    /// ordinary computer's scheduler is late by many.
    pub const RATES_HZ: [f64; 2] = [250.0, 10_000.0];

    /// The tick of a loop that is played, to the nearest nanosecond.
    pub fn of_rate(hz: f64) -> Result<Self, PeriodError> {
        let [slowest, fastest] = Self::RATES_HZ;
        if hz >= slowest && hz <= fastest {
            Ok(Self((1e9 / hz).round() as u64))
        } else {
            Err(PeriodError::Rate(hz))
        }
    }

    /// Any tick from 1 ns to 1 s, as simulations may want.
    pub fn of_nanos(nanos: u64) -> Result<Self, PeriodError> {
        if (1..=1_000_000_000).contains(&nanos) {
            Ok(Self(nanos))
        } else {
            Err(PeriodError::Nanos(nanos))
        }
    }

    #[must_use]
    pub fn nanos(self) -> u64 {
        self.0
    }

    #[must_use]
    pub fn seconds(self) -> Seconds {
        Seconds(self.0 as f64 * 1e-9)
    }

    /// In milliseconds, as slew limits have it.
    #[must_use]
    pub fn millis(self) -> f64 {
        self.0 as f64 * 1e-6
    }

    /// In ticks a second.
    #[must_use]
    pub fn hz(self) -> f64 {
        1e9 / self.0 as f64
    }

    /// The time of a tick, from the first, which is tick 0.
    #[must_use]
    pub fn time_of(self, tick: u64) -> Nanos {
        Nanos(tick.saturating_mul(self.0))
    }

    /// Ticks in a span, rounded to the nearest and at least one; spans without a length give one.
    #[must_use]
    pub fn ticks_in(self, span: Seconds) -> u64 {
        // A cast of NaN is 0.
        ((span.0 * 1e9 / self.0 as f64).round() as u64).max(1)
    }
}

impl TryFrom<u64> for Period {
    type Error = PeriodError;
    fn try_from(nanos: u64) -> Result<Self, PeriodError> {
        Self::of_nanos(nanos)
    }
}

impl From<Period> for u64 {
    fn from(period: Period) -> Self {
        period.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_is_a_product_of_integers() {
        // 3000 Hz has no whole number of ns; a day of its ticks is still exactly that many periods.
        let period = Period::of_rate(3000.0).unwrap();
        assert_eq!(period.nanos(), 333_333);
        let day = 259_200_000;
        assert_eq!(period.time_of(day), Nanos(day * 333_333));
        assert_eq!(period.ticks_in(Seconds(0.1)), 300);
        assert_eq!(period.ticks_in(Seconds(f64::NAN)), 1);
        // Beyond the numbers time stands still and does not start again.
        assert_eq!(period.time_of(u64::MAX), Nanos(u64::MAX));
    }

    #[test]
    fn rates_beyond_what_is_offered_are_refused() {
        for hz in [0.0, -1.0, 249.0, 10_001.0, f64::NAN, f64::INFINITY] {
            assert!(Period::of_rate(hz).is_err(), "{hz}");
        }
        for hz in Period::RATES_HZ {
            assert!((Period::of_rate(hz).unwrap().hz() - hz).abs() < 1e-9);
        }
        assert!(Period::of_nanos(0).is_err() && Period::of_nanos(u64::MAX).is_err());
    }
}
