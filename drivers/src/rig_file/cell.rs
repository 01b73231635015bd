//! The keys of a load cell on a wire of its own, in the table `[cell]`.

use super::address::read_address;
use super::fields::Fields;
use crate::cell::CellDevice;
use crate::devices::{DEVICES, Role};
use crate::mark10::GaugeSettings;
use crate::mark10::gauge::{FILTER_MAX, RATES};
use crate::wire::Place;
use palpate_model::units::Newtons;
use std::sync::Arc;

pub(super) fn read(fields: &mut Fields) -> Option<(Place, Arc<dyn CellDevice>)> {
    let cells = DEVICES.iter().filter_map(|kind| match kind.role {
        Role::Cell { read, .. } => Some((kind.word, read)),
        Role::Axis(_) => None,
    });
    let cell = fields.choice("cell.device", &cells.collect::<Vec<_>>(), None);
    let place = read_address(fields, "cell.");
    let cell = cell?(fields)?;
    Some((place?, cell))
}

pub(crate) fn gauge(fields: &mut Fields) -> Option<GaugeSettings> {
    let usual = GaugeSettings::default();
    let capacity = fields.needed("cell.capacity_n", 1e-3, 1e6);
    let per_second = fields.whole("cell.readings_per_second", 1, 250);
    let per_second = per_second.map_or(usual.per_second, |rate| rate as u16);
    if !RATES.contains(&per_second) {
        let rates = RATES.map(|rate| rate.to_string()).join(", ");
        fields.mistake("cell.readings_per_second", &format!("give one of {rates}"));
    }
    let filter = fields.whole("cell.filter", 0, u64::from(FILTER_MAX));
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
