//! What a step must be to run at all, each with the sentence of its refusal.

use super::walk::Walk;
use crate::engine::outside_travel;
use crate::steps::FORCE_FLOOR;
use palpate_model::units::{Depth, MmPerS, Newtons, Position, Seconds};

impl Walk<'_> {
    pub fn check_speed(&mut self, speed: MmPerS) {
        self.refusals.extend(self.rig.check_speed(speed).err());
    }

    /// The end of a move `further_mm` deeper is within the travel, wherever contact is.
    pub fn check_travel(&mut self, what: &str, further_mm: f64) {
        let (travel, end) = (self.limits.travel_max, self.reach.low + further_mm);
        if self.known.contact && end > travel.0 {
            self.refusals.push(outside_travel(what, Position(end), travel));
        }
    }

    /// Distances and forces of a plan are finite and no larger than any rig.
    pub fn check_sizes(&mut self, sizes: &[f64]) {
        if let Some(size) = sizes.iter().find(|size| size.is_nan() || size.abs() > 1000.0) {
            self.refusals.push(format!(
                "a distance or force of {size} is not possible; give at most 1000 mm or 1000 N"
            ));
        }
    }

    pub fn check_force(&mut self, force: Newtons) {
        let most = self.limits.force_max;
        if !(force.0 > 0.0 && force < most) {
            self.refusals.push(format!(
                "a force of {force:.2} is not possible; give a force above 0 N and below the force limit of {most:.1}"
            ));
        } else if force.0 <= FORCE_FLOOR {
            self.note(format!(
                "a force of {force:.4} is not above the tolerance of {FORCE_FLOOR} N, so the record cannot show whether it was reached; use a larger force"
            ));
        }
    }

    pub fn check_span(&mut self, span: Seconds) {
        // A day is longer than any specimen lasts and keeps every tick count small.
        if !(span.0 >= 0.0 && span.0 <= 86_400.0) {
            self.refusals.push(format!("a duration of {span} is not possible; give 0 to 86400 s"));
        }
    }

    pub fn check_depth(&mut self, depth: Depth) {
        let travel = self.limits.travel_max;
        if depth.0.is_nan() || depth.0 <= 0.0 {
            self.refusals
                .push(format!("a depth of {depth} is not possible; give a depth above 0 mm"));
        } else if depth.0 > travel.0 {
            self.refusals.push(format!(
                "a depth of {depth} is beyond the travel of rig {}, which ends at {travel}; give a smaller depth",
                self.rig.name
            ));
        }
    }
}
