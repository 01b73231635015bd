//! Time as an input: integer nanoseconds since the session started, handed in by the caller.

use crate::units::Seconds;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::Add;

/// Nanoseconds since the session started, on the host's monotonic clock.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(transparent)]
pub struct Nanos(pub u64);

impl Nanos {
    pub const ZERO: Self = Self(0);

    /// Whole milliseconds as nanoseconds.
    #[must_use]
    pub const fn from_millis(millis: u64) -> Self {
        Self(millis * 1_000_000)
    }

    /// Seconds, rounded to the nearest nanosecond; negative and non-finite spans become zero.
    #[must_use]
    pub fn from_seconds(span: Seconds) -> Self {
        if span.0 > 0.0 && span.0.is_finite() {
            Self((span.0 * 1e9).round() as u64)
        } else {
            Self::ZERO
        }
    }

    /// This time in seconds.
    #[must_use]
    pub fn seconds(self) -> Seconds {
        Seconds(self.0 as f64 * 1e-9)
    }

    /// Time passed since `earlier`, zero if `earlier` is later.
    #[must_use]
    pub const fn since(self, earlier: Self) -> Self {
        Self(self.0.saturating_sub(earlier.0))
    }
}

impl Add for Nanos {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}

impl fmt::Display for Nanos {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:.3} s", self.seconds().0)
    }
}
