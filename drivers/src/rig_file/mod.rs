//! The description of a rig as a file: what is wired to what, which no device can report.
//!
//! Text in, a [`RigFile`] or every mistake with its line out; [`RigFile::open`] then opens the devices. The keys are
//! described in `docs/guide/galil.md`, `grbl.md` and `mark10.md`.

mod address;
pub mod fields;
mod galil;
mod grbl;
mod mark10;

pub use fields::{Fields, Mistake};
pub(crate) use galil::galil;
pub(crate) use grbl::grbl;
pub(crate) use mark10::{gauge, stand};

use crate::cell::CellDevice;
use crate::device::{DeviceRig, OpenError, RigDevice};
use crate::devices::{DEVICES, DeviceRole};
use crate::rig::Rig;
use crate::wire::{DeviceAddress, HostClock};
use std::fmt;
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
        let mut fields = Fields::read(text).map_err(|mistake| error(vec![mistake]))?;
        let read = read(file, &mut fields);
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

/// The file's name without folders and ending.
fn stem(file: &str) -> String {
    std::path::Path::new(file)
        .file_stem()
        .map_or_else(|| file.to_owned(), |stem| stem.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests;
