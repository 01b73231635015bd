//! What is known of a specimen, a rig or a load cell over time: its sessions with all that was said of them,
//! the rig's daily checks and compliances, and the calibrations of rig and cell.

use super::entry::Made;
use super::search::{Order, Query};
use super::{Catalog, CatalogError};
use crate::checks::read_checks_since;
use crate::edits::{Change, Edit, Edits};
use crate::shelf::{Document, Shelf, taken_at};
use chrono::{DateTime, SecondsFormat, Utc};
use palpate_model::calibration::Calibration;
use palpate_model::rig::RigCompliance;
use serde::Serialize;

/// Whose history it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Subject {
    /// What was indented.
    Specimen,
    /// A rig, by its name.
    Rig,
    /// A load cell, by its serial number.
    Cell,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Event {
    /// When, UTC, RFC 3339 to the millisecond; empty where nobody knows.
    pub at: String,
    /// `session`, `verdict`, `contact`, `tags`, `note`, `review`, `fit`, `recalibration`, `mask`,
    /// `calibration`, `compliance` or `check`.
    pub what: String,
    /// Folder of the session below the library; empty for what is of no session.
    pub folder: String,
    /// By whom; empty where nobody is told.
    pub by: String,
    /// What, in words.
    pub sentence: String,
}

fn stamp(at: DateTime<Utc>) -> String {
    at.to_rfc3339_opts(SecondsFormat::Millis, true)
}

impl Catalog {
    /// The history of one of them, oldest first, and sentences about what cannot be read. The catalog is
    /// taken as it is: see [`Catalog::update`].
    pub fn history(
        &self,
        subject: Subject,
        name: &str,
    ) -> Result<(Vec<Event>, Vec<String>), CatalogError> {
        let wanted = Some(name.to_owned());
        let mut query = Query { order: Order::Started, ..Query::default() };
        match subject {
            Subject::Specimen => query.specimen = wanted,
            Subject::Rig => query.rig = wanted,
            Subject::Cell => query.cell = wanted,
        }
        let (mut events, mut remarks) = (Vec::new(), Vec::new());
        for entry in self.find(&query)?.entries {
            let ending = entry.ending.as_deref().unwrap_or("no end");
            events.push(Event {
                at: entry.started_at.clone(),
                what: "session".into(),
                folder: entry.folder.clone(),
                by: entry.operator.clone(),
                sentence: format!("{}, {:.1} s, {ending}", entry.protocol, entry.duration_s),
            });
            // What of it cannot be read, its edits among them, is in the entry.
            if let Ok(edits) = Edits::read(&self.library.join(&entry.folder), &entry.session_id) {
                events.extend(edits.all.iter().map(|one| Event::said(&entry.folder, one)));
            }
            remarks.extend(entry.trouble);
            events.extend(entry.analyses.iter().map(|one| Event::made(&entry.folder, one)));
        }
        let calibrations = Shelf::<Calibration>::open(&self.library);
        documents(&calibrations, &mut events, &mut remarks, |one| {
            let is_its = match subject {
                Subject::Specimen => false,
                Subject::Rig => one.rig == name,
                Subject::Cell => one.cell == name,
            };
            is_its.then(|| one.operator.clone())
        });
        let compliances = Shelf::<RigCompliance>::open(&self.library);
        documents(&compliances, &mut events, &mut remarks, |one| {
            (subject == Subject::Rig && one.rig == name).then(|| one.operator.clone())
        });
        if subject == Subject::Rig {
            let heads = self.heads()?;
            match read_checks_since(&self.library, name, |file| heads.of(file, name)) {
                Ok(checks) => events.extend(checks.iter().map(|one| Event {
                    at: stamp(one.at),
                    what: "check".into(),
                    folder: String::new(),
                    by: one.by.clone(),
                    sentence: match one.is_passed {
                        true => "daily check passed".to_owned(),
                        false => format!("daily check failed: {}", one.failures()),
                    },
                })),
                Err(err) => remarks.push(err.to_string()),
            }
        }
        // Times of one form sort as they are written; of equals, a session comes before what is said of it.
        events.sort_by(|a, b| a.at.cmp(&b.at));
        Ok((events, remarks))
    }
}

/// The documents of a shelf as events; `author` tells who made one that belongs there.
fn documents<D: Document>(
    shelf: &Shelf<D>,
    events: &mut Vec<Event>,
    remarks: &mut Vec<String>,
    author: impl Fn(&D) -> Option<String>,
) {
    remarks.extend(shelf.unreadable.iter().map(ToString::to_string));
    for kept in &shelf.kept {
        let Some(by) = author(&kept.document) else {
            continue;
        };
        let at = taken_at(&kept.document).ok().flatten();
        let instead = kept.document.supersedes();
        let instead = instead.map_or(String::new(), |old| format!(" in the place of {old}"));
        events.push(Event {
            at: at.map_or(String::new(), |at| stamp(at.to_utc())),
            what: D::KIND.into(),
            folder: String::new(),
            by,
            sentence: format!("{}{instead}", kept.id),
        });
    }
}

impl Event {
    /// An edit of the session in this folder as an event.
    #[must_use]
    pub fn said(folder: &str, edit: &Edit) -> Self {
        let (what, words) = match &edit.change {
            Change::Verdict { verdict } => ("verdict", verdict.to_string()),
            Change::Contact { position_mm, .. } => {
                ("contact", format!("at {:.3} mm", position_mm.0))
            }
            Change::Tags { add, remove } => {
                let signs = |sign: &str, tags: &[String]| -> Vec<String> {
                    tags.iter().map(|tag| format!("{sign}{tag}")).collect()
                };
                ("tags", [signs("+", add), signs("-", remove)].concat().join(" "))
            }
            Change::Review { decision, .. } => ("review", decision.name().to_owned()),
            Change::Note => ("note", String::new()),
        };
        Self {
            at: stamp(edit.at),
            what: what.into(),
            folder: folder.to_owned(),
            by: edit.by.clone(),
            sentence: match (words.as_str(), edit.reason.as_str()) {
                (_, "") => words,
                ("", reason) => reason.to_owned(),
                (_, reason) => format!("{words}: {reason}"),
            },
        }
    }

    /// An analysis of the session in this folder as an event.
    #[must_use]
    pub fn made(folder: &str, one: &Made) -> Self {
        Self {
            at: stamp(one.at),
            what: one.what.clone(),
            folder: folder.to_owned(),
            by: one.by.clone(),
            sentence: one.name.clone(),
        }
    }
}
