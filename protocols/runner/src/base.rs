//! The base behind a specimen and how thick the specimen is, as a run found them.

use palpate_protocols::engine::Record;
use palpate_sessions::log::Session;
use palpate_sessions::record::EntryKind;
use serde::Serialize;

/// Empty where no step looked for the base.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FoundBase {
    /// Position of the base from home in mm.
    pub base_mm: Option<f64>,
    /// Its standard error in mm.
    pub base_std_error_mm: Option<f64>,
    /// From the tissue's surface to the base in mm, where the surface was found before.
    pub thickness_mm: Option<f64>,
    /// Its standard error in mm.
    pub thickness_std_error_mm: Option<f64>,
}

impl FoundBase {
    #[must_use]
    pub fn of(record: &Record) -> Option<Self> {
        let Record::BaseFound {
            position, std_error_mm, thickness_mm, thickness_std_error_mm, ..
        } = record
        else {
            return None;
        };
        Some(Self {
            base_mm: Some(position.0),
            base_std_error_mm: Some(*std_error_mm),
            thickness_mm: *thickness_mm,
            thickness_std_error_mm: *thickness_std_error_mm,
        })
    }

    /// The last base of a session, edits made as the session has them.
    #[must_use]
    pub fn of_session(session: &Session) -> Self {
        let found = session.entries.iter().rev().find_map(|entry| {
            let is_one = entry.kind == EntryKind::Decision && entry.body["record"] == "base_found";
            let record = is_one.then(|| serde_json::from_value(entry.body.clone()))?;
            // A newer palpate may use the name for another record.
            Self::of(&record.ok()?)
        });
        found.unwrap_or_default()
    }

    /// Name, value and standard error in mm of what was found.
    pub fn facts(&self) -> impl Iterator<Item = (&'static str, f64, f64)> {
        let fact = |name, value: Option<f64>, error: Option<f64>| Some((name, value?, error?));
        let base = fact("base", self.base_mm, self.base_std_error_mm);
        let thickness = (self.thickness_mm, self.thickness_std_error_mm);
        let thickness = fact("thickness", thickness.0, thickness.1);
        [base, thickness].into_iter().flatten()
    }
}
