//! Heads of JSON-lines files as of the last update. They reveal that lines were cut off together with the [`ChainHead`]
//! beside the file.
//!
//! The catalog records the edits and analyses of every session, the daily checks of every rig, and the journals of
//! programmes. These heads are its only original data, so they survive a rebuild and a change of the catalog's version.
//!
//! Unnoticed remain lines that were added and cut again between two updates, cuts in a folder that was moved or renamed
//! since, a deleted programme folder, and any change together with a deletion or rewrite of the catalog. In a library
//! without write permission nothing is recorded.

use super::entry::{CatalogEntry, SessionHeads};
use super::schema::{bad_text, collect_rows};
use super::update::entry_of;
use super::walk::stamp;
use super::{Catalog, CatalogError};
use crate::analyses::ANALYSES_FILE;
use crate::chain::{self, ChainHead};
use crate::checks::CHECKS_FOLDER;
use crate::edits::EDITS_FILE;
use crate::folder::PROGRAMMES_FOLDER;
use crate::journal::JOURNAL_FILE;
use crate::text::checksum;
use rusqlite::{Connection, Row, params};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Longest first line that is read, in bytes.
const LINE_BYTES_MAX: u64 = 1 << 20;

/// The head of a JSON-lines file as of the last update.
#[derive(Clone, Debug)]
pub(super) struct RecordedHead {
    /// Path below the library, separated by `/`.
    file: String,
    /// Seed of the file's checksums: a session's id, a rig, or the journal's name.
    name: String,
    head: ChainHead,
    /// Size and modification time; empty for files of a session, whose fingerprint has them.
    stamp: String,
}

#[derive(Debug, Default)]
pub(super) struct KnownHeads(BTreeMap<String, Vec<RecordedHead>>);

impl KnownHeads {
    pub fn of(&self, file: &str, name: &str) -> ChainHead {
        let own = self.0.get(file).into_iter().flatten().find(|one| one.name == name);
        own.map(|one| one.head).unwrap_or_default()
    }

    pub fn of_session(&self, folder: &str, session_id: &str) -> SessionHeads {
        let [edits, analyses] = session_files(folder).map(|file| self.of(&file, session_id));
        SessionHeads { edits, analyses }
    }
}

/// The JSON-lines files of a session.
fn session_files(folder: &str) -> [String; 2] {
    [EDITS_FILE, ANALYSES_FILE].map(|name| format!("{folder}/{name}"))
}

/// A JSON-lines file outside session folders: a rig's checks, or a programme's journal.
struct LineFile<'a> {
    library: &'a Path,
    file: &'a str,
}

impl LineFile<'_> {
    fn stamp(&self) -> String {
        let path = self.library.join(self.file);
        stamp(&path, "lines") + &stamp(&ChainHead::file_of(&path), "head")
    }

    /// Seed of the checksums, from the first line; `None` for a line without checksum, as in old journals.
    fn name(&self) -> Option<String> {
        let mut line = Vec::new();
        let file = File::open(self.library.join(self.file)).ok()?;
        BufReader::new(file.take(LINE_BYTES_MAX)).read_until(b'\n', &mut line).ok()?;
        let line: Value = serde_json::from_slice(&line).ok()?;
        line.get("checksum")?;
        match self.file.ends_with(JOURNAL_FILE) {
            true => Some(JOURNAL_FILE.to_owned()),
            false => Some(line["body"]["rig"].as_str()?.to_owned()),
        }
    }
}

impl Catalog {
    pub(super) fn heads(&self) -> Result<KnownHeads, CatalogError> {
        let mut known = KnownHeads::default();
        for one in read(&self.db).map_err(self.failed())? {
            known.0.entry(one.file.clone()).or_default().push(one);
        }
        Ok(known)
    }

    /// Verifies changed JSON-lines files outside sessions. Returns their heads, and pairs of file and error.
    pub(super) fn confirm(
        &self,
        known: &KnownHeads,
        is_stamp_enough: bool,
    ) -> (Vec<RecordedHead>, Vec<(String, String)>) {
        let (mut read, mut wrong) = (Vec::new(), Vec::new());
        let mut files = self.line_files();
        files.extend(known.0.keys().filter(|file| self.is_expected(file)).cloned());
        for file in files {
            let lines = LineFile { library: &self.library, file: &file };
            let stamp = lines.stamp();
            let former = known.0.get(&file).and_then(|all| all.first());
            if is_stamp_enough && former.is_some_and(|former| former.stamp == stamp) {
                continue;
            }
            let name = former.map(|former| former.name.clone()).or_else(|| lines.name());
            let Some(name) = name else { continue };
            let since = known.of(&file, &name);
            match chain::read_since(&self.library.join(&file), &name, since) {
                Ok(chain) => read.push(RecordedHead { file, name, head: chain.head(), stamp }),
                Err(err) => wrong.push((file, err.to_string())),
            }
        }
        (read, wrong)
    }

    /// Whether a recorded file must exist: checks always, a journal while its folder exists.
    fn is_expected(&self, file: &str) -> bool {
        let top = file.split('/').next();
        let folder = || self.library.join(file).parent().is_some_and(Path::is_dir);
        top == Some(CHECKS_FOLDER) || (top == Some(PROGRAMMES_FOLDER) && folder())
    }

    fn line_files(&self) -> BTreeSet<String> {
        let names = |folder: &str| {
            let items = fs::read_dir(self.library.join(folder)).into_iter().flatten().flatten();
            items.filter_map(|item| item.file_name().into_string().ok())
        };
        let checks = names(CHECKS_FOLDER).filter(|name| name.ends_with(".jsonl"));
        let checks = checks.map(|name| format!("{CHECKS_FOLDER}/{name}"));
        let journals = names(PROGRAMMES_FOLDER)
            .map(|name| format!("{PROGRAMMES_FOLDER}/{name}/{JOURNAL_FILE}"))
            .filter(|file| self.library.join(file).is_file());
        checks.chain(journals).collect()
    }
}

/// Records a head, unless one with more lines is recorded.
pub(super) fn record_head(db: &Connection, one: &RecordedHead) -> rusqlite::Result<()> {
    let RecordedHead { file, name, head, stamp } = one;
    db.prepare_cached(
        "INSERT INTO head (file, name, lines, last, stamp, checksum) VALUES (?, ?, ?, ?, ?, ?)
         ON CONFLICT DO UPDATE SET lines = excluded.lines, last = excluded.last,
             stamp = excluded.stamp, checksum = excluded.checksum
         WHERE excluded.lines >= head.lines",
    )?
    .execute(params![file, name, head.lines as i64, head.checksum, stamp, sum(file, name, *head)])
    .map(|_| ())
}

pub(super) fn record_session_heads(db: &Connection, entry: &CatalogEntry) -> rusqlite::Result<()> {
    of_entry(entry).iter().try_for_each(|one| record_head(db, one))
}

fn of_entry(entry: &CatalogEntry) -> Vec<RecordedHead> {
    let SessionHeads { edits, analyses } = entry.heads;
    let heads = session_files(&entry.folder).into_iter().zip([edits, analyses]);
    let has_lines = |(_, head): &(String, ChainHead)| head.lines > 0;
    let name = &entry.session_id;
    heads
        .filter(has_lines)
        .map(|(file, head)| RecordedHead { file, name: name.clone(), head, stamp: String::new() })
        .collect()
}

/// Heads from a catalog of an older version, as far as they are readable.
pub(super) fn heads_of_older_version(db: &Connection) -> Vec<RecordedHead> {
    // Older versions have no table `head`, but heads in their entries.
    let sql = "SELECT entry, checksum FROM session";
    let entries = || collect_rows(db, sql, [], |row| Ok(entry_of(row).ok()));
    let of_entries =
        |entries: Vec<Option<CatalogEntry>>| entries.iter().flatten().flat_map(of_entry).collect();
    read(db).or_else(|_| entries().map(of_entries)).unwrap_or_default()
}

fn read(db: &Connection) -> rusqlite::Result<Vec<RecordedHead>> {
    collect_rows(db, "SELECT file, name, lines, last, stamp, checksum FROM head", [], parse_head)
}

fn parse_head(row: &Row<'_>) -> rusqlite::Result<RecordedHead> {
    let head = ChainHead { lines: row.get::<_, i64>(2)?.unsigned_abs(), checksum: row.get(3)? };
    let one = RecordedHead { file: row.get(0)?, name: row.get(1)?, head, stamp: row.get(4)? };
    match sum(&one.file, &one.name, head) == row.get::<_, String>(5)? {
        true => Ok(one),
        false => Err(bad_text("the recorded line count of a file has a wrong checksum")),
    }
}

fn sum(file: &str, name: &str, head: ChainHead) -> String {
    checksum(&format!("{file}\n{name}\n{} {}", head.lines, head.checksum))
}
