//! Sessions out of a lake.

use super::checksums::{Checksums, crc32_of};
use super::layout::{Part, is_lake, part};
use super::rows::rows;
use super::write::kind_name;
use palpate_model::Nanos;
use palpate_sessions::log::Session;
use palpate_sessions::manifest::{Manifest, RECORD_VERSION};
use palpate_sessions::record::{Entry, EntryKind};
use polars_core::prelude::{DataFrame, PolarsError, PolarsResult};
use polars_io::prelude::{ParquetReader, SerReader};
use std::fs::File;
use std::io::{self, Seek};
use std::path::{Path, PathBuf};
use thiserror::Error;
use walkdir::{DirEntry, WalkDir};

/// A lake, or a session in it, could not be read.
#[derive(Debug, Error)]
pub enum LakeError {
    /// The folder is none.
    #[error("{} is not a lake: it has no v1/samples and v1/sessions; export sessions to a lake first", path.display())]
    NoLake {
        /// The folder.
        path: PathBuf,
    },
    /// A file holds something else than a lake's.
    #[error("{} cannot be read ({reason}); export its session again to another lake", path.display())]
    Bad {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// It was written by a newer version.
    #[error("{} is a session of record version {version}, newer than this program; update palpate", path.display())]
    Newer {
        /// The file.
        path: PathBuf,
        /// Its version.
        version: u32,
    },
    /// The system refused.
    #[error("cannot read {} ({source}); check its permissions", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

/// A session of a lake.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct InLake {
    /// Its name.
    pub id: String,
    /// Its folder below that of each part.
    place: PathBuf,
}

/// Every session of a lake, by name. Files that are being written are not listed.
pub fn sessions(lake: &Path) -> Result<Vec<InLake>, LakeError> {
    if !is_lake(lake) {
        return Err(LakeError::NoLake { path: lake.into() });
    }
    let top = part(lake, Part::Sessions);
    // rig=R, month=YYYY-MM, then the files.
    let files = WalkDir::new(&top).min_depth(3).max_depth(3);
    let is_hidden = |one: &DirEntry| one.file_name().to_string_lossy().starts_with('.');
    let files = files.follow_links(true).into_iter();
    let mut found = Vec::new();
    for file in files.filter_entry(|one| !is_hidden(one)) {
        let file = file.map_err(|err| LakeError::Io {
            path: err.path().unwrap_or(&top).into(),
            source: err.into(),
        })?;
        let id = file.file_name().to_str();
        let id = id.and_then(|name| name.strip_suffix(".parquet"));
        let place = file.path().parent();
        let place = place.and_then(|folder| folder.strip_prefix(&top).ok());
        found.extend(
            id.zip(place).map(|(id, place)| InLake { id: id.to_owned(), place: place.to_owned() }),
        );
    }
    found.sort();
    Ok(found)
}

/// A session as it was put in, its edits made, and why it was rejected, if it was.
pub fn read_session(lake: &Path, one: &InLake) -> Result<(Session, Option<String>), LakeError> {
    let path = |of| {
        let folder = part(lake, of).join(&one.place);
        folder.join(format!("{}.parquet", one.id))
    };
    let checksums = Checksums::read(lake, &one.place, &one.id)?;
    let about = path(Part::Sessions);
    let sum = checksums.of_part(Part::Sessions);
    let (manifest, mut session, rejection) =
        with(&about, sum, |frame| session_of(frame).map_err(|err| err.to_string()))?;
    if manifest.record_version > RECORD_VERSION {
        return Err(LakeError::Newer { path: about, version: manifest.record_version });
    }
    let samples = path(Part::Samples);
    let sum = checksums.of_part(Part::Samples);
    let rows = with(&samples, sum, |frame| rows(frame).map_err(|err| err.to_string()))?;
    if rows.len() as u64 != session.samples {
        return Err(LakeError::Bad {
            reason: format!("{} samples of {}", rows.len(), session.samples),
            path: samples,
        });
    }
    let sum = checksums.of_part(Part::Events);
    let entries =
        with(&path(Part::Events), sum, |frame| entries(frame).map_err(|err| err.to_string()))?;
    let session = Session {
        path: samples,
        manifest,
        rows,
        entries,
        end: session.end.take(),
        notes: session.notes,
        // A lake holds what was measured and decided, not what went over the wires.
        beside: palpate_sessions::log::Beside::default(),
    };
    Ok((session, rejection))
}

/// Reads a table whose file has this checksum. No other file is given to the decoder, which trusts what it
/// reads.
fn with<T>(
    path: &Path,
    checksum: Option<u32>,
    take: impl FnOnce(&DataFrame) -> Result<T, String>,
) -> Result<T, LakeError> {
    let failed = |source| LakeError::Io { path: path.into(), source };
    let mut file = File::open(path).map_err(failed)?;
    if Some(crc32_of(&mut file).map_err(failed)?) != checksum {
        return Err(LakeError::Bad { path: path.into(), reason: "its checksum is wrong".into() });
    }
    file.rewind().map_err(failed)?;
    let frame = ParquetReader::new(file).finish().map_err(|err| err.to_string());
    frame
        .and_then(|frame| take(&frame))
        .map_err(|reason| LakeError::Bad { path: path.into(), reason })
}

/// What the sessions table tells beside the manifest.
struct About {
    samples: u64,
    end: Option<palpate_sessions::record::EndRecord>,
    notes: Vec<String>,
}

fn bad(reason: impl ToString) -> PolarsError {
    PolarsError::ComputeError(reason.to_string().into())
}

fn session_of(frame: &DataFrame) -> PolarsResult<(Manifest, About, Option<String>)> {
    if frame.height() != 1 {
        return Err(bad(format!("it has {} rows, not one", frame.height())));
    }
    let text = |name: &str| -> PolarsResult<Option<&str>> { Ok(frame.column(name)?.str()?.get(0)) };
    let needed = |name: &str| text(name)?.ok_or_else(|| bad(format!("it has no {name}")));
    let manifest = serde_json::from_str(needed("manifest")?).map_err(bad)?;
    let about = About {
        samples: frame.column("samples")?.u64()?.get(0).unwrap_or(0),
        end: serde_json::from_str(needed("end")?).map_err(bad)?,
        notes: serde_json::from_str(needed("notes")?).map_err(bad)?,
    };
    let is_rejected = text("verdict")? == Some("rejected");
    let reason = text("verdict_reason")?.unwrap_or_default().to_owned();
    Ok((manifest, about, is_rejected.then_some(reason)))
}

fn entries(frame: &DataFrame) -> PolarsResult<Vec<Entry>> {
    let (kind, body) = (frame.column("kind")?.str()?, frame.column("body")?.str()?);
    let number = |name: &str| frame.column(name)?.u64();
    let (order, now) = (number("order")?, number("now_ns")?);
    let after = number("after_sample")?;
    let each = |index: usize| {
        let value = |column: &polars_core::prelude::UInt64Chunked| {
            column.get(index).ok_or_else(|| bad("a number is missing"))
        };
        let kind = kind.get(index).unwrap_or_default();
        let kinds = [EntryKind::Input, EntryKind::Decision, EntryKind::Fit];
        let found = kinds.into_iter().find(|known| kind_name(*known) == kind);
        Ok(Entry {
            kind: found.ok_or_else(|| bad(format!("kind {kind:?} is unknown")))?,
            order: value(order)?,
            after_sample: value(after)?,
            now: Nanos(value(now)?),
            body: serde_json::from_str(body.get(index).unwrap_or_default()).map_err(bad)?,
        })
    };
    (0..frame.height()).map(each).collect()
}
