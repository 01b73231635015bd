//! From what is on disk to what a fit takes: sessions and foreign tables alike.

use palpate_model::calibration::Calibration;
use palpate_model::fit::FitSample;
use palpate_model::rig::Phase;
use palpate_model::units::{Depth, Newtons, Seconds, Volts};
use palpate_sessions::import::{ColumnNames, TableError, read_table};
use palpate_sessions::log::{ReadError, Session};
use palpate_sessions::record::{EntryKind, Row};
use std::path::Path;
use thiserror::Error;

use crate::engine::{Effect, Record};

/// Samples for a fit, and what a reader should know about them.
#[derive(Clone, Debug)]
pub struct FitSource {
    /// Time from the first sample, depth, force and its own uncertainty.
    pub samples: Vec<FitSample>,
    /// Session time of the first sample; 0 for a table, whose times are kept as they are.
    pub start: Seconds,
    /// Remarks, such as an interrupted recording.
    pub notes: Vec<String>,
}

/// Nothing to fit could be read.
#[derive(Debug, Error)]
pub enum SourceError {
    /// The session cannot be read.
    #[error(transparent)]
    Session(#[from] ReadError),
    /// The table cannot be read.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The session ended before there was anything to fit.
    #[error(
        "the session has no ramp and hold with known force and depth, so there is nothing to fit"
    )]
    Empty,
    /// The session's calibration is not what this version knows.
    #[error("the session's calibration cannot be understood ({detail})")]
    Calibration {
        /// The parser's words.
        detail: String,
    },
}

/// Reads a session folder, a session file or a table.
pub fn read(path: &Path) -> Result<FitSource, SourceError> {
    read_named(path, None)
}

/// As [`read`]; `columns` names the columns of a table that has no header.
pub fn read_named(path: &Path, columns: Option<&ColumnNames>) -> Result<FitSource, SourceError> {
    let is_session = path.is_dir()
        || path
            .extension()
            .is_some_and(|extension| extension == "mcap");
    if !is_session && path.exists() {
        let table = read_table(path, columns)?;
        return Ok(FitSource {
            samples: samples_of_table(&table),
            start: Seconds(0.0),
            notes: table.notes,
        });
    }
    let session = Session::open(path)?;
    let samples = samples_of(&session)?;
    Ok(FitSource {
        samples,
        start: start_of(&session),
        notes: session.notes,
    })
}

/// The ramp and hold of a session, each force weighted by what the signal's noise and the
/// calibration curve's sensitivity make of it.
pub fn samples_of(session: &Session) -> Result<Vec<FitSample>, SourceError> {
    let bad = |detail: String| SourceError::Calibration { detail };
    let calibration: Calibration = serde_json::from_value(session.manifest.calibration.clone())
        .map_err(|err| bad(err.to_string()))?;
    let curve = calibration.curve().map_err(|err| bad(err.to_string()))?;
    let noise = noise_of(session).ok_or(SourceError::Empty)?;
    let tick_secs = session.manifest.rig.tick().0;
    let rows = session.rows.iter().filter(|row| is_fitted(row));
    let mut first_tick = None;
    let samples: Vec<FitSample> = rows
        .filter_map(|row| {
            let (force, depth) = (Newtons(row.force?), Depth(row.depth?));
            let first_tick = *first_tick.get_or_insert(row.tick);
            Some(FitSample {
                t: Seconds((row.tick - first_tick) as f64 * tick_secs),
                depth,
                force,
                sigma: curve.force_sigma(force, noise),
            })
        })
        .collect();
    if samples.is_empty() {
        Err(SourceError::Empty)
    } else {
        Ok(samples)
    }
}

fn is_fitted(row: &Row) -> bool {
    matches!(row.phase, Phase::Ramp | Phase::Hold) && row.force.is_some() && row.depth.is_some()
}

/// Session time of the first sample that a fit takes.
fn start_of(session: &Session) -> Seconds {
    let first = session.rows.iter().find(|row| is_fitted(row));
    first.map_or(Seconds(0.0), |row| row.host.seconds())
}

/// The signal's noise as the tare found it.
fn noise_of(session: &Session) -> Option<Volts> {
    session
        .entries
        .iter()
        .filter(|entry| entry.kind == EntryKind::Decision)
        .filter_map(|entry| serde_json::from_value(entry.body.clone()).ok())
        .find_map(|effect| match effect {
            Effect::Record(Record::Tared { noise, .. }) => Some(noise),
            _ => None,
        })
}

/// A table knows nothing of its noise: every sample counts alike.
fn samples_of_table(table: &palpate_sessions::import::Table) -> Vec<FitSample> {
    (0..table.t.len())
        .map(|i| FitSample {
            t: Seconds(table.t[i]),
            depth: Depth(table.depth[i]),
            force: Newtons(table.force[i]),
            sigma: Newtons(1.0),
        })
        .collect()
}
