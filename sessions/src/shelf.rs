//! The documents of a library: one file each in the folder of their kind, never changed and never removed,
//! only superseded by a later one.
//!
//! A file is `{"checksum": CRC-32 of the compact JSON of the document with its keys in alphabetical order,
//! KIND: the document}` and is called by its id, `20260305-bench-cell-9f31c2aa`: day, name, checksum.

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

/// What a library keeps.
pub trait Document: Clone + Serialize + DeserializeOwned {
    /// What one is called, in sentences and in its file.
    const KIND: &'static str;
    /// Their folder in the library.
    const FOLDER: &'static str;
    /// What shows all that are kept.
    const LISTED: &'static str;
    /// What makes a new one.
    const RENEW: &'static str;

    /// What people call it.
    fn name(&self) -> &str;
    /// The rig it is of.
    fn rig(&self) -> &str;
    /// When it was taken, RFC 3339; `None` where that is not known.
    fn taken_at(&self) -> Option<&str>;
    /// Id of the one whose place it takes.
    fn supersedes(&self) -> Option<&str>;
    /// The same in the place of another one.
    #[must_use]
    fn superseding(self, id: String) -> Self;
    /// Why it cannot be used, in words.
    fn check(&self) -> Result<(), String>;
}

/// A document could not be kept or had.
#[derive(Debug, Error)]
pub enum LibraryError {
    /// The disk refused.
    #[error("the {kind} cannot be {what} ({source}), {}", path.display())]
    Io {
        /// What the document is.
        kind: &'static str,
        /// `stored` or `read`.
        what: &'static str,
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Something else than a document of this kind.
    #[error("this file holds no {kind} ({reason}); name another, {}", path.display())]
    NotOne {
        /// What was wanted.
        kind: &'static str,
        /// The file.
        path: PathBuf,
        /// What is missing or wrong.
        reason: String,
    },
    /// Other content than was written.
    #[error("this {kind} was changed after it was stored; a {kind} is never edited, {renew} to supersede it, {}", path.display())]
    Changed {
        /// What the document is.
        kind: &'static str,
        /// What makes a new one.
        renew: &'static str,
        /// The file.
        path: PathBuf,
    },
    /// The document cannot be used.
    #[error("{reason}, in {what}")]
    Unsound {
        /// Its file or name.
        what: String,
        /// Why.
        reason: String,
    },
    /// The same document is stored already.
    #[error("the library has this very {kind} already, as {id}")]
    AlreadyThere {
        /// What the document is.
        kind: &'static str,
        /// Its id.
        id: String,
    },
    /// A date that is none.
    #[error(
        "the {kind} is dated \"{date}\", which is no RFC 3339 time; write it like 2026-03-05T14:15:00Z"
    )]
    Date {
        /// What the document is.
        kind: &'static str,
        /// The text.
        date: String,
    },
    /// Nothing of that name.
    #[error("the library has no {kind} \"{name}\"{known}; {listed} shows them, or give a file")]
    Unknown {
        /// What was wanted.
        kind: &'static str,
        /// The name.
        name: String,
        /// What there is, in words.
        known: String,
        /// What shows all.
        listed: &'static str,
    },
    /// Several of that name, none superseding the others.
    #[error("\"{name}\" may be {}; give the id of one", ids.join(" or "))]
    Ambiguous {
        /// The name.
        name: String,
        /// Their ids.
        ids: Vec<String>,
    },
    /// The old one has a successor already.
    #[error("{id} is superseded by {by} already; supersede that one")]
    Superseded {
        /// The old one.
        id: String,
        /// Its successor.
        by: String,
    },
}

/// A document in the library.
#[derive(Clone, Debug, PartialEq)]
pub struct Kept<D> {
    /// Its id, the stem of its file.
    pub id: String,
    /// Its file.
    pub path: PathBuf,
    /// The document.
    pub document: D,
}

impl<D: Document> Kept<D> {
    /// CRC-32 of the document as its file has it, eight hexadecimal digits.
    pub fn checksum(&self) -> Option<String> {
        let value = serde_json::to_value(&self.document).ok()?;
        Some(format!("{:08x}", checksum(&value).ok()?))
    }
}

/// What a library holds.
#[derive(Debug)]
pub struct Shelf<D> {
    /// Every readable one, by id.
    pub kept: Vec<Kept<D>>,
    /// Why others cannot be read.
    pub unreadable: Vec<LibraryError>,
}

impl<D> Default for Shelf<D> {
    fn default() -> Self {
        Self { kept: Vec::new(), unreadable: Vec::new() }
    }
}

impl<D: Document> Shelf<D> {
    /// Reads a library; a folder that is not there is empty.
    #[must_use]
    pub fn open(library: &Path) -> Self {
        let mut shelf = Self::default();
        for path in json_files(&library.join(D::FOLDER)) {
            match read(&path) {
                Ok(document) => shelf.kept.push(Kept {
                    id: path.file_stem().unwrap_or_default().to_string_lossy().into(),
                    path,
                    document,
                }),
                Err(err) => shelf.unreadable.push(err),
            }
        }
        shelf
    }

    /// The id of the one that took the place of this one.
    pub fn successor(&self, id: &str) -> Option<&str> {
        let by = |one: &&Kept<D>| one.document.supersedes() == Some(id);
        self.kept.iter().find(by).map(|one| one.id.as_str())
    }

    /// The one in force for a rig: of those taken on it that nothing supersedes, the latest by its date.
    pub fn in_force(&self, rig: &str) -> Option<&Kept<D>> {
        let own = self.kept.iter().filter(|one| one.document.rig() == rig);
        let open = own.filter(|one| self.successor(&one.id).is_none());
        open.max_by_key(|one| (taken_at(&one.document).ok().flatten(), &one.id))
    }

    /// One by its id, or by a name that only one has which nothing supersedes.
    pub fn find(&self, name: &str) -> Result<&Kept<D>, LibraryError> {
        if let Some(exact) = self.kept.iter().find(|one| one.id == name) {
            return Ok(exact);
        }
        let named = self.kept.iter().filter(|one| one.document.name() == name);
        let open: Vec<&Kept<D>> = named.filter(|one| self.successor(&one.id).is_none()).collect();
        match open.as_slice() {
            [one] => Ok(one),
            [] => Err(LibraryError::Unknown {
                kind: D::KIND,
                name: name.to_owned(),
                listed: D::LISTED,
                known: match self.kept.len() {
                    0 => ", it holds none".to_owned(),
                    count => format!(" among its {count}"),
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

/// When a document was taken.
pub fn taken_at<D: Document>(document: &D) -> Result<Option<DateTime<FixedOffset>>, LibraryError> {
    let parse = |text: &str| {
        DateTime::parse_from_rfc3339(text)
            .map_err(|_| LibraryError::Date { kind: D::KIND, date: text.to_owned() })
    };
    document.taken_at().map(parse).transpose()
}

/// Whole days from when a document was taken until `now`; `None` where it does not say when.
#[must_use]
pub fn age_days<D: Document>(document: &D, now: DateTime<Utc>) -> Option<i64> {
    let taken = taken_at(document).ok()??;
    Some((now - taken.to_utc()).num_days())
}

/// Stores a new document and tells its id. Nothing is ever written over; the file is whole whenever it
/// is there.
pub fn save<D: Document>(library: &Path, document: &D) -> Result<Kept<D>, LibraryError> {
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
        Ok(()) => Ok(Kept { id, path, document: document.clone() }),
    }
}

/// Stores a document that takes the place of another one, which stays as it is.
pub fn supersede<D: Document>(library: &Path, old: &str, new: &D) -> Result<Kept<D>, LibraryError> {
    let shelf = Shelf::<D>::open(library);
    let old = shelf.find(old)?;
    if let Some(by) = shelf.successor(&old.id) {
        return Err(LibraryError::Superseded { id: old.id.clone(), by: by.to_owned() });
    }
    save(library, &new.clone().superseding(old.id.clone()))
}

/// Reads a file of the library and checks that it is what was written, or a bare document.
pub fn read<D: Document>(path: &Path) -> Result<D, LibraryError> {
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

/// A name as part of a file's: small letters, digits and single dashes.
fn slug(name: &str) -> String {
    let words = name
        .split(|letter: char| !letter.is_ascii_alphanumeric())
        .filter(|word| !word.is_empty())
        .map(str::to_ascii_lowercase);
    let slug = words.collect::<Vec<_>>().join("-");
    // File names have an end; 40 letters tell one document from another.
    let short: String = slug.chars().take(40).collect();
    if short.is_empty() { "unnamed".into() } else { short }
}
