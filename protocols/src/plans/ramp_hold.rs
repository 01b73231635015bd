//! Ramp and hold: find the tissue, indent at constant speed, hold while the force relaxes.

use super::{FindContact, HoldUntil, Plan, Step};
use palpate_model::units::{Depth, MmPerS, Seconds};
use serde::{Deserialize, Serialize};

/// What a technician chooses for a ramp and hold.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RampHold {
    /// Indentation speed.
    pub speed: MmPerS,
    /// Depth from contact.
    pub depth: Depth,
    /// Time at depth, at most.
    pub hold: Seconds,
    /// What may end the hold before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<HoldUntil>,
}

impl Default for RampHold {
    /// The identification run on pig stomach: 0.75 mm/s to 30 mm, 50 s at depth.
    fn default() -> Self {
        Self {
            speed: MmPerS(0.75),
            depth: Depth(30.0),
            hold: Seconds(50.0),
            until: None,
        }
    }
}

impl RampHold {
    /// The plan, from self-test to retract.
    #[must_use]
    pub fn plan(&self) -> Plan {
        Plan {
            name: "ramp-hold".into(),
            version: 1,
            steps: vec![
                Step::SelfTest {
                    duration: Seconds(0.5),
                },
                Step::Home {
                    speed: MmPerS(9.0),
                    touch_speed: MmPerS(0.3),
                },
                Step::Tare {
                    duration: Seconds(1.0),
                },
                Step::FindContact(FindContact::default()),
                Step::Ramp {
                    speed: self.speed,
                    depth: self.depth,
                },
                Step::Hold {
                    duration: self.hold,
                    until: self.until,
                },
                Step::Retract {
                    speed: MmPerS(6.0),
                    clearance_mm: 10.0,
                },
            ],
        }
    }
}
