//! A session made of a part of a foreign file, the file kept beside its log.

use super::{ForeignPart, Sample};
use chrono::{DateTime, Utc};
use palpate_model::Nanos;
use palpate_model::about::Labels;
use palpate_sessions::atomic;
use palpate_sessions::folder::{FolderError, SessionFolder, check_free_space};
use palpate_sessions::imported::{Imported, ORIGINAL_FOLDER};
use palpate_sessions::log::{BATCHES_PER_SEGMENT, FolderSegments, LogError, LogWriter};
use palpate_sessions::manifest::{IMPORTED_TICKS_PER_S, Manifest, RECORD_VERSION};
use palpate_sessions::record::{EndRecord, Row};
use serde_json::Value;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Rows written at a time.
const ROWS_PER_BATCH: usize = 1 << 14;
/// What a row takes on disk, with room to spare: 27 bytes were measured.
const BYTES_PER_ROW: u64 = 64;

/// A session could not be made of a file.
#[derive(Debug, Error)]
pub enum KeepError {
    /// No folder for it.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// Its log cannot be written.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The original cannot be written.
    #[error("cannot keep the original as {} ({source}); choose a folder that may be written", path.display())]
    Original {
        /// Where it was to be.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The times do not fit a session.
    #[error("{reason}")]
    Times {
        /// Why, and what to do.
        reason: String,
    },
}

/// What a session is made of, beside the part.
#[derive(Clone, Debug)]
pub struct Kept<'a> {
    /// Folder of the session, new or empty.
    pub folder: &'a Path,
    /// The whole file, byte for byte.
    pub original: &'a [u8],
    /// Name of the session.
    pub session_id: String,
    /// When it is imported.
    pub at: DateTime<Utc>,
    /// Version of this program.
    pub software_version: &'a str,
    /// Who and what, as told.
    pub labels: Labels,
}

/// Makes the session: first the original, then the log, each on disk when this returns.
pub fn keep(part: &ForeignPart, kept: Kept<'_>) -> Result<(), KeepError> {
    let ticks = ticks(&part.samples)?;
    let rows = part.samples.len() as u64 * BYTES_PER_ROW;
    check_free_space(kept.folder, kept.original.len() as u64 + rows)?;
    let folder = SessionFolder::create(kept.folder)?;
    keep_original(folder.path(), &part.imported.file, kept.original)?;
    let reason = format!("imported from {}", part.imported.source());
    let manifest = Manifest {
        record_version: RECORD_VERSION,
        session_id: kept.session_id,
        software_version: kept.software_version.into(),
        // No engine decided anything.
        engine_version: 0,
        started_at: kept.at,
        operator: kept.labels.operator,
        specimen: kept.labels.specimen,
        indenter: kept.labels.indenter,
        about: kept.labels.about,
        signal: None,
        imported: Some(part.imported.clone()),
        recovered: None,
        rig: None,
        limits: None,
        calibration: Value::Null,
        plan: Value::Null,
        settings: Value::Null,
        acknowledgements: Vec::new(),
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
    log.finish(EndRecord {
        outcome: "imported".into(),
        reason,
        samples: 0,
        entries: 0,
        raw_bytes: 0,
        ended_at,
        time_use: Vec::new(),
    })?;
    Ok(())
}

fn row(sample: &Sample, tick: u64) -> Row {
    Row {
        tick,
        host: Nanos(tick / 1000),
        age: None,
        counts: None,
        volts: sample.signal,
        pulses: None,
        status: 0,
        force: sample.force,
        depth: sample.depth,
        phase: sample.phase,
        cycle: 0,
    }
}

/// Times from the first one in ticks.
fn ticks(samples: &[Sample]) -> Result<Vec<u64>, KeepError> {
    let first = samples.first().map_or(0.0, |first| first.t);
    let refused = |reason: String| KeepError::Times { reason };
    let mut ticks: Vec<u64> = Vec::with_capacity(samples.len());
    for sample in samples {
        let tick = ((sample.t - first) * IMPORTED_TICKS_PER_S).round();
        // Beyond 2^63 ticks, 106 days, differences of ticks would lose their sign.
        if !(0.0..9.2e18).contains(&tick) {
            return Err(refused(format!(
                "the time {} s is more than 106 days after the first; say the unit of time, or cut the file",
                sample.t
            )));
        }
        let tick = tick as u64;
        if ticks.last().is_some_and(|last| tick <= *last) {
            return Err(refused(format!(
                "the time {} s is less than a picosecond after the one before; say the unit of time",
                sample.t
            )));
        }
        ticks.push(tick);
    }
    Ok(ticks)
}

fn keep_original(folder: &Path, name: &str, bytes: &[u8]) -> Result<(), KeepError> {
    let below = folder.join(ORIGINAL_FOLDER);
    let path = below.join(name);
    let written = fs::create_dir(&below).and_then(|()| atomic::create(&path, bytes));
    written.map_err(|source| KeepError::Original { path, source })
}

/// A name for the folder of a part: that of the file and of the part, with nothing a path could mind.
#[must_use]
pub fn folder_name(imported: &Imported) -> String {
    let stem = Path::new(&imported.file).file_stem().unwrap_or_default();
    let part = match imported.part.as_str() {
        "" => String::new(),
        part => format!("-{part}"),
    };
    let is_plain = |c: &char| c.is_alphanumeric() || "-_.".contains(*c);
    // Well below the 255 bytes that file systems take, whatever the letters.
    let name = stem.to_string_lossy().into_owned() + &part;
    let name: String = name.chars().take(60).map(|c| if is_plain(&c) { c } else { '-' }).collect();
    match name.trim_matches('.') {
        "" => "imported".into(),
        name => name.into(),
    }
}
