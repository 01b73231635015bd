//! A plan gone through: what every step takes, and what refuses it.

use super::StepPreview;
use super::expected::Expected;
use super::moves::Reach;
use crate::engine::NOT_HOMED;
use crate::plans::{FindBase, FindContact, LoadTo, OnFailure, PlannedStep, Step};
use palpate_model::rig::{HandAction, Limits, Phase, RigDescription};
use palpate_model::units::{Depth, MmPerS, Seconds};

/// Where contact is expected when nothing is known: in the first half of the travel.
const CONTACT_EXPECTED_SHARE: f64 = 0.3;

/// A correction at a constant force takes about so long beyond the hold itself.
const SETTLE_SECS: f64 = 0.1;

/// A plan gone through step by step.
pub(super) struct Walk<'a> {
    pub rig: &'a RigDescription,
    pub limits: &'a Limits,
    pub refusals: Vec<String>,
    pub notes: Vec<String>,
    /// The specimen as it is expected, and the depth the plan has reached.
    pub expected: Expected,
    pub is_homed: bool,
    pub is_contact_known: bool,
    pub is_tared: bool,
    /// Where the probe may be, once contact is known.
    pub reach: Reach,
}

/// Expected and longest duration, and whether they are the same and exact.
pub(super) struct Span(pub f64, pub f64, pub bool);

impl Walk<'_> {
    pub(super) fn step(&mut self, index: usize, planned: &PlannedStep) -> StepPreview {
        let step = &planned.step;
        let phase = step.phase();
        let refused_before = self.refusals.len();
        if step.needs_homed_axis() && !self.is_homed {
            self.refusals.push(NOT_HOMED.into());
        }
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
                self.is_tared = true;
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
                if matches!(prompt.hand, Some(HandAction::Mount { .. })) {
                    self.is_contact_known = false;
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
                // At home, which is somewhere in front of the tissue.
                self.expected.place(-CONTACT_EXPECTED_SHARE * travel);
                self.reach = Reach {
                    low: -travel,
                    high: 0.0,
                };
                self.unknown(phase, near, far)
            }
            Step::FindBase(search) => {
                self.check_tare();
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
                self.reach = Reach::at(0.0);
                self.unknown(phase, near, far)
            }
            Step::FindContact(search) => {
                self.check_tare();
                self.is_contact_known = true;
                let (near, far) = self.contact(search);
                self.expected.place(0.0);
                self.reach = Reach::at(0.0);
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
                self.reach = Reach {
                    low: self.reach.low.min(0.0),
                    high: self.reach.high.max(hold.depth_max.0),
                };
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
                let deepest = 2.0 * command.amplitude_pulses as f64 * self.rig.mm_per_pulse;
                self.check_travel("sine", deepest);
                let from = Depth(self.expected.depth());
                if self.expected.oscillate(phase, sine).0 <= 0.0 {
                    self.note(format!(
                        "tissue like that of the source presses too little at {from:.1} for a swing of {} mm either way: the force would come back to zero and the probe lose the tissue; go deeper or swing less",
                        sine.amplitude_mm
                    ));
                }
                // The rig counts whole ticks of each period.
                let ticks = u64::from(command.cycles) * u64::from(command.period_ticks);
                let secs = self.secs(ticks + self.answer_ticks());
                Span(secs, secs, self.is_answer_exact())
            }
            Step::Follow(follow) => {
                self.check_contact();
                self.check_speed(follow.speed);
                self.check_depth(follow.depth_max);
                self.check_span(follow.duration);
                let (duration, way) = (follow.duration.0, follow.depth_max.0);
                // Where it goes is not known before; what bounds it is.
                let there = self.move_secs(way - self.expected.depth(), follow.speed);
                self.expected.go(phase, way, there.min(duration));
                self.expected.stay(phase, (duration - there).max(0.0));
                self.reach = Reach {
                    low: -travel,
                    high: way,
                };
                self.note(format!(
                    "the slave goes where it is led, at {} at most and no deeper than {}",
                    follow.speed, follow.depth_max
                ));
                // The move under way is braked first.
                let braking = follow.speed.0 / self.rig.acceleration.0;
                Span(duration, duration + braking + SETTLE_SECS, false)
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
                self.leave(phase, *clearance_mm, *speed)
            }
            Step::Jog { distance_mm, speed } => {
                self.check_sizes(&[*distance_mm]);
                if distance_mm.abs() > travel {
                    self.refusals.push(format!(
                        "a jog of {distance_mm} mm is longer than the travel of {travel:.1} mm"
                    ));
                }
                self.check_speed(*speed);
                self.jog(phase, *distance_mm, *speed)
            }
        }
    }

    /// Notes what the same step in a loop has not told yet.
    pub(super) fn note(&mut self, note: String) {
        if !self.notes.contains(&note) {
            self.notes.push(note);
        }
    }

    fn jog(&mut self, phase: Phase, distance_mm: f64, speed: MmPerS) -> Span {
        let pulse = self.rig.mm_per_pulse;
        let moved = (distance_mm / pulse).round() * pulse;
        if distance_mm > 0.0 && self.is_homed {
            self.check_travel("jog", moved);
        }
        let secs = self.secs(self.move_ticks(moved, speed));
        if self.is_contact_known && self.refusals.is_empty() {
            self.reach = self.reach.moved_by(moved);
            self.expected.go(phase, self.expected.depth() + moved, secs);
        } else {
            self.expected.stay(phase, secs);
        }
        Span(secs, secs, self.is_answer_exact())
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
        let from = Depth(self.reach.low);
        let refusal = load.check_from(from, self.rig.mm_per_pulse).err();
        self.refusals.extend(refusal);
        if !self.refusals.is_empty() {
            return Span(0.0, 0.0, false);
        }
        let longest = self.move_secs(load.depth_max.0 - from.0, load.speed);
        self.reach.high = self.reach.high.max(load.depth_max.0);
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
}
