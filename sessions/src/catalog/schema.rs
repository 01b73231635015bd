//! The tables of the catalog.

use rusqlite::types::Type;
use rusqlite::{Connection, Params, Row, TransactionBehavior};
use std::error::Error;

/// Identifies the file as palpate's: "palp".
pub(super) const APPLICATION: i64 = 0x7061_6c70;
/// Version of the tables and their content. An older catalog is replaced; only the table `head` is kept.
pub const VERSION: i64 = 12;

/// Identifiers of a millisecond: a session's identifier is its start in ms times this, plus a number from 1, so that sessions in
/// the order of their identifiers are in that of their starts, and the latest of many are found without sorting them.
pub(super) const IDS: i64 = 4096;

/// `entry` has whole entries as JSON, with a checksum because SQLite has none; the other tables are for search. `named` has the
/// named values of a session, whose identifier is their owner; those of a plan, which many sessions have alike, are there once
/// under the negative of the plan's identifier. `head` has the recorded heads of JSON-lines files, each row with its checksum.
/// `words` has all text of an entry in `text`, and again the text of each [`SearchField`](super::SearchField) in a column of its
/// name. `mirrored` says up to where the table of a store was read, and `pushed` which of this computer's folders it has as they
/// are; both are empty in a library's catalog.
const TABLES: &str = "
CREATE TABLE session (
    id INTEGER PRIMARY KEY,
    folder TEXT NOT NULL UNIQUE,
    fingerprint TEXT NOT NULL,
    started_ms INTEGER NOT NULL,
    operator TEXT NOT NULL,
    specimen TEXT NOT NULL,
    protocol TEXT NOT NULL,
    rig TEXT NOT NULL,
    cell TEXT NOT NULL,
    verdict TEXT NOT NULL,
    review TEXT NOT NULL,
    duration_s REAL NOT NULL,
    plan INTEGER NOT NULL
) STRICT;
CREATE INDEX session_specimen ON session (specimen);
CREATE INDEX session_operator ON session (operator);
CREATE INDEX session_protocol ON session (protocol);
CREATE INDEX session_plan ON session (plan);
CREATE TABLE entry (
    id INTEGER PRIMARY KEY,
    entry TEXT NOT NULL,
    checksum TEXT NOT NULL
) STRICT;
CREATE TABLE plan (
    id INTEGER PRIMARY KEY,
    checksum TEXT NOT NULL UNIQUE
) STRICT;
CREATE TABLE named (
    owner INTEGER NOT NULL,
    source TEXT NOT NULL,
    name TEXT NOT NULL,
    unit TEXT NOT NULL,
    number REAL,
    text TEXT NOT NULL
) STRICT;
CREATE INDEX named_name ON named (name, number, owner, unit);
CREATE INDEX named_owner ON named (owner, name);
CREATE TABLE tag (
    session INTEGER NOT NULL,
    tag TEXT NOT NULL,
    PRIMARY KEY (session, tag)
) STRICT, WITHOUT ROWID;
CREATE INDEX tag_tag ON tag (tag);
CREATE TABLE head (
    file TEXT NOT NULL,
    name TEXT NOT NULL,
    lines INTEGER NOT NULL,
    last INTEGER NOT NULL,
    stamp TEXT NOT NULL,
    checksum TEXT NOT NULL,
    PRIMARY KEY (file, name)
) STRICT, WITHOUT ROWID;
CREATE TABLE mirrored (
    id TEXT NOT NULL,
    version INTEGER NOT NULL,
    schema TEXT NOT NULL
) STRICT;
CREATE TABLE pushed (
    folder TEXT PRIMARY KEY,
    fingerprint TEXT NOT NULL
) STRICT, WITHOUT ROWID;
CREATE VIRTUAL TABLE words USING fts5 (text, specimen, operator, protocol, rig, cell, tag, tokenize = 'unicode61', prefix = '2 3', content = '', contentless_delete = 1);
";

/// Storage for pages that SQLite keeps, 64 MB; negative, because it is not a number of pages. With SQLite's own 2 MB the indices
/// of many sessions are written again and again.
const CACHE: i64 = -64 * 1024;

/// Creates the tables of a new file, all or none.
pub(super) fn create(db: &mut Connection) -> rusqlite::Result<()> {
    // With a write-ahead log, readers and the one writer do not wait for each other.
    db.pragma_update(None, "journal_mode", "wal")?;
    let work = db.transaction_with_behavior(TransactionBehavior::Immediate)?;
    work.execute_batch(TABLES)?;
    work.pragma_update(None, "application_id", APPLICATION)?;
    work.pragma_update(None, "user_version", VERSION)?;
    work.commit()
}

pub(super) fn prepare(db: &Connection) -> rusqlite::Result<()> {
    // With a write-ahead log a power cut can lose the last changes but not the file.
    db.pragma_update(None, "synchronous", "normal")?;
    db.pragma_update(None, "cache_size", CACHE)
}

/// All rows of a statement.
pub(super) fn collect_rows<T>(
    db: &Connection,
    sql: &str,
    values: impl Params,
    read: impl FnMut(&Row<'_>) -> rusqlite::Result<T>,
) -> rusqlite::Result<Vec<T>> {
    db.prepare_cached(sql)?.query_map(values, read)?.collect()
}

/// The error for a text column whose content is damaged.
pub(super) fn bad_text(err: impl Into<Box<dyn Error + Send + Sync>>) -> rusqlite::Error {
    rusqlite::Error::FromSqlConversionFailure(0, Type::Text, err.into())
}
