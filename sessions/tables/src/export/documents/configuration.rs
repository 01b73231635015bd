//! What was set and does not change in a run, by device.

use super::keys::{CELL, PROBE, STAGE};
use palpate_sessions::manifest::Manifest;
use palpate_sessions::text::sha256;
use serde_json::{Map, Value, json};

/// Settings of a device: name, unit and value.
type Setting = (&'static str, &'static str, Value);

/// The configuration of every device, read at `time` in POSIX seconds.
pub(super) fn configuration(manifest: &Manifest, time: f64) -> Value {
    let devices = [(CELL, cell(manifest)), (STAGE, stage(manifest)), (PROBE, probe(manifest))];
    let devices = devices.into_iter().filter(|(_, settings)| !settings.is_empty());
    devices.map(|(name, settings)| (name.to_owned(), device(name, settings, time))).collect()
}

fn device(name: &str, settings: Vec<Setting>, time: f64) -> Value {
    let (mut data, mut times, mut keys) = (Map::new(), Map::new(), Map::new());
    for (setting, unit, value) in settings {
        let setting = format!("{name}_{setting}");
        let (dtype, shape) = match &value {
            Value::Number(number) if number.is_f64() => ("number", json!([])),
            Value::Number(_) => ("integer", json!([])),
            Value::Array(values) => ("array", json!([values.len()])),
            _ => ("string", json!([])),
        };
        let mut key =
            json!({ "dtype": dtype, "shape": shape, "source": format!("manifest:{setting}") });
        if !unit.is_empty() {
            key["units"] = unit.into();
        }
        keys.insert(setting.clone(), key);
        times.insert(setting.clone(), time.into());
        data.insert(setting, value);
    }
    json!({ "data": data, "timestamps": times, "data_keys": keys })
}

/// The settings of which something is known.
fn known(settings: impl IntoIterator<Item = Setting>) -> Vec<Setting> {
    settings.into_iter().filter(|(_, _, value)| !value.is_null() && *value != json!("")).collect()
}

fn cell(manifest: &Manifest) -> Vec<Setting> {
    let calibration = &manifest.calibration;
    let text = (!calibration.is_null()).then(|| calibration.to_string());
    let hash = text.as_ref().map(|text| sha256(text.as_bytes()));
    let of_calibration = |name: &str| calibration.get(name).cloned().unwrap_or_default();
    let mut settings = known([
        ("calibration", "", text.into()),
        ("calibration_name", "", of_calibration("name")),
        ("calibration_sha256", "", hash.into()),
        ("calibration_taken_at", "", of_calibration("taken_at")),
    ]);
    if let Some(signal) = &manifest.signal {
        settings.extend(known([
            ("sample_rate", "Hz", signal.sample_rate_hz.into()),
            ("filter", "", signal.filter.as_str().into()),
            ("signal_range", "V", json!(signal.range_v)),
            ("signal_resolution", "V", signal.resolution_v.into()),
        ]));
    }
    settings
}

fn stage(manifest: &Manifest) -> Vec<Setting> {
    let Some(rig) = &manifest.rig else {
        return Vec::new();
    };
    known([
        ("rig", "", rig.name.as_str().into()),
        ("identity", "", rig.identity.as_str().into()),
        ("travel_per_pulse", "mm", rig.mm_per_pulse.into()),
        ("travel", "mm", rig.travel.0.into()),
        ("tick", "ns", rig.tick_nanos.into()),
        ("speed_max", "mm/s", rig.speed_max.0.into()),
        ("acceleration", "mm/s2", rig.acceleration.0.into()),
    ])
}

fn probe(manifest: &Manifest) -> Vec<Setting> {
    let about = |name: &str| manifest.about.get(name).cloned().unwrap_or_default();
    known([
        ("description", "", manifest.indenter.as_str().into()),
        ("diameter", "mm", about("indenter.diameter_mm")),
        ("tip", "", about("indenter.tip")),
        ("material", "", about("indenter.material")),
    ])
}
