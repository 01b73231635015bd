//! A session made from a part of a foreign file, with the original file beside the log.

use super::{ForeignPart, ForeignSample};
use chrono::{DateTime, Utc};
use palpate_model::Nanos;
use palpate_model::metadata::SessionLabels;
use palpate_sessions::atomic;
use palpate_sessions::folder::{FolderError, SessionFolder, check_free_space};
use palpate_sessions::import_origin::{ImportOrigin, ORIGINAL_FOLDER};
use palpate_sessions::log::{BATCHES_PER_SEGMENT, FolderSegments, LogError, LogWriter};
use palpate_sessions::manifest::{IMPORTED_TICKS_PER_S, Manifest, RECORD_VERSION};
use palpate_sessions::record::{EndRecord, SampleRow};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

const ROWS_PER_BATCH: usize = 1 << 14;
/// Generous size of a row on disk: 27 bytes were measured.
const BYTES_PER_ROW: u64 = 64;

#[derive(Debug, Error)]
pub enum StoreImportError {
    #[error(transparent)]
    Folder(#[from] FolderError),
    #[error(transparent)]
    Log(#[from] LogError),
    #[error("cannot store the original as {} ({source}); choose a writable folder", path.display())]
    Original { path: PathBuf, source: io::Error },
    #[error("{reason}")]
    Times { reason: String },
}

/// The session to make.
#[derive(Clone, Debug)]
pub struct ImportTarget<'a> {
    /// Must be new or empty.
    pub folder: &'a Path,
    /// The bytes of the whole file.
    pub original: &'a [u8],
    pub session_id: String,
    pub at: DateTime<Utc>,
    pub software_version: &'a str,
    pub labels: SessionLabels,
}

/// Stores the original, then the log; both are on the disk when this returns.
pub fn store_import(part: &ForeignPart, target: ImportTarget<'_>) -> Result<(), StoreImportError> {
    let ticks = ticks(&part.samples)?;
    let rows = part.samples.len() as u64 * BYTES_PER_ROW;
    check_free_space(target.folder, target.original.len() as u64 + rows)?;
    let folder = SessionFolder::create(target.folder)?;
    store_original(folder.path(), &part.imported.file, target.original)?;
    let reason = format!("imported from {}", part.imported.source());
    let manifest = Manifest {
        record_version: RECORD_VERSION,
        session_id: target.session_id,
        software_version: target.software_version.into(),
        started_at: target.at,
        operator: target.labels.operator,
        specimen: target.labels.specimen,
        indenter: target.labels.indenter,
        about: target.labels.about,
        imported: Some(part.imported.clone()),
        ..Manifest::default()
    };
    let segments = Box::new(FolderSegments::new(folder.path()));
    let mut log = LogWriter::begin_in_segments(segments, BATCHES_PER_SEGMENT, &manifest)?;
    let mut batch = Vec::with_capacity(ROWS_PER_BATCH.min(ticks.len()));
    let samples = part.samples.chunks(ROWS_PER_BATCH);
    for (samples, ticks) in samples.zip(ticks.chunks(ROWS_PER_BATCH)) {
        batch.clear();
        batch.extend(samples.iter().zip(ticks).map(|(sample, tick)| row(sample, *tick)));
        log.append(&batch, &[])?;
    }
    let ended_at = batch.last().map_or(Nanos::ZERO, |last| last.host);
    let outcome = "imported".into();
    Ok(log.finish(EndRecord { outcome, reason, ended_at, ..EndRecord::default() })?)
}

fn row(sample: &ForeignSample, tick: u64) -> SampleRow {
    SampleRow {
        tick,
        host: Nanos(tick / 1000),
        volts: sample.signal,
        force: sample.force,
        depth: sample.depth,
        phase: sample.phase,
        ..SampleRow::default()
    }
}

/// Times since the first sample, in ticks.
fn ticks(samples: &[ForeignSample]) -> Result<Vec<u64>, StoreImportError> {
    let first = samples.first().map_or(0.0, |first| first.t);
    let refused = |reason: String| StoreImportError::Times { reason };
    let mut ticks: Vec<u64> = Vec::with_capacity(samples.len());
    for sample in samples {
        let tick = ((sample.t - first) * IMPORTED_TICKS_PER_S).round();
        // From 2^63 ticks, 106 days, differences of ticks would overflow.
        if !(0.0..9.2e18).contains(&tick) {
            return Err(refused(format!(
                "the time {} s is more than 106 days after the first row, too long for one session; give the unit of time if it is not seconds, or split the file",
                sample.t
            )));
        }
        let tick = tick as u64;
        if ticks.last().is_some_and(|last| tick <= *last) {
            return Err(refused(format!(
                "the time {} s is less than a picosecond after that of the previous row; give the unit of time if it is not seconds",
                sample.t
            )));
        }
        ticks.push(tick);
    }
    Ok(ticks)
}

fn store_original(folder: &Path, name: &str, bytes: &[u8]) -> Result<(), StoreImportError> {
    let below = folder.join(ORIGINAL_FOLDER);
    let path = below.join(name);
    let written = fs::create_dir(&below).and_then(|()| atomic::create(&path, bytes));
    written.map_err(|source| StoreImportError::Original { path, source })
}

/// A folder's name from the names of file and part, without characters that are special in paths.
#[must_use]
pub fn folder_name(imported: &ImportOrigin) -> String {
    let stem = Path::new(&imported.file).file_stem().unwrap_or_default();
    let part = match imported.part.as_str() {
        "" => String::new(),
        part => format!("-{part}"),
    };
    let is_plain = |c: &char| c.is_alphanumeric() || "-_.".contains(*c);
    // 60 letters stay below the file system's 255 bytes.
    let name = stem.to_string_lossy().into_owned() + &part;
    let name: String = name.chars().take(60).map(|c| if is_plain(&c) { c } else { '-' }).collect();
    match name.trim_matches('.') {
        "" => "imported".into(),
        name => name.into(),
    }
}
