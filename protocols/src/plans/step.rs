//! What a plan can ask for, one variant a step.

use super::{HoldRate, HoldUntil};
use palpate_model::rig::{HandAction, Oscillation, Phase, RigDescription};
use palpate_model::units::{Depth, MmPerS, Newtons, Seconds};
use serde::{Deserialize, Serialize};

/// One step of a plan.

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "step", rename_all = "kebab-case")]
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
        /// End it once a parameter is known well enough.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        until: Option<HoldUntil>,
        /// End it once the force hardly changes any more.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rate: Option<HoldRate>,
    },
    /// Indent at constant speed until a force is reached.
    LoadTo(LoadTo),
    /// Keep the force constant and let the depth creep.
    HoldForce(HoldForce),
    /// Follow a sine deeper than where the probe stands.
    Sine(Sine),
    /// Go where a lead from outside says, such as the master of a master-slave system.
    Follow(Follow),
    /// Stay where the probe is and let the tissue recover.
    Rest {
        /// How long.
        duration: Seconds,
    },
    /// Ask a person for something and wait.
    Prompt(Prompt),
    /// Read the load cell under a known mass.
    Weigh(Weigh),
    /// Find the base the specimen lay on, with the specimen taken away: its thickness.
    FindBase(FindBase),
    /// Touch the home switch again and say how many pulses were missed.
    CheckHome {
        /// Speed of the search.
        speed: MmPerS,
        /// Speed of the second touch.
        touch_speed: MmPerS,
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

/// Search for the stiff base behind a specimen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FindBase {
    /// Speed of the first touch.
    pub approach_speed: MmPerS,
    /// Filtered force above tare that ends the first touch.
    pub criterion: Newtons,
    /// Distance to withdraw before the second touch, in mm.
    pub retreat_mm: f64,
    /// Speed of the second touch.
    pub pass_speed: MmPerS,
    /// Filtered force that ends the second touch.
    pub pass_force: Newtons,
}

impl FindBase {
    /// Fastest touch of a stiff base. At 0.6 mm/s an axis is stopped within 12 micrometres of feeling something: 0.4 N
    /// on a rig that gives way by 30 micrometres per newton.
    pub const SPEED_MAX: MmPerS = MmPerS(0.6);
}

impl Default for FindBase {
    /// The first touch as fast as [`FindBase::SPEED_MAX`]. The second is the slowest that a step of 0.03 mm/s allows, and
    /// ends at 0.4 N, under the half newton that finding positions may exert.
    fn default() -> Self {
        Self {
            approach_speed: Self::SPEED_MAX,
            criterion: Newtons(0.05),
            retreat_mm: 0.3,
            pass_speed: MmPerS(0.03),
            pass_force: Newtons(0.4),
        }
    }
}

/// Indentation to a force.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoadTo {
    /// Indentation speed.
    pub speed: MmPerS,
    /// Force above tare at which the probe stops.
    pub force: Newtons,
    /// Depth beyond which the step fails: the specimen is not what was expected.
    pub depth_max: Depth,
    /// From so much force before the target the probe goes at a tenth of the speed, and from a tenth of that
    /// at a hundredth; without it the probe stops from full speed, early by what stopping adds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub brake: Option<Newtons>,
}

impl LoadTo {
    /// Refuses to begin deeper than it may go, which would lead out of the tissue. A pulse of `pulse_mm` is
    /// forgiven: depths end on whole ones.
    pub fn check_from(&self, depth: Depth, pulse_mm: f64) -> Result<(), String> {
        if depth.0 <= self.depth_max.0 + pulse_mm {
            return Ok(());
        }
        Err(format!(
            "the load may go to a depth of {:.2} and the probe is at {depth:.2} already; allow a greater depth, or unload before it",
            self.depth_max
        ))
    }
}

/// Constant force.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct HoldForce {
    /// Force above tare.
    pub force: Newtons,
    /// How long.
    pub duration: Seconds,
    /// Fastest correction.
    pub speed: MmPerS,
    /// Depth beyond which the step fails.
    pub depth_max: Depth,
}

/// A sine from where the probe stands to deeper and back, beginning and ending at rest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sine {
    /// Half of the distance between the turning points, in mm.
    pub amplitude_mm: f64,
    /// Frequency in Hz.
    pub frequency_hz: f64,
    /// Whole cycles.
    pub cycles: u32,
}

impl Sine {
    /// What a rig is told: whole pulses and whole ticks.
    #[must_use]
    pub fn command(&self, rig: &RigDescription) -> Oscillation {
        Oscillation {
            amplitude_pulses: (self.amplitude_mm / rig.mm_per_pulse).round() as i64,
            period_ticks: (1.0 / (self.frequency_hz * rig.tick().0)).round() as u32,
            cycles: self.cycles,
            acceleration: rig.acceleration,
        }
    }
}

/// A slave that follows a lead, within bounds that no lead can move.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Follow {
    /// How long.
    pub duration: Seconds,
    /// Fastest move.
    pub speed: MmPerS,
    /// Depth beyond which it does not follow.
    pub depth_max: Depth,
}

/// A question to a person.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Prompt {
    /// What to do, as one sentence.
    pub message: String,
    /// How long the run waits for an answer.
    pub timeout: Seconds,
    /// What follows without one.
    #[serde(default)]
    pub on_timeout: OnTimeout,
    /// What is done by hand before the answer: a simulated rig does it then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hand: Option<HandAction>,
}

/// What follows a question that nobody answered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OnTimeout {
    /// The run stops where it is.
    #[default]
    Stop,
    /// The plan goes on.
    Continue,
}

/// One reading of a calibration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Weigh {
    /// Mass on the cell in g, the platform included.
    pub mass_g: f64,
    /// Whether the masses go up or down.
    pub is_loading: bool,
    /// Which pass through the masses, from 1.
    pub repeat: u32,
    /// When the signal counts as settled.
    pub settle: Settle,
}

/// When a signal counts as settled.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Settle {
    /// Length of the window that is looked at and averaged.
    pub window: Seconds,
    /// Longest wait.
    pub timeout: Seconds,
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
    /// What the first pass does once it has felt the tissue; without it the first pass ends there and contact
    /// is estimated from the second alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub press: Option<Press>,
}

/// The end of a first pass that goes on into the tissue to learn how it answers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Press {
    /// Filtered force above tare that ends it.
    pub force: Newtons,
    /// Time at that depth, and at the end of the second pass, while the force relaxes.
    pub dwell: Seconds,
}

impl Default for FindContact {
    /// 1.5 mm/s stays under the 2-3 mm/s above which published testers trigger late;
    /// 0.03 N (3 g) is in the range of their 0.01-5 g criteria; the second pass is eight times slower.
    ///
    /// The press to 0.42 N leaves a sixth of the 0.5 N that contact finding may ever exert to filter and
    /// brake; the 6 s after it are six relaxation times of pig stomach. Together with the pass to 0.14 N they
    /// give the contact position to 0.02 mm at 0.05 N of noise, with nothing known of the body beforehand; a
    /// pass of its own would give 0.06 mm.
    fn default() -> Self {
        Self {
            approach_speed: MmPerS(1.5),
            criterion: Newtons(0.03),
            retreat_mm: 2.0,
            pass_speed: MmPerS(0.18),
            pass_force: Newtons(0.14),
            recovery: Seconds(10.0),
            std_error_mm_max: 0.1,
            press: Some(Press::default()),
        }
    }
}

impl Default for Press {
    /// Reasons as for [`FindContact`].
    fn default() -> Self {
        Self {
            force: Newtons(0.42),
            dwell: Seconds(6.0),
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
            Self::LoadTo(_) => Phase::Ramp,
            Self::HoldForce(_) => Phase::Creep,
            Self::Sine(_) => Phase::Sine,
            Self::Follow(_) => Phase::Follow,
            Self::Rest { .. } => Phase::Rest,
            Self::Prompt(_) => Phase::Prompt,
            Self::Weigh(_) => Phase::Weigh,
            Self::FindBase(_) => Phase::Contact,
            Self::CheckHome { .. } => Phase::CheckHome,
            Self::Unload { .. } => Phase::Unload,
            Self::Retract { .. } => Phase::Retract,
            Self::Jog { .. } => Phase::Jog,
        }
    }

    /// Whether the step is the measurement itself, which indents or leaves tissue while it is recorded.
    #[must_use]
    pub fn is_measuring(&self) -> bool {
        matches!(
            self,
            Self::Ramp { .. }
                | Self::LoadTo(_)
                | Self::HoldForce(_)
                | Self::Sine(_)
                | Self::Follow(_)
                | Self::Unload { .. }
        )
    }

    /// Whether the step may move the probe towards the tissue, where it can touch. Homing and leaving cannot.
    #[must_use]
    pub fn may_touch(&self) -> bool {
        match self {
            Self::Jog { distance_mm, .. } => *distance_mm > 0.0,
            Self::FindContact(_)
            | Self::FindBase(_)
            | Self::Ramp { .. }
            | Self::LoadTo(_)
            | Self::HoldForce(_)
            | Self::Sine(_)
            | Self::Follow(_) => true,
            Self::SelfTest { .. }
            | Self::Home { .. }
            | Self::CheckHome { .. }
            | Self::Tare { .. }
            | Self::Hold { .. }
            | Self::Rest { .. }
            | Self::Prompt(_)
            | Self::Weigh(_)
            | Self::Unload { .. }
            | Self::Retract { .. } => false,
        }
    }

    /// Whether the step moves the probe by a known position, which needs a homed axis.
    #[must_use]
    pub fn needs_homed_axis(&self) -> bool {
        matches!(
            self,
            Self::FindContact(_)
                | Self::FindBase(_)
                | Self::Ramp { .. }
                | Self::LoadTo(_)
                | Self::HoldForce(_)
                | Self::Sine(_)
                | Self::Follow(_)
                | Self::Unload { .. }
                | Self::Retract { .. }
                | Self::CheckHome { .. }
        )
    }
}
