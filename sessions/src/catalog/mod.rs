//! The catalog: what a library's sessions say of themselves, in one SQLite file that can be searched.
//!
//! The file is made from the sessions, brought up to date from those that changed, and may be deleted at any time; what is
//! lost with it is only the memory of how far edits, analyses, checks and journals went, by which it notices that some were
//! taken away (`heads.rs`). A file of another version is replaced; one that is damaged, or another program's, is set aside
//! and replaced.
//!
//! Start reading at [`Entry`] for what is known of a session, then [`Catalog::update`] and
//! [`Catalog::find`].

mod condition;
mod entry;
mod heads;
mod history;
mod schema;
mod search;
mod typed;
mod update;
mod walk;

pub use condition::{Condition, ConditionError};
pub use entry::{Entry, Heads, Made, Named, Origin, Source};
pub use history::{Event, Subject};
pub use search::{Choices, Found, Order, Query, ReviewIs, VerdictIs};
pub use typed::{DayError, beginning, ending, words_and_conditions};
pub use update::{Changes, Doubt};

use crate::lock::{Busy, NotLocked, holder_of, lock_soon};
use rusqlite::{Connection, ErrorCode};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;
use thiserror::Error;

/// Name of the catalog in a library.
pub const CATALOG_FILE: &str = "catalog.sqlite";
/// Held for the moment in which a catalog is opened or replaced.
const GATE_FILE: &str = "catalog.lock";
/// Longest wait for another process that writes: it writes in pieces of a fraction of a second.
const PATIENCE: Duration = Duration::from_secs(5);

/// The catalog could not be made or read.
#[derive(Debug, Error)]
pub enum CatalogError {
    /// The disk refused.
    #[error("the catalog cannot be {what} ({source}), {}; check the permissions of its folder", path.display())]
    Io {
        /// `opened` or `replaced`.
        what: &'static str,
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Another process has locked it and does not let go.
    #[error("the catalog cannot be used: {0}")]
    Busy(Busy),
    /// SQLite refused.
    #[error("the catalog cannot be used ({source}), {}; delete the file, it is made anew from the sessions", path.display())]
    Sql {
        /// The file.
        path: PathBuf,
        /// What SQLite said.
        source: rusqlite::Error,
    },
}

impl CatalogError {
    fn of(path: &Path, source: rusqlite::Error) -> Self {
        let path = path.to_owned();
        match source.sqlite_error_code() {
            Some(ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked) => {
                // SQLite locks the file itself, or those beside it.
                let holder = parts(&path).iter().find_map(|part| holder_of(part));
                Self::Busy(Busy { path, holder })
            }
            _ => Self::Sql { path, source },
        }
    }

    /// Whether the system lets nobody, or not this user, write there.
    fn is_forbidden(&self) -> bool {
        use io::ErrorKind::{PermissionDenied, ReadOnlyFilesystem};
        let Self::Io { source, .. } = self else {
            return false;
        };
        matches!(source.kind(), PermissionDenied | ReadOnlyFilesystem)
    }

    /// Whether the file's content is at fault, so that a new one helps.
    fn is_damage(&self) -> bool {
        let Self::Sql { source, .. } = self else {
            return false;
        };
        match source.sqlite_error_code() {
            Some(code) => matches!(
                code,
                // A table that ought to be there and is not is `Unknown`.
                ErrorCode::DatabaseCorrupt
                    | ErrorCode::NotADatabase
                    | ErrorCode::Unknown
                    // Two rows of one folder.
                    | ErrorCode::ConstraintViolation
            ),
            // Something else in a column than was written there.
            None => true,
        }
    }
}

/// What SQLite calls a database without a file.
const IN_MEMORY: &str = ":memory:";

/// An open catalog.
#[derive(Debug)]
pub struct Catalog {
    db: Connection,
    library: PathBuf,
    /// What happened to the file that was there, in sentences.
    pub remarks: Vec<String>,
}

impl Catalog {
    /// Opens the catalog of a library, and makes it if there is none. Where the library may not be written, it is made
    /// in memory.
    pub fn open(library: &Path) -> Result<Self, CatalogError> {
        match gate(library) {
            Ok(_gate) => Self::open_behind_gate(library, Vec::new()),
            Err(err) if err.is_forbidden() && library.is_dir() => Ok(Self {
                db: open_new(Path::new(IN_MEMORY))?,
                library: library.to_owned(),
                remarks: vec![format!(
                    "{} may not be written, so every session in it is read anew for each search",
                    library.display()
                )],
            }),
            Err(err) => Err(err),
        }
    }

    /// Does some work with the catalog of a library. If its file proves to be damaged, it is set aside and
    /// the work done again with a new one.
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
            Ok(Opened::Ours(db)) => db,
            Ok(Opened::OtherVersion(heads)) => {
                remove(&path)?;
                let db = open_new(&path)?;
                let kept = heads.iter().try_for_each(|one| heads::remember(&db, one));
                kept.map_err(|err| CatalogError::of(&path, err))?;
                db
            }
            Ok(Opened::Foreign) => {
                remarks.push(set_aside(&path, "it is another program's")?);
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

    /// Whether it is in memory, for want of a library that may be written: then it starts empty whenever it is opened.
    pub fn is_in_memory(&self) -> bool {
        self.db.path().is_none_or(str::is_empty)
    }

    /// The catalog's file.
    pub fn path(&self) -> PathBuf {
        self.library.join(CATALOG_FILE)
    }

    fn failed(&self) -> impl Fn(rusqlite::Error) -> CatalogError + use<> {
        let path = self.path();
        move |source| CatalogError::of(&path, source)
    }
}

enum Opened {
    Ours(Connection),
    /// What it remembers.
    OtherVersion(Vec<heads::RecordedHead>),
    Foreign,
}

fn open_file(path: &Path) -> Result<Opened, CatalogError> {
    let failed = |source| CatalogError::of(path, source);
    let mut db = Connection::open(path).map_err(failed)?;
    db.busy_timeout(PATIENCE).map_err(failed)?;
    let number = |name: &str| -> Result<i64, CatalogError> {
        db.pragma_query_value(None, name, |row| row.get(0)).map_err(failed)
    };
    let tables: i64 =
        db.query_row("SELECT count(*) FROM sqlite_schema", [], |row| row.get(0)).map_err(failed)?;
    match (number("application_id")?, number("user_version")?) {
        (schema::APPLICATION, schema::VERSION) => {}
        (schema::APPLICATION, _) => {
            return Ok(Opened::OtherVersion(heads::heads_of_other_version(&db)));
        }
        (0, 0) if tables == 0 => schema::create(&mut db).map_err(failed)?,
        _ => return Ok(Opened::Foreign),
    }
    schema::prepare(&db).map_err(failed)?;
    Ok(Opened::Ours(db))
}

fn open_new(path: &Path) -> Result<Connection, CatalogError> {
    match open_file(path)? {
        Opened::Ours(db) => Ok(db),
        // Nobody else can have made one: the gate is ours.
        Opened::OtherVersion(_) | Opened::Foreign => Err(CatalogError::Busy(Busy::of(path))),
    }
}

/// One process at a time opens or replaces the file. The system lets go when the process dies.
fn gate(library: &Path) -> Result<fs::File, CatalogError> {
    let path = library.join(GATE_FILE);
    let failed = |source| CatalogError::Io { what: "opened", path: path.clone(), source };
    let mut options = fs::OpenOptions::new();
    let options = options.write(true).create(true).truncate(false);
    let file = fs::create_dir_all(library).and_then(|()| options.open(&path)).map_err(failed)?;
    match lock_soon(&file, &path) {
        Ok(()) => Ok(file),
        Err(NotLocked::Busy(busy)) => Err(CatalogError::Busy(busy)),
        Err(NotLocked::Io(source)) => Err(failed(source)),
    }
}

/// A catalog and the two files that SQLite keeps beside it.
fn parts(path: &Path) -> [PathBuf; 3] {
    ["", "-wal", "-shm"].map(|ending| {
        let mut name = path.as_os_str().to_owned();
        name.push(ending);
        name.into()
    })
}

fn remove(path: &Path) -> Result<(), CatalogError> {
    for part in parts(path) {
        match fs::remove_file(&part) {
            Err(err) if err.kind() != io::ErrorKind::NotFound => {
                return Err(CatalogError::Io { what: "replaced", path: part, source: err });
            }
            _ => {}
        }
    }
    Ok(())
}

/// Gives a file that is no catalog another name, and says so.
fn set_aside(path: &Path, reason: &str) -> Result<String, CatalogError> {
    let aside = (1..)
        .map(|number| path.with_file_name(format!("{CATALOG_FILE}.aside-{number}")))
        .find(|aside| !aside.exists())
        .unwrap_or_default();
    for (part, to) in parts(path).iter().zip(parts(&aside)) {
        match fs::rename(part, &to) {
            Err(err) if err.kind() != io::ErrorKind::NotFound => {
                return Err(CatalogError::Io { what: "replaced", path: part.clone(), source: err });
            }
            _ => {}
        }
    }
    Ok(format!(
        "{} was no usable catalog ({reason}); it was set aside as {} and a new one made",
        path.display(),
        aside.display()
    ))
}
