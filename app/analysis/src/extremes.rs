//! Every case at the extremes, as the command line and the window both run them.

use crate::pool::{WorkEvent, WorkFailure, in_order};
use crate::progress::Progress;
use palpate_rheology::extremes::{ExtremesExtent, ExtremesPart, ExtremesRow, list_extremes};
use palpate_rheology::families::UnknownFamily;
use std::io;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::available_parallelism;
use thiserror::Error;

#[derive(Debug, Error)]
pub enum ExtremesError {
    #[error(transparent)]
    Family(#[from] UnknownFamily),
    #[error("the threads of the test cannot be started ({0}); close other programs and try again")]
    Threads(#[from] io::Error),
    #[error("a part of the test ended with a fault of palpate; report it with the log")]
    Died,
}

/// Runs everything, or what concerns one family, on all processors. `progress` hears how many thousandths are done and
/// what is under way, and may end the whole between two parts: then there is no answer.
pub fn survey(
    extent: ExtremesExtent,
    family: Option<&str>,
    progress: &(dyn Progress + Sync),
) -> Result<Option<Vec<ExtremesRow>>, ExtremesError> {
    let parts = list_extremes(extent, family)?;
    let pieces: Vec<(&ExtremesPart, AtomicUsize)> =
        parts.iter().map(|part| (part, AtomicUsize::new(0))).collect();
    let is_ending = AtomicBool::new(false);
    let work = |(part, thousandths): &(&ExtremesPart, AtomicUsize)| {
        let what = format!("{}: {}", part.group, part.subject);
        let tell = |share: f64| {
            thousandths.store((1000.0 * share) as usize, Ordering::Relaxed);
            let done = pieces.iter().map(|(_, done)| done.load(Ordering::Relaxed)).sum();
            if progress.report(done, 1000 * pieces.len(), &what).is_break() {
                is_ending.store(true, Ordering::Relaxed);
            }
        };
        tell(0.0);
        part.rows(tell)
    };
    let jobs = available_parallelism().map_or(1, usize::from);
    let (mut rows, mut failure) = (Vec::new(), None);
    in_order(jobs, &pieces, &is_ending, work, |event| match event {
        WorkEvent::Next(Ok(more)) => rows.extend(more),
        WorkEvent::Next(Err(reason)) => failure = failure.or(Some(reason)),
        WorkEvent::Done(_) => {}
    })?;
    match failure {
        None => Ok(Some(rows)),
        Some(WorkFailure::NotBegun) => Ok(None),
        Some(WorkFailure::Died) => Err(ExtremesError::Died),
    }
}
