//! The first message of every session: who measured what, on which rig, with which versions.

use crate::imported::Imported;
use crate::recover::Recovered;
use chrono::{DateTime, SecondsFormat, Utc};
use palpate_model::about::About;
use palpate_model::rig::{Limits, RigDescription, SignalFacts};
use palpate_model::units::Seconds;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicU32, Ordering};

/// Version of the on-disk form. A reader refuses a higher one.
///
/// 2: imported sessions, which have no rig and no limits, and samples without volts and pulses.
pub const RECORD_VERSION: u32 = 2;

/// Ticks in a second of an imported session: fine enough to keep every digit that a file's times have, and
/// 63 bits of them are 106 days.
pub const IMPORTED_TICKS_PER_S: f64 = 1e12;

/// What a session needs to be understood and replayed, beside its samples and entries.
///
/// `calibration`, `plan` and `settings` are opaque here: their types belong to the crates that
/// act on them, which read them back from this JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Version of the on-disk form, [`RECORD_VERSION`] when written by this program.
    pub record_version: u32,
    /// Sortable name of the session, such as `20260305T141507Z-9f31c2aa`.
    pub session_id: String,
    /// Version of the program that recorded.
    pub software_version: String,
    /// Version of the decision rules that recorded; a replay needs the same.
    pub engine_version: u32,
    /// Wall clock at session time zero, UTC, RFC 3339 on disk; of the import, for an imported session.
    pub started_at: DateTime<Utc>,
    /// Who measured.
    pub operator: String,
    /// What was indented.
    pub specimen: String,
    /// The probe's shape and size, in words.
    pub indenter: String,
    /// What else was told of specimen, probe and series; see [`palpate_model::about::KEYS`].
    #[serde(default, skip_serializing_if = "About::is_empty")]
    pub about: About,
    /// How the signal was taken; `None` in sessions recorded before this was written down.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signal: Option<SignalFacts>,
    /// Which file the session was imported from, and how; `None` for one that was recorded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub imported: Option<Imported>,
    /// The rig as it described itself; `None` in an imported session.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rig: Option<RigDescription>,
    /// The interlock limits in force; `None` in an imported session.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<Limits>,
    /// The load-cell calibration in force; null in an imported session, as are plan and settings.
    pub calibration: serde_json::Value,
    /// The protocol and its parameters.
    pub plan: serde_json::Value,
    /// Whatever else a replay needs, such as pace and seeds.
    pub settings: serde_json::Value,
    /// Warnings the operator read and accepted before the start.
    pub acknowledgements: Vec<String>,
    /// Set if this is what could be kept of another session.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recovered: Option<Recovered>,
}

impl Manifest {
    /// Length of one tick of the samples.
    pub fn tick(&self) -> Seconds {
        self.rig.as_ref().map_or(Seconds(1.0 / IMPORTED_TICKS_PER_S), RigDescription::tick)
    }

    /// The length of so many ticks. Of an imported session it is the float that the file's decimal number is.
    pub fn time_of(&self, ticks: i64) -> Seconds {
        Seconds(match &self.rig {
            Some(rig) => ticks as f64 * rig.tick().0,
            None => ticks as f64 / IMPORTED_TICKS_PER_S,
        })
    }

    /// The start as an RFC 3339 text in UTC, to the millisecond.
    pub fn started_at_text(&self) -> String {
        self.started_at.to_rfc3339_opts(SecondsFormat::Millis, true)
    }
}

/// A new session name: the UTC start to the second, then eight hexadecimal digits.
///
/// The digits mix the process, the sub-second time and a counter, so that two sessions started
/// in the same second, by one process or by two, get different names.
#[must_use]
pub fn new_session_id(started_at: DateTime<Utc>) -> String {
    static COUNTER: AtomicU32 = AtomicU32::new(0);
    let counter = COUNTER.fetch_add(1, Ordering::Relaxed);
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&std::process::id().to_le_bytes());
    hasher.update(&started_at.timestamp_subsec_nanos().to_le_bytes());
    hasher.update(&counter.to_le_bytes());
    let tail = hasher.finalize();
    format!("{}-{tail:08x}", started_at.format("%Y%m%dT%H%M%SZ"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use chrono::TimeZone;

    #[test]
    fn session_ids_sort_by_time_and_do_not_repeat() {
        let first = Utc.with_ymd_and_hms(2026, 3, 5, 14, 15, 7).unwrap();
        let second = Utc.with_ymd_and_hms(2026, 3, 5, 14, 15, 8).unwrap();
        let ids = [new_session_id(first), new_session_id(first), new_session_id(second)];
        assert!(ids[0].starts_with("20260305T141507Z-"), "{}", ids[0]);
        assert_eq!(ids[0].len(), "20260305T141507Z-".len() + 8);
        assert_ne!(ids[0], ids[1]);
        assert!(ids[0] < ids[2] && ids[1] < ids[2]);
    }
}
