//! The tables of the catalog.

use rusqlite::{Connection, TransactionBehavior};

/// Marks the file as ours: "palp".
pub(super) const APPLICATION: i64 = 0x7061_6c70;
/// Version of the tables and of what stands in them. Another one is replaced, but for what it remembers of files of lines.
pub(super) const VERSION: i64 = 8;

/// `entry` has all that is known of a session, as JSON, with its own checksum, for SQLite has none; the other
/// columns are what is searched. `head` is how far files of lines went, each row with its own checksum.
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
    entry TEXT NOT NULL,
    checksum TEXT NOT NULL
) STRICT;
CREATE INDEX session_started ON session (started_ms DESC, folder);
CREATE INDEX session_specimen ON session (specimen);
CREATE INDEX session_operator ON session (operator);
CREATE INDEX session_protocol ON session (protocol);
CREATE TABLE named (
    session INTEGER NOT NULL,
    source TEXT NOT NULL,
    name TEXT NOT NULL,
    unit TEXT NOT NULL,
    number REAL,
    text TEXT NOT NULL
) STRICT;
CREATE INDEX named_name ON named (name, number);
CREATE INDEX named_session ON named (session);
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
CREATE VIRTUAL TABLE words USING fts5 (text, tokenize = 'unicode61', prefix = '2 3');
";

/// Makes the tables of a new file, all or none.
pub(super) fn create(db: &mut Connection) -> rusqlite::Result<()> {
    // Readers and one writer at a time do not wait for each other.
    db.pragma_update(None, "journal_mode", "wal")?;
    let work = db.transaction_with_behavior(TransactionBehavior::Immediate)?;
    work.execute_batch(TABLES)?;
    work.pragma_update(None, "application_id", APPLICATION)?;
    work.pragma_update(None, "user_version", VERSION)?;
    work.commit()
}

/// Settings of a connection.
pub(super) fn prepare(db: &Connection) -> rusqlite::Result<()> {
    // With a write-ahead log a power cut can lose the last changes but not the file.
    db.pragma_update(None, "synchronous", "normal")
}
