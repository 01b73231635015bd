//! What the order of steps must keep, on any rig: the motor is on, the axis is homed, the cell is tared and the
//! surface is found before they are needed, and the probe is outside where it has to be.

use super::problem::{Problem, Problems};
use super::procedure::Placed;
use crate::plans::Step;
use palpate_model::rig::HandAction;
use std::collections::BTreeSet;

/// What is known at a place of the plan.
#[derive(Default)]
struct Known {
    motor: bool,
    home: bool,
    tare: bool,
    contact: bool,
    is_inside: bool,
    /// Whether the specimen was taken out and no other clipped in.
    is_bare: bool,
}

/// Looks through the steps.
pub(super) fn check(steps: &[Placed], problems: &mut Problems) {
    let mut known = Known::default();
    let mut warned = BTreeSet::new();
    for placed in steps {
        let step = &placed.planned.step;
        let name = word(step);
        // What is missed is missed once: the steps behind would only repeat it.
        while let Err((missed, message)) = known.judge(step) {
            problems.error(placed.line, format!("'{name}' {message}"));
            known.assume(missed);
        }
        known.pass(step);
        if known.motor && matches!(step, Step::Weigh(_)) && warned.insert(placed.line) {
            problems.push(Problem::warning(
                placed.line,
                "'weigh' with the motor on ends at the force limit of the rig; leave { do = \"self-test\" } out of a protocol that only weighs",
            ));
        }
        let checkpoint = placed.planned.checkpoint.as_ref();
        if let Some(checkpoint) =
            checkpoint.filter(|_| known.is_inside && warned.insert(placed.line))
        {
            problems.push(Problem::warning(
                placed.line,
                format!("at the checkpoint '{checkpoint}' the probe is in the tissue, which goes on relaxing in a pause; put the checkpoint behind a retract or unload if that matters"),
            ));
        }
    }
    if let Some(last) = steps.last().filter(|_| known.is_inside) {
        problems.push(Problem::warning(
            last.line,
            "the protocol ends with the probe in the tissue; end it with { do = \"retract\" } if that is not meant",
        ));
    }
}

/// What a step can miss.
#[derive(Clone, Copy)]
enum Missed {
    Motor,
    Home,
    Tare,
    Contact,
    Outside,
    Inside,
    Specimen,
}

impl Known {
    /// Whether a step can be done here, or what it misses and what to put before it.
    fn judge(&self, step: &Step) -> Result<(), (Missed, &'static str)> {
        let is_motion =
            step.needs_homed_axis() || matches!(step, Step::Home { .. } | Step::Jog { .. });
        let is_search = matches!(step, Step::FindContact(_) | Step::FindBase(_));
        let is_by_hand = matches!(step, Step::Prompt(prompt) if prompt.hand.is_some());
        let is_from_surface =
            step.needs_homed_axis() && !is_search && !matches!(step, Step::CheckHome { .. });
        if is_motion && !self.motor {
            let message =
                "moves the axis, but the motor is not on yet; begin with { do = \"self-test\" }";
            return Err((Missed::Motor, message));
        }
        if step.needs_homed_axis() && !self.home {
            let message = "needs a homed axis; put { do = \"home\" } before it, which is left out where the axis is homed already";
            return Err((Missed::Home, message));
        }
        if is_search && !self.tare {
            let message = "compares forces, but the load cell is not tared yet; put { do = \"tare\" } before it";
            return Err((Missed::Tare, message));
        }
        if is_from_surface && !self.contact {
            let message = "counts depth from the surface, which is not known yet; put { do = \"find-contact\" } before it";
            return Err((Missed::Contact, message));
        }
        if !self.is_inside && matches!(step, Step::HoldForce(_)) {
            let message = "keeps a force that is there already and hardly moves where there is none; put { do = \"load\", to = \"1 N\", ... } before it";
            return Err((Missed::Inside, message));
        }
        if self.is_bare && matches!(step, Step::FindContact(_)) {
            let message = "would run into the base, for the specimen was taken out before it; clip one in with { do = \"prompt\", message = \"...\", mount = 1 } before it, or find the base with { do = \"find-base\" }";
            return Err((Missed::Specimen, message));
        }
        if self.is_inside && (is_search || is_by_hand || matches!(step, Step::Tare { .. })) {
            let message = "must not be done while the probe is in the tissue; put { do = \"retract\" } before it";
            return Err((Missed::Outside, message));
        }
        Ok(())
    }

    fn assume(&mut self, missed: Missed) {
        match missed {
            Missed::Motor => self.motor = true,
            Missed::Home => self.home = true,
            Missed::Tare => self.tare = true,
            Missed::Contact => self.contact = true,
            Missed::Outside => self.is_inside = false,
            Missed::Inside => self.is_inside = true,
            Missed::Specimen => self.is_bare = false,
        }
    }

    /// What is known behind a step.
    fn pass(&mut self, step: &Step) {
        match step {
            Step::SelfTest { .. } => self.motor = true,
            // An axis that is homed already stays where it is.
            Step::Home { .. } => {
                self.is_inside &= self.home;
                self.home = true;
            }
            Step::CheckHome { .. } => self.is_inside = false,
            Step::Tare { .. } => self.tare = true,
            Step::FindContact(_) | Step::FindBase(_) => self.contact = true,
            Step::Ramp { .. }
            | Step::LoadTo(_)
            | Step::HoldForce(_)
            | Step::Sine(_)
            | Step::Follow(_) => self.is_inside = true,
            Step::Unload { .. } | Step::Retract { .. } => self.is_inside = false,
            // Another specimen has its surface elsewhere. Without one there is only the base to find.
            Step::Prompt(prompt) => match prompt.hand {
                Some(hand @ (HandAction::Mount { .. } | HandAction::Unmount)) => {
                    self.contact = false;
                    self.is_bare = hand == HandAction::Unmount;
                }
                Some(HandAction::LoadCell { .. }) | None => {}
            },
            // From the surface a jog towards the tissue goes in.
            Step::Jog { distance_mm, .. } => self.is_inside |= self.contact && *distance_mm > 0.0,
            Step::Hold { .. } | Step::Rest { .. } | Step::Weigh(_) => {}
        }
    }
}

/// The word for a step in a protocol.
#[must_use]
pub fn word(step: &Step) -> &'static str {
    match step {
        Step::SelfTest { .. } => "self-test",
        Step::Home { .. } => "home",
        Step::Tare { .. } => "tare",
        Step::FindContact(_) => "find-contact",
        Step::FindBase(_) => "find-base",
        Step::Ramp { .. } => "ramp",
        Step::Hold { .. } => "hold",
        Step::LoadTo(_) => "load",
        Step::HoldForce(_) => "hold-force",
        Step::Sine(_) => "sine",
        Step::Follow(_) => "follow",
        Step::Rest { .. } => "rest",
        Step::Prompt(_) => "prompt",
        Step::Weigh(_) => "weigh",
        Step::CheckHome { .. } => "check-home",
        Step::Unload { .. } => "unload",
        Step::Retract { .. } => "retract",
        Step::Jog { .. } => "jog",
    }
}
