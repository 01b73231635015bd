//! The keys of a sidecar, and of sensors beside any rig.

use super::address::read_address;
use super::fields::Fields;
use super::{RigFile, RigFileError};
use crate::sidecar::{SensorDevice, SidecarDevice, SidecarSettings};
use crate::wire::DeviceAddress;
use palpate_model::rig::{RigDescription, SensorChannel};
use palpate_model::units::{MmPerS, MmPerS2, Position};

pub(crate) fn sidecar(name: String, fields: &mut Fields) -> Option<RigFile> {
    let (place, settings) = read(name, fields)?;
    Some(RigFile::of(vec![place.clone()], SidecarDevice::new(place, settings)))
}

/// Address and settings. What the sidecar knows by itself may be left out.
pub(super) fn read(name: String, fields: &mut Fields) -> Option<(DeviceAddress, SidecarSettings)> {
    let place = read_address(fields, "");
    let serial_number = fields.text("serial_number");
    let travel = fields.number("travel_mm", 1.0, 10_000.0).map(Position);
    let speed_max = fields.required_number("speed_max_mm_s", 1e-3, 1000.0);
    let acceleration = fields.number("acceleration_mm_s2", 1e-3, 1e6).map(MmPerS2);
    // As for every other axis.
    let unseen = fields.number("unseen_mm", 0.02, 0.5);
    let settings = SidecarSettings {
        name,
        serial_number,
        travel,
        speed_max: MmPerS(speed_max?),
        acceleration,
        unseen: unseen.map_or(RigDescription::UNSEEN_USUAL, Position),
    };
    Some((place?, settings))
}

/// The tables `[sensors.NAME]`, in the order of their lines; `None` where one has a mistake.
pub(super) fn read_sensors(fields: &mut Fields) -> Option<Vec<SensorDevice>> {
    let names = fields.tables_in("sensors");
    let devices: Vec<Option<SensorDevice>> =
        names.into_iter().map(|name| read_sensor(fields, name)).collect();
    devices.into_iter().collect()
}

fn read_sensor(fields: &mut Fields, name: String) -> Option<SensorDevice> {
    let table = format!("sensors.{name}.");
    let is_name = SensorChannel::is_name(&name);
    if !is_name {
        fields.mistake(&table, "name the table with letters, digits, '-' and '_'");
    }
    let place = read_address(fields, &table);
    let serial_number = fields.text(&format!("{table}serial_number"));
    Some(SensorDevice { name, place: place?, serial_number }).filter(|_| is_name)
}

/// The sidecars of a rig file: `rig`, `cell` or `sensors.NAME`, each with its address. What else is in the file is not
/// looked at.
pub fn sidecars(file: &str, text: &str) -> Result<Vec<(String, DeviceAddress)>, RigFileError> {
    let error = |mistakes| RigFileError { file: file.to_owned(), mistakes };
    let fields = Fields::read(text).map_err(|mistake| error(vec![mistake]))?;
    let mut fields = fields.in_folder(super::folder_of(file));
    let is_sidecar = |text: Option<String>| text.as_deref() == Some("sidecar");
    let mut parts: Vec<(String, String)> = Vec::new();
    if is_sidecar(fields.text("device")) {
        parts.push(("rig".into(), String::new()));
    }
    if is_sidecar(fields.text("cell.device")) {
        parts.push(("cell".into(), "cell.".into()));
    }
    for name in fields.tables_in("sensors") {
        parts.push((format!("sensors.{name}"), format!("sensors.{name}.")));
    }
    let mut all = Vec::new();
    for (part, table) in parts {
        all.extend(read_address(&mut fields, &table).map(|place| (part, place)));
    }
    match fields.into_mistakes() {
        mistakes if mistakes.is_empty() => Ok(all),
        mistakes => Err(error(mistakes)),
    }
}
