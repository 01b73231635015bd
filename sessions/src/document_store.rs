//! The documents of a library: one file each in the folder of their kind. A document is never changed and never removed,
//! only superseded by a later one.
//!
//! A file is `{"checksum": CRC-32 of the compact JSON of the document with its keys in alphabetical order,
//! KIND: the document}`. Its name is the document's id, `20260305-bench-cell-9f31c2aa`: day, name, checksum.

use crate::atomic;
use crate::text::json_files;
use chrono::{DateTime, FixedOffset, Utc};
use serde::Serialize;
use serde::de::{DeserializeOwned, Error as _};
use serde_json::{Map, Value};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

pub trait Document: Clone + Serialize + DeserializeOwned {
    /// The word in messages, and the key in the file.
    const KIND: &'static str;
    const FOLDER: &'static str;
    /// How to make a new one, as in `import it again`.
    const RENEW: &'static str;

    fn name(&self) -> &str;
    fn rig(&self) -> &str;
    /// RFC 3339; `None` where the time is not known.
    fn taken_at(&self) -> Option<&str>;
    /// Id of the document that this one supersedes.
    fn supersedes(&self) -> Option<&str>;
    #[must_use]
    fn superseding(self, id: String) -> Self;
    /// The error says why the document cannot be used.
    fn check(&self) -> Result<(), String>;
}

#[derive(Debug, Error)]
pub enum LibraryError {
    #[error("the {kind} at {} cannot be {what} ({source}); check the path, its permissions and the disk", path.display())]
    Io {
        kind: &'static str,
        /// `stored` or `read`.
        what: &'static str,
        path: PathBuf,
        source: io::Error,
    },
    #[error("{} holds no {kind} ({reason}); choose another file", path.display())]
    NotOne { kind: &'static str, path: PathBuf, reason: String },
    #[error("{} was changed after it was stored, but a stored {kind} must not change; {renew} to supersede it", path.display())]
    Changed { kind: &'static str, renew: &'static str, path: PathBuf },
    #[error("{what}: {reason}")]
    Unsound { what: String, reason: String },
    #[error("the library already holds this {kind} as {id}")]
    AlreadyThere { kind: &'static str, id: String },
    #[error(
        "the {kind} is dated \"{date}\", which is not an RFC 3339 time; write it like 2026-03-05T14:15:00Z"
    )]
    Date { kind: &'static str, date: String },
    #[error(
        "the library has no {kind} \"{name}\"{known}; look in its folder {folder}, or give a file"
    )]
    Unknown { kind: &'static str, name: String, known: String, folder: &'static str },
    #[error("several documents have the name \"{name}\": {}; give the id of one of them", ids.join(", "))]
    Ambiguous { name: String, ids: Vec<String> },
    #[error("{id} is already superseded by {by}; supersede {by} instead")]
    Superseded { id: String, by: String },
}

#[derive(Clone, Debug, PartialEq)]
pub struct StoredDocument<D> {
    /// The file's name without its ending.
    pub id: String,
    pub path: PathBuf,
    pub document: D,
}

impl<D: Document> StoredDocument<D> {
    /// CRC-32 as in the file, eight hexadecimal digits.
    pub fn checksum(&self) -> Option<String> {
        let value = serde_json::to_value(&self.document).ok()?;
        Some(format!("{:08x}", checksum(&value).ok()?))
    }
}

#[derive(Debug)]
pub struct DocumentStore<D> {
    pub documents: Vec<StoredDocument<D>>,
    pub unreadable: Vec<LibraryError>,
}

impl<D> Default for DocumentStore<D> {
    fn default() -> Self {
        Self { documents: Vec::new(), unreadable: Vec::new() }
    }
}

impl<D: Document> DocumentStore<D> {
    /// A missing folder counts as empty.
    #[must_use]
    pub fn open(library: &Path) -> Self {
        let mut shelf = Self::default();
        for path in json_files(&library.join(D::FOLDER)) {
            match read_document(&path) {
                Ok(document) => shelf.documents.push(StoredDocument {
                    id: path.file_stem().unwrap_or_default().to_string_lossy().into(),
                    path,
                    document,
                }),
                Err(err) => shelf.unreadable.push(err),
            }
        }
        shelf
    }

    /// Id of the document that supersedes this one.
    pub fn successor(&self, id: &str) -> Option<&str> {
        let by = |one: &&StoredDocument<D>| one.document.supersedes() == Some(id);
        self.documents.iter().find(by).map(|one| one.id.as_str())
    }

    /// The latest document of a rig that is not superseded.
    pub fn in_force(&self, rig: &str) -> Option<&StoredDocument<D>> {
        let own = self.documents.iter().filter(|one| one.document.rig() == rig);
        let open = own.filter(|one| self.successor(&one.id).is_none());
        open.max_by_key(|one| (taken_at(&one.document).ok().flatten(), &one.id))
    }

    /// Finds a document by its id, or by a name that only one document in force has.
    pub fn find(&self, name: &str) -> Result<&StoredDocument<D>, LibraryError> {
        if let Some(exact) = self.documents.iter().find(|one| one.id == name) {
            return Ok(exact);
        }
        let named = self.documents.iter().filter(|one| one.document.name() == name);
        let open: Vec<&StoredDocument<D>> =
            named.filter(|one| self.successor(&one.id).is_none()).collect();
        match open.as_slice() {
            [one] => Ok(one),
            [] => Err(LibraryError::Unknown {
                kind: D::KIND,
                name: name.to_owned(),
                folder: D::FOLDER,
                known: match (self.documents.len(), self.unreadable.first()) {
                    (_, Some(err)) => format!(", but one cannot be read ({err})"),
                    (0, None) => ", nor any other".to_owned(),
                    (count, None) => format!(" among its {count}"),
                },
            }),
            several => Err(LibraryError::Ambiguous {
                name: name.to_owned(),
                ids: several.iter().map(|one| one.id.clone()).collect(),
            }),
        }
    }
}

fn checksum(document: &Value) -> serde_json::Result<u32> {
    Ok(crc32fast::hash(&serde_json::to_vec(document)?))
}

pub fn taken_at<D: Document>(document: &D) -> Result<Option<DateTime<FixedOffset>>, LibraryError> {
    let parse = |text: &str| {
        DateTime::parse_from_rfc3339(text)
            .map_err(|_| LibraryError::Date { kind: D::KIND, date: text.to_owned() })
    };
    document.taken_at().map(parse).transpose()
}

/// Whole days between a document's date and `now`; `None` without a date.
#[must_use]
pub fn age_days<D: Document>(document: &D, now: DateTime<Utc>) -> Option<i64> {
    let taken = taken_at(document).ok()??;
    Some((now - taken.to_utc()).num_days())
}

/// Stores a new document atomically; an existing file is never overwritten.
pub fn save_document<D: Document>(
    library: &Path,
    document: &D,
) -> Result<StoredDocument<D>, LibraryError> {
    check(document, document.name())?;
    let day =
        taken_at(document)?.map_or("undated".to_owned(), |at| at.format("%Y%m%d").to_string());
    let as_io = |err: serde_json::Error| io::Error::from(err);
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| LibraryError::Io { kind: D::KIND, what: "stored", path, source }
    };
    let folder = library.join(D::FOLDER);
    let value = serde_json::to_value(document).map_err(as_io).map_err(failed(&folder))?;
    let checksum = checksum(&value).map_err(as_io).map_err(failed(&folder))?;
    let id = format!("{day}-{}-{checksum:08x}", slug(document.name()));
    let path = folder.join(format!("{id}.json"));
    if path.exists() {
        return Err(LibraryError::AlreadyThere { kind: D::KIND, id });
    }
    fs::create_dir_all(&folder).map_err(failed(&folder))?;
    let file =
        Map::from_iter([("checksum".to_owned(), checksum.into()), (D::KIND.to_owned(), value)]);
    let text = serde_json::to_vec_pretty(&file).map_err(as_io).map_err(failed(&path))?;
    match atomic::create(&path, &text) {
        Err(err) if err.kind() == io::ErrorKind::AlreadyExists => {
            Err(LibraryError::AlreadyThere { kind: D::KIND, id })
        }
        Err(err) => Err(failed(&path)(err)),
        Ok(()) => Ok(StoredDocument { id, path, document: document.clone() }),
    }
}

/// Stores a document that supersedes `old`; the old file stays as it is.
pub fn supersede_document<D: Document>(
    library: &Path,
    old: &str,
    new: &D,
) -> Result<StoredDocument<D>, LibraryError> {
    let shelf = DocumentStore::<D>::open(library);
    let old = shelf.find(old)?;
    if let Some(by) = shelf.successor(&old.id) {
        return Err(LibraryError::Superseded { id: old.id.clone(), by: by.to_owned() });
    }
    save_document(library, &new.clone().superseding(old.id.clone()))
}

/// Reads and verifies a file of the library, or a bare document without checksum.
pub fn read_document<D: Document>(path: &Path) -> Result<D, LibraryError> {
    let not_one = |err: serde_json::Error| LibraryError::NotOne {
        kind: D::KIND,
        path: path.into(),
        reason: err.to_string(),
    };
    let text = fs::read_to_string(path).map_err(|source| LibraryError::Io {
        kind: D::KIND,
        what: "read",
        path: path.into(),
        source,
    })?;
    let mut value: Value = serde_json::from_str(&text).map_err(not_one)?;
    if let Some(written) = value.get("checksum").cloned() {
        let Some(inner) = value.get_mut(D::KIND).map(Value::take) else {
            return Err(not_one(serde_json::Error::custom(format!("it has no field {}", D::KIND))));
        };
        if written != checksum(&inner).map_err(not_one)? {
            return Err(LibraryError::Changed {
                kind: D::KIND,
                renew: D::RENEW,
                path: path.into(),
            });
        }
        value = inner;
    }
    let document: D = serde_json::from_value(value).map_err(not_one)?;
    check(&document, &path.display().to_string())?;
    Ok(document)
}

fn check<D: Document>(document: &D, what: &str) -> Result<(), LibraryError> {
    taken_at(document)?;
    document.check().map_err(|reason| LibraryError::Unsound { what: what.to_owned(), reason })
}

/// A name for a file: lower-case letters, digits and single dashes.
fn slug(name: &str) -> String {
    let words = name
        .split(|letter: char| !letter.is_ascii_alphanumeric())
        .filter(|word| !word.is_empty())
        .map(str::to_ascii_lowercase);
    let slug = words.collect::<Vec<_>>().join("-");
    // 40 letters distinguish documents and stay far below the file system's limit.
    let short: String = slug.chars().take(40).collect();
    if short.is_empty() { "unnamed".into() } else { short }
}
