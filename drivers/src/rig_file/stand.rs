//! The keys of a Mark-10 stand with its gauge.

use super::cell::gauge;
use super::fields::Fields;
use super::place::place;
use crate::mark10::StandSettings;
use crate::wire::Place;
use palpate_model::units::{MmPerS, MmPerS2, Position};

/// Where the stand is, and what it is.
pub(super) fn read(name: String, fields: &mut Fields) -> Option<(Place, StandSettings)> {
    let place = place(fields, "", true);
    let travel = fields.needed("travel_mm", 1.0, 10_000.0);
    let speed_max = fields.needed("speed_max_mm_s", 1e-3, 1000.0);
    let acceleration = fields.needed("acceleration_mm_s2", 1e-3, 1e6);
    let unseen = fields.unseen();
    let is_upwards = fields.choice("direction", &[("down", false), ("up", true)], Some(false));
    let gauge = gauge(fields);
    Some((
        place?,
        StandSettings {
            name,
            travel: Position(travel?),
            speed_max: MmPerS(speed_max?),
            acceleration: MmPerS2(acceleration?),
            unseen,
            is_upwards: is_upwards?,
            gauge: gauge?,
        },
    ))
}
