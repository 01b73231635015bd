//! The contact points of a session, in the order in which edits number them.

use crate::record::{EntryKind, LogEntry};
use palpate_model::units::Position;
use serde_json::Value;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundContact {
    /// Samples before the contact; depths of later samples count from it.
    pub after_sample: u64,
    pub position: Position,
}

#[must_use]
pub fn contacts(entries: &[LogEntry]) -> Vec<FoundContact> {
    let found = entries.iter().filter_map(|entry| {
        Some(FoundContact {
            after_sample: entry.after_sample,
            position: Position(contact_position(entry)?.as_f64()?),
        })
    });
    found.collect()
}

/// The position in a decision that records a contact.
#[must_use]
pub fn contact_position(entry: &LogEntry) -> Option<&Value> {
    is_record(entry, "contact_found").then(|| entry.body.get("position"))?
}

/// Whether an entry is a decision with a record of this name.
#[must_use]
pub fn is_record(entry: &LogEntry, name: &str) -> bool {
    let body = &entry.body;
    entry.kind == EntryKind::Decision && body["effect"] == "record" && body["record"] == name
}
