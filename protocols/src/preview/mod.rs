//! Dry run of a plan: limits, duration, force band and storage, before anything moves.

mod expected;
#[cfg(test)]
mod tests;

pub use expected::OutlinePoint;

use crate::plans::{
    FindBase, FindContact, HoldUntil, LoadTo, OnFailure, Plan, PlannedStep, Press, Step,
};
use expected::Expected;
use palpate_model::calibration::Curve;
use palpate_model::rig::{Limits, Phase, Profile, RigDescription};
use palpate_model::units::{Depth, MmPerS, Newtons, Position, Seconds};
use serde::{Deserialize, Serialize};

/// Bytes that one sample takes in the session log, raw and derived: 16 measured on the lab profile,
/// 23 on the ideal one, whose noise fills every digit; rounded up.
const BYTES_PER_SAMPLE: f64 = 30.0;

/// Contact finding never exerts more than 0.5 N; filter and brake need a sixth of it.
const PRESS_MAX: Newtons = Newtons(0.42);

/// Where contact is expected when nothing is known: in the first half of the travel.
const CONTACT_EXPECTED_SHARE: f64 = 0.3;

/// Controller ticks from the sample that begins a move to the first tick of its motion, and from its last tick to
/// the sample that shows rest: report 1.0 to 1.5 ms and command 0.5 ms make one, the tick that shows rest the other.
const MOVE_TICKS: u64 = 2;

/// A correction at a constant force takes about so long beyond the hold itself.
const SETTLE_SECS: f64 = 0.1;

/// One step of the plan as it is expected to go.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepPreview {
    /// Phase name.
    pub phase: Phase,
    /// Expected duration.
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
    walk(plan, rig, limits, curve, is_homed, false).0
}

/// Depth and force over time as the thesis body would answer, for a picture of the plan: a point at every turn
/// and a few between.
#[must_use]
pub fn outline(
    plan: &Plan,
    rig: &RigDescription,
    limits: &Limits,
    curve: &Curve,
) -> Vec<OutlinePoint> {
    walk(plan, rig, limits, curve, false, true).1
}

fn walk(
    plan: &Plan,
    rig: &RigDescription,
    limits: &Limits,
    curve: &Curve,
    is_homed: bool,
    has_outline: bool,
) -> (Preview, Vec<OutlinePoint>) {
    let unused_limit = plan.limits.unused(limits);
    let limits = plan.limits.tighten(*limits);
    let mut walk = Walk {
        rig,
        limits: &limits,
        refusals: Vec::new(),
        notes: Vec::new(),
        expected: Expected::new(has_outline),
        is_homed,
        is_contact_known: false,
    };
    let steps: Vec<StepPreview> = plan
        .steps
        .iter()
        .enumerate()
        .map(|(index, planned)| walk.step(index, planned))
        .collect();
    for monitor in &plan.monitors {
        walk.refusals.extend(monitor.check().err());
    }
    let (mut refusals, mut notes) = (walk.refusals, walk.notes);
    if plan.steps.is_empty() {
        refusals.push("the plan has no steps".into());
    }
    let total =
        |of: fn(&StepPreview) -> Seconds| Seconds(steps.iter().map(|step| of(step).0).sum());
    let (expected, longest) = (total(|step| step.expected), total(|step| step.longest));
    let force_band = if refusals.is_empty() {
        walk.expected.force_band()
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
    notes.extend(unused_limit);
    if force_band[1] > limits.force_max {
        notes.push(format!(
            "a stiff specimen may reach {:.1}; the interlock stops the run at {:.1}",
            force_band[1], limits.force_max
        ));
    }
    let preview = Preview {
        storage_bytes: (longest.0 / rig.tick().0 * BYTES_PER_SAMPLE) as u64,
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

struct Walk<'a> {
    rig: &'a RigDescription,
    limits: &'a Limits,
    refusals: Vec<String>,
    notes: Vec<String>,
    /// The specimen as it is expected, and the depth the plan has reached.
    expected: Expected,
    is_homed: bool,
    is_contact_known: bool,
}

/// Expected and longest duration, and whether they are the same and exact.
struct Span(f64, f64, bool);

impl Walk<'_> {
    fn step(&mut self, index: usize, planned: &PlannedStep) -> StepPreview {
        let step = &planned.step;
        let phase = step.phase();
        let refused_before = self.refusals.len();
        let Span(expected, longest, is_exact) = self.span(phase, step);
        if matches!(planned.on_failure, OnFailure::Retry(_)) && step.is_measuring() {
            self.refusals.push(
                "a measurement cannot be tried again, for tissue that was indented is another specimen; let it abort or skip"
                    .into(),
            );
        }
        let refusals = self.refusals[refused_before..].to_vec();
        for refusal in &mut self.refusals[refused_before..] {
            *refusal = format!("step {}, {phase}: {refusal}", index + 1);
        }
        StepPreview {
            phase,
            expected: Seconds(expected),
            longest: Seconds(longest),
            is_exact,
            refusals,
        }
    }

    fn span(&mut self, phase: Phase, step: &Step) -> Span {
        let travel = self.limits.travel_max.0;
        match step {
            Step::SelfTest { duration } => {
                self.check_span(*duration);
                Span(duration.0, duration.0, false)
            }
            Step::Tare { duration } => {
                self.check_span(*duration);
                self.wait(phase, *duration)
            }
            Step::Hold {
                duration,
                until,
                rate,
            } => {
                self.check_span(*duration);
                if let Some(rule) = until {
                    self.check_rule(rule, *duration);
                }
                if let Some(rule) = rate {
                    self.refusals.extend(rule.check().err());
                    self.notes.push(format!("the hold ends as soon as {rule}"));
                }
                let Span(expected, longest, _) = self.wait(phase, *duration);
                Span(expected, longest, until.is_none() && rate.is_none())
            }
            Step::Rest { duration } => {
                self.check_span(*duration);
                self.wait(phase, *duration)
            }
            Step::Prompt(prompt) => {
                self.check_span(prompt.timeout);
                if prompt.message.trim().is_empty() {
                    self.refusals
                        .push("a prompt must say what it asks for".into());
                }
                // Somebody who stands beside the rig answers within half a minute.
                self.unknown(phase, prompt.timeout.0.min(30.0), prompt.timeout.0)
            }
            Step::Weigh(weigh) => {
                self.check_span(weigh.settle.window);
                self.check_span(weigh.settle.timeout);
                let (window, timeout) = (weigh.settle.window.0, weigh.settle.timeout.0);
                self.unknown(phase, (2.0 * window).min(timeout), timeout)
            }
            Step::Home { speed, touch_speed } => {
                self.check_speed(*speed);
                self.check_speed(*touch_speed);
                if self.is_homed {
                    return Span(0.0, 0.0, true);
                }
                self.is_homed = true;
                let touch = self.touch_secs(*speed, *touch_speed);
                let near = self.move_secs(0.1 * travel, *speed) + touch;
                let far = self.move_secs(travel, *speed) + touch;
                self.unknown(phase, near, far)
            }
            Step::CheckHome { speed, touch_speed } => {
                self.check_speed(*speed);
                self.check_speed(*touch_speed);
                let touch = self.touch_secs(*speed, *touch_speed);
                let near = self.move_secs(CONTACT_EXPECTED_SHARE * travel, *speed) + touch;
                let far = self.move_secs(travel, *speed) + touch;
                self.unknown(phase, near, far)
            }
            Step::FindBase(search) => {
                self.is_contact_known = true;
                self.check_sizes(&[search.retreat_mm, search.criterion.0, search.pass_force.0]);
                self.check_speed(search.approach_speed);
                self.check_speed(search.pass_speed);
                if search.approach_speed.0.max(search.pass_speed.0) > FindBase::SPEED_MAX.0 {
                    self.refusals.push(format!(
                        "a base is stiff; touch it at {} at most",
                        FindBase::SPEED_MAX
                    ));
                }
                let approach = |share: f64| self.move_secs(share * travel, search.approach_speed);
                let slow = self.move_secs(search.retreat_mm, search.pass_speed);
                // Behind the specimen, as far as it is thick.
                let (near, far) = (
                    approach(2.0 * CONTACT_EXPECTED_SHARE) + slow,
                    approach(1.0) + slow,
                );
                self.expected.place_on_base();
                self.unknown(phase, near, far)
            }
            Step::FindContact(search) => {
                self.is_contact_known = true;
                let (near, far) = self.contact(search);
                self.expected.place(0.0);
                self.unknown(phase, near, far)
            }
            Step::Ramp { speed, depth } => {
                self.check_contact();
                self.check_speed(*speed);
                self.check_depth(*depth);
                self.go(phase, depth.0, *speed)
            }
            Step::LoadTo(load) => self.load(phase, load),
            Step::HoldForce(hold) => {
                self.check_contact();
                self.check_speed(hold.speed);
                self.check_depth(hold.depth_max);
                self.check_force(hold.force);
                self.check_span(hold.duration);
                let ticks = self.ticks(hold.duration.0);
                self.expected.keep(phase, self.secs(ticks));
                Span(self.secs(ticks), self.secs(ticks) + SETTLE_SECS, false)
            }
            Step::Sine(sine) => {
                self.check_contact();
                let cycles_secs = f64::from(sine.cycles) / sine.frequency_hz;
                self.check_span(Seconds(cycles_secs));
                self.check_sizes(&[sine.amplitude_mm]);
                if sine.cycles == 0 || sine.amplitude_mm <= 0.0 {
                    self.refusals
                        .push("a sine needs a cycle and an amplitude above 0 mm".into());
                }
                if !self.refusals.is_empty() {
                    return Span(0.0, 0.0, true);
                }
                let command = sine.command(self.rig);
                self.refusals
                    .extend(self.rig.check_oscillation(&command).err());
                self.expected.oscillate(phase, sine);
                let secs = self.secs(self.ticks(cycles_secs) + MOVE_TICKS);
                Span(secs, secs, true)
            }
            Step::Unload {
                speed,
                clearance_mm,
            }
            | Step::Retract {
                speed,
                clearance_mm,
            } => {
                self.check_contact();
                self.check_sizes(&[*clearance_mm]);
                self.check_speed(*speed);
                self.go(phase, -clearance_mm, *speed)
            }
            Step::Jog { distance_mm, speed } => {
                self.check_sizes(&[*distance_mm]);
                if distance_mm.abs() > travel {
                    self.refusals.push(format!(
                        "a jog of {distance_mm} mm is longer than the travel of {travel:.1} mm"
                    ));
                }
                self.check_speed(*speed);
                let ticks = self.move_ticks(*distance_mm, *speed);
                Span(self.secs(ticks), self.secs(ticks), true)
            }
        }
    }

    fn load(&mut self, phase: Phase, load: &LoadTo) -> Span {
        self.check_contact();
        self.check_speed(load.speed);
        self.check_depth(load.depth_max);
        self.check_force(load.force);
        if let Some(brake) = load.brake
            && !(brake.0 > 0.0 && brake < load.force)
        {
            self.refusals.push(format!(
                "a brake {brake} before a target of {:.2} is not possible; give less than the target",
                load.force
            ));
        }
        if !self.refusals.is_empty() {
            return Span(0.0, 0.0, false);
        }
        let from = self.expected.depth();
        let longest = self.move_secs(load.depth_max.0 - from, load.speed);
        let expected = self.expected.load(phase, load);
        // The braked stages are a tenth and a hundredth as fast over what is left.
        let braked = load.brake.map_or(1.0, |_| 100.0);
        Span(expected, braked * longest, false)
    }

    fn contact(&mut self, search: &FindContact) -> (f64, f64) {
        self.check_sizes(&[
            search.retreat_mm,
            search.criterion.0,
            search.pass_force.0,
            search.std_error_mm_max,
        ]);
        self.check_span(search.recovery);
        if let Some(press) = search.press {
            self.check_press(&press);
        }
        self.check_speed(search.approach_speed);
        self.check_speed(search.pass_speed);
        let travel = self.limits.travel_max.0;
        let approach = |distance: f64| self.move_secs(distance, search.approach_speed);
        let dwell = search.press.map_or(0.0, |press| press.dwell.0);
        let rest = 2.0 * (search.recovery.0 + dwell);
        let slow = self.move_secs(search.retreat_mm + 1.0, search.pass_speed)
            + self.move_secs(1.0, search.pass_speed);
        let moves = 2.0 * approach(search.retreat_mm) + slow + rest;
        (
            approach(CONTACT_EXPECTED_SHARE * travel) + moves,
            approach(travel) + moves,
        )
    }

    fn check_press(&mut self, press: &Press) {
        self.check_span(press.dwell);
        if !(press.force.0 > 0.0 && press.force <= PRESS_MAX) {
            self.refusals.push(format!(
                "finding contact cannot press to {}; give above 0 and up to {PRESS_MAX}",
                press.force
            ));
        }
    }

    /// A wait of so many whole samples.
    fn wait(&mut self, phase: Phase, duration: Seconds) -> Span {
        let secs = self.secs(self.ticks(duration.0));
        self.expected.stay(phase, secs);
        Span(secs, secs, true)
    }

    /// Something whose duration only the rig or a person knows.
    fn unknown(&mut self, phase: Phase, expected: f64, longest: f64) -> Span {
        self.expected.stay(phase, expected);
        Span(expected, longest, false)
    }

    /// A move to a depth.
    fn go(&mut self, phase: Phase, depth_mm: f64, speed: MmPerS) -> Span {
        if !self.refusals.is_empty() {
            return Span(0.0, 0.0, true);
        }
        let ticks = self.move_ticks(depth_mm - self.expected.depth(), speed);
        let secs = self.secs(ticks);
        self.expected.go(phase, depth_mm, secs);
        Span(secs, secs, true)
    }

    fn move_ticks(&self, distance_mm: f64, speed: MmPerS) -> u64 {
        match self.ticks(self.move_secs(distance_mm, speed)) {
            0 => 0,
            ticks => ticks + MOVE_TICKS,
        }
    }

    /// As the engine counts: rounded up, a millionth of a tick forgiven.
    fn ticks(&self, secs: f64) -> u64 {
        (secs / self.rig.tick().0 - 1e-6).ceil().max(0.0) as u64
    }

    fn secs(&self, ticks: u64) -> f64 {
        ticks as f64 * self.rig.tick().0
    }

    fn touch_secs(&self, speed: MmPerS, touch_speed: MmPerS) -> f64 {
        // Back off 2 mm and touch again.
        self.move_secs(2.0, speed) + self.move_secs(2.0, touch_speed)
    }

    fn move_secs(&self, distance_mm: f64, speed: MmPerS) -> f64 {
        if !(distance_mm.is_finite() && speed.0 > 0.0) {
            return 0.0;
        }
        // The axis ends on whole pulses.
        let pulse = self.rig.mm_per_pulse;
        let distance_mm = (distance_mm / pulse).round() * pulse;
        Profile::to_rest(
            Position(0.0),
            Position(distance_mm),
            speed,
            self.rig.acceleration,
        )
        .duration()
        .0
    }

    fn check_speed(&mut self, speed: MmPerS) {
        self.refusals.extend(self.rig.check_speed(speed).err());
    }

    fn check_contact(&mut self) {
        if !self.is_contact_known {
            self.refusals
                .push("contact is not known here; put find-contact before it".into());
        }
    }

    /// Distances and forces of a plan are finite and no larger than any rig.
    fn check_sizes(&mut self, sizes: &[f64]) {
        if let Some(size) = sizes
            .iter()
            .find(|size| size.is_nan() || size.abs() > 1000.0)
        {
            self.refusals
                .push(format!("{size} is not possible; give a size up to 1000"));
        }
    }

    fn check_force(&mut self, force: Newtons) {
        let most = self.limits.force_max;
        if !(force.0 > 0.0 && force < most) {
            self.refusals.push(format!(
                "a force of {force:.2} is not possible; give a force above 0 N and below the interlock at {most:.1}"
            ));
        }
    }

    fn check_span(&mut self, span: Seconds) {
        // A day is longer than any specimen lasts and keeps every tick count small.
        if !(span.0 >= 0.0 && span.0 <= 86_400.0) {
            self.refusals.push(format!(
                "a duration of {span} is not possible; give 0 to 86400 s"
            ));
        }
    }

    fn check_rule(&mut self, rule: &HoldUntil, duration: Seconds) {
        match rule.check() {
            Err(reason) => self.refusals.push(reason),
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
                "a depth of {depth} is not possible; give a depth above 0 mm"
            ));
        } else if depth.0 > travel.0 {
            self.refusals.push(format!(
                "a depth of {depth} is beyond the travel of rig {}; it ends at {travel}",
                self.rig.name
            ));
        }
    }
}
