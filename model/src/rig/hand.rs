//! Actions of a person at the rig between motions, for a simulated rig.

use crate::calibration::STANDARD_GRAVITY;
use crate::units::Newtons;
use serde::{Deserialize, Serialize};

/// One thing done by hand while the axis rests.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "by_hand", rename_all = "snake_case")]
pub enum HandAction {
    /// This much mass, and no other, now rests on the load cell; 0 is a free cell.
    LoadCell {
        /// All of it, platform included, in g.
        mass_g: f64,
    },
    /// A fresh specimen is clipped in.
    Mount {
        /// Which: equal numbers are equal specimens, and 0 is the one a rig begins with.
        specimen: u64,
    },
    Unmount,
}

impl HandAction {
    /// The weight of a mass in g.
    #[must_use]
    pub fn weight(mass_g: f64) -> Newtons {
        Newtons(mass_g * 1e-3 * STANDARD_GRAVITY)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_heaviest_weight_of_the_thesis_is_its_force() {
        assert!((HandAction::weight(1040.0).0 - 10.198_916).abs() < 1e-12);
    }
}
