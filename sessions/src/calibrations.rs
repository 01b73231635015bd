//! The calibrations of a library: one file each in `calibrations/`, never changed and never removed, only
//! superseded by a later one.
//!
//! A file is `{"checksum": CRC-32 of the compact JSON of the calibration with its keys in alphabetical order, "calibration": ...}` and is
//! called by its id, `20260305-bench-cell-9f31c2aa`: day, name, checksum.

use chrono::{DateTime, FixedOffset, Utc};
use palpate_model::calibration::{Calibration, CalibrationError};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A calibration could not be kept or had.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LibraryError {
    /// The disk refused.
    #[error("the calibration cannot be {what} ({source}), {}", path.display())]
    Io {
        /// `stored` or `read`.
        what: &'static str,
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Something else than a calibration.
    #[error("this file holds no calibration ({reason}); name another, {}", path.display())]
    NotOne {
        /// The file.
        path: PathBuf,
        /// What is missing or wrong.
        reason: String,
    },
    /// Other content than was written.
    #[error("this calibration was changed after it was stored; a calibration is never edited, import it anew to supersede it, {}", path.display())]
    Changed {
        /// The file.
        path: PathBuf,
    },
    /// The document makes no curve.
    #[error("{source}, in {what}")]
    Calibration {
        /// Its file or name.
        what: String,
        /// Why.
        source: CalibrationError,
    },
    /// The same document is stored already.
    #[error("the library has this very calibration already, as {id}")]
    AlreadyThere {
        /// Its id.
        id: String,
    },
    /// A date that is none.
    #[error(
        "the calibration is dated \"{date}\", which is no RFC 3339 time; write it like 2026-03-05T14:15:00Z"
    )]
    Date {
        /// The text.
        date: String,
    },
    /// Nothing of that name.
    #[error(
        "the library has no calibration \"{name}\"{known}; 'palpate calibration list' shows them, or give a file"
    )]
    Unknown {
        /// The name.
        name: String,
        /// What there is, in words.
        known: String,
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

#[derive(Serialize, Deserialize)]
struct File {
    checksum: u32,
    /// As it stands in the file, with what a later version may have added.
    calibration: Value,
}

/// A calibration in the library.
#[derive(Clone, Debug, PartialEq)]
pub struct Kept {
    /// Its id, the stem of its file.
    pub id: String,
    /// Its file.
    pub path: PathBuf,
    /// The document.
    pub calibration: Calibration,
}

/// What a library holds.
#[derive(Debug, Default)]
pub struct Shelf {
    /// Every readable one, by id.
    pub kept: Vec<Kept>,
    /// Why others cannot be read.
    pub unreadable: Vec<LibraryError>,
}

impl Shelf {
    /// Reads a library; a folder that is not there is empty.
    #[must_use]
    pub fn open(library: &Path) -> Self {
        let mut shelf = Self::default();
        let entries = fs::read_dir(folder(library)).map(|entries| entries.flatten());
        let paths = entries.into_iter().flatten().map(|entry| entry.path());
        let mut paths: Vec<PathBuf> = paths.filter(|path| is_whole(path)).collect();
        paths.sort();
        for path in paths {
            match read_calibration(&path) {
                Ok(calibration) => shelf.kept.push(Kept {
                    id: path
                        .file_stem()
                        .unwrap_or_default()
                        .to_string_lossy()
                        .into(),
                    path,
                    calibration,
                }),
                Err(err) => shelf.unreadable.push(err),
            }
        }
        shelf
    }

    /// The id of the one that took the place of this one.
    #[must_use]
    pub fn successor(&self, id: &str) -> Option<&str> {
        let by = |one: &&Kept| one.calibration.supersedes.as_deref() == Some(id);
        self.kept.iter().find(by).map(|one| one.id.as_str())
    }

    /// The one in force for a rig: of those taken on it that nothing supersedes, the latest by its date.
    #[must_use]
    pub fn in_force(&self, rig: &str) -> Option<&Kept> {
        let own = self.kept.iter().filter(|one| one.calibration.rig == rig);
        let open = own.filter(|one| self.successor(&one.id).is_none());
        open.max_by_key(|one| (taken_at(&one.calibration).ok().flatten(), &one.id))
    }

    /// One by its id, or by a name that only one has which nothing supersedes.
    pub fn find(&self, name: &str) -> Result<&Kept, LibraryError> {
        if let Some(exact) = self.kept.iter().find(|one| one.id == name) {
            return Ok(exact);
        }
        let named = self.kept.iter().filter(|one| one.calibration.name == name);
        let open: Vec<&Kept> = named
            .filter(|one| self.successor(&one.id).is_none())
            .collect();
        match open.as_slice() {
            [one] => Ok(one),
            [] => Err(LibraryError::Unknown {
                name: name.to_owned(),
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

fn folder(library: &Path) -> PathBuf {
    library.join("calibrations")
}

fn is_whole(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    name.ends_with(".json") && !name.starts_with('.')
}

fn checksum(calibration: &Value) -> serde_json::Result<u32> {
    Ok(crc32fast::hash(&serde_json::to_vec(calibration)?))
}

/// When a calibration was taken.
pub fn taken_at(calibration: &Calibration) -> Result<Option<DateTime<FixedOffset>>, LibraryError> {
    let parse = |text: &String| {
        DateTime::parse_from_rfc3339(text).map_err(|_| LibraryError::Date { date: text.clone() })
    };
    calibration.taken_at.as_ref().map(parse).transpose()
}

/// Whole days from when a calibration was taken until `now`; `None` where it does not say when.
#[must_use]
pub fn age_days(calibration: &Calibration, now: DateTime<Utc>) -> Option<i64> {
    let taken = taken_at(calibration).ok()??;
    Some((now - taken.to_utc()).num_days())
}

/// Stores a new calibration and tells its id. Nothing is ever written over; the file is whole whenever it
/// is there.
pub fn save_calibration(library: &Path, calibration: &Calibration) -> Result<Kept, LibraryError> {
    check(calibration, &calibration.name)?;
    let day =
        taken_at(calibration)?.map_or("undated".to_owned(), |at| at.format("%Y%m%d").to_string());
    let as_io = |err: serde_json::Error| io::Error::from(err);
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| LibraryError::Io {
            what: "stored",
            path,
            source,
        }
    };
    let folder = folder(library);
    let document = serde_json::to_value(calibration)
        .map_err(as_io)
        .map_err(failed(&folder))?;
    let checksum = checksum(&document)
        .map_err(as_io)
        .map_err(failed(&folder))?;
    let id = format!("{day}-{}-{checksum:08x}", slug(&calibration.name));
    let path = folder.join(format!("{id}.json"));
    if path.exists() {
        return Err(LibraryError::AlreadyThere { id });
    }
    fs::create_dir_all(&folder).map_err(failed(&folder))?;
    let file = File {
        checksum,
        calibration: document,
    };
    let text = serde_json::to_vec_pretty(&file)
        .map_err(as_io)
        .map_err(failed(&path))?;
    let hidden = folder.join(format!(".{id}.{}.tmp", std::process::id()));
    let written = fs::File::create(&hidden)
        .and_then(|mut file| file.write_all(&text).and_then(|()| file.sync_all()))
        // A link is refused where a file is; a rename would write over it.
        .and_then(|()| fs::hard_link(&hidden, &path));
    // Whether it is left or not, the result is told by what came before.
    let _ = fs::remove_file(&hidden);
    match written {
        Err(err) if err.kind() == io::ErrorKind::AlreadyExists => {
            Err(LibraryError::AlreadyThere { id })
        }
        Err(err) => Err(failed(&path)(err)),
        Ok(()) => Ok(Kept {
            id,
            path,
            calibration: calibration.clone(),
        }),
    }
}

/// Stores a calibration that takes the place of another one, which stays as it is.
pub fn supersede(library: &Path, old: &str, new: &Calibration) -> Result<Kept, LibraryError> {
    let shelf = Shelf::open(library);
    let old = shelf.find(old)?;
    if let Some(by) = shelf.successor(&old.id) {
        return Err(LibraryError::Superseded {
            id: old.id.clone(),
            by: by.to_owned(),
        });
    }
    let new = Calibration {
        supersedes: Some(old.id.clone()),
        ..new.clone()
    };
    save_calibration(library, &new)
}

/// Reads a file of the library and checks that it is what was written, or a bare document.
pub fn read_calibration(path: &Path) -> Result<Calibration, LibraryError> {
    let not_one = |err: serde_json::Error| LibraryError::NotOne {
        path: path.into(),
        reason: err.to_string(),
    };
    let text = fs::read_to_string(path).map_err(|source| LibraryError::Io {
        what: "read",
        path: path.into(),
        source,
    })?;
    let value: Value = serde_json::from_str(&text).map_err(not_one)?;
    let calibration = if value.get("checksum").is_some() {
        let file: File = serde_json::from_str(&text).map_err(not_one)?;
        if checksum(&file.calibration).map_err(not_one)? != file.checksum {
            return Err(LibraryError::Changed { path: path.into() });
        }
        serde_json::from_value(file.calibration)
    } else {
        serde_json::from_value(value)
    };
    let calibration = calibration.map_err(not_one)?;
    check(&calibration, &path.display().to_string())?;
    Ok(calibration)
}

fn check(calibration: &Calibration, what: &str) -> Result<(), LibraryError> {
    taken_at(calibration)?;
    let curve = calibration
        .curve()
        .map_err(|source| LibraryError::Calibration {
            what: what.to_owned(),
            source,
        });
    curve.map(|_| ())
}

/// A name as part of a file's: small letters, digits and single dashes.
fn slug(name: &str) -> String {
    let words = name
        .split(|letter: char| !letter.is_ascii_alphanumeric())
        .filter(|word| !word.is_empty())
        .map(str::to_ascii_lowercase);
    let slug = words.collect::<Vec<_>>().join("-");
    // File names have an end; 40 letters tell one calibration from another.
    let short: String = slug.chars().take(40).collect();
    if short.is_empty() {
        "unnamed".into()
    } else {
        short
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use chrono::TimeZone;
    use palpate_model::units::Volts;

    fn taken(name: &str, day: &str) -> Calibration {
        Calibration {
            name: name.into(),
            rig: "bench".into(),
            taken_at: Some(format!("{day}T10:00:00+08:00")),
            ..Calibration::thesis()
        }
    }

    #[test]
    fn what_is_stored_is_read_and_never_written_over() {
        let home = tempfile::tempdir().unwrap();
        let first = taken("Cell 4711 (new)", "2026-03-05");
        let kept = save_calibration(home.path(), &first).unwrap();
        assert!(
            kept.id.starts_with("20260305-cell-4711-new-"),
            "{}",
            kept.id
        );
        assert_eq!(read_calibration(&kept.path).unwrap(), first);
        let again = save_calibration(home.path(), &first).unwrap_err();
        assert!(again.to_string().contains(&kept.id), "{again}");
        let names: Vec<_> = fs::read_dir(home.path().join("calibrations"))
            .unwrap()
            .collect();
        assert_eq!(names.len(), 1, "no temporary file is left");
        let mut broken = first.clone();
        broken.steps.truncate(1);
        assert!(save_calibration(home.path(), &broken).is_err());
        broken = Calibration {
            taken_at: Some("yesterday".into()),
            ..first
        };
        let refusal = save_calibration(home.path(), &broken).unwrap_err();
        assert!(
            refusal.to_string().contains("no RFC 3339 time"),
            "{refusal}"
        );
    }

    #[test]
    fn a_changed_file_is_refused() {
        let home = tempfile::tempdir().unwrap();
        let kept = save_calibration(home.path(), &taken("c", "2026-03-05")).unwrap();
        let text = fs::read_to_string(&kept.path).unwrap();
        fs::write(&kept.path, text.replace("1.73", "1.74")).unwrap();
        let refusal = read_calibration(&kept.path).unwrap_err();
        assert!(
            refusal.to_string().contains("was changed after"),
            "{refusal}"
        );
        let shelf = Shelf::open(home.path());
        assert!(shelf.kept.is_empty() && shelf.unreadable.len() == 1);
        // A bare document carries no checksum and is taken as it is.
        let bare = home.path().join("bare.json");
        fs::write(
            &bare,
            serde_json::to_string(&Calibration::thesis()).unwrap(),
        )
        .unwrap();
        assert_eq!(read_calibration(&bare).unwrap(), Calibration::thesis());
        fs::write(&bare, "{\"checksum\": 1}").unwrap();
        assert!(matches!(
            read_calibration(&bare),
            Err(LibraryError::NotOne { .. })
        ));
    }

    #[test]
    fn the_latest_that_nothing_supersedes_is_in_force() {
        let home = tempfile::tempdir().unwrap();
        let old = save_calibration(home.path(), &taken("a", "2026-03-05")).unwrap();
        let later = save_calibration(home.path(), &taken("b", "2026-06-05")).unwrap();
        let mut other = taken("c", "2026-09-05");
        other.rig = "elsewhere".into();
        save_calibration(home.path(), &other).unwrap();
        let shelf = Shelf::open(home.path());
        assert_eq!(shelf.in_force("bench"), Some(&later));
        assert_eq!(shelf.in_force("nowhere"), None);
        // Superseding the later one by a document of an earlier date: that date counts.
        let mut correction = taken("b", "2026-06-05");
        correction.steps[3].volts = Volts(1.785);
        let new = supersede(home.path(), "b", &correction).unwrap();
        assert_eq!(new.calibration.supersedes.as_ref(), Some(&later.id));
        let shelf = Shelf::open(home.path());
        assert_eq!(shelf.in_force("bench"), Some(&new));
        assert_eq!(shelf.find("b").unwrap(), &new);
        assert_eq!(shelf.find(&later.id).unwrap(), &later);
        assert_eq!(shelf.successor(&old.id), None);
        let twice = supersede(home.path(), &later.id, &correction).unwrap_err();
        assert!(twice.to_string().contains(&new.id), "{twice}");
        assert!(matches!(shelf.find("z"), Err(LibraryError::Unknown { .. })));
        save_calibration(home.path(), &taken("a", "2026-03-06")).unwrap();
        let shelf = Shelf::open(home.path());
        assert!(matches!(
            shelf.find("a"),
            Err(LibraryError::Ambiguous { .. })
        ));
    }

    #[test]
    fn age_is_in_whole_days() {
        let now = Utc.with_ymd_and_hms(2026, 3, 15, 3, 0, 0).unwrap();
        // 10:00 at +08:00 is 02:00 UTC.
        assert_eq!(age_days(&taken("a", "2026-03-05"), now), Some(10));
        assert_eq!(age_days(&Calibration::thesis(), now), None);
    }
}
