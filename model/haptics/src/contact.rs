//! The load cell as a detector of contact.

use super::Flags;
use palpate_model::units::Newtons;
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Thresholds at which contact begins and ends.
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
    "contact begins at {on} and ends below {off}, so there is no hysteresis; choose a smaller force for the end of contact than for its beginning"
)]
pub struct ContactThresholdError {
    pub on: Newtons,
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
}

impl ContactDetector {
    #[must_use]
    pub fn new(settings: ContactSettings) -> Self {
        Self { settings, is_touching: false }
    }

    pub fn is_touching(&self) -> bool {
        self.is_touching
    }

    /// Takes the cell's force. What is not a number changes nothing.
    pub fn tick(&mut self, cell: Newtons) -> Flags {
        self.is_touching = if self.is_touching {
            cell >= self.settings.off || cell.0.is_nan()
        } else {
            cell >= self.settings.on
        };
        Flags::CELL.when(!cell.is_finite())
    }
}
