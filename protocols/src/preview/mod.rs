//! Dry run of a plan: limits, duration, force band and storage, before anything moves.

mod checks;
mod expected;
mod moves;
mod walk;

pub use expected::OutlinePoint;

pub(crate) use moves::Reach;
pub(crate) use walk::{CONTACT_EXPECTED_SHARE, DurationEstimate, SETTLE_SECS, Walk};

use crate::plans::MonitorSource;
use crate::plans::Plan;
use crate::steps::Preconditions;
use expected::ExpectedSpecimen;
use palpate_model::calibration::CalibrationCurve;
use palpate_model::rig::{Limits, Phase, RigDescription};
use palpate_model::units::{Newtons, Seconds};
use serde::{Deserialize, Serialize};

/// Bytes that one sample takes in the session log, raw and derived: 16 measured on the lab profile,
/// 23 on the ideal one, whose noise fills every digit; rounded up.
const BYTES_PER_SAMPLE: f64 = 30.0;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepPreview {
    pub phase: Phase,
    pub expected: Seconds,
    /// Longest duration.
    pub longest: Seconds,
    /// Whether the duration is known to the sample: moves and waits are, searches are not.
    pub is_exact: bool,
    /// Why this step cannot run on this rig; empty if it can.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub refusals: Vec<String>,
}

/// What a plan will do, as far as it can be known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Preview {
    pub steps: Vec<StepPreview>,
    pub expected: Seconds,
    /// Longest duration: tissue at the end of the travel, axis at the far end before homing.
    pub longest: Seconds,
    /// Lowest and highest peak force expected over specimens.
    pub force_band: [Newtons; 2],
    pub storage_bytes: u64,
    /// Why the plan cannot run on this rig; empty if it can.
    pub refusals: Vec<String>,
    /// What the operator must acknowledge before the start; empty if nothing.
    pub acknowledgements: Vec<String>,
    /// What the operator should know; needs no answer.
    pub notes: Vec<String>,
}

impl Preview {
    /// Whether the plan may start, or the reason why not, in words.
    pub fn check_start(&self, is_acknowledged: bool) -> Result<(), String> {
        match (self.refusals.first(), self.acknowledgements.first()) {
            (Some(refusal), _) => Err(refusal.clone()),
            (None, Some(warning)) if !is_acknowledged => Err(warning.clone()),
            _ => Ok(()),
        }
    }
}

/// Previews a plan on a rig. `is_homed` tells whether the axis needs homing.
#[must_use]
pub fn preview(
    plan: &Plan,
    rig: &RigDescription,
    limits: &Limits,
    curve: &CalibrationCurve,
    is_homed: bool,
) -> Preview {
    walk(plan, rig, limits, curve, is_homed, false).0
}

/// Depth and force over time as the thesis body would answer, for a picture of the plan: a point at every turn
/// and a few between.
#[must_use]
pub fn outline(
    plan: &Plan,
    rig: &RigDescription,
    limits: &Limits,
    curve: &CalibrationCurve,
) -> Vec<OutlinePoint> {
    walk(plan, rig, limits, curve, false, true).1
}

fn walk(
    plan: &Plan,
    rig: &RigDescription,
    limits: &Limits,
    curve: &CalibrationCurve,
    is_homed: bool,
    has_outline: bool,
) -> (Preview, Vec<OutlinePoint>) {
    let unused_limits = plan.limits.unused(limits);
    let limits = plan.limits.tighten(*limits);
    let mut walk = Walk {
        rig,
        limits: &limits,
        refusals: Vec::new(),
        notes: Vec::new(),
        expected: ExpectedSpecimen::new(has_outline),
        known: Preconditions { home: is_homed, ..Preconditions::default() },
        phase: Phase::Idle,
        reach: Reach::at(0.0),
    };
    let steps: Vec<StepPreview> =
        plan.steps.iter().enumerate().map(|(index, planned)| walk.step(index, planned)).collect();
    for monitor in &plan.monitors {
        walk.refusals.extend(monitor.check().err());
        if let MonitorSource::Channel(name) = &monitor.source
            && rig.sensors.channel_number(name).is_none()
        {
            walk.refuse(format!("rig {} has no sensor called {name}", rig.name));
        }
    }
    let (mut refusals, mut notes) = (walk.refusals, walk.notes);
    if plan.steps.is_empty() {
        refusals.push("the plan has no steps; add at least one".into());
    }
    let total =
        |of: fn(&StepPreview) -> Seconds| Seconds(steps.iter().map(|step| of(step).0).sum());
    let (expected, longest) = (total(|step| step.expected), total(|step| step.longest));
    let force_band =
        if refusals.is_empty() { walk.expected.force_band() } else { [Newtons(0.0); 2] };
    let (_, calibrated_max) = curve.force_range();
    let mut acknowledgements = Vec::new();
    if force_band[1] > calibrated_max {
        acknowledgements.push(format!(
            "forces of {:.1} to {:.1} are expected, but the load cell is calibrated only up to {calibrated_max:.1}; larger forces are extrapolated",
            force_band[0], force_band[1]
        ));
    }
    notes.extend(unused_limits);
    if force_band[1] > limits.force_max {
        notes.push(format!(
            "the force on a stiff specimen may reach {:.1}, but the interlock stops the run at {:.1}",
            force_band[1], limits.force_max
        ));
    }
    let preview = Preview {
        storage_bytes: (longest.0 / rig.sample_interval().0 * BYTES_PER_SAMPLE) as u64,
        steps,
        expected,
        longest,
        force_band,
        refusals,
        acknowledgements,
        notes,
    };
    (preview, walk.expected.outline)
}
