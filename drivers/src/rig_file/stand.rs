//! The keys of a Mark-10 stand with its gauge.

use super::RigFile;
use super::cell::gauge;
use super::fields::Fields;
use super::place::place;
use crate::device::DeviceRig;
use crate::mark10::{StandDevice, StandSettings};
use crate::wire::Place;
use palpate_model::units::{MmPerS, MmPerS2, Position};

/// A rig with the stand of a rig file.
pub(crate) fn stand(name: String, fields: &mut Fields) -> Option<RigFile> {
    let (place, settings) = read(name, fields)?;
    Some(RigFile::new(vec![place.clone()], move |clock| {
        let (place, settings) = (place.clone(), settings.clone());
        let device = StandDevice { place, settings };
        Ok(Box::new(DeviceRig::open(device, clock.clone())?))
    }))
}

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
