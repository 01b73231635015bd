//! The keys of a load cell on a wire of its own, in the table `[cell]`.

use super::fields::Fields;
use super::place::place;
use crate::hx711::Hx711Settings;
use crate::mark10::GaugeSettings;
use crate::mark10::gauge::{FILTER_MAX, RATES};
use crate::text::{DeviceError, OpenedCell};
use crate::wire::{HostClock, Link, Place};
use palpate_model::units::{Newtons, Volts};
use std::sync::Arc;

/// A load cell beside an axis.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum CellFile {
    /// An HX711 board with palpate's sketch.
    Hx711(Hx711Settings),
    /// A Mark-10 force gauge.
    Mark10(GaugeSettings),
}

impl CellFile {
    /// Makes sure who answers on a link.
    pub(crate) fn open(
        &self,
        link: &mut dyn Link,
        clock: &HostClock,
    ) -> Result<OpenedCell, DeviceError> {
        let name: Arc<str> = "cell".into();
        match self {
            Self::Hx711(settings) => crate::hx711::open(link, clock, settings, &name),
            Self::Mark10(settings) => crate::mark10::gauge::open(link, clock, settings, &name),
        }
    }
}

#[derive(Clone, Copy)]
enum Kind {
    Hx711,
    Mark10,
}

/// Where the cell is, and what it is.
pub(super) fn read(fields: &mut Fields) -> Option<(Place, CellFile)> {
    let kinds = [("hx711", Kind::Hx711), ("mark10", Kind::Mark10)];
    let kind = fields.choice("cell.device", &kinds, None);
    let place = place(fields, "cell.", true);
    let cell = match kind? {
        Kind::Hx711 => {
            let usual = Hx711Settings::default();
            CellFile::Hx711(Hx711Settings {
                board: fields.text("cell.board"),
                full_scale: fields
                    .number("cell.full_scale_v", 1e-3, 1000.0)
                    .map_or(usual.full_scale, Volts),
                noise: fields
                    .number("cell.noise_v", 1e-9, 1.0)
                    .map_or(usual.noise, Volts),
            })
        }
        Kind::Mark10 => CellFile::Mark10(gauge(fields)?),
    };
    Some((place?, cell))
}

/// A gauge, alone or on a stand.
pub(super) fn gauge(fields: &mut Fields) -> Option<GaugeSettings> {
    let usual = GaugeSettings::default();
    let capacity = fields.needed("cell.capacity_n", 1e-3, 1e6);
    let per_second = fields.whole("cell.readings_per_second", 1, 250);
    let per_second = per_second.map_or(usual.per_second, |rate| rate as u16);
    if !RATES.contains(&per_second) {
        let rates = RATES.map(|rate| rate.to_string()).join(", ");
        fields.mistake("cell.readings_per_second", &format!("gauges send {rates}"));
    }
    let filter = fields.whole("cell.filter", 0, u64::from(FILTER_MAX));
    let is_reversed = fields.choice(
        "cell.direction",
        &[("compression", false), ("tension", true)],
        Some(false),
    );
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
