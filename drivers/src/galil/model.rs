//! Which controllers can be driven, and why one cannot be opened.

use super::error::GalilError;
use std::fmt;
use std::io;
use thiserror::Error;

/// A controller as it identifies itself (`^R^V`).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GalilBoard {
    /// The whole answer, such as `DMC4143 Rev 1.3a`.
    pub revision: String,
    pub axes: usize,
    /// Serial number (`_BN`), where it reports one.
    pub serial_number: Option<u64>,
}

impl GalilBoard {
    /// Reads the answer to `^R^V`.
    pub fn parse(revision: &str) -> Result<Self, GalilOpenError> {
        let unsupported =
            |why: &'static str| GalilOpenError::Unsupported { revision: revision.to_owned(), why };
        let Some(model) = revision.strip_prefix("DMC") else {
            return Err(if revision.starts_with("RIO") {
                unsupported("it has only inputs and outputs and drives no axis")
            } else {
                GalilOpenError::NoGalil { got: revision.to_owned() }
            });
        };
        let digits: Vec<usize> =
            model.chars().map_while(|c| c.to_digit(10)).map(|digit| digit as usize).collect();
        let axes = match digits.as_slice() {
            [4, 1, axes, 3, ..] | [2, 1, axes, 3, ..] | [4, 0, axes, 0, ..] => *axes,
            [3, 0, 0, 1, 0] => 1,
            [1, 8, ..] | [1, 7, ..] => {
                return Err(unsupported(
                    "it is a plug-in card, and palpate drives no plug-in cards",
                ));
            }
            _ => {
                return Err(unsupported(
                    "palpate drives only the series 21x3, 41x3, 40x0 and 30010",
                ));
            }
        };
        if !(1..=8).contains(&axes) {
            return Err(unsupported("its name does not give a number of axes from 1 to 8"));
        }
        Ok(Self { revision: revision.to_owned(), axes, serial_number: None })
    }
}

impl fmt::Display for GalilBoard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Galil {}", self.revision)?;
        match self.serial_number {
            Some(number) => write!(f, ", no. {number}"),
            None => Ok(()),
        }
    }
}

#[derive(Clone, Debug, PartialEq, Error)]
pub enum GalilOpenError {
    /// The link was lost while the controller was set up.
    #[error("the link was lost while the controller was set up ({detail}); check cable and power")]
    Lost { detail: String },
    #[error(
        "no Galil controller answers; check its power, the cable and the baud rate set by its jumpers"
    )]
    Silent,
    #[error(
        "the device is not a Galil controller: it answers '{got}'; check the port in the rig file"
    )]
    NoGalil { got: String },
    #[error("{revision} cannot be used: {why}")]
    Unsupported { revision: String, why: &'static str },
    #[error(
        "the controller has serial number {found}, but the rig file expects {expected}; check the cables and the serial_number in the rig file"
    )]
    OtherSerial {
        found: String,
        /// The rig file's.
        expected: u64,
    },
    #[error(
        "{revision} has {axes} axes, so axis {axis} does not exist; correct the axis in the rig file"
    )]
    NoAxis {
        revision: String,
        axes: usize,
        /// The rig file's.
        axis: char,
    },
    #[error("the controller refuses {command} ({error})")]
    Refused { command: String, error: GalilError },
    #[error("the controller reports {found} after {command}; correct the rig file")]
    SetOtherwise { command: String, found: String },
    /// The rig file asks for a recording that there cannot be.
    #[error(
        "this controller cannot record samples ({0}); remove the key sampling from the rig file or set the key to \"auto\""
    )]
    NoRecording(String),
}

impl GalilOpenError {
    pub(super) fn set_otherwise(command: impl Into<String>, found: impl Into<String>) -> Self {
        Self::SetOtherwise { command: command.into(), found: found.into() }
    }
}

impl From<io::Error> for GalilOpenError {
    fn from(err: io::Error) -> Self {
        Self::Lost { detail: err.to_string() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_read_from_the_model_number() {
        for (revision, axes) in [
            ("DMC4143 Rev 1.3a", 4),
            ("DMC4010 Rev 1.3c-SER", 1),
            ("DMC30010 Rev 1.2i-SER", 1),
            ("DMC2143 Rev 1.0o", 4),
            ("DMC4183 Rev 1.3a", 8),
        ] {
            assert_eq!(GalilBoard::parse(revision).unwrap().axes, axes, "{revision}");
        }
    }

    #[test]
    fn unsupported_controllers_are_refused_by_name() {
        for (revision, why) in [
            ("DMC1820 Rev 1.0", "plug-in card"),
            ("DMC1842 Rev 1.0", "plug-in card"),
            ("RIO47120 Rev 1.1b", "drives no axis"),
            ("DMC52010 Rev 1.0", "series"),
            ("DMC4103 Rev 1", "number of axes"),
            ("Grbl 1.1h", "not a Galil"),
        ] {
            let err = GalilBoard::parse(revision).unwrap_err().to_string();
            assert!(err.contains(why) && err.contains(revision), "{err}");
        }
    }
}
