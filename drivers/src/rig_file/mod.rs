//! The description of a rig as a file: what is wired to what, which no device can tell.
//!
//! Text in, a [`RigFile`] or every mistake with its line out; [`RigFile::open`] then opens the devices. The keys are
//! described in `docs/guide/galil.md`.

mod fields;
mod galil;

pub use fields::Mistake;

use crate::galil::{GalilOpenError, GalilRig, GalilSettings};
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
        for (at, mistake) in self.mistakes.iter().enumerate() {
            if at > 0 {
                f.write_str("; ")?;
            }
            match mistake.line {
                0 => write!(f, "{}: {}", self.file, mistake.message)?,
                line => write!(f, "{}, line {line}: {}", self.file, mistake.message)?,
            }
        }
        Ok(())
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
            Self::Galil { place, .. } => vec![place],
        }
    }

    /// Opens the devices and checks them against the file. Nothing moves.
    pub fn open(&self, clock: &HostClock) -> Result<Box<dyn Rig>, DeviceError> {
        match self {
            Self::Galil { place, settings } => {
                Ok(Box::new(GalilRig::open(place, settings, clock.clone())?))
            }
        }
    }
}

/// A device that a rig file describes cannot be used.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum DeviceError {
    /// A Galil controller.
    #[error(transparent)]
    Galil(#[from] GalilOpenError),
    /// A device that speaks in lines: a gauge, a stand, an HX711 board.
    #[error(transparent)]
    Lines(#[from] crate::text::DeviceError),
}

fn read(file: &str, fields: &mut Fields) -> Option<RigFile> {
    fields.choice("device", &[("galil", ())], None);
    let name = fields.text("name").unwrap_or_else(|| stem(file));
    let (place, settings) = galil::read(name, fields)?;
    Some(RigFile::Galil { place, settings })
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
