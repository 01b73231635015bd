//! Ramp and hold: find the tissue, indent at constant speed, hold while the force relaxes, and, if asked,
//! unload at constant speed.

use super::{
    FindContact, Hold, HoldUntil, Home, Plan, Ramp, Retract, SelfTest, Step, Tare, Unload,
};
use palpate_model::units::{Depth, MmPerS, Seconds};
use serde::{Deserialize, Serialize};

/// Where an unloading ends, in mm before contact: five times the widest accepted standard error of the
/// contact position and well clear of the tissue that the probe draws after it.
const UNLOAD_CLEARANCE_MM: f64 = 0.5;

/// The retract after a measurement.
pub const LEAVE_TISSUE: Step = Step::Retract(Retract { speed: MmPerS(6.0), clearance_mm: 10.0 });

/// Whole mains cycles, and long enough to tell a drift of 0.04 mV/s.
pub(super) const TARE: Seconds = Seconds(4.0);

/// What comes before a measurement: self-test, home, tare and contact.
#[must_use]
pub fn approach_steps(tare: Seconds, contact: FindContact) -> Vec<Step> {
    vec![
        SelfTest { duration: Seconds(0.5) }.into(),
        Home { speed: MmPerS(9.0), touch_speed: MmPerS(0.3) }.into(),
        Tare { duration: tare }.into(),
        contact.into(),
    ]
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RampHold {
    pub speed: MmPerS,
    /// Depth from contact.
    pub depth: Depth,
    /// Time at depth, at most.
    pub hold: Seconds,
    /// What may end the hold before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<HoldUntil>,
    /// Speed of a recorded unloading; without it the probe only retracts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unload: Option<MmPerS>,
}

impl Default for RampHold {
    /// The identification run on pig stomach: 0.75 mm/s to 30 mm, 50 s at depth.
    fn default() -> Self {
        Self {
            speed: MmPerS(0.75),
            depth: Depth(30.0),
            hold: Seconds(50.0),
            until: None,
            unload: None,
        }
    }
}

impl RampHold {
    pub fn plan(&self) -> Plan {
        let mut steps = approach_steps(TARE, FindContact::default());
        steps.extend([
            Ramp { speed: self.speed, depth: self.depth }.into(),
            Hold { until: self.until, ..Hold::of(self.hold) }.into(),
        ]);
        steps.extend(
            self.unload
                .map(|speed| Step::Unload(Unload { speed, clearance_mm: UNLOAD_CLEARANCE_MM })),
        );
        steps.push(LEAVE_TISSUE);
        Plan::of("ramp-hold", 1, steps)
    }
}
