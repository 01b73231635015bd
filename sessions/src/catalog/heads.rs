//! How far files of lines went when the catalog last read them: what notices that lines were taken off the end together
//! with the [`Head`] beside them.
//!
//! Recorded are the edits and the analyses of every session, the daily checks of every rig and the journals of programmes
//! in the library. It is the one thing that the catalog does not only repeat, so it stays when the catalog is rebuilt and
//! when another version of palpate replaces the tables.
//!
//! It notices a file that is shorter or other than at the last update, whatever became of the head beside it. Not noticed
//! is what was added and cut again between two updates, what was cut in a folder that was moved or renamed since, a programme
//! whose whole folder is gone, and anything by somebody who also deletes or rewrites the catalog: it then knows only
//! what it finds. A library that may not be written is never remembered.

use super::entry::{Entry, Heads};
use super::update::entry_of;
use super::walk::stamp;
use super::{Catalog, CatalogError};
use crate::analyses::ANALYSES_FILE;
use crate::chain::{self, Head};
use crate::checks::CHECKS_FOLDER;
use crate::edits::EDITS_FILE;
use crate::folder::PROGRAMMES_FOLDER;
use crate::journal::JOURNAL_FILE;
use crate::text::checksum;
use rusqlite::types::Type;
use rusqlite::{Connection, Row, params};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

/// Longest first line that is looked at.
const LINE_BYTES_MAX: u64 = 1 << 20;

/// A file of lines that the catalog has read.
#[derive(Clone, Debug)]
pub(super) struct RecordedHead {
    /// Its path below the library, with `/` between.
    file: String,
    /// What it belongs to: a session's id, a rig, or the journal's own name.
    name: String,
    head: Head,
    /// Size and time of change; empty where it is not asked for.
    stamp: String,
}

/// All of them, by path.
#[derive(Debug, Default)]
pub(super) struct KnownHeads(BTreeMap<String, Vec<RecordedHead>>);

impl KnownHeads {
    /// How far a file went that belongs to `name`.
    pub fn of(&self, file: &str, name: &str) -> Head {
        let own = self.0.get(file).into_iter().flatten().find(|one| one.name == name);
        own.map(|one| one.head).unwrap_or_default()
    }

    /// How far the files of a session went.
    pub fn of_session(&self, folder: &str, session_id: &str) -> Heads {
        let [edits, analyses] = beside(folder).map(|file| self.of(&file, session_id));
        Heads { edits, analyses }
    }
}

/// The files of lines in a session's folder.
fn beside(folder: &str) -> [String; 2] {
    [EDITS_FILE, ANALYSES_FILE].map(|name| format!("{folder}/{name}"))
}

/// The file of lines of a rig's checks or a programme, which is in no session's folder.
struct LineFile<'a> {
    library: &'a Path,
    file: &'a str,
}

impl LineFile<'_> {
    fn stamp(&self) -> String {
        let path = self.library.join(self.file);
        stamp(&path, "lines") + &stamp(&Head::file_of(&path), "head")
    }

    /// What it belongs to, by its first line; none where that has no checksum, as in an old journal.
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
    /// The recorded head of every file.
    pub(super) fn heads(&self) -> Result<KnownHeads, CatalogError> {
        let mut known = KnownHeads::default();
        for one in read(&self.db).map_err(self.failed())? {
            known.0.entry(one.file.clone()).or_default().push(one);
        }
        Ok(known)
    }

    /// Reads the changed files of lines outside sessions. Returns how far each goes and, by file, what is wrong.
    pub(super) fn confirm(
        &self,
        known: &KnownHeads,
        is_stamp_enough: bool,
    ) -> (Vec<RecordedHead>, Vec<(String, String)>) {
        let (mut read, mut wrong) = (Vec::new(), Vec::new());
        let mut files = self.files_of_lines();
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

    /// Whether a file that is remembered ought to be there: of checks always, of a programme as long as its folder is.
    fn is_expected(&self, file: &str) -> bool {
        let top = file.split('/').next();
        let folder = || self.library.join(file).parent().is_some_and(Path::is_dir);
        top == Some(CHECKS_FOLDER) || (top == Some(PROGRAMMES_FOLDER) && folder())
    }

    fn files_of_lines(&self) -> BTreeSet<String> {
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

/// Remembers how far a file goes. What is remembered of more lines stays.
pub(super) fn remember(db: &Connection, one: &RecordedHead) -> rusqlite::Result<()> {
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

/// Remembers the files of a session.
pub(super) fn remember_session(db: &Connection, entry: &Entry) -> rusqlite::Result<()> {
    of_entry(entry).iter().try_for_each(|one| remember(db, one))
}

fn of_entry(entry: &Entry) -> Vec<RecordedHead> {
    let Heads { edits, analyses } = entry.heads;
    let heads = beside(&entry.folder).into_iter().zip([edits, analyses]);
    let has_lines = |(_, head): &(String, Head)| head.lines > 0;
    let name = &entry.session_id;
    heads
        .filter(has_lines)
        .map(|(file, head)| RecordedHead { file, name: name.clone(), head, stamp: String::new() })
        .collect()
}

/// What a catalog of another version remembers, as far as that can be understood.
pub(super) fn heads_of_other_version(db: &Connection) -> Vec<RecordedHead> {
    let entries = || -> rusqlite::Result<Vec<RecordedHead>> {
        let mut statement = db.prepare("SELECT entry, checksum FROM session")?;
        let entries = statement.query_map([], entry_of)?;
        Ok(entries.flatten().flat_map(|entry| of_entry(&entry)).collect())
    };
    read(db).or_else(|_| entries()).unwrap_or_default()
}

fn read(db: &Connection) -> rusqlite::Result<Vec<RecordedHead>> {
    let mut statement =
        db.prepare_cached("SELECT file, name, lines, last, stamp, checksum FROM head")?;
    statement.query_map([], remembered)?.collect()
}

fn remembered(row: &Row<'_>) -> rusqlite::Result<RecordedHead> {
    let head = Head { lines: row.get::<_, i64>(2)?.unsigned_abs(), checksum: row.get(3)? };
    let one = RecordedHead { file: row.get(0)?, name: row.get(1)?, head, stamp: row.get(4)? };
    match sum(&one.file, &one.name, head) == row.get::<_, String>(5)? {
        true => Ok(one),
        false => Err(rusqlite::Error::FromSqlConversionFailure(
            0,
            Type::Text,
            "what is remembered of a file is not as it was written".into(),
        )),
    }
}

fn sum(file: &str, name: &str, head: Head) -> String {
    checksum(&format!("{file}\n{name}\n{} {}", head.lines, head.checksum))
}
