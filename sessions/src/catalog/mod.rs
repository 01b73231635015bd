//! The catalog: a searchable index of a library's sessions in one SQLite file.
//!
//! The file is built and updated from the sessions and may be deleted at any time. Only the recorded heads of JSON-lines
//! files (`heads.rs`) are lost with it. A file of an older version is replaced; one of a newer version stays as it is, and
//! the catalog is made in memory; a damaged one, or one of another program, is renamed and replaced.
//!
//! Start reading at [`CatalogEntry`], then [`Catalog::update`] and [`Catalog::find`].

mod condition;
mod entry;
mod field;
mod heads;
mod history;
mod mirrored;
mod schema;
mod search;
mod typed;
mod update;
mod walk;

pub use condition::{Condition, ConditionError};
pub use entry::{
    CatalogAnalysis, CatalogEntry, NamedValue, NamedValueSource, SessionHeads, SessionOrigin,
};
pub use field::{FieldWords, SearchField};
pub use history::{HistoryEvent, HistorySubject};
pub use mirrored::{LocalSession, MirroredSession, MirroredTable};
pub use schema::VERSION as CATALOG_VERSION;
pub use search::{
    CatalogChoices, CatalogOrder, CatalogPage, CatalogQuery, QualityFilter, ReviewFilter,
};
pub use typed::{DayError, QueryLine, parse_end, parse_query_line, parse_start};
pub use update::{CatalogChanges, CatalogMismatch};

use crate::chain::with_ending;
use crate::lock::{LockFailure, LockTimeout, holder_of, lock_waiting};
use rusqlite::{Connection, ErrorCode};
use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::time::Duration;
use thiserror::Error;

pub const CATALOG_FILE: &str = "catalog.sqlite";
/// Locked while a catalog is opened or replaced.
const GATE_FILE: &str = "catalog.lock";
/// Longest wait for another process, whose transactions take a fraction of a second.
const PATIENCE: Duration = Duration::from_secs(5);

/// The catalog could not be made or read.
#[derive(Debug, Error)]
pub enum CatalogError {
    #[error("the catalog {} cannot be {what} ({source}); check the permissions of its folder", path.display())]
    Io {
        /// `opened` or `replaced`.
        what: &'static str,
        path: PathBuf,
        source: io::Error,
    },
    #[error("the catalog cannot be used: {0}")]
    LockTimeout(LockTimeout),
    #[error("the catalog {} cannot be used ({source}); delete the file, and palpate rebuilds the catalog from the sessions", path.display())]
    Sql { path: PathBuf, source: rusqlite::Error },
}

impl CatalogError {
    fn of(path: &Path, source: rusqlite::Error) -> Self {
        let path = path.to_owned();
        match source.sqlite_error_code() {
            Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => {
                // SQLite locks the file itself, or one of the two beside it.
                let holder = parts(&path).iter().find_map(|part| holder_of(part));
                Self::LockTimeout(LockTimeout { path, holder })
            }
            _ => Self::Sql { path, source },
        }
    }

    /// Whether this user has no write permission.
    fn is_forbidden(&self) -> bool {
        use io::ErrorKind::{PermissionDenied, ReadOnlyFilesystem};
        let Self::Io { source, .. } = self else {
            return false;
        };
        matches!(source.kind(), PermissionDenied | ReadOnlyFilesystem)
    }

    /// Whether a new file would help.
    fn is_damage(&self) -> bool {
        let Self::Sql { source, .. } = self else {
            return false;
        };
        match source.sqlite_error_code() {
            Some(code) => matches!(
                code,
                // A missing table is `Unknown`.
                ErrorCode::DatabaseCorrupt
                    | ErrorCode::NotADatabase
                    | ErrorCode::Unknown
                    // Two rows have the same folder.
                    | ErrorCode::ConstraintViolation
            ),
            // A column has a wrong type or checksum.
            None => true,
        }
    }
}

/// SQLite's name for a database without a file.
const IN_MEMORY: &str = ":memory:";

#[derive(Debug)]
pub struct Catalog {
    db: Connection,
    library: PathBuf,
    /// One sentence for each former file that was replaced.
    pub remarks: Vec<String>,
}

impl Catalog {
    /// Opens or creates the catalog of a library; in memory if the library is not writable, or its catalog is of a newer
    /// version.
    pub fn open(library: &Path) -> Result<Self, CatalogError> {
        match gate(library) {
            Ok(_gate) => Self::open_behind_gate(library, Vec::new()),
            Err(err) if err.is_forbidden() && library.is_dir() => {
                let remark = format!(
                    "the library {} is not writable, so every search reads every session",
                    library.display()
                );
                Self::in_memory(library, remark)
            }
            Err(err) => Err(err),
        }
    }

    fn in_memory(library: &Path, remark: String) -> Result<Self, CatalogError> {
        let db = open_new(Path::new(IN_MEMORY))?;
        Ok(Self { db, library: library.to_owned(), remarks: vec![remark] })
    }

    /// Runs `work` with the catalog of a library. If the file proves damaged, `work` runs again with a new file.
    pub fn with<T>(
        library: &Path,
        mut work: impl FnMut(&mut Self) -> Result<T, CatalogError>,
    ) -> Result<T, CatalogError> {
        let done = Self::open(library).and_then(|mut catalog| work(&mut catalog));
        match done {
            Err(err) if err.is_damage() => {
                let mut catalog = Self::replace(library, &err.to_string())?;
                work(&mut catalog)
            }
            done => done,
        }
    }

    fn replace(library: &Path, reason: &str) -> Result<Self, CatalogError> {
        let _gate = gate(library)?;
        let remark = set_aside(&library.join(CATALOG_FILE), reason)?;
        Self::open_behind_gate(library, vec![remark])
    }

    fn open_behind_gate(library: &Path, mut remarks: Vec<String>) -> Result<Self, CatalogError> {
        let path = library.join(CATALOG_FILE);
        let db = match open_file(&path) {
            Ok(CatalogFile::Current(db)) => db,
            Ok(CatalogFile::Newer(version)) => {
                return Self::in_memory(library, newer_remark(&path, version));
            }
            Ok(CatalogFile::Older(heads)) => {
                remove(&path)?;
                let db = open_new(&path)?;
                let outcome = heads.iter().try_for_each(|one| heads::record_head(&db, one));
                outcome.map_err(|err| CatalogError::of(&path, err))?;
                db
            }
            Ok(CatalogFile::Foreign) => {
                remarks.push(set_aside(&path, "another program made it")?);
                open_new(&path)?
            }
            Err(err) if err.is_damage() => {
                remarks.push(set_aside(&path, "it is damaged")?);
                open_new(&path)?
            }
            Err(err) => return Err(err),
        };
        Ok(Self { db, library: library.to_owned(), remarks })
    }

    /// A catalog in memory starts empty whenever it is opened.
    pub fn is_in_memory(&self) -> bool {
        self.db.path().is_none_or(str::is_empty)
    }

    pub fn path(&self) -> PathBuf {
        self.library.join(CATALOG_FILE)
    }

    fn failed(&self) -> impl Fn(rusqlite::Error) -> CatalogError + use<> {
        let path = self.path();
        move |source| CatalogError::of(&path, source)
    }
}

enum CatalogFile {
    Current(Connection),
    Older(Vec<heads::RecordedHead>),
    /// Its version.
    Newer(i64),
    Foreign,
}

fn open_file(path: &Path) -> Result<CatalogFile, CatalogError> {
    let failed = |source| CatalogError::of(path, source);
    if let Some(version) = newer_version(path) {
        return Ok(CatalogFile::Newer(version));
    }
    let mut db = Connection::open(path).map_err(failed)?;
    db.busy_timeout(PATIENCE).map_err(failed)?;
    let number = |name: &str| -> Result<i64, CatalogError> {
        db.pragma_query_value(None, name, |row| row.get(0)).map_err(failed)
    };
    let tables: i64 =
        db.query_row("SELECT count(*) FROM sqlite_schema", [], |row| row.get(0)).map_err(failed)?;
    match (number("application_id")?, number("user_version")?) {
        (schema::APPLICATION, schema::VERSION) => {}
        (schema::APPLICATION, version) if version > schema::VERSION => {
            return Ok(CatalogFile::Newer(version));
        }
        (schema::APPLICATION, _) => {
            return Ok(CatalogFile::Older(heads::heads_of_older_version(&db)));
        }
        (0, 0) if tables == 0 => schema::create(&mut db).map_err(failed)?,
        _ => return Ok(CatalogFile::Foreign),
    }
    schema::prepare(&db).map_err(failed)?;
    Ok(CatalogFile::Current(db))
}

/// Version of a newer catalog, from the file's bytes: opening it with SQLite may already change it.
fn newer_version(path: &Path) -> Option<i64> {
    // SQLite's file format, section 1.3: both numbers are big-endian.
    const VERSION_AT: usize = 60;
    const APPLICATION_AT: usize = 68;
    let mut head = [0; 100];
    fs::File::open(path).and_then(|mut file| file.read_exact(&mut head)).ok()?;
    let number = |at: usize| Some(i32::from_be_bytes(head.get(at..at + 4)?.try_into().ok()?));
    let is_ours = i64::from(number(APPLICATION_AT)?) == schema::APPLICATION;
    let version = i64::from(number(VERSION_AT)?);
    (is_ours && version > schema::VERSION).then_some(version)
}

fn newer_remark(path: &Path, version: i64) -> String {
    format!(
        "a newer version of palpate made the catalog {} (version {version}, this one makes {}); it stays as it is, and every search reads every session until palpate is updated",
        path.display(),
        schema::VERSION
    )
}

fn open_new(path: &Path) -> Result<Connection, CatalogError> {
    match open_file(path)? {
        CatalogFile::Current(db) => Ok(db),
        // This process holds the gate, so no other can have created the file.
        CatalogFile::Older(_) | CatalogFile::Newer(_) | CatalogFile::Foreign => {
            Err(CatalogError::LockTimeout(LockTimeout::of(path)))
        }
    }
}

/// Lets one process at a time open or replace the file. The system releases the lock when the process dies.
fn gate(library: &Path) -> Result<fs::File, CatalogError> {
    let path = library.join(GATE_FILE);
    let failed = |source| CatalogError::Io { what: "opened", path: path.clone(), source };
    let mut options = fs::OpenOptions::new();
    let options = options.write(true).create(true).truncate(false);
    let file = fs::create_dir_all(library).and_then(|()| options.open(&path)).map_err(failed)?;
    match lock_waiting(&file, &path) {
        Ok(()) => Ok(file),
        Err(LockFailure::LockTimeout(busy)) => Err(CatalogError::LockTimeout(busy)),
        Err(LockFailure::Io(source)) => Err(failed(source)),
    }
}

/// The catalog and the two files that SQLite writes beside it.
fn parts(path: &Path) -> [PathBuf; 3] {
    ["", "-wal", "-shm"].map(|ending| with_ending(path, ending))
}

fn remove(path: &Path) -> Result<(), CatalogError> {
    parts(path).iter().try_for_each(|part| replaced(part, fs::remove_file(part)))
}

/// A part of the catalog that does not exist needs no replacement.
fn replaced(path: &Path, outcome: io::Result<()>) -> Result<(), CatalogError> {
    match outcome {
        Err(source) if source.kind() != io::ErrorKind::NotFound => {
            Err(CatalogError::Io { what: "replaced", path: path.to_owned(), source })
        }
        _ => Ok(()),
    }
}

/// Renames a file that is not a usable catalog; returns the remark.
fn set_aside(path: &Path, reason: &str) -> Result<String, CatalogError> {
    let aside = (1..)
        .map(|number| path.with_file_name(format!("{CATALOG_FILE}.aside-{number}")))
        .find(|aside| !aside.exists())
        .unwrap_or_default();
    for (part, to) in parts(path).iter().zip(parts(&aside)) {
        replaced(part, fs::rename(part, &to))?;
    }
    Ok(format!(
        "{} was not a usable catalog ({reason}); it was renamed to {} and a new catalog was made",
        path.display(),
        aside.display()
    ))
}
