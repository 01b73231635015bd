//! What an imported session says of the file it was made from.

use serde::{Deserialize, Serialize};

/// Folder beside the log with the original file, as it was.
pub const ORIGINAL_FOLDER: &str = "original";

/// One thing about a file that had to be known to read it, and who said it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reading {
    /// What, such as `delimiter`.
    pub what: String,
    /// How it was taken, in words.
    pub found: String,
    /// `detected` or `told`.
    pub how: String,
    /// The option that says it otherwise.
    pub option: String,
}

/// Which file an imported session was made from, and how it was read.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Imported {
    /// Name of the file, which is kept in [`ORIGINAL_FOLDER`].
    pub file: String,
    /// Its size.
    pub bytes: u64,
    /// CRC-32 of its bytes as eight hexadecimal digits (ISO-HDLC, as in zip files).
    pub checksum: String,
    /// Its layout, such as `mach-1`.
    pub format: String,
    /// The sheet, block or interval; empty if it is all there is.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub part: String,
    /// Time of the first sample in the file, in s; the session counts from there.
    pub first_time_s: f64,
    /// How it was read.
    pub readings: Vec<Reading>,
    /// What the file says of the part in lines of its own, as text.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub facts: Vec<(String, String)>,
    /// What a user of the numbers must know, one sentence each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub remarks: Vec<String>,
}

impl Imported {
    /// File, part, layout and checksum in words.
    pub fn source(&self) -> String {
        let part = match self.part.as_str() {
            "" => String::new(),
            part => format!(" ({part})"),
        };
        format!(
            "{}{part}, {}, {} bytes, CRC-32 {}",
            self.file, self.format, self.bytes, self.checksum
        )
    }

    /// What every reader of the session must know.
    pub(crate) fn notes(&self) -> impl Iterator<Item = String> + '_ {
        let first = format!(
            "imported from {}: nothing is known of rig, calibration and noise",
            self.source()
        );
        std::iter::once(first).chain(self.remarks.iter().cloned())
    }
}
