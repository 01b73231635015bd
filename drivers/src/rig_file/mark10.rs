//! The keys of a Mark-10 gauge, alone or on a stand, and of the stand.

use super::RigFile;
use super::address::read_address;
use super::fields::Fields;
use crate::mark10::gauge::{FILTER_MAX, RATES};
use crate::mark10::{GaugeSettings, StandDevice, StandSettings};
use crate::wire::DeviceAddress;
use palpate_model::units::Newtons;

pub(crate) fn gauge(fields: &mut Fields) -> Option<GaugeSettings> {
    let usual = GaugeSettings::default();
    let capacity = fields.required_number("cell.capacity_n", 1e-3, 1e6);
    let per_second = fields.whole_number("cell.readings_per_second", 1, 250);
    let per_second = per_second.map_or(usual.per_second, |rate| rate as u16);
    if !RATES.contains(&per_second) {
        let rates = RATES.map(|rate| rate.to_string()).join(", ");
        fields.mistake("cell.readings_per_second", &format!("give one of {rates}"));
    }
    let filter = fields.whole_number("cell.filter", 0, u64::from(FILTER_MAX));
    let is_reversed =
        fields.choice("cell.direction", &[("compression", false), ("tension", true)], Some(false));
    let noise = fields.number("cell.noise_n", 1e-9, 1e3).map(Newtons);
    Some(GaugeSettings {
        serial_number: fields.text("cell.serial_number"),
        capacity: Newtons(capacity?),
        per_second,
        // Between 0 and 10, checked.
        filter: filter.map(|filter| filter as u8),
        is_reversed: is_reversed?,
        noise,
    })
}

pub(crate) fn stand(name: String, fields: &mut Fields) -> Option<RigFile> {
    let (place, settings) = read(name, fields)?;
    let places = vec![place.clone()];
    Some(RigFile::of(places, StandDevice { place, settings }))
}

pub(super) fn read(name: String, fields: &mut Fields) -> Option<(DeviceAddress, StandSettings)> {
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
