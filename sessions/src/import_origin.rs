//! The file that an imported session was made from, and how it was read.

use serde::{Deserialize, Serialize};

/// Folder beside the log with the unchanged original file.
pub const ORIGINAL_FOLDER: &str = "original";

/// One property of a foreign file, such as its delimiter.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ImportReading {
    /// Name of the property, such as `delimiter`.
    pub what: String,
    /// Its value, in words.
    pub found: String,
    /// `detected` or, for a value that the user gave, `told`; the words are part of the format.
    pub how: String,
    /// The option that sets it.
    pub option: String,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ImportOrigin {
    /// Name of the file in [`ORIGINAL_FOLDER`].
    pub file: String,
    pub bytes: u64,
    /// CRC-32 of its bytes as eight hexadecimal digits (ISO-HDLC, as in zip files).
    pub checksum: String,
    /// Its layout, such as `mach-1`.
    pub format: String,
    /// The sheet, block or interval; empty if the file has only one.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub part: String,
    /// Time of the first sample in the file, in s; session time counts from there.
    pub first_time_s: f64,
    pub readings: Vec<ImportReading>,
    /// Further lines of the file about this part.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub facts: Vec<(String, String)>,
    /// Remarks for users of the data, one sentence each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub remarks: Vec<String>,
}

impl ImportOrigin {
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

    pub(crate) fn notes(&self) -> impl Iterator<Item = String> + '_ {
        let first = format!(
            "the session was imported from {}; its rig, calibration and noise are unknown",
            self.source()
        );
        std::iter::once(first).chain(self.remarks.iter().cloned())
    }
}
