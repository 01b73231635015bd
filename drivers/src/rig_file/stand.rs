//! The keys of a Mark-10 stand with its gauge.

use super::RigFile;
use super::address::read_address;
use super::cell::gauge;
use super::fields::Fields;
use crate::mark10::{StandDevice, StandSettings};
use crate::wire::Place;

pub(crate) fn stand(name: String, fields: &mut Fields) -> Option<RigFile> {
    let (place, settings) = read(name, fields)?;
    let places = vec![place.clone()];
    Some(RigFile::of(places, StandDevice { place, settings }))
}

pub(super) fn read(name: String, fields: &mut Fields) -> Option<(Place, StandSettings)> {
    let place = read_address(fields, "");
    let limits = fields.limits();
    let is_upwards = fields.choice("direction", &[("down", false), ("up", true)], Some(false));
    let gauge = gauge(fields);
    let limits = limits?;
    Some((
        place?,
        StandSettings {
            name,
            travel: limits.travel,
            speed_max: limits.speed_max,
            acceleration: limits.acceleration,
            unseen: limits.unseen,
            is_upwards: is_upwards?,
            gauge: gauge?,
        },
    ))
}
