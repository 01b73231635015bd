//! The description of a rig as a file: what is wired to what, which no device can tell.
//!
//! Text in, a [`RigFile`] or every mistake with its line out; [`RigFile::open`] then opens the devices. The keys are
//! described in `docs/guide/galil.md`, `grbl.md` and `mark10.md`.

mod cell;
pub mod fields;
mod galil;
mod grbl;
mod place;
mod stand;

pub use cell::CellFile;
pub use fields::Mistake;

use crate::device::{DeviceRig, OpenError};
use crate::galil::{GalilDevice, GalilSettings};
use crate::grbl::GrblSettings;
use crate::mark10::{StandDevice, StandSettings};
use crate::parts::Parts;
use crate::rig::Rig;
use crate::wire::{HostClock, Place};
use fields::Fields;
use std::fmt;
use thiserror::Error;

/// A longer rig file is something else.
pub const BYTES_MAX: usize = 64 * 1024;

/// A rig as its file describes it.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum RigFile {
    /// Slide and load cell on one Galil controller.
    Galil {
        /// Where the controller is.
        place: Place,
        /// How it is wired.
        settings: GalilSettings,
    },
    /// A slide on a Grbl board, and a load cell on a wire of its own.
    Grbl {
        /// Where the board is.
        place: Place,
        /// How it is wired.
        settings: GrblSettings,
        /// Where the cell is.
        cell_place: Place,
        /// What it is.
        cell: CellFile,
    },
    /// A Mark-10 stand with its gauge on one line.
    Stand {
        /// Where it is.
        place: Place,
        /// What it is.
        settings: StandSettings,
    },
}

/// A rig file with mistakes, all of them.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub struct RigFileError {
    /// The file, as it was given.
    pub file: String,
    /// What is wrong with it, in the order of its lines.
    pub mistakes: Vec<Mistake>,
}

impl fmt::Display for RigFileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&fields::in_words(&self.file, &self.mistakes))
    }
}

impl RigFile {
    /// Reads the text of a rig file; `file` is what messages call it, and the rig where it has no name of its own.
    pub fn parse(file: &str, text: &str) -> Result<Self, RigFileError> {
        let error = |mistakes| RigFileError {
            file: file.to_owned(),
            mistakes,
        };
        if text.len() > BYTES_MAX {
            let message = format!("more than {BYTES_MAX} bytes are no rig file");
            return Err(error(vec![Mistake { line: 0, message }]));
        }
        let mut fields = Fields::read(text).map_err(|mistake| error(vec![mistake]))?;
        let read = read(file, &mut fields);
        match (read, fields.finish()) {
            (Some(read), mistakes) if mistakes.is_empty() => Ok(read),
            (_, mistakes) => Err(error(mistakes)),
        }
    }

    /// Where its devices are, that of the axis first.
    #[must_use]
    pub fn places(&self) -> Vec<&Place> {
        match self {
            Self::Galil { place, .. } | Self::Stand { place, .. } => vec![place],
            Self::Grbl {
                place, cell_place, ..
            } => vec![place, cell_place],
        }
    }

    /// Opens the devices and checks them against the file. Nothing moves.
    pub fn open(&self, clock: &HostClock) -> Result<Box<dyn Rig>, OpenError> {
        let clock = clock.clone();
        Ok(match self.clone() {
            Self::Galil { place, settings } => {
                Box::new(DeviceRig::open(GalilDevice::new(place, settings), clock)?)
            }
            Self::Grbl {
                place,
                settings,
                cell_place,
                cell,
            } => {
                let parts = Parts::new((place, settings), (cell_place, cell));
                Box::new(DeviceRig::open(parts, clock)?)
            }
            Self::Stand { place, settings } => {
                Box::new(DeviceRig::open(StandDevice { place, settings }, clock)?)
            }
        })
    }
}

#[derive(Clone, Copy)]
enum Device {
    Galil,
    Grbl,
    Stand,
}

fn read(file: &str, fields: &mut Fields) -> Option<RigFile> {
    let devices = [
        ("galil", Device::Galil),
        ("grbl", Device::Grbl),
        ("mark10-stand", Device::Stand),
    ];
    let device = fields.choice("device", &devices, None)?;
    let name = fields.text("name").unwrap_or_else(|| stem(file));
    match device {
        Device::Galil => {
            let (place, settings) = galil::read(name, fields)?;
            Some(RigFile::Galil { place, settings })
        }
        Device::Grbl => {
            // Both are read, so that the mistakes of both are told.
            let (axis, cell) = (grbl::read(name, fields), cell::read(fields));
            let ((place, settings), (cell_place, cell)) = (axis?, cell?);
            if place == cell_place {
                fields.mistake(
                    "cell.port",
                    "the board is at this port; the load cell has another",
                );
                return None;
            }
            Some(RigFile::Grbl {
                place,
                settings,
                cell_place,
                cell,
            })
        }
        Device::Stand => {
            let (place, settings) = stand::read(name, fields)?;
            Some(RigFile::Stand { place, settings })
        }
    }
}

/// The file's name without folders and ending.
fn stem(file: &str) -> String {
    std::path::Path::new(file).file_stem().map_or_else(
        || file.to_owned(),
        |stem| stem.to_string_lossy().into_owned(),
    )
}

#[cfg(test)]
mod tests;
