//! A session as its edits leave it: the way every reader but replay opens one.
//!
//! A corrected contact moves every depth that was counted from it by the difference, and stands in the
//! decision that found it. Metadata entries of an edit replace those of the manifest. The log itself stays as it is.

use crate::source::SourceError;
use palpate_model::metadata::{METADATA_KEYS, MetadataKey, plain_value};
use palpate_model::units::Depth;
pub use palpate_sessions::contacts::{FoundContact, contacts};
use palpate_sessions::contacts::{contact_position, is_record};
use palpate_sessions::{
    DataQuality, Edits, LogEntry, Manifest, ReadError, SampleBlock, SampleRow, Session,
    SessionOutline,
};
use std::ops::Range;
use std::path::Path;

/// A session with its edits applied.
#[derive(Clone, Debug)]
pub struct EditedSession {
    /// The session; its notes name corrections and doubts.
    pub session: Session,
    pub edits: Edits,
}

impl EditedSession {
    pub fn rejection(&self) -> Option<&str> {
        match self.edits.verdict() {
            Some((DataQuality::Rejected, edit)) => Some(&edit.reason),
            _ => None,
        }
    }
}

/// Opens a session folder, or one file of it, and makes its edits.
pub fn open(path: &Path) -> Result<EditedSession, SourceError> {
    let mut session = Session::open(path)?;
    let edits = Edits::read(path, &session.manifest.session_id)?;
    correct(&mut session, &edits);
    session.notes.extend(correct_labels(&mut session.manifest, &edits));
    session.notes.extend(doubts(&edits));
    Ok(EditedSession { session, edits })
}

/// Notes on the edits for users of the data, apart from corrections.
fn doubts(edits: &Edits) -> Vec<String> {
    let mut notes = Vec::new();
    if edits.is_torn {
        notes.push("the last edit is incomplete and does not count; the next edit moves it to edits.jsonl.torn".into());
    }
    if let Some((verdict @ (DataQuality::Suspect | DataQuality::Rejected), edit)) = edits.verdict()
    {
        notes.push(format!("{verdict}, says {}: {}", edit.by, edit.reason));
    }
    notes
}

/// A session with its edits made, whose samples pass by and are never all in memory.
#[derive(Clone, Debug)]
pub struct StreamedSession {
    /// All but the samples, its notes telling what was corrected and doubted.
    pub outline: SessionOutline,
    pub edits: Edits,
    shifts: Vec<Shift>,
}

/// Reads a session through, so that it is known to be whole, and keeps all but its samples.
pub fn stream_edited(path: &Path) -> Result<StreamedSession, SourceError> {
    let outline = Session::scan(path, &mut |_block| {})?;
    of_outline(path, outline)
}

pub fn of_outline(
    path: &Path,
    mut outline: SessionOutline,
) -> Result<StreamedSession, SourceError> {
    let edits = Edits::read(path, &outline.manifest.session_id)?;
    let (shifts, notes) = shifts(&mut outline.entries, outline.samples, &edits);
    outline.notes.extend(notes);
    outline.notes.extend(correct_labels(&mut outline.manifest, &edits));
    outline.notes.extend(doubts(&edits));
    Ok(StreamedSession { outline, edits, shifts })
}

impl StreamedSession {
    /// Whether depths are other than those recorded.
    pub fn is_changed(&self) -> bool {
        !self.shifts.is_empty()
    }

    /// Hands out every sample that was there when the session was first read, edits made, in order, some at a time.
    pub fn rows(&self, path: &Path, visit: &mut dyn FnMut(&[SampleRow])) -> Result<(), ReadError> {
        let mut index = 0;
        let mut rows = Vec::new();
        let mut each = |block: &SampleBlock| {
            rows.clear();
            rows.extend(block.rows());
            // One that is being recorded may have grown.
            let remaining = self.outline.samples.saturating_sub(index);
            rows.truncate(usize::try_from(remaining).unwrap_or(usize::MAX));
            for (number, row) in (index..).zip(&mut rows) {
                for shift in &self.shifts {
                    shift.apply(number, row);
                }
            }
            index += rows.len() as u64;
            visit(&rows);
        };
        Session::scan(path, &mut each).map(|_outline| ())
    }
}

/// Shift of the depths of a range of samples.
#[derive(Clone, Debug)]
struct Shift {
    samples: Range<u64>,
    deeper: Depth,
}

impl Shift {
    fn apply(&self, index: u64, row: &mut SampleRow) {
        if let Some(depth) = row.depth.as_mut().filter(|_| self.samples.contains(&index)) {
            *depth += self.deeper.0;
        }
    }
}

fn correct(session: &mut Session, edits: &Edits) {
    let (shifts, notes) = shifts(&mut session.entries, session.rows.len() as u64, edits);
    for shift in &shifts {
        let samples = shift.samples.start as usize..shift.samples.end as usize;
        for (row, index) in session.rows[samples].iter_mut().zip(shift.samples.start..) {
            shift.apply(index, row);
        }
    }
    session.notes.extend(notes);
}

/// Takes over the entries of edits; a sentence on each that was recorded otherwise.
fn correct_labels(manifest: &mut Manifest, edits: &Edits) -> Vec<String> {
    let recorded = manifest.labels();
    let mut labels = recorded.clone();
    edits.apply_to_labels(&mut labels);
    let note = |key: &MetadataKey| {
        let (was, now) = (recorded.value(key.name)?, labels.value(key.name));
        let edit = edits.about(key.name).filter(|_| now.as_ref() != Some(&was))?;
        let (name, was, by, reason) = (key.name, plain_value(&was), &edit.by, &edit.reason);
        Some(match now.as_ref().map(plain_value) {
            Some(now) => format!("{name} was corrected from '{was}' to '{now}' by {by} ({reason})"),
            None => format!("{name} '{was}' was removed by {by} ({reason})"),
        })
    };
    let notes = METADATA_KEYS.iter().filter_map(note).collect();
    manifest.set_labels(labels);
    notes
}

/// Corrects contacts among the entries; what that does to the depths, and a sentence on each.
fn shifts(entries: &mut [LogEntry], last: u64, edits: &Edits) -> (Vec<Shift>, Vec<String>) {
    let contacts = contacts(entries);
    let (mut shifts, mut notes) = (Vec::new(), Vec::new());
    for (index, found) in contacts.iter().enumerate() {
        let number = index as u32 + 1;
        let Some((position, edit)) = edits.contact(number) else { continue };
        let next = contacts.get(index + 1).map(|next| next.after_sample);
        let deeper = found.position.depth_from(position);
        let base = entries.iter_mut().find(|entry| {
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
        let from = found.after_sample.min(last);
        shifts.push(Shift { samples: from..until.unwrap_or(last).clamp(from, last), deeper });
        let mut entries = entries.iter_mut().filter(|entry| contact_position(entry).is_some());
        if let Some(at) = entries.nth(index).and_then(|entry| entry.body.get_mut("position")) {
            *at = position.0.into();
        }
        notes.push(format!(
            "contact {number} was corrected from {:.3} mm to {:.3} mm by {} ({}); depths are measured from the corrected contact point",
            found.position.0, position.0, edit.by, edit.reason
        ));
    }
    (shifts, notes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_model::units::Position;
    use palpate_sessions::edits::{Edit, EditChange};

    fn edit(number: u32, position_mm: f64) -> Edit {
        Edit {
            at: std::time::UNIX_EPOCH.into(),
            by: "Ada".into(),
            reason: "by eye".into(),
            change: EditChange::Contact {
                number,
                position_mm: Position(position_mm),
                was_mm: Position(0.0),
            },
        }
    }

    #[test]
    fn of_several_contacts_only_the_corrected_one_moves_its_depths() {
        let sessions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/sessions");
        let mut session = Session::open(&sessions.join("ramp-hold-lab")).unwrap();
        let first = contacts(&session.entries);
        assert_eq!(first.len(), 1);
        let known = |row: &palpate_sessions::record::SampleRow| row.depth.is_some();
        assert_eq!(session.rows.iter().position(known), Some(first[0].after_sample as usize));
        // A second one, found later, as a protocol that searches again leaves it.
        let second = (first[0].after_sample as usize + session.rows.len()) / 2;
        let mut again =
            session.entries.iter().find(|entry| contact_position(entry).is_some()).unwrap().clone();
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
            ..Edits::default()
        };
        correct(&mut session, &edits);
        for (index, (old, new)) in before.rows.iter().zip(&session.rows).enumerate() {
            let expected = if index >= second && index < third { -0.5 } else { 0.0 };
            let moved = new.depth.unwrap_or(0.0) - old.depth.unwrap_or(0.0);
            assert!((moved - expected).abs() < 1e-12 || old.depth.is_none(), "{index}: {moved}");
        }
        let base = session.entries.last().unwrap();
        assert_eq!(base.body["thickness_mm"], 19.5);
        let found = contacts(&session.entries);
        assert_eq!(found[0], first[0]);
        assert!((found[1].position.0 - first[0].position.0 - 0.5).abs() < 1e-12);
        assert_eq!(session.notes.len(), before.notes.len() + 1);
        // A contact that was never found cannot be moved.
        let mut same = before.clone();
        correct(&mut same, &Edits { all: vec![edit(3, 1.0)], ..Edits::default() });
        assert!(same == before);
    }
}
