//! From what is on disk to what a fit takes: sessions and foreign tables alike.

use palpate_model::calibration::Calibration;
use palpate_model::fit::FitSample;
use palpate_model::rig::Phase;
use palpate_model::units::{Depth, Newtons, Seconds, Volts};
use palpate_sessions::import::{TableError, read_table};
use palpate_sessions::log::{ReadError, Session};
use palpate_sessions::record::EntryKind;
use std::path::Path;
use thiserror::Error;

use crate::engine::{Effect, Record};

/// Samples for a fit, and what a reader should know about them.
#[derive(Clone, Debug)]
pub struct FitSource {
    /// Time from the first sample, depth, force and its own uncertainty.
    pub samples: Vec<FitSample>,
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
    let is_session = path.is_dir()
        || path
            .extension()
            .is_some_and(|extension| extension == "mcap");
    if !is_session && path.exists() {
        let table = read_table(path)?;
        return Ok(FitSource {
            samples: samples_of_table(&table),
            notes: table.notes,
        });
    }
    let session = Session::open(path)?;
    let samples = samples_of(&session)?;
    Ok(FitSource {
        samples,
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
    let rows = session
        .rows
        .iter()
        .filter(|row| matches!(row.phase, Phase::Ramp | Phase::Hold));
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
