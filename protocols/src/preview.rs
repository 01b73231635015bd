//! Dry run of a plan: limits, duration, force band and storage, before anything moves.

use crate::plans::{FindContact, HoldUntil, Plan, Step};
use palpate_model::calibration::Curve;
use palpate_model::rig::{Limits, Phase, Profile, RigDescription};
use palpate_model::units::{Depth, MmPerS, Newtons, Position, Seconds};
use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
use serde::{Deserialize, Serialize};

/// Softest and stiffest specimen expected, as multiples of the thesis body. Specimens of one
/// organ differ in level by tens of percent; the band must not be narrower than that.
const STIFFNESS_BAND: [f64; 2] = [0.7, 1.35];

/// Step of the force prediction. At 1.5 mm/s the depth is off by at most 15 micrometres between
/// steps, and the exact step has no error of its own.
const PREDICTION_STEP: Seconds = Seconds(0.02);

/// Bytes that one sample takes in the session log, raw and derived: 16 measured on the lab profile,
/// 23 on the ideal one, whose noise fills every digit; rounded up.
const BYTES_PER_SAMPLE: f64 = 30.0;

/// Where contact is expected when nothing is known: in the first half of the travel.
const CONTACT_EXPECTED_SHARE: f64 = 0.3;

/// One step of the plan as it is expected to go.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepPreview {
    /// Phase name.
    pub phase: Phase,
    /// Expected duration.
    pub expected: Seconds,
    /// Longest duration.
    pub longest: Seconds,
}

/// What a plan will do, as far as it can be known.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Preview {
    /// Step by step.
    pub steps: Vec<StepPreview>,
    /// Expected duration of the whole run.
    pub expected: Seconds,
    /// Longest duration: tissue at the end of the travel, axis at the far end before homing.
    pub longest: Seconds,
    /// Lowest and highest peak force expected over specimens.
    pub force_band: [Newtons; 2],
    /// Bytes of disk the session may take.
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
    pub fn verdict(&self, is_acknowledged: bool) -> Result<(), String> {
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
    curve: &Curve,
    is_homed: bool,
) -> Preview {
    let mut walk = Walk {
        rig,
        limits,
        refusals: Vec::new(),
        notes: Vec::new(),
        depth_now: 0.0,
        is_homed,
    };
    let steps: Vec<StepPreview> = plan.steps.iter().map(|step| walk.step(step)).collect();
    let (mut refusals, mut notes) = (walk.refusals, walk.notes);
    if plan.steps.is_empty() {
        refusals.push("the plan has no steps".into());
    }
    let total =
        |of: fn(&StepPreview) -> Seconds| Seconds(steps.iter().map(|step| of(step).0).sum());
    let (expected, longest) = (total(|step| step.expected), total(|step| step.longest));
    let force_band = if refusals.is_empty() {
        force_band(plan)
    } else {
        [Newtons(0.0); 2]
    };
    let (_, calibrated_max) = curve.force_range();
    let mut acknowledgements = Vec::new();
    if force_band[1] > calibrated_max {
        acknowledgements.push(format!(
            "forces of {:.1} to {:.1} are expected, but the load cell is calibrated only up to {calibrated_max:.1}; beyond it force is extrapolated",
            force_band[0], force_band[1]
        ));
    }
    if force_band[1] > limits.force_max {
        notes.push(format!(
            "a stiff specimen may reach {:.1}; the interlock stops the run at {:.1}",
            force_band[1], limits.force_max
        ));
    }
    Preview {
        storage_bytes: (longest.0 / rig.tick().0 * BYTES_PER_SAMPLE) as u64,
        steps,
        expected,
        longest,
        force_band,
        refusals,
        acknowledgements,
        notes,
    }
}

struct Walk<'a> {
    rig: &'a RigDescription,
    limits: &'a Limits,
    refusals: Vec<String>,
    notes: Vec<String>,
    /// Depth the plan has reached, in mm from contact.
    depth_now: f64,
    is_homed: bool,
}

impl Walk<'_> {
    fn step(&mut self, step: &Step) -> StepPreview {
        let travel = self.limits.travel_max.0;
        let phase = step.phase();
        let (expected, longest) = match *step {
            Step::SelfTest { duration } | Step::Tare { duration } | Step::Hold { duration, .. } => {
                self.check_span(phase, duration);
                if let Step::Hold {
                    until: Some(rule), ..
                } = step
                {
                    self.check_rule(phase, rule, duration);
                }
                (duration.0, duration.0)
            }
            Step::Home { speed, touch_speed } => {
                self.check_speed(phase, speed);
                self.check_speed(phase, touch_speed);
                // Back off 2 mm and touch again, plus the search over up to the whole travel.
                let touch = self.move_secs(2.0, speed) + self.move_secs(2.0, touch_speed);
                if self.is_homed {
                    (0.0, 0.0)
                } else {
                    (
                        self.move_secs(0.1 * travel, speed) + touch,
                        self.move_secs(travel, speed) + touch,
                    )
                }
            }
            Step::FindContact(search) => self.contact(phase, &search),
            Step::Ramp { speed, depth } => {
                self.check_speed(phase, speed);
                self.check_depth(depth);
                let distance = depth.0 - self.depth_now;
                self.depth_now = depth.0;
                let secs = self.move_secs(distance, speed);
                (secs, secs)
            }
            Step::Unload {
                speed,
                clearance_mm,
            }
            | Step::Retract {
                speed,
                clearance_mm,
            } => {
                self.check_sizes(phase, &[clearance_mm]);
                self.check_speed(phase, speed);
                let secs = self.move_secs(self.depth_now + clearance_mm, speed);
                self.depth_now = -clearance_mm;
                (secs, secs)
            }
            Step::Jog { distance_mm, speed } => {
                self.check_sizes(phase, &[distance_mm]);
                self.check_speed(phase, speed);
                let secs = self.move_secs(distance_mm, speed);
                (secs, secs)
            }
        };
        StepPreview {
            phase,
            expected: Seconds(expected),
            longest: Seconds(longest),
        }
    }

    fn contact(&mut self, phase: Phase, search: &FindContact) -> (f64, f64) {
        self.check_sizes(
            phase,
            &[
                search.retreat_mm,
                search.criterion.0,
                search.pass_force.0,
                search.std_error_mm_max,
            ],
        );
        self.check_span(phase, search.recovery);
        self.check_speed(phase, search.approach_speed);
        self.check_speed(phase, search.pass_speed);
        let travel = self.limits.travel_max.0;
        let approach = |distance: f64| self.move_secs(distance, search.approach_speed);
        let rest = 2.0 * search.recovery.0;
        let slow = self.move_secs(search.retreat_mm + 1.0, search.pass_speed)
            + self.move_secs(1.0, search.pass_speed);
        let moves = 2.0 * approach(search.retreat_mm) + slow + rest;
        (
            approach(CONTACT_EXPECTED_SHARE * travel) + moves,
            approach(travel) + moves,
        )
    }

    fn move_secs(&self, distance_mm: f64, speed: MmPerS) -> f64 {
        if !(distance_mm.is_finite() && speed.0 > 0.0) {
            return 0.0;
        }
        Profile::to_rest(
            Position(0.0),
            Position(distance_mm),
            speed,
            self.rig.acceleration,
        )
        .duration()
        .0
    }

    fn check_speed(&mut self, phase: Phase, speed: MmPerS) {
        if let Err(reason) = self.rig.check_speed(speed) {
            self.refusals.push(format!("{phase}: {reason}"));
        }
    }

    /// Distances and forces of a plan are finite and no larger than any rig.
    fn check_sizes(&mut self, phase: Phase, sizes: &[f64]) {
        if let Some(size) = sizes
            .iter()
            .find(|size| size.is_nan() || size.abs() > 1000.0)
        {
            self.refusals.push(format!(
                "{phase}: {size} is not possible; give a size up to 1000"
            ));
        }
    }

    fn check_span(&mut self, phase: Phase, span: Seconds) {
        // A day is longer than any specimen lasts and keeps every tick count small.
        if !(span.0 >= 0.0 && span.0 <= 86_400.0) {
            self.refusals.push(format!(
                "{phase}: a duration of {span} is not possible; give 0 to 86400 s"
            ));
        }
    }

    fn check_rule(&mut self, phase: Phase, rule: &HoldUntil, duration: Seconds) {
        match rule.check() {
            Err(reason) => self.refusals.push(format!("{phase}: {reason}")),
            Ok(()) if rule.at_least < duration => self.notes.push(format!(
                "the hold ends as soon as {rule}, after {:.0} at the earliest",
                rule.at_least
            )),
            Ok(()) => self.notes.push(format!(
                "the hold is too short to end early: that takes {:.0} at least",
                rule.at_least
            )),
        }
    }

    fn check_depth(&mut self, depth: Depth) {
        let travel = self.limits.travel_max;
        if depth.0.is_nan() || depth.0 <= 0.0 {
            self.refusals.push(format!(
                "ramp: a depth of {depth} is not possible; give a depth above 0 mm"
            ));
        } else if depth.0 > travel.0 {
            self.refusals.push(format!(
                "ramp: a depth of {depth} is beyond the travel of rig {}; it ends at {travel}",
                self.rig.name
            ));
        }
    }
}

/// Peak force of the softest and the stiffest expected specimen over the plan's indentation.
fn force_band(plan: &Plan) -> [Newtons; 2] {
    let mut body_state = KelvinState::at_rest();
    let (mut depth, mut peak) = (0.0, 0.0f64);
    for step in &plan.steps {
        let Step::Ramp {
            speed,
            depth: target,
        } = *step
        else {
            continue;
        };
        let step_count = ((target.0 - depth) / speed.0 / PREDICTION_STEP.0)
            .abs()
            .ceil()
            .max(1.0) as usize;
        let dt = Seconds((target.0 - depth).abs() / speed.0 / step_count as f64);
        for i in 1..=step_count {
            let x = depth + (target.0 - depth) * i as f64 / step_count as f64;
            let force = body_state.step(&ModifiedKelvin::THESIS, Depth(x), dt);
            peak = peak.max(force.0);
        }
        depth = target.0;
    }
    STIFFNESS_BAND.map(|factor| Newtons(factor * peak))
}
