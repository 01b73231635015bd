//! Plans: serialisable lists of typed steps. A plan never moves anything.

pub mod hold_rate;
pub mod hold_until;
pub mod monitor;
pub mod ramp_hold;
mod slave;

use palpate_model::rig::Limits;
use palpate_model::units::{Depth, Newtons, Position};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt::Display;

pub use crate::steps::*;
pub use hold_rate::HoldRate;
pub use hold_until::{BodyParameter, HoldUntil};
pub use monitor::{Monitor, MonitorAction, MonitorSource, ThresholdSide};
pub use ramp_hold::{LEAVE_TISSUE, RampHold, approach_steps};

/// A list of steps, run in order by the one interpreter in [`crate::engine`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Name, such as `ramp-hold`.
    pub name: String,
    /// Version of the plan's own definition.
    pub version: u32,
    pub steps: Vec<PlannedStep>,
    /// What is watched beside the interlocks.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub monitors: Vec<Monitor>,
    /// Limits tighter than the rig's.
    #[serde(default, skip_serializing_if = "PlanLimits::is_none")]
    pub limits: PlanLimits,
    /// The file it was written out from; none for a plan made by the program.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<PlanSource>,
}

/// Which text a plan was written out from, and with which values.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanSource {
    /// CRC-32 of the text, eight hexadecimal digits.
    pub crc32: String,
    pub values: BTreeMap<String, String>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlannedStep {
    #[serde(flatten)]
    pub step: Step,
    /// Which repeat of the measurement it belongs to, from 1; 0 where nothing is repeated.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub cycle: u32,
    /// Name of the checkpoint behind this step: where the run may pause without spoiling data.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub checkpoint: Option<String>,
    #[serde(default, skip_serializing_if = "OnFailure::is_default")]
    pub on_failure: OnFailure,
}

/// What follows a step that cannot be done. Interlocks always stop the run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OnFailure {
    #[default]
    Abort,
    /// Return to the start of the step and repeat it, so many times; then as [`OnFailure::Abort`].
    Retry(u32),
    /// Written down, and the plan goes on with the next step.
    Skip,
}

/// Limits that a plan adds to the rig's own. They can only be tighter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlanLimits {
    /// Highest force above tare.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_max: Option<Newtons>,
    /// Furthest position from home.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub travel_max: Option<Position>,
}

impl PlanLimits {
    /// Whether there is none.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// A sentence for each limit without effect: limits can only be tighter than the rig's.
    pub fn unused(&self, rig: &Limits) -> Vec<String> {
        let sentence = |name, own: &dyn Display, rigs: &dyn Display| {
            format!(
                "{name} = {own} in [limits] has no effect, because the rig already stops at {rigs}; give less than {rigs}, or remove {name}"
            )
        };
        let force = self.force_max.filter(|own| *own >= rig.force_max);
        let travel = self.travel_max.filter(|own| *own >= rig.travel_max);
        let force = force.map(|own| sentence("force_max", &own, &rig.force_max));
        let travel = travel.map(|own| sentence("travel_max", &own, &rig.travel_max));
        force.into_iter().chain(travel).collect()
    }

    /// The rig's limits, made tighter where this plan asks for it.
    pub fn tighten(&self, mut limits: Limits) -> Limits {
        if let Some(force) = self.force_max {
            limits.force_max = Newtons(limits.force_max.0.min(force.0));
        }
        if let Some(end) = self.travel_max {
            limits.travel_max = Position(limits.travel_max.0.min(end.0));
        }
        limits
    }
}

impl OnFailure {
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands a reference")]
fn is_zero(cycle: &u32) -> bool {
    *cycle == 0
}

impl From<Step> for PlannedStep {
    fn from(step: Step) -> Self {
        Self { step, cycle: 0, checkpoint: None, on_failure: OnFailure::default() }
    }
}

impl Plan {
    /// A plan of steps with nothing repeated, watched or named.
    #[must_use]
    pub fn of(name: &str, version: u32, steps: Vec<Step>) -> Self {
        Self {
            name: name.into(),
            version,
            steps: steps.into_iter().map(PlannedStep::from).collect(),
            monitors: Vec::new(),
            limits: PlanLimits::default(),
            source: None,
        }
    }

    /// The depths that its steps that follow a master may reach.
    pub fn follow_depths(&self) -> impl Iterator<Item = Depth> {
        self.steps.iter().filter_map(|planned| match &planned.step {
            Step::Follow(follow) => Some(follow.depth_max),
            _ => None,
        })
    }

    /// Whether it has a step that follows a master.
    pub fn needs_lead(&self) -> bool {
        self.follow_depths().next().is_some()
    }

    /// Why a run that has no master cannot make it; none where it needs none.
    pub fn refusal_without_master(&self) -> Option<String> {
        self.needs_lead().then(|| {
            format!(
                "the step 'follow' of {} needs a master, and this run has none; run the protocol with 'palpate haptics slave', which supplies the master",
                self.name
            )
        })
    }

    /// The checkpoints ahead of a step: index of the step before each, and its name.
    pub fn checkpoints_from(&self, step_index: usize) -> impl Iterator<Item = (usize, &str)> {
        let steps = self.steps.iter().enumerate().skip(step_index);
        steps.filter_map(|(index, planned)| Some((index, planned.checkpoint.as_deref()?)))
    }
}
