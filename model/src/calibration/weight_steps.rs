//! A weight on the load cell and the voltage it gives.

use crate::units::{Newtons, Volts};
use serde::{Deserialize, Serialize};

/// Standard acceleration of gravity in m/s^2 (3rd General Conference on Weights and Measures, 1901).
pub const STANDARD_GRAVITY: f64 = 9.80665;

/// One calibration point: a mass resting on the load cell and the signal it gives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WeightStep {
    /// Total mass on the cell in grams, the platform included.
    pub mass_g: f64,
    /// Signal at that mass.
    pub volts: Volts,
}

impl WeightStep {
    /// The weight of the mass in N under [`STANDARD_GRAVITY`].
    pub fn newtons(&self) -> Newtons {
        newtons_of(self.mass_g)
    }
}

/// The weight of a mass in g under [`STANDARD_GRAVITY`].
#[must_use]
pub fn newtons_of(mass_g: f64) -> Newtons {
    Newtons(mass_g * 1e-3 * STANDARD_GRAVITY)
}
