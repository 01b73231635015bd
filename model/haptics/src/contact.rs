//! The load cell as a detector of contact.

use super::Flags;
use palpate_model::units::Newtons;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Where contact begins and where it ends.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ContactSettings {
    /// Force from which on the probe touches.
    pub on: Newtons,
    /// Force below which it no longer touches; further below `on` than the cell's noise is wide, or
    /// contact comes and goes by itself.
    pub off: Newtons,
}

/// No hysteresis.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error(
    "contact from {on} on and until below {off} has no hysteresis; let it end at a smaller force than it begins"
)]
pub struct ContactThresholdError {
    /// Where it would begin.
    pub on: Newtons,
    /// Where it would end.
    pub off: Newtons,
}

impl ContactSettings {
    /// Both thresholds above the noise of a cell whose standard deviation at rest is `sigma`: contact ends
    /// at four of them, which noise of zero mean passes once in 30 000 samples, and begins eight higher,
    /// more than the noise is wide.
    #[must_use]
    pub fn above_noise(sigma: Newtons) -> Self {
        Self { on: Newtons(12.0 * sigma.0), off: Newtons(4.0 * sigma.0) }
    }

    /// Itself if contact can end.
    pub fn checked(self) -> Result<Self, ContactThresholdError> {
        let Self { on, off } = self;
        if on.is_finite() && off.is_finite() && off <= on {
            Ok(self)
        } else {
            Err(ContactThresholdError { on, off })
        }
    }
}

/// Whether the probe touches, with memory.
#[derive(Clone, Copy, Debug)]
pub struct ContactDetector {
    settings: ContactSettings,
    is_touching: bool,
    changes: u64,
}

impl ContactDetector {
    /// Not touching.
    #[must_use]
    pub fn new(settings: ContactSettings) -> Self {
        Self { settings, is_touching: false, changes: 0 }
    }

    /// Whether it touches.
    pub fn is_touching(&self) -> bool {
        self.is_touching
    }

    /// How often that has changed.
    pub fn changes(&self) -> u64 {
        self.changes
    }

    /// Takes the cell's force. What is not a number changes nothing.
    pub fn tick(&mut self, cell: Newtons) -> Flags {
        let touching = if self.is_touching {
            cell >= self.settings.off || cell.0.is_nan()
        } else {
            cell >= self.settings.on
        };
        self.changes += u64::from(touching != self.is_touching);
        self.is_touching = touching;
        Flags::CELL.when(!cell.is_finite())
    }
}
