//! Recovery of a damaged or interrupted session, with an exact list of missing data.
//!
//! Data with a wrong checksum is never used, and the original is never changed. A damaged chunk is skipped; after a damaged
//! length, a search finds the next undamaged chunk.

mod companions;
mod doctor;
mod salvage;
mod write;

pub use doctor::{
    SessionExamination, SessionHealth, examine_session, find_unfinished_sessions, recover_library,
};
pub use salvage::{Salvage, salvage};
pub use write::{
    RecoverError, RecoveredSession, RecoveryOrigin, is_in_use, recover, recovered_folder,
    recovered_id,
};

use crate::record::is_zero;
use serde::{Deserialize, Serialize};

/// A gap in the samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SampleGap {
    pub after_sample: u64,
    pub samples: u64,
    /// Session time of the last sample before the gap, in s.
    pub from_s: f64,
    /// Session time of the first sample after the gap, in s; `None` at the end of the recording.
    pub to_s: Option<f64>,
}

/// A damaged place in a file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct DamageSite {
    pub file: String,
    pub offset: u64,
    pub reason: String,
}

/// Missing data of a session, to the sample.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MissingData {
    pub gaps: Vec<SampleGap>,
    /// Number of missing inputs, decisions and fits.
    pub entries: u64,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub raw_bytes: u64,
    /// Whether the end record is missing, so that later data is unknown.
    pub is_end_lost: bool,
    #[serde(rename = "wounds")]
    pub damage: Vec<DamageSite>,
    /// Edits and analyses that the recovered copy lacks, one sentence each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<String>,
}

impl MissingData {
    /// Whether data other than the end is missing.
    pub fn is_lossy(&self) -> bool {
        let has_gaps = !self.gaps.is_empty() || self.entries > 0 || self.raw_bytes > 0;
        has_gaps || !self.damage.is_empty()
    }

    /// One sentence for every loss.
    pub fn sentences(&self) -> Vec<String> {
        let mut sentences = Vec::new();
        for gap in &self.gaps {
            let SampleGap { samples, from_s, .. } = gap;
            sentences.push(match gap.to_s {
                Some(to_s) if gap.after_sample == 0 => format!(
                    "the first {samples} samples, before {to_s:.3} s of the recording, are missing; t_s counts from the first remaining sample, so its values are smaller than in the original session by the duration of the missing samples"
                ),
                Some(to_s) => {
                    format!("{samples} samples between {from_s:.3} s and {to_s:.3} s are missing")
                }
                None => format!("{samples} samples after {from_s:.3} s are missing"),
            });
        }
        if self.entries > 0 {
            let entries = self.entries;
            sentences.push(format!("{entries} inputs, decisions or fits are missing"));
        }
        if self.raw_bytes > 0 {
            let raw_bytes = self.raw_bytes;
            sentences.push(format!("{raw_bytes} raw bytes of devices are missing"));
        }
        for DamageSite { file, offset, reason } in &self.damage {
            sentences.push(format!("{file} is damaged at byte {offset}: {reason}"));
        }
        if self.is_end_lost {
            sentences.push(
                "the end is missing, so it is unknown how the run ended and whether more was recorded"
                    .into(),
            );
        }
        sentences.extend(self.left_out.iter().cloned());
        sentences
    }
}
