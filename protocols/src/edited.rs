//! A session as its edits leave it: the way every reader but replay opens one.
//!
//! A corrected contact moves every depth that was counted from it by the difference, and stands in the
//! decision that found it. The log itself stays as it is.

use crate::analysis::SourceError;
use palpate_model::units::Position;
use palpate_sessions::edits::{Edits, Verdict};
use palpate_sessions::log::Session;
use palpate_sessions::record::{Entry, EntryKind};
use serde_json::Value;
use std::path::Path;

/// A session with its edits made.
#[derive(Clone, Debug)]
pub struct Edited {
    /// The session, its notes telling what was corrected and doubted.
    pub session: Session,
    /// The edits.
    pub edits: Edits,
}

impl Edited {
    /// Why the session was rejected, if it was.
    #[must_use]
    pub fn rejection(&self) -> Option<&str> {
        match self.edits.verdict() {
            Some((Verdict::Rejected, edit)) => Some(&edit.reason),
            _ => None,
        }
    }
}

/// Opens a session folder, or one file of it, and makes its edits.
pub fn open(path: &Path) -> Result<Edited, SourceError> {
    let mut session = Session::open(path)?;
    let edits = Edits::read(path, &session.manifest.session_id)?;
    correct(&mut session, &edits);
    if edits.is_torn {
        let note = "the last edit was begun and never finished; it does not count";
        session.notes.push(note.into());
    }
    if let Some((verdict @ (Verdict::Suspect | Verdict::Rejected), edit)) = edits.verdict() {
        session
            .notes
            .push(format!("{verdict}, says {}: {}", edit.by, edit.reason));
    }
    Ok(Edited { session, edits })
}

/// A contact that a session found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundContact {
    /// Samples before it; those that follow count their depth from it.
    pub after_sample: u64,
    /// Position from home.
    pub position: Position,
}

/// Every contact a session found, in order.
#[must_use]
pub fn contacts(session: &Session) -> Vec<FoundContact> {
    let found = session.entries.iter().filter_map(|entry| {
        Some(FoundContact {
            after_sample: entry.after_sample,
            position: Position(found_at(entry)?.as_f64()?),
        })
    });
    found.collect()
}

/// The position in a decision that found contact.
fn found_at(entry: &Entry) -> Option<&Value> {
    is_record(entry, "contact_found").then(|| entry.body.get("position"))?
}

fn is_record(entry: &Entry, name: &str) -> bool {
    let body = &entry.body;
    entry.kind == EntryKind::Decision && body["effect"] == "record" && body["record"] == name
}

fn correct(session: &mut Session, edits: &Edits) {
    let contacts = contacts(session);
    for (index, found) in contacts.iter().enumerate() {
        let number = index as u32 + 1;
        let Some((position, edit)) = edits.contact(number) else {
            continue;
        };
        let next = contacts.get(index + 1).map(|next| next.after_sample);
        let deeper = found.position.depth_from(position);
        let base = session.entries.iter_mut().find(|entry| {
            let at = entry.after_sample;
            is_record(entry, "base_found")
                && at > found.after_sample
                && next.is_none_or(|next| at <= next)
        });
        // Depths behind a base count from the base; how thick the specimen is does not.
        let until = match base {
            Some(base) => {
                if let Some(thickness) = base.body["thickness_mm"].as_f64() {
                    base.body["thickness_mm"] = (thickness + deeper.0).into();
                }
                Some(base.after_sample)
            }
            None => next,
        };
        let last = session.rows.len();
        let until = until.map_or(last, |until| until as usize).min(last);
        let range = (found.after_sample as usize).min(until)..until;
        for depth in session.rows[range]
            .iter_mut()
            .filter_map(|row| row.depth.as_mut())
        {
            *depth += deeper.0;
        }
        let mut entries = session
            .entries
            .iter_mut()
            .filter(|entry| found_at(entry).is_some());
        if let Some(at) = entries
            .nth(index)
            .and_then(|entry| entry.body.get_mut("position"))
        {
            *at = position.0.into();
        }
        session.notes.push(format!(
            "contact {number} was corrected from {:.3} to {:.3} mm by {}: {}; depths count from there",
            found.position.0, position.0, edit.by, edit.reason
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_sessions::edits::{Change, Edit};

    fn edit(number: u32, position_mm: f64) -> Edit {
        Edit {
            at: std::time::UNIX_EPOCH.into(),
            by: "Ada".into(),
            reason: "by eye".into(),
            change: Change::Contact {
                number,
                position_mm: Position(position_mm),
                was_mm: Position(0.0),
            },
        }
    }

    #[test]
    fn of_several_contacts_only_the_corrected_one_moves_its_depths() {
        let sessions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/sessions");
        let mut session = Session::open(&sessions.join("ramp-hold-lab")).unwrap();
        let first = contacts(&session);
        assert_eq!(first.len(), 1);
        let known = |row: &palpate_sessions::record::Row| row.depth.is_some();
        assert_eq!(
            session.rows.iter().position(known),
            Some(first[0].after_sample as usize)
        );
        // A second one, found later, as a protocol that searches again leaves it.
        let second = (first[0].after_sample as usize + session.rows.len()) / 2;
        let mut again = session
            .entries
            .iter()
            .find(|entry| found_at(entry).is_some())
            .unwrap()
            .clone();
        again.after_sample = second as u64;
        session.entries.push(again.clone());
        // Then the base behind it: depths count from there.
        let third = (second + session.rows.len()) / 2;
        again.after_sample = third as u64;
        again.body["record"] = "base_found".into();
        again.body["thickness_mm"] = 20.0.into();
        session.entries.push(again);
        let before = session.clone();
        let edits = Edits {
            all: vec![edit(2, 40.0), edit(2, first[0].position.0 + 0.5)],
            is_torn: false,
        };
        correct(&mut session, &edits);
        for (index, (old, new)) in before.rows.iter().zip(&session.rows).enumerate() {
            let expected = match index >= second && index < third {
                true => -0.5,
                false => 0.0,
            };
            let moved = new.depth.unwrap_or(0.0) - old.depth.unwrap_or(0.0);
            assert!(
                (moved - expected).abs() < 1e-12 || old.depth.is_none(),
                "{index}: {moved}"
            );
        }
        let base = session.entries.last().unwrap();
        assert_eq!(base.body["thickness_mm"], 19.5);
        let found = contacts(&session);
        assert_eq!(found[0], first[0]);
        assert!((found[1].position.0 - first[0].position.0 - 0.5).abs() < 1e-12);
        assert_eq!(session.notes.len(), before.notes.len() + 1);
        // A contact that was never found cannot be moved.
        let mut same = before.clone();
        correct(
            &mut same,
            &Edits {
                all: vec![edit(3, 1.0)],
                is_torn: false,
            },
        );
        assert!(same == before);
    }
}
