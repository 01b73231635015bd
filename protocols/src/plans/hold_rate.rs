//! A rule that ends a hold early: when the force hardly changes any more.

use palpate_model::units::Seconds;
use serde::{Deserialize, Serialize};
use std::fmt;

/// End the hold once the force's slope over a window is small. The planned duration stays the longest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HoldRate {
    /// Largest slope either way, in N/s.
    pub below_n_per_s: f64,
    pub over: Seconds,
}

impl HoldRate {
    pub fn check(&self) -> Result<(), String> {
        if !(self.below_n_per_s > 0.0 && self.below_n_per_s.is_finite()) {
            return Err(format!(
                "a hold cannot end at a slope of {} N/s; give a slope above 0",
                self.below_n_per_s
            ));
        }
        // 0.2 s holds ten points of the fit at 20 ms; an hour is longer than any published window.
        if !(0.2..=3600.0).contains(&self.over.0) {
            return Err(format!(
                "a slope cannot be measured over {}; give a window of 0.2 to 3600 s",
                self.over
            ));
        }
        Ok(())
    }
}

impl fmt::Display for HoldRate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "the force changes by less than {} N/min over {:.0}",
            60.0 * self.below_n_per_s,
            self.over
        )
    }
}
