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
        (!is_ending.load(Ordering::Relaxed)).then(|| part.rows(tell))
    };
    let jobs = available_parallelism().map_or(1, usize::from);
    let (mut rows, mut has_died) = (Some(Vec::new()), false);
    in_order(jobs, &pieces, &is_ending, work, |event| match event {
        WorkEvent::Next(Ok(Some(more))) => {
            if let Some(rows) = &mut rows {
                rows.extend(more);
            }
        }
        WorkEvent::Next(Ok(None) | Err(WorkFailure::NotBegun)) => rows = None,
        WorkEvent::Next(Err(WorkFailure::Died)) => has_died = true,
        WorkEvent::Done(_) => {}
    })?;
    if has_died { Err(ExtremesError::Died) } else { Ok(rows) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::progress::NoProgress;
    use std::ops::ControlFlow;

    #[test]
    fn rows_come_in_the_order_of_their_parts() {
        let parts = list_extremes(ExtremesExtent::Quick, Some("voigt")).unwrap();
        let expected: Vec<ExtremesRow> = parts.iter().flat_map(|part| part.rows(|_| {})).collect();
        let found = survey(ExtremesExtent::Quick, Some("voigt"), &NoProgress).unwrap().unwrap();
        // As texts: a row may hold a NaN.
        assert_eq!(format!("{found:?}"), format!("{expected:?}"));
    }

    #[test]
    fn a_survey_that_is_ended_has_no_rows() {
        let end = |_: usize, _: usize, _: &str| ControlFlow::Break(());
        assert!(survey(ExtremesExtent::Quick, Some("voigt"), &end).unwrap().is_none());
    }
}
