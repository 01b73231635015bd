//! History of a specimen, a rig or a load cell: sessions with edits and analyses, daily checks, machine compliances and
//! calibrations.

use super::entry::CatalogAnalysis;
use super::search::{CatalogOrder, CatalogQuery};
use super::{Catalog, CatalogError};
use crate::checks::read_checks_since;
use crate::document_store::{Document, DocumentStore, taken_at};
use crate::edits::{Edit, EditChange, Edits};
use crate::manifest::format_utc;
use palpate_model::calibration::Calibration;
use palpate_model::rig::RigCompliance;
use serde::Serialize;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum HistorySubject {
    Specimen,
    Rig,
    /// A load cell, by its serial number.
    Cell,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HistoryEvent {
    /// UTC, RFC 3339 to the millisecond; empty if unknown.
    pub at: String,
    /// `session`, `verdict`, `contact`, `about`, `tags`, `note`, `review`, `fit`, `recalibration`, `mask`,
    /// `calibration`, `compliance` or `check`.
    pub what: String,
    /// Folder of the session below the library; empty for an event outside sessions.
    pub folder: String,
    /// Author; empty if unknown.
    pub by: String,
    pub sentence: String,
}

impl Catalog {
    /// Events as of the last [`Catalog::update`], oldest first, and one sentence for each unreadable file.
    pub fn history(
        &self,
        subject: HistorySubject,
        name: &str,
    ) -> Result<(Vec<HistoryEvent>, Vec<String>), CatalogError> {
        let criterion = Some(name.to_owned());
        let mut query = CatalogQuery { order: CatalogOrder::Started, ..CatalogQuery::default() };
        match subject {
            HistorySubject::Specimen => query.specimen = criterion,
            HistorySubject::Rig => query.rig = criterion,
            HistorySubject::Cell => query.cell = criterion,
        }
        let (mut events, mut remarks) = (Vec::new(), Vec::new());
        for entry in self.find(&query)?.entries {
            let ending = entry.ending.as_deref().unwrap_or("no end");
            let sentence = format!("{}, {:.1} s, {ending}", entry.protocol, entry.duration_s);
            let (at, folder) = (entry.started_at.clone(), &entry.folder);
            events.push(HistoryEvent::new(at, "session", folder, &entry.operator, sentence));
            // The entry's `trouble` reports unreadable edits.
            if let Ok(edits) = Edits::read(&self.library.join(&entry.folder), &entry.session_id) {
                events.extend(
                    edits.all.iter().map(|one| HistoryEvent::from_edit(&entry.folder, one)),
                );
            }
            remarks.extend(entry.trouble);
            events.extend(
                entry.analyses.iter().map(|one| HistoryEvent::from_analysis(&entry.folder, one)),
            );
        }
        let calibrations = DocumentStore::<Calibration>::open(&self.library);
        add_documents(&calibrations, &mut events, &mut remarks, |one| {
            let is_its = match subject {
                HistorySubject::Specimen => false,
                HistorySubject::Rig => one.rig == name,
                HistorySubject::Cell => one.cell == name,
            };
            is_its.then(|| one.operator.clone())
        });
        let compliances = DocumentStore::<RigCompliance>::open(&self.library);
        add_documents(&compliances, &mut events, &mut remarks, |one| {
            (subject == HistorySubject::Rig && one.rig == name).then(|| one.operator.clone())
        });
        if subject == HistorySubject::Rig {
            let heads = self.heads()?;
            match read_checks_since(&self.library, name, |file| heads.of(file, name)) {
                Ok(checks) => events.extend(checks.iter().map(|one| {
                    let sentence = match one.is_passed {
                        true => "daily check passed".to_owned(),
                        false => format!("daily check failed: {}", one.failures()),
                    };
                    HistoryEvent::new(format_utc(one.at), "check", "", &one.by, sentence)
                })),
                Err(err) => remarks.push(err.to_string()),
            }
        }
        // RFC 3339 texts of one form sort by time. The sort is stable: a session precedes its edits of the same time.
        events.sort_by(|a, b| a.at.cmp(&b.at));
        Ok((events, remarks))
    }
}

/// Adds the documents for which `author` returns a name.
fn add_documents<D: Document>(
    shelf: &DocumentStore<D>,
    events: &mut Vec<HistoryEvent>,
    remarks: &mut Vec<String>,
    author: impl Fn(&D) -> Option<String>,
) {
    remarks.extend(shelf.unreadable.iter().map(ToString::to_string));
    for stored in &shelf.documents {
        let Some(by) = author(&stored.document) else {
            continue;
        };
        let at = taken_at(&stored.document).ok().flatten();
        let superseded = stored.document.supersedes();
        let superseded = superseded.map_or(String::new(), |old| format!(" supersedes {old}"));
        let at = at.map_or(String::new(), |at| format_utc(at.to_utc()));
        events.push(HistoryEvent::new(at, D::KIND, "", &by, format!("{}{superseded}", stored.id)));
    }
}

impl HistoryEvent {
    fn new(at: String, what: &str, folder: &str, by: &str, sentence: String) -> Self {
        Self { at, what: what.into(), folder: folder.into(), by: by.into(), sentence }
    }

    #[must_use]
    pub fn from_edit(folder: &str, edit: &Edit) -> Self {
        let (what, words) = match &edit.change {
            EditChange::Verdict { verdict } => ("verdict", verdict.to_string()),
            EditChange::Contact { position_mm, .. } => {
                ("contact", format!("at {:.3} mm", position_mm.0))
            }
            EditChange::Tags { add, remove } => {
                let signs = |sign: &str, tags: &[String]| -> Vec<String> {
                    tags.iter().map(|tag| format!("{sign}{tag}")).collect()
                };
                ("tags", [signs("+", add), signs("-", remove)].concat().join(" "))
            }
            EditChange::About { entries } => ("about", entries.pairs()),
            EditChange::Review { decision, .. } => ("review", decision.name().to_owned()),
            EditChange::Note => ("note", String::new()),
        };
        let sentence = match (words.as_str(), edit.reason.as_str()) {
            (_, "") => words,
            ("", reason) => reason.to_owned(),
            (_, reason) => format!("{words}: {reason}"),
        };
        Self::new(format_utc(edit.at), what, folder, &edit.by, sentence)
    }

    #[must_use]
    pub fn from_analysis(folder: &str, one: &CatalogAnalysis) -> Self {
        Self::new(format_utc(one.at), &one.what, folder, &one.by, one.name.clone())
    }
}
