//! Update of the catalog: changed sessions are read again, deleted ones are removed.

use super::entry::{CatalogEntry, NamedValue, NamedValueSource};
use super::field::SearchField;
use super::heads::{record_head, record_session_heads};
use super::schema::{IDS, bad_text, collect_rows};
use super::search::ReviewFilter;
use super::walk::{LibrarySession, walk};
use super::{Catalog, CatalogError};
use crate::text::{checksum, sha256};
use rusqlite::types::Value as Sql;
use rusqlite::{Connection, OptionalExtension, TransactionBehavior, params, params_from_iter};
use serde::Serialize;
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// Sessions per transaction, which makes another process wait a fraction of a second at most.
const BATCH: usize = 100;

/// SQL that removes all sessions.
pub(super) const FORGET_ALL: &str =
    "DELETE FROM session; DELETE FROM entry; DELETE FROM plan; DELETE FROM named;
    DELETE FROM tag; INSERT INTO words (words) VALUES ('delete-all');";

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct CatalogChanges {
    pub sessions: usize,
    /// New and changed sessions.
    pub read: usize,
    pub removed: usize,
    /// One sentence for each folder or file that could not be read.
    pub remarks: Vec<String>,
}

/// A session, or a file of checks or a journal, that differs from its catalog entry.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct CatalogMismatch {
    /// Path of the folder or file below the library.
    pub folder: String,
    pub sentence: String,
}

/// Called with the number of finished sessions and of all sessions.
pub type CatalogProgress<'a> = &'a mut dyn FnMut(usize, usize);

impl Catalog {
    /// Reads new and changed sessions and removes deleted ones. Several processes may do so at a time.
    pub fn update(
        &mut self,
        progress: CatalogProgress<'_>,
    ) -> Result<CatalogChanges, CatalogError> {
        self.update_while(&mut |done, of| {
            progress(done, of);
            ControlFlow::Continue(())
        })
    }

    /// Like [`update`](Self::update), until `progress` breaks. Sessions read so far stay in the catalog.
    pub fn update_while(
        &mut self,
        progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
    ) -> Result<CatalogChanges, CatalogError> {
        let (sessions, remarks) = walk(&self.library);
        let mut known = self.fingerprints()?;
        let heads = self.heads()?;
        let is_new =
            |session: &&LibrarySession| known.get(&session.name) != Some(&session.fingerprint);
        let new: Vec<&LibrarySession> = sessions.iter().filter(is_new).collect();
        for session in &sessions {
            known.remove(&session.name);
        }
        let mut changes = CatalogChanges { sessions: sessions.len(), read: 0, removed: 0, remarks };
        let mut done = 0;
        let mut flow = progress(done, new.len());
        for batch in new.chunks(BATCH) {
            if flow.is_break() {
                break;
            }
            let mut entries = Vec::with_capacity(batch.len());
            for session in batch {
                if flow.is_break() {
                    break;
                }
                entries.push((*session, CatalogEntry::read(session, &heads)));
                done += 1;
                flow = progress(done, new.len());
            }
            self.write(|db| {
                entries.iter().try_for_each(|(session, entry)| put(db, &session.fingerprint, entry))
            })?;
        }
        changes.read = done;
        // Another process may have added a session after our walk.
        let is_gone = |name: &String| !self.library.join(name).exists();
        let gone: Vec<String> = known.into_keys().filter(is_gone).collect();
        changes.removed = gone.len();
        if !gone.is_empty() {
            self.write(|db| gone.iter().try_for_each(|name| forget(db, name)))?;
        }
        let (read, wrong) = self.confirm(&heads, true);
        if !read.is_empty() {
            self.write(|db| read.iter().try_for_each(|one| record_head(db, one)))?;
        }
        changes.remarks.extend(wrong.into_iter().map(|(_, sentence)| sentence));
        Ok(changes)
    }

    /// Reads everything again. The recorded heads of edits, analyses, checks and journals stay.
    pub fn rebuild(
        &mut self,
        progress: CatalogProgress<'_>,
    ) -> Result<CatalogChanges, CatalogError> {
        self.write(|db| db.execute_batch(&format!("{FORGET_ALL} UPDATE head SET stamp = '';")))?;
        self.update(progress)
    }

    /// Compares every session with its entry, without changing the catalog.
    pub fn check(
        &self,
        progress: CatalogProgress<'_>,
    ) -> Result<Vec<CatalogMismatch>, CatalogError> {
        let (sessions, _) = walk(&self.library);
        let heads = self.heads()?;
        let mut known: BTreeMap<String, CatalogEntry> =
            self.all()?.into_iter().map(|entry| (entry.folder.clone(), entry)).collect();
        let mut doubts = Vec::new();
        for (done, session) in sessions.iter().enumerate() {
            progress(done, sessions.len());
            let sentence = match known.remove(&session.name) {
                None => "the session is not in the catalog",
                Some(entry) if entry != CatalogEntry::read(session, &heads) => {
                    "the session has changed since the catalog read it"
                }
                Some(_) => continue,
            };
            doubts.push(CatalogMismatch {
                folder: session.name.clone(),
                sentence: sentence.to_owned(),
            });
        }
        doubts.extend(known.into_keys().map(|folder| CatalogMismatch {
            folder,
            sentence: "the session was deleted but is still in the catalog".to_owned(),
        }));
        let (_, wrong) = self.confirm(&heads, false);
        doubts.extend(
            wrong.into_iter().map(|(folder, sentence)| CatalogMismatch { folder, sentence }),
        );
        Ok(doubts)
    }

    pub fn all(&self) -> Result<Vec<CatalogEntry>, CatalogError> {
        let sql = "SELECT entry, checksum FROM session JOIN entry USING (id) ORDER BY folder";
        collect_rows(&self.db, sql, [], entry_of).map_err(self.failed())
    }

    fn fingerprints(&self) -> Result<BTreeMap<String, String>, CatalogError> {
        let sql = "SELECT folder, fingerprint FROM session";
        let pairs = collect_rows(&self.db, sql, [], |row| Ok((row.get(0)?, row.get(1)?)));
        Ok(pairs.map_err(self.failed())?.into_iter().collect())
    }

    pub(super) fn write(
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

/// Parses an entry from its JSON and the JSON's checksum.
pub(super) fn entry_of(row: &rusqlite::Row<'_>) -> rusqlite::Result<CatalogEntry> {
    let text: String = row.get(0)?;
    if checksum(&text) != row.get::<_, String>(1)? {
        return Err(bad_text("an entry of the catalog has a wrong checksum"));
    }
    serde_json::from_str(&text).map_err(bad_text)
}

pub(super) fn put(
    db: &Connection,
    fingerprint: &str,
    entry: &CatalogEntry,
) -> rusqlite::Result<()> {
    forget(db, &entry.folder)?;
    let text = serde_json::to_string(entry)
        .map_err(|err| rusqlite::Error::ToSqlConversionFailure(err.into()))?;
    let started = chrono::DateTime::parse_from_rfc3339(&entry.started_at);
    // An unreadable session may have a verdict or a review, so it must not be found as one without.
    let is_unread = entry.trouble.is_some();
    let verdict = match entry.verdict {
        Some(verdict) => verdict.name(),
        None if is_unread => "?",
        None => "",
    };
    let review = match entry.review.as_ref() {
        None if is_unread => "?",
        review => ReviewFilter::of(review).word(),
    };
    let started_ms = started.map_or(0, |at| at.timestamp_millis());
    let id = free_id(db, started_ms)?;
    let (of_plan, own): (Vec<&NamedValue>, Vec<&NamedValue>) =
        entry.named.iter().partition(|one| one.source == NamedValueSource::Plan);
    db.prepare_cached(
        "INSERT INTO session (id, folder, fingerprint, started_ms, operator, specimen, protocol, rig, cell, verdict, review, duration_s, plan)
         VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
    )?
    .execute(params![
        id,
        entry.folder,
        fingerprint,
        started_ms,
        entry.operator,
        entry.specimen,
        entry.protocol,
        entry.rig,
        entry.cell,
        verdict,
        review,
        entry.duration_s,
        plan_of(db, &of_plan)?,
    ])?;
    let sum = checksum(&text);
    db.prepare_cached("INSERT INTO entry (id, entry, checksum) VALUES (?, ?, ?)")?
        .execute(params![id, text, sum])?;
    put_named(db, id, &own)?;
    let mut tags = db.prepare_cached("INSERT INTO tag (session, tag) VALUES (?, ?)")?;
    for tag in &entry.tags {
        tags.execute(params![id, tag])?;
    }
    record_session_heads(db, entry)?;
    let columns = SearchField::ALL.map(SearchField::name).join(", ");
    let marks = ["?"; SearchField::ALL.len()].join(", ");
    let sql = format!("INSERT INTO words (rowid, text, {columns}) VALUES (?, ?, {marks})");
    let texts = SearchField::ALL.map(|field| Sql::from(field.text_of(entry)));
    let values = [Sql::from(id), entry.text().into()].into_iter().chain(texts);
    db.prepare_cached(&sql)?.execute(params_from_iter(values))?;
    Ok(())
}

/// An identifier for a session of this start.
fn free_id(db: &Connection, started_ms: i64) -> rusqlite::Result<i64> {
    let mut first = started_ms.max(0) * IDS + 1;
    loop {
        let sql = "SELECT max(id) FROM session WHERE id BETWEEN ? AND ?";
        let last = first + IDS - 2;
        let known: Option<i64> =
            db.prepare_cached(sql)?.query_row([first, last], |row| row.get(0))?;
        match known {
            None => return Ok(first),
            Some(known) if known < last => return Ok(known + 1),
            // As many sessions of one millisecond have no start at all: they cannot be read.
            Some(_) => first += IDS,
        }
    }
}

/// The identifier of a plan with these values, which are stored where they are new.
fn plan_of(db: &Connection, values: &[&NamedValue]) -> rusqlite::Result<i64> {
    let text = serde_json::to_string(values)
        .map_err(|err| rusqlite::Error::ToSqlConversionFailure(err.into()))?;
    let sum = sha256(text.as_bytes());
    let known = db
        .prepare_cached("SELECT id FROM plan WHERE checksum = ?")?
        .query_row([&sum], |row| row.get(0))
        .optional()?;
    if let Some(id) = known {
        return Ok(id);
    }
    db.execute("INSERT INTO plan (checksum) VALUES (?)", [&sum])?;
    let id = db.last_insert_rowid();
    put_named(db, -id, values)?;
    Ok(id)
}

fn put_named(db: &Connection, owner: i64, values: &[&NamedValue]) -> rusqlite::Result<()> {
    let mut named = db.prepare_cached(
        "INSERT INTO named (owner, source, name, unit, number, text) VALUES (?, ?, ?, ?, ?, ?)",
    )?;
    values.iter().try_for_each(|one| {
        let values = params![owner, one.source.name(), one.name, one.unit, one.number, one.text];
        named.execute(values).map(drop)
    })
}

fn forget(db: &Connection, folder: &str) -> rusqlite::Result<()> {
    let id: Option<i64> = db
        .prepare_cached("SELECT id FROM session WHERE folder = ?")?
        .query_row([folder], |row| row.get(0))
        .optional()?;
    if let Some(id) = id {
        for sql in [
            "DELETE FROM named WHERE owner = ?",
            "DELETE FROM entry WHERE id = ?",
            "DELETE FROM tag WHERE session = ?",
            "DELETE FROM words WHERE rowid = ?",
            "DELETE FROM session WHERE id = ?",
        ] {
            db.prepare_cached(sql)?.execute([id])?;
        }
    }
    Ok(())
}
