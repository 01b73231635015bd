//! Fills a library with simulated sessions, for the command line and the window.

use crate::catalog_search::update;
use crate::pool::{WorkEvent, in_order};
use crate::progress::Progress;
use palpate_runner::demonstration::{DEMONSTRATION_RUNS, DemonstrationError, DemonstrationRun};
use serde::Serialize;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use thiserror::Error;

#[derive(Debug, Error)]
pub enum DemonstrationLibraryError {
    #[error("the library {} already has sessions", .0.display())]
    InUse(PathBuf),
    #[error("the recording was interrupted, so the library {} lacks some of the sessions; use an empty folder to record all of them", .0.display())]
    Interrupted(PathBuf),
    #[error(transparent)]
    Run(#[from] DemonstrationError),
    #[error("the threads that record cannot be started ({0}); close other programs and try again")]
    Threads(io::Error),
    /// The sessions are there.
    #[error("{0}")]
    Catalog(String),
}

#[derive(Clone, Debug, Serialize)]
pub struct RecordedDemonstration {
    pub session: PathBuf,
    pub protocol: &'static str,
    pub specimen: &'static str,
}

/// Whether a library has no session yet; a missing folder has none.
#[must_use]
pub fn has_no_session(library: &Path) -> bool {
    std::fs::read_dir(library.join("sessions")).map_or(true, |mut items| items.next().is_none())
}

/// Records the sessions of the demonstration and reads them into the catalog. Simulated sessions are not mixed into a
/// library that is in use.
pub fn record_demonstration(
    library: &Path,
    progress: &dyn Progress,
) -> Result<Vec<RecordedDemonstration>, DemonstrationLibraryError> {
    if !has_no_session(library) {
        return Err(DemonstrationLibraryError::InUse(library.to_owned()));
    }
    let jobs = std::thread::available_parallelism().map_or(1, usize::from);
    let is_ending = AtomicBool::new(false);
    let report = |done: usize| {
        let next = DEMONSTRATION_RUNS.get(done).map_or("the catalog", |run| run.specimen);
        if progress.report(done, DEMONSTRATION_RUNS.len(), next).is_break() {
            is_ending.store(true, Ordering::Relaxed);
        }
    };
    report(0);
    let mut outcomes = Vec::new();
    let record = |run: &DemonstrationRun| run.record(library);
    in_order(jobs, &DEMONSTRATION_RUNS, &is_ending, record, |event| match event {
        WorkEvent::Done(count) => report(count),
        WorkEvent::Next(outcome) => outcomes.push(outcome),
    })
    .map_err(DemonstrationLibraryError::Threads)?;
    let mut sessions = Vec::new();
    for (run, outcome) in DEMONSTRATION_RUNS.iter().zip(outcomes) {
        let interrupted = |_| DemonstrationLibraryError::Interrupted(library.to_owned());
        let session = outcome.map_err(interrupted)??;
        let DemonstrationRun { protocol, specimen, .. } = *run;
        sessions.push(RecordedDemonstration { session, protocol, specimen });
    }
    update(library, progress).map_err(DemonstrationLibraryError::Catalog)?;
    Ok(sessions)
}
