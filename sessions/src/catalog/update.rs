//! The catalog follows the sessions: what changed is read again, what is gone goes.

use super::entry::Entry;
use super::heads::{remember, remember_session};
use super::search::ReviewIs;
use super::walk::{Place, walk};
use super::{Catalog, CatalogError};
use crate::text::checksum;
use rusqlite::{Connection, OptionalExtension, TransactionBehavior, params};
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// Sessions that are written at a time: another process waits a fraction of a second at most.
const BATCH: usize = 100;

/// What an update did.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Changes {
    /// Sessions in the library.
    pub sessions: usize,
    /// Sessions that were read, for the first time or again.
    pub read: usize,
    /// Sessions that are gone.
    pub removed: usize,
    /// What could not be looked at, in sentences.
    pub remarks: Vec<String>,
}

/// A session, or a file of checks or a journal, of which the catalog says something else than there is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Doubt {
    /// Its folder, or the file, below the library.
    pub folder: String,
    /// What differs.
    pub sentence: String,
}

/// Hears how far it is: sessions done, sessions in all.
pub type Progress<'a> = &'a mut dyn FnMut(usize, usize);

impl Catalog {
    /// Reads the sessions that are new or have changed, and forgets those that are gone. Several processes
    /// may do so at a time.
    pub fn update(&mut self, progress: Progress<'_>) -> Result<Changes, CatalogError> {
        self.update_while(&mut |done, of| {
            progress(done, of);
            ControlFlow::Continue(())
        })
    }

    /// The same, which ends before its time when `progress` breaks it. What was read until then is kept.
    pub fn update_while(
        &mut self,
        progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<Changes, CatalogError> {
        let (places, remarks) = walk(&self.library);
        let mut known = self.fingerprints()?;
        let heads = self.heads()?;
        let is_new = |place: &&Place| known.get(&place.name) != Some(&place.fingerprint);
        let new: Vec<&Place> = places.iter().filter(is_new).collect();
        for place in &places {
            known.remove(&place.name);
        }
        let mut changes = Changes { sessions: places.len(), read: 0, removed: 0, remarks };
        let mut done = 0;
        let mut flow = progress(done, new.len());
        for batch in new.chunks(BATCH) {
            if flow.is_break() {
                break;
            }
            let mut entries = Vec::with_capacity(batch.len());
            for place in batch {
                if flow.is_break() {
                    break;
                }
                entries.push((*place, Entry::read(place, &heads)));
                done += 1;
                flow = progress(done, new.len());
            }
            self.write(|db| entries.iter().try_for_each(|(place, entry)| put(db, place, entry)))?;
        }
        changes.read = done;
        let gone: Vec<String> = known.into_keys().collect();
        // Another process may have read a session that came after our walk.
        let is_gone = |name: &&String| !self.library.join(name).exists();
        let gone: Vec<String> = gone.iter().filter(is_gone).cloned().collect();
        changes.removed = gone.len();
        if !gone.is_empty() {
            self.write(|db| gone.iter().try_for_each(|name| forget(db, name)))?;
        }
        let (read, wrong) = self.confirm(&heads, true);
        if !read.is_empty() {
            self.write(|db| read.iter().try_for_each(|one| remember(db, one)))?;
        }
        changes.remarks.extend(wrong.into_iter().map(|(_, sentence)| sentence));
        Ok(changes)
    }

    /// Reads everything again. What was known of edits, analyses, checks and journals is not forgotten.
    pub fn rebuild(&mut self, progress: Progress<'_>) -> Result<Changes, CatalogError> {
        self.write(|db| {
            db.execute_batch(
                "DELETE FROM session; DELETE FROM named; DELETE FROM tag; DELETE FROM words;
                 UPDATE head SET stamp = '';",
            )
        })?;
        self.update(progress)
    }

    /// Reads every session and tells where the catalog says something else; it is left as it is.
    pub fn check(&self, progress: Progress<'_>) -> Result<Vec<Doubt>, CatalogError> {
        let (places, _) = walk(&self.library);
        let heads = self.heads()?;
        let mut known: BTreeMap<String, Entry> =
            self.all()?.into_iter().map(|entry| (entry.folder.clone(), entry)).collect();
        let mut doubts = Vec::new();
        for (done, place) in places.iter().enumerate() {
            progress(done, places.len());
            let sentence = match known.remove(&place.name) {
                None => "the session is not in the catalog",
                Some(entry) if entry != Entry::read(place, &heads) => {
                    "the session has changed since the catalog read it"
                }
                Some(_) => continue,
            };
            doubts.push(Doubt { folder: place.name.clone(), sentence: sentence.to_owned() });
        }
        doubts.extend(known.into_keys().map(|folder| Doubt {
            folder,
            sentence: "the catalog has a session that is gone".to_owned(),
        }));
        let (_, wrong) = self.confirm(&heads, false);
        doubts.extend(wrong.into_iter().map(|(folder, sentence)| Doubt { folder, sentence }));
        Ok(doubts)
    }

    /// Every entry, by folder.
    pub fn all(&self) -> Result<Vec<Entry>, CatalogError> {
        let read = || -> rusqlite::Result<Vec<Entry>> {
            let sql = "SELECT entry, checksum FROM session ORDER BY folder";
            let mut statement = self.db.prepare_cached(sql)?;
            let rows = statement.query_map([], entry_of)?;
            rows.collect()
        };
        read().map_err(self.failed())
    }

    fn fingerprints(&self) -> Result<BTreeMap<String, String>, CatalogError> {
        let read = || -> rusqlite::Result<BTreeMap<String, String>> {
            let sql = "SELECT folder, fingerprint FROM session";
            let mut statement = self.db.prepare_cached(sql)?;
            let rows = statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?)))?;
            rows.collect()
        };
        read().map_err(self.failed())
    }

    /// Writes all or nothing.
    fn write(
        &mut self,
        work: impl FnOnce(&Connection) -> rusqlite::Result<()>,
    ) -> Result<(), CatalogError> {
        let failed = self.failed();
        let write = || -> rusqlite::Result<()> {
            let transaction = self.db.transaction_with_behavior(TransactionBehavior::Immediate)?;
            work(&transaction)?;
            transaction.commit()
        };
        write().map_err(failed)
    }
}

/// An entry as it stands in the table: its JSON and the checksum of that.
pub(super) fn entry_of(row: &rusqlite::Row<'_>) -> rusqlite::Result<Entry> {
    let text: String = row.get(0)?;
    let bad = |err: Box<dyn std::error::Error + Send + Sync>| {
        rusqlite::Error::FromSqlConversionFailure(0, rusqlite::types::Type::Text, err)
    };
    if checksum(&text) != row.get::<_, String>(1)? {
        return Err(bad("an entry is not as it was written".into()));
    }
    serde_json::from_str(&text).map_err(|err| bad(err.into()))
}

fn put(db: &Connection, place: &Place, entry: &Entry) -> rusqlite::Result<()> {
    forget(db, &entry.folder)?;
    let text = serde_json::to_string(entry)
        .map_err(|err| rusqlite::Error::ToSqlConversionFailure(err.into()))?;
    let started = chrono::DateTime::parse_from_rfc3339(&entry.started_at);
    // Where it cannot be read nobody can say that there is none.
    let is_unread = entry.trouble.is_some();
    let verdict = match entry.verdict {
        Some(verdict) => verdict.name(),
        None if is_unread => "?",
        None => "",
    };
    let review = match entry.review.as_ref() {
        None if is_unread => "?",
        review => ReviewIs::of(review).word(),
    };
    db.prepare_cached(
        "INSERT INTO session (folder, fingerprint, started_ms, operator, specimen, protocol, rig, cell, verdict, review, duration_s, entry, checksum)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    )?
    .execute(params![
        entry.folder,
        place.fingerprint,
        started.map_or(0, |at| at.timestamp_millis()),
        entry.operator,
        entry.specimen,
        entry.protocol,
        entry.rig,
        entry.cell,
        verdict,
        review,
        entry.duration_s,
        text,
        checksum(&text),
    ])?;
    let id = db.last_insert_rowid();
    let mut named = db.prepare_cached(
        "INSERT INTO named (session, source, name, unit, number, text) VALUES (?, ?, ?, ?, ?, ?)",
    )?;
    for one in &entry.named {
        let source = one.source.name();
        named.execute(params![id, source, one.name, one.unit, one.number, one.text])?;
    }
    let mut tags = db.prepare_cached("INSERT INTO tag (session, tag) VALUES (?, ?)")?;
    for tag in &entry.tags {
        tags.execute(params![id, tag])?;
    }
    remember_session(db, entry)?;
    db.prepare_cached("INSERT INTO words (rowid, text) VALUES (?, ?)")?
        .execute(params![id, entry.text()])?;
    Ok(())
}

fn forget(db: &Connection, folder: &str) -> rusqlite::Result<()> {
    let id: Option<i64> = db
        .prepare_cached("SELECT id FROM session WHERE folder = ?")?
        .query_row([folder], |row| row.get(0))
        .optional()?;
    if let Some(id) = id {
        for sql in [
            "DELETE FROM named WHERE session = ?",
            "DELETE FROM tag WHERE session = ?",
            "DELETE FROM words WHERE rowid = ?",
            "DELETE FROM session WHERE id = ?",
        ] {
            db.prepare_cached(sql)?.execute([id])?;
        }
    }
    Ok(())
}
