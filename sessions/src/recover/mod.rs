//! What can be kept of a damaged or interrupted session, and what exactly is missing.
//!
//! Nothing whose checksum is wrong is ever used, and the original is never written to. A chunk that
//! is damaged is passed over; where a length is damaged, the search goes on for the next chunk that
//! is whole.

mod beside;
mod doctor;
mod salvage;
mod write;
mod wrong_beside;

pub use doctor::{Health, Patient, examine, examine_library, recover_library};
pub use salvage::{Salvage, salvage};
pub use write::{
    RecoverError, Recovered, Recovery, is_in_use, recover, recovered_folder, recovered_id,
};

use crate::record::is_zero;
use serde::{Deserialize, Serialize};

/// Samples that are not there any more.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Gap {
    /// Samples kept before it.
    pub after_sample: u64,
    /// How many are missing.
    pub samples: u64,
    /// Session time of the last sample before it, in s.
    pub from_s: f64,
    /// Session time of the first sample after it, in s; `None` at the end of the recording.
    pub to_s: Option<f64>,
}

/// What a damaged file looked like where it could not be read.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Wound {
    /// File name.
    pub file: String,
    /// Where in the file.
    pub offset: u64,
    /// What is wrong there.
    pub reason: String,
}

/// What is missing of a session, to the sample.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Missing {
    /// Samples that are known to be missing.
    pub gaps: Vec<Gap>,
    /// Inputs, decisions and fits that are known to be missing.
    pub entries: u64,
    /// Raw bytes of devices that are known to be missing.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub raw_bytes: u64,
    /// Whether the end is missing: what came after the last sample is not known.
    pub is_end_lost: bool,
    /// The damage itself.
    pub wounds: Vec<Wound>,
    /// What stood beside the log and is not beside the copy, one sentence each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<String>,
}

impl Missing {
    /// Whether something is known to be missing, the end apart.
    pub fn is_lossy(&self) -> bool {
        let has_gaps = !self.gaps.is_empty() || self.entries > 0 || self.raw_bytes > 0;
        has_gaps || !self.wounds.is_empty()
    }

    /// One sentence for every loss.
    pub fn sentences(&self) -> Vec<String> {
        let mut told = Vec::new();
        for gap in &self.gaps {
            let Gap { samples, from_s, .. } = gap;
            told.push(match gap.to_s {
                Some(to_s) if gap.after_sample == 0 => format!(
                    "the first {samples} samples, before {to_s:.3} s of the recording, are missing: t_s counts from the first sample that was kept, so it is less than in the original by their time"
                ),
                Some(to_s) => {
                    format!("{samples} samples between {from_s:.3} s and {to_s:.3} s are missing")
                }
                None => format!("{samples} samples after {from_s:.3} s are missing"),
            });
        }
        if self.entries > 0 {
            let entries = self.entries;
            told.push(format!("{entries} inputs, decisions or fits are missing"));
        }
        if self.raw_bytes > 0 {
            let raw_bytes = self.raw_bytes;
            told.push(format!("{raw_bytes} raw bytes of devices are missing"));
        }
        for Wound { file, offset, reason } in &self.wounds {
            told.push(format!("{file} is damaged at byte {offset}: {reason}"));
        }
        if self.is_end_lost {
            told.push("the end is missing: how the run ended, and whether anything came after, is not known".into());
        }
        told.extend(self.left_out.iter().cloned());
        told
    }
}
