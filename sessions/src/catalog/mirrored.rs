//! A catalog of the sessions in a store, whose entries come from the store's table instead of a walk through folders; and
//! what of this computer's sessions is in it already.

use super::entry::CatalogEntry;
use super::heads::KnownHeads;
use super::schema::{bad_text, collect_rows};
use super::update::{FORGET_ALL, entry_of, put};
use super::walk::{LibrarySession, fingerprint_of};
use super::{Catalog, CatalogError};
use rusqlite::{Connection, OptionalExtension, TransactionBehavior, params};
use std::path::Path;

/// Up to where a store's table was read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MirroredTable {
    /// Identity of the table.
    pub id: String,
    /// Its version.
    pub version: u64,
    /// Its columns, as the table describes them.
    pub schema: String,
}

/// A session of the table with what identifies its content.
#[derive(Clone, Debug, PartialEq)]
pub struct MirroredSession {
    pub entry: CatalogEntry,
    /// Version of the session in the store, from 1.
    pub version: u64,
    /// SHA-256 of the list of its files.
    pub content: String,
}

/// A session on this computer's disk.
#[derive(Clone, Debug, PartialEq)]
pub struct LocalSession {
    pub entry: CatalogEntry,
    /// Sizes and times of its files.
    pub fingerprint: String,
}

impl LocalSession {
    /// Reads a session's folder, whose name becomes that of the entry.
    #[must_use]
    pub fn read(folder: &Path) -> Self {
        let name = folder.display().to_string();
        let fingerprint = fingerprint_of(folder);
        let session = LibrarySession { name, path: folder.to_owned(), fingerprint };
        let entry = CatalogEntry::read(&session, &KnownHeads::default());
        Self { entry, fingerprint: session.fingerprint }
    }

    /// Whether the files of a folder are as they were when it was read.
    #[must_use]
    pub fn is_unchanged(&self, folder: &Path) -> bool {
        fingerprint_of(folder) == self.fingerprint
    }
}

/// The text that the table `session` has for the fingerprint of a session in a store.
fn fingerprint(session: &MirroredSession) -> String {
    format!("{} {}", session.version, session.content)
}

fn parsed(fingerprint: &str) -> Option<(u64, String)> {
    let (version, content) = fingerprint.split_once(' ')?;
    Some((version.parse().ok()?, content.to_owned()))
}

/// Takes a session, unless a later version of it is known.
fn take(db: &Connection, one: &MirroredSession) -> rusqlite::Result<()> {
    let known: Option<String> = db
        .prepare_cached("SELECT fingerprint FROM session WHERE folder = ?")?
        .query_row([&one.entry.folder], |row| row.get(0))
        .optional()?;
    match known.as_deref().and_then(parsed) {
        Some((version, _)) if version >= one.version => Ok(()),
        _ => put(db, &fingerprint(one), &one.entry),
    }
}

impl Catalog {
    /// All sessions as of the last update, each with its folder below the library in its entry.
    pub fn local_sessions(&self) -> Result<Vec<LocalSession>, CatalogError> {
        let sql = "SELECT entry, checksum, fingerprint FROM session JOIN entry USING (id) ORDER BY folder";
        let read = |row: &rusqlite::Row<'_>| {
            Ok(LocalSession { entry: entry_of(row)?, fingerprint: row.get(2)? })
        };
        collect_rows(&self.db, sql, [], read).map_err(self.failed())
    }

    /// Up to where the store's table was read; none before the first time.
    pub fn mirrored_table(&self) -> Result<Option<MirroredTable>, CatalogError> {
        let read = |row: &rusqlite::Row<'_>| {
            let version: i64 = row.get(1)?;
            Ok(MirroredTable {
                id: row.get(0)?,
                version: u64::try_from(version).map_err(bad_text)?,
                schema: row.get(2)?,
            })
        };
        let found = self.db.query_row("SELECT id, version, schema FROM mirrored", [], read);
        found.optional().map_err(self.failed())
    }

    /// Takes the sessions that the table had from one of its versions to another, all or none. Where `was` is none, all that
    /// was known before is forgotten. Returns whether it was still read up to there: another process may have been faster.
    pub fn take_mirrored<E: From<CatalogError>>(
        &mut self,
        was: Option<&MirroredTable>,
        now: &MirroredTable,
        sessions: impl Iterator<Item = Result<MirroredSession, E>>,
    ) -> Result<bool, E> {
        let known = self.mirrored_table()?;
        if was.is_some() && known.as_ref() != was {
            return Ok(false);
        }
        let failed = self.failed();
        let db = self.db.transaction_with_behavior(TransactionBehavior::Immediate);
        let db = db.map_err(&failed)?;
        if was.is_none() {
            db.execute_batch(FORGET_ALL).map_err(&failed)?;
        }
        for one in sessions {
            take(&db, &one?).map_err(&failed)?;
        }
        let end = || {
            db.execute("DELETE FROM mirrored", [])?;
            let version = i64::try_from(now.version).map_err(bad_text)?;
            let values = params![now.id, version, now.schema];
            db.execute("INSERT INTO mirrored (id, version, schema) VALUES (?, ?, ?)", values)
        };
        end().map_err(&failed)?;
        db.commit().map_err(&failed)?;
        Ok(true)
    }

    /// Version and content of a session in the store; none where the store lacks it.
    pub fn mirrored_content(&self, id: &str) -> Result<Option<(u64, String)>, CatalogError> {
        let sql = "SELECT fingerprint FROM session WHERE folder = ?";
        let read = || -> rusqlite::Result<Option<String>> {
            self.db.prepare_cached(sql)?.query_row([id], |row| row.get(0)).optional()
        };
        let found = read().map_err(self.failed())?;
        Ok(found.as_deref().and_then(parsed))
    }

    /// Identifiers of all sessions, in order.
    pub fn mirrored_ids(&self) -> Result<Vec<String>, CatalogError> {
        let sql = "SELECT folder FROM session ORDER BY folder";
        collect_rows(&self.db, sql, [], |row| row.get(0)).map_err(self.failed())
    }

    /// Whether a folder of this computer was pushed as it is.
    pub fn is_pushed(&self, folder: &Path, fingerprint: &str) -> Result<bool, CatalogError> {
        let sql = "SELECT count(*) FROM pushed WHERE folder = ? AND fingerprint = ?";
        let values = params![folder.display().to_string(), fingerprint];
        let found = self.db.query_row(sql, values, |row| row.get::<_, i64>(0));
        Ok(found.map_err(self.failed())? > 0)
    }

    /// Remembers that folders were pushed as they are.
    pub fn set_pushed(&mut self, folders: &[(&Path, &str)]) -> Result<(), CatalogError> {
        self.write(|db| {
            let sql = "INSERT OR REPLACE INTO pushed (folder, fingerprint) VALUES (?, ?)";
            let mut statement = db.prepare_cached(sql)?;
            folders.iter().try_for_each(|(folder, fingerprint)| {
                statement.execute(params![folder.display().to_string(), fingerprint]).map(drop)
            })
        })
    }
}
