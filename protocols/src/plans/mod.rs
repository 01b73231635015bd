//! Plans: serialisable lists of typed steps. A plan never moves anything.

pub mod hold_until;
pub mod ramp_hold;

use palpate_model::rig::Phase;
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds};
use serde::{Deserialize, Serialize};

pub use hold_until::{BodyParameter, HoldUntil};
pub use ramp_hold::RampHold;

/// A list of steps, run in order by the one interpreter in [`crate::engine`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Name, such as `ramp-hold`.
    pub name: String,
    /// Version of the plan's own definition.
    pub version: u32,
    /// The steps.
    pub steps: Vec<Step>,
}

/// One step of a plan.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "step", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Step {
    /// Check link, stop command, sample rate and signal at rest; energise the motor.
    SelfTest {
        /// How long the signal is watched.
        duration: Seconds,
    },
    /// Find the home switch, unless the axis is homed already.
    Home {
        /// Speed of the search.
        speed: MmPerS,
        /// Speed of the second touch, which defines position zero.
        touch_speed: MmPerS,
    },
    /// Average the unloaded signal.
    Tare {
        /// Whole mains cycles: a whole second is 50 or 60 of them.
        duration: Seconds,
    },
    /// Find the tissue surface in two passes and rest before the measurement.
    FindContact(FindContact),
    /// Indent to a depth at constant speed.
    Ramp {
        /// Indentation speed.
        speed: MmPerS,
        /// Depth from contact.
        depth: Depth,
    },
    /// Stay at depth while the force relaxes.
    Hold {
        /// How long, at most.
        duration: Seconds,
        /// What may end it before.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        until: Option<HoldUntil>,
    },
    /// Come back to the surface at constant speed, as carefully recorded as the way in.
    Unload {
        /// Speed of the way back.
        speed: MmPerS,
        /// Distance from contact to stop at, in mm: where the force is surely gone.
        clearance_mm: f64,
    },
    /// Leave the tissue.
    Retract {
        /// Speed of the way out.
        speed: MmPerS,
        /// Distance from contact to stop at, in mm.
        clearance_mm: f64,
    },
    /// Move by a signed distance; allowed before homing.
    Jog {
        /// Signed distance in mm, positive towards the tissue.
        distance_mm: f64,
        /// Speed.
        speed: MmPerS,
    },
}

/// Parameters of the contact search.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FindContact {
    /// Speed of the first pass.
    pub approach_speed: MmPerS,
    /// Filtered force above tare that ends the first pass.
    pub criterion: Newtons,
    /// Distance to withdraw before the second pass, in mm.
    pub retreat_mm: f64,
    /// Speed of the second pass.
    pub pass_speed: MmPerS,
    /// Filtered force that ends the second pass: enough of the onset to fit its start.
    pub pass_force: Newtons,
    /// Rest after each pass, about ten relaxation times of soft tissue.
    pub recovery: Seconds,
    /// Widest accepted standard error of the contact position, in mm.
    pub std_error_mm_max: f64,
}

impl Default for FindContact {
    /// 1.5 mm/s stays under the 2-3 mm/s above which published testers trigger late;
    /// 0.03 N (3 g) is in the range of their 0.01-5 g criteria; the second pass is ten times
    /// slower and goes on to 0.1 N, a fifth of the 0.5 N that contact finding may ever exert.
    fn default() -> Self {
        Self {
            approach_speed: MmPerS(1.5),
            criterion: Newtons(0.03),
            retreat_mm: 3.0,
            pass_speed: MmPerS(0.15),
            pass_force: Newtons(0.1),
            recovery: Seconds(10.0),
            std_error_mm_max: 0.1,
        }
    }
}

impl Step {
    /// The phase a step begins with.
    #[must_use]
    pub fn phase(&self) -> Phase {
        match self {
            Self::SelfTest { .. } => Phase::SelfTest,
            Self::Home { .. } => Phase::Home,
            Self::Tare { .. } => Phase::Tare,
            Self::FindContact(_) => Phase::Contact,
            Self::Ramp { .. } => Phase::Ramp,
            Self::Hold { .. } => Phase::Hold,
            Self::Unload { .. } => Phase::Unload,
            Self::Retract { .. } => Phase::Retract,
            Self::Jog { .. } => Phase::Jog,
        }
    }

    /// Whether the step moves the probe by a known position, which needs a homed axis.
    #[must_use]
    pub fn needs_homed_axis(&self) -> bool {
        matches!(
            self,
            Self::FindContact(_) | Self::Ramp { .. } | Self::Unload { .. } | Self::Retract { .. }
        )
    }
}
