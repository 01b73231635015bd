//! The description of a rig as a file: what is wired to what, which no device can report.
//!
//! Text in, a [`RigFile`] or every mistake with its line out; [`RigFile::open`] then opens the devices. The keys are
//! described in `docs/guide/galil.md`, `grbl.md`, `mark10.md` and `own-rig.md`.

mod address;
pub mod fields;
mod galil;
mod grbl;
mod mark10;
mod sidecar;

pub use fields::{Fields, Mistake};
pub(crate) use galil::galil;
pub(crate) use grbl::grbl;
pub(crate) use mark10::{gauge, stand};
pub(crate) use sidecar::sidecar;
pub use sidecar::sidecars;

use crate::cell::CellDevice;
use crate::device::{DeviceRig, OpenError, RigDevice};
use crate::devices::{DEVICES, DeviceRole};
use crate::rig::Rig;
use crate::sidecar::{SensorDevice, SensorRig};
use crate::wire::{DeviceAddress, HostClock};
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use thiserror::Error;

pub const BYTES_MAX: usize = 64 * 1024;

type Opener = dyn Fn(&HostClock) -> Result<Box<dyn Rig>, OpenError> + Send + Sync;

pub struct RigFile {
    places: Vec<DeviceAddress>,
    open: Box<Opener>,
}

#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{}", fields::format_mistakes(.file, .mistakes))]
pub struct RigFileError {
    pub file: String,
    /// What is wrong with it, in the order of its lines.
    pub mistakes: Vec<Mistake>,
}

impl RigFile {
    /// Reads the text of a rig file; `file` is what messages call it, and the rig where it has no name of its own.
    pub fn parse(file: &str, text: &str) -> Result<Self, RigFileError> {
        let error = |mistakes| RigFileError { file: file.to_owned(), mistakes };
        if text.len() > BYTES_MAX {
            let message = format!(
                "the file has more than {BYTES_MAX} bytes, so it is not a rig file; check its path"
            );
            return Err(error(vec![Mistake { line: 0, message }]));
        }
        let fields = Fields::read(text).map_err(|mistake| error(vec![mistake]))?;
        let mut fields = fields.in_folder(folder_of(file));
        let read = read(file, &mut fields);
        // Both are read, so that the mistakes of both are reported.
        let sensors = sidecar::read_sensors(&mut fields);
        let read = read.zip(sensors).map(|(read, sensors)| read.with_sensors(sensors));
        match (read, fields.finish()) {
            (Some(read), mistakes) if mistakes.is_empty() => Ok(read),
            (_, mistakes) => Err(error(mistakes)),
        }
    }

    /// A rig whose devices are at these places, that of the axis first.
    pub(crate) fn of(
        places: Vec<DeviceAddress>,
        device: impl RigDevice + Clone + Sync + 'static,
    ) -> Self {
        let open = Box::new(move |clock: &HostClock| -> Result<Box<dyn Rig>, OpenError> {
            Ok(Box::new(DeviceRig::open(device.clone(), clock.clone())?))
        });
        Self { places, open }
    }

    /// The same with sensors beside it.
    fn with_sensors(self, sensors: Vec<SensorDevice>) -> Self {
        if sensors.is_empty() {
            return self;
        }
        let Self { mut places, open } = self;
        places.extend(sensors.iter().map(|sensor| sensor.place.clone()));
        let open = Box::new(move |clock: &HostClock| -> Result<Box<dyn Rig>, OpenError> {
            let rig = open(clock)?;
            Ok(Box::new(SensorRig::open(rig, sensors.clone(), clock.clone())?))
        });
        Self { places, open }
    }

    /// Addresses of its devices, that of the axis first.
    pub fn places(&self) -> &[DeviceAddress] {
        &self.places
    }

    /// Opens the devices and checks them against the file. Nothing moves.
    pub fn open(&self, clock: &HostClock) -> Result<Box<dyn Rig>, OpenError> {
        (self.open)(clock)
    }
}

impl fmt::Debug for RigFile {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("RigFile").field(&self.places).finish()
    }
}

/// Address and settings of the load cell in the table `[cell]`.
fn read_cell(fields: &mut Fields) -> Option<(DeviceAddress, Arc<dyn CellDevice>)> {
    let cells = DEVICES.iter().filter_map(|kind| match kind.role {
        DeviceRole::Cell { read, .. } => Some((kind.word, read)),
        DeviceRole::Axis(_) => None,
    });
    let cell = fields.choice("cell.device", &cells.collect::<Vec<_>>(), None);
    let place = address::read_address(fields, "cell.");
    let cell = cell?(fields)?;
    Some((place?, cell))
}

fn read(file: &str, fields: &mut Fields) -> Option<RigFile> {
    let axes = DEVICES.iter().filter_map(|kind| match kind.role {
        DeviceRole::Axis(read) => Some((kind.word, read)),
        DeviceRole::Cell { .. } => None,
    });
    let read = fields.choice("device", &axes.collect::<Vec<_>>(), None)?;
    let name = fields.text("name").unwrap_or_else(|| stem(file));
    read(name, fields)
}

/// The folder of a file.
fn folder_of(file: &str) -> PathBuf {
    let parent = Path::new(file).parent().filter(|parent| !parent.as_os_str().is_empty());
    parent.unwrap_or(Path::new(".")).to_owned()
}

/// The file's name without folders and ending.
fn stem(file: &str) -> String {
    std::path::Path::new(file)
        .file_stem()
        .map_or_else(|| file.to_owned(), |stem| stem.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests;
