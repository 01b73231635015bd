//! Machine and date of a measurement, and whether it still holds here and now.

use super::TradeCurves;
use serde::{Deserialize, Serialize};

/// Curves older than this are stale: compilers, kernels and microcode change over a season.
pub const STALE_DAYS: f64 = 90.0;

/// A machine as far as speed depends on it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// Processor, by its own name where the system tells it, else its architecture.
    pub cpu: String,
    pub os: String,
    pub cores: usize,
    /// How palpate was built: `debug` or `release`.
    pub profile: String,
}

impl Machine {
    pub fn words(&self) -> String {
        let Self { cpu, os, cores, profile } = self;
        format!("{cpu}, {cores} logical cores, {os}, {profile} build")
    }

    /// A name for a file: letters, digits and dashes.
    pub fn file_stem(&self) -> String {
        let words = self.words().to_lowercase();
        let parts = words.split(|c: char| !c.is_ascii_alphanumeric());
        parts.filter(|part| !part.is_empty()).collect::<Vec<_>>().join("-")
    }
}

impl TradeCurves {
    /// Reasons not to plan from these curves here and now, a sentence each: measured on
    /// another machine, by another build or version, too long ago (`age_days`), or in haste.
    pub fn doubts(&self, here: &Machine, version: &str, age_days: f64) -> Vec<String> {
        let mut doubts = Vec::new();
        let there = &self.machine;
        if (&there.cpu, &there.os, there.cores) != (&here.cpu, &here.os, here.cores) {
            doubts.push(format!(
                "these curves were measured on another computer ({}), but this computer is {}; measure again here",
                there.words(),
                here.words()
            ));
        } else if there.profile != here.profile {
            doubts.push(format!(
                "these curves were measured with a {} build of palpate, but this is a {} build; measure them again",
                there.profile, here.profile
            ));
        }
        if self.version != version {
            doubts.push(format!(
                "these curves are stale: they are from palpate {}, but this is palpate {version}; measure again",
                self.version
            ));
        } else if age_days > STALE_DAYS {
            doubts.push(format!(
                "these curves are stale: they were measured {age_days:.0} days ago; measure again"
            ));
        } else if age_days < -1.0 {
            // A day allows for a clock that was set.
            doubts.push(
                "these curves are dated in the future; check the clock and measure again".into(),
            );
        }
        if self.quick {
            doubts.push(
                "these curves were measured quickly, so they have few rows and rough times".into(),
            );
        }
        doubts
    }
}
