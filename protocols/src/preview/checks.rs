//! What a step must be to run at all, each with the sentence of its refusal.

use super::walk::Walk;
use crate::engine::{NOT_TARED, outside_travel};
use crate::fidelity::FORCE_FLOOR;
use crate::plans::{HoldUntil, Press};
use palpate_model::units::{Depth, MmPerS, Newtons, Position, Seconds};

/// Contact finding never exerts more than 0.5 N; filter and brake need a sixth of it.
const PRESS_MAX: Newtons = Newtons(0.42);

impl Walk<'_> {
    pub(super) fn check_press(&mut self, press: &Press) {
        self.check_span(press.dwell);
        let most = self.limits.force_max;
        if !(press.force.0 > 0.0 && press.force <= PRESS_MAX) {
            self.refusals.push(format!(
                "finding contact cannot press to {}; give above 0 and up to {PRESS_MAX}",
                press.force
            ));
        } else if press.force >= most {
            self.refusals.push(format!(
                "finding contact presses to {}, where the limit of {most} ends every run; allow more force or press less",
                press.force
            ));
        }
    }

    pub(super) fn check_speed(&mut self, speed: MmPerS) {
        self.refusals.extend(self.rig.check_speed(speed).err());
    }

    pub(super) fn check_tare(&mut self) {
        if !self.is_tared {
            self.refusals.push(NOT_TARED.into());
        }
    }

    /// A way further in by so much ends within the travel, wherever contact is: in front of it home is.
    pub(super) fn check_travel(&mut self, what: &str, further_mm: f64) {
        let (travel, end) = (self.limits.travel_max, self.reach.low + further_mm);
        if self.is_contact_known && end > travel.0 {
            self.refusals
                .push(outside_travel(what, Position(end), travel));
        }
    }

    pub(super) fn check_contact(&mut self) {
        if !self.is_contact_known {
            self.refusals
                .push("contact is not known here; put find-contact before it".into());
        }
    }

    /// Distances and forces of a plan are finite and no larger than any rig.
    pub(super) fn check_sizes(&mut self, sizes: &[f64]) {
        if let Some(size) = sizes
            .iter()
            .find(|size| size.is_nan() || size.abs() > 1000.0)
        {
            self.refusals
                .push(format!("{size} is not possible; give a size up to 1000"));
        }
    }

    pub(super) fn check_force(&mut self, force: Newtons) {
        let most = self.limits.force_max;
        if !(force.0 > 0.0 && force < most) {
            self.refusals.push(format!(
                "a force of {force:.2} is not possible; give a force above 0 N and below the interlock at {most:.1}"
            ));
        } else if force.0 <= FORCE_FLOOR {
            self.note(format!(
                "a force of {force:.4} is no more than a force may be off, {FORCE_FLOOR} N, so nothing tells whether it was met; load to more"
            ));
        }
    }

    pub(super) fn check_span(&mut self, span: Seconds) {
        // A day is longer than any specimen lasts and keeps every tick count small.
        if !(span.0 >= 0.0 && span.0 <= 86_400.0) {
            self.refusals.push(format!(
                "a duration of {span} is not possible; give 0 to 86400 s"
            ));
        }
    }

    pub(super) fn check_rule(&mut self, rule: &HoldUntil, duration: Seconds) {
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

    pub(super) fn check_depth(&mut self, depth: Depth) {
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
