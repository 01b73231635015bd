//! The first message of every session: operator, specimen, rig, settings and versions.

use crate::import_origin::ImportOrigin;
use crate::recover::RecoveryOrigin;
use chrono::{DateTime, SecondsFormat, Utc};
use palpate_model::metadata::{SessionLabels, SessionMetadata};
use palpate_model::rig::{Limits, RigDescription, SignalFacts};
use palpate_model::units::Seconds;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicU32, Ordering};

/// Version of the on-disk format. A reader refuses a higher one.
///
/// 2: imported sessions, which have no rig and no limits, and whose samples may lack volts and pulses.
///
/// 3: rigs may have channels of sensors, whose values are inputs.
///
/// 4: an axis may get a new target on the way to another one, the command `track`.
pub const RECORD_VERSION: u32 = 4;

/// Ticks per second of an imported session: fine enough for every digit of a file's times, and 63 bits span 106 days.
pub const IMPORTED_TICKS_PER_S: f64 = 1e12;

/// Everything needed to interpret and replay a session's samples and entries.
///
/// `calibration`, `plan` and `settings` are opaque here: their types belong to the crates that use them.
/// The default is an empty import: without rig, plan and decisions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// [`RECORD_VERSION`] of the program that recorded.
    pub record_version: u32,
    /// Sortable by time, such as `20260305T141507Z-9f31c2aa`.
    pub session_id: String,
    pub software_version: String,
    /// Version of the decision rules; a replay needs the same.
    pub engine_version: u32,
    /// Wall clock at session time zero, or at the import; UTC, RFC 3339 on disk.
    pub started_at: DateTime<Utc>,
    pub operator: String,
    pub specimen: String,
    /// Shape and size of the probe, in words.
    pub indenter: String,
    /// Further facts about specimen, probe and series; see [`palpate_model::metadata::METADATA_KEYS`].
    #[serde(default, skip_serializing_if = "SessionMetadata::is_empty")]
    pub about: SessionMetadata,
    /// `None` in sessions of old versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub signal: Option<SignalFacts>,
    /// `None` in a recorded session.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub imported: Option<ImportOrigin>,
    /// The rig's description of itself; `None` in an imported session.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rig: Option<RigDescription>,
    /// The interlock limits in force; `None` in an imported session.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<Limits>,
    /// Null in an imported session, like plan and settings.
    pub calibration: serde_json::Value,
    pub plan: serde_json::Value,
    /// Further inputs of a replay, such as pace and seeds.
    pub settings: serde_json::Value,
    /// Warnings the operator read and accepted before the start.
    pub acknowledgements: Vec<String>,
    /// Set if the session was recovered from another one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recovered: Option<RecoveryOrigin>,
}

impl Manifest {
    /// Duration of a tick.
    pub fn tick(&self) -> Seconds {
        self.rig.as_ref().map_or(Seconds(1.0 / IMPORTED_TICKS_PER_S), RigDescription::tick)
    }

    /// Duration of `ticks`. In an imported session it is exactly the float of the file's decimal number.
    pub fn time_of(&self, ticks: i64) -> Seconds {
        Seconds(match &self.rig {
            Some(rig) => ticks as f64 * rig.tick().0,
            None => ticks as f64 / IMPORTED_TICKS_PER_S,
        })
    }

    pub fn labels(&self) -> SessionLabels {
        SessionLabels {
            operator: self.operator.clone(),
            specimen: self.specimen.clone(),
            indenter: self.indenter.clone(),
            about: self.about.clone(),
        }
    }

    /// Takes over labels; that of the signal's filter counts for the signal too.
    pub fn set_labels(&mut self, labels: SessionLabels) {
        let filter = labels.about.get("signal.filter").and_then(serde_json::Value::as_str);
        if let (Some(signal), Some(filter)) = (&mut self.signal, filter) {
            signal.filter = filter.into();
        }
        self.operator = labels.operator;
        self.specimen = labels.specimen;
        self.indenter = labels.indenter;
        self.about = labels.about;
    }

    /// RFC 3339 in UTC, to the millisecond.
    pub fn started_at_text(&self) -> String {
        format_utc(self.started_at)
    }
}

pub(crate) fn format_utc(at: DateTime<Utc>) -> String {
    at.to_rfc3339_opts(SecondsFormat::Millis, true)
}

/// A new session name: the start in UTC to the second, then eight hexadecimal digits.
///
/// The digits hash process number, sub-second time and a counter, so that sessions of the same second, of one process or of
/// two, have different names.
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
    fn session_ids_sort_by_time_and_are_unique() {
        let first = Utc.with_ymd_and_hms(2026, 3, 5, 14, 15, 7).unwrap();
        let second = Utc.with_ymd_and_hms(2026, 3, 5, 14, 15, 8).unwrap();
        let ids = [new_session_id(first), new_session_id(first), new_session_id(second)];
        assert!(ids[0].starts_with("20260305T141507Z-"), "{}", ids[0]);
        assert_eq!(ids[0].len(), "20260305T141507Z-".len() + 8);
        assert_ne!(ids[0], ids[1]);
        assert!(ids[0] < ids[2] && ids[1] < ids[2]);
    }
}
