//! Reading sessions from a lake.

use super::checksums::Checksums;
use super::layout::{LakePart, is_lake, part_folder};
use super::rows::rows;
use super::write::kind_name;
use palpate_model::Nanos;
use palpate_sessions::log::Session;
use palpate_sessions::manifest::{Manifest, RECORD_VERSION};
use palpate_sessions::record::{EntryKind, LogEntry};
use palpate_sessions::text::crc32_of;
use polars_core::prelude::{DataFrame, PolarsError, PolarsResult};
use polars_io::prelude::{ParallelStrategy, ParquetReader, SerReader};
use serde_json::{Value, json};
use std::fs::File;
use std::io::{self, Seek};
use std::path::{Path, PathBuf};
use thiserror::Error;
use walkdir::{DirEntry, WalkDir};

#[derive(Debug, Error)]
pub enum LakeError {
    #[error("{} is not a lake: it has no v1/samples and v1/sessions; export sessions to a lake first", path.display())]
    NoLake { path: PathBuf },
    #[error("{} cannot be read ({reason}); export its session again to another lake", path.display())]
    Bad { path: PathBuf, reason: String },
    #[error("{} is a session of record version {version}, which this palpate is too old to read; update palpate", path.display())]
    Newer { path: PathBuf, version: u32 },
    #[error("{} is not a whole fit ({reason}); move it away and fit the lake again", path.display())]
    BadFit { path: PathBuf, reason: String },
    #[error("cannot read {} ({source}); check its permissions", path.display())]
    Io { path: PathBuf, source: io::Error },
}

#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct LakeSession {
    pub id: String,
    /// Folder below the folder of each part.
    partition: PathBuf,
}

/// All sessions of a lake, by name. Files being written are not listed.
pub fn list_sessions(lake: &Path) -> Result<Vec<LakeSession>, LakeError> {
    if !is_lake(lake) {
        return Err(LakeError::NoLake { path: lake.into() });
    }
    let top = part_folder(lake, LakePart::Sessions);
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
        let partition = file.path().parent();
        let partition = partition.and_then(|folder| folder.strip_prefix(&top).ok());
        found.extend(id.zip(partition).map(|(id, partition)| LakeSession {
            id: id.to_owned(),
            partition: partition.to_owned(),
        }));
    }
    found.sort();
    Ok(found)
}

/// The manifest of a session as it was added, with its edits applied; and the reason if it was rejected.
pub fn read_manifest(
    lake: &Path,
    one: &LakeSession,
) -> Result<(Manifest, Option<String>), LakeError> {
    let checksums = Checksums::read(lake, &one.partition, &one.id)?;
    let (manifest, _, rejection) = read_outline(lake, one, &checksums)?;
    Ok((manifest, rejection))
}

/// The stored checksums of a session's files, as JSON: with its name they identify its data.
pub fn read_checksums(lake: &Path, one: &LakeSession) -> Result<Value, LakeError> {
    Ok(json!(Checksums::read(lake, &one.partition, &one.id)?))
}

fn path_of(lake: &Path, one: &LakeSession, part: LakePart) -> PathBuf {
    part_folder(lake, part).join(&one.partition).join(format!("{}.parquet", one.id))
}

fn read_outline(
    lake: &Path,
    one: &LakeSession,
    checksums: &Checksums,
) -> Result<(Manifest, StoredOutline, Option<String>), LakeError> {
    let path = path_of(lake, one, LakePart::Sessions);
    let sum = checksums.of_part(LakePart::Sessions);
    let outline = read_table(&path, sum, Some(&OUTLINE_COLUMNS), session_of)?;
    let version = outline.0.record_version;
    match version > RECORD_VERSION {
        true => Err(LakeError::Newer { path, version }),
        false => Ok(outline),
    }
}

/// A session as it was added, with its edits applied; and the reason if it was rejected.
pub fn read_session(
    lake: &Path,
    one: &LakeSession,
) -> Result<(Session, Option<String>), LakeError> {
    let checksums = Checksums::read(lake, &one.partition, &one.id)?;
    let (manifest, mut session, rejection) = read_outline(lake, one, &checksums)?;
    let samples = path_of(lake, one, LakePart::Samples);
    let sum = checksums.of_part(LakePart::Samples);
    let rows = read_table(&samples, sum, None, rows)?;
    if rows.len() as u64 != session.samples {
        return Err(LakeError::Bad {
            reason: format!("it has {} of {} samples", rows.len(), session.samples),
            path: samples,
        });
    }
    let sum = checksums.of_part(LakePart::Events);
    let entries = read_table(&path_of(lake, one, LakePart::Events), sum, None, entries)?;
    let session = Session {
        path: samples,
        manifest,
        rows,
        entries,
        end: session.end.take(),
        notes: session.notes,
        // A lake has no raw bytes and no health messages.
        auxiliary: palpate_sessions::log::AuxiliaryData::default(),
    };
    Ok((session, rejection))
}

/// Reads a table, or some of its columns, after its checksum, because the decoder trusts its input.
fn read_table<T>(
    path: &Path,
    checksum: Option<u32>,
    columns: Option<&[&str]>,
    parse: impl FnOnce(&DataFrame) -> PolarsResult<T>,
) -> Result<T, LakeError> {
    let failed = |source| LakeError::Io { path: path.into(), source };
    let mut file = File::open(path).map_err(failed)?;
    if Some(crc32_of(&mut file).map_err(failed)?) != checksum {
        return Err(LakeError::Bad { path: path.into(), reason: "its checksum is wrong".into() });
    }
    file.rewind().map_err(failed)?;
    // One row needs no threads, whose start takes longer than the reading.
    let threads = if columns.is_some() { ParallelStrategy::None } else { ParallelStrategy::Auto };
    let columns = columns.map(|names| names.iter().map(|&name| name.to_owned()).collect());
    let reader = ParquetReader::new(file).with_columns(columns).read_parallel(threads);
    let parsed = reader.finish().and_then(|frame| parse(&frame));
    parsed.map_err(|err| LakeError::Bad { path: path.into(), reason: err.to_string() })
}

/// The row of the sessions table without the manifest.
struct StoredOutline {
    samples: u64,
    end: Option<palpate_sessions::record::EndRecord>,
    notes: Vec<String>,
}

/// The columns that are read of the sessions table: the others say the same again, for other programs.
const OUTLINE_COLUMNS: [&str; 6] =
    ["manifest", "samples", "end", "notes", "verdict", "verdict_reason"];

fn bad(reason: impl ToString) -> PolarsError {
    PolarsError::ComputeError(reason.to_string().into())
}

fn session_of(frame: &DataFrame) -> PolarsResult<(Manifest, StoredOutline, Option<String>)> {
    if frame.height() != 1 {
        return Err(bad(format!("it has {} rows; exactly one is expected", frame.height())));
    }
    let text = |name: &str| -> PolarsResult<Option<&str>> { Ok(frame.column(name)?.str()?.get(0)) };
    let needed = |name: &str| text(name)?.ok_or_else(|| bad(format!("it has no {name}")));
    let manifest = serde_json::from_str(needed("manifest")?).map_err(bad)?;
    let about = StoredOutline {
        samples: frame.column("samples")?.u64()?.get(0).unwrap_or(0),
        end: serde_json::from_str(needed("end")?).map_err(bad)?,
        notes: serde_json::from_str(needed("notes")?).map_err(bad)?,
    };
    let is_rejected = text("verdict")? == Some("rejected");
    let reason = text("verdict_reason")?.unwrap_or_default().to_owned();
    Ok((manifest, about, is_rejected.then_some(reason)))
}

fn entries(frame: &DataFrame) -> PolarsResult<Vec<LogEntry>> {
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
        Ok(LogEntry {
            kind: found.ok_or_else(|| bad(format!("kind {kind:?} is unknown")))?,
            order: value(order)?,
            after_sample: value(after)?,
            now: Nanos(value(now)?),
            body: serde_json::from_str(body.get(index).unwrap_or_default()).map_err(bad)?,
        })
    };
    (0..frame.height()).map(each).collect()
}
