//! Many sources, each read and fitted by itself on one of several threads; the answers in the sources' order.

use super::{Fitted, Recipe};
use crate::pool::{News, WorkFailure, in_order};
use crate::source::SourceError;
use palpate_rheology::fit::FitError;
use std::io;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use thiserror::Error;

/// A source among many has no fit.
#[derive(Debug, Error)]
pub enum NotFitted {
    #[error(transparent)]
    Source(#[from] SourceError),
    #[error(transparent)]
    Fit(#[from] FitError),
    #[error("not begun; the batch was asked to end")]
    NotBegun,
    #[error("the fit ended unexpectedly; report this with the source")]
    Died,
}

impl From<WorkFailure> for NotFitted {
    fn from(failure: WorkFailure) -> Self {
        match failure {
            WorkFailure::NotBegun => Self::NotBegun,
            WorkFailure::Died => Self::Died,
        }
    }
}

/// Fits every source with `jobs` threads and tells `hear` every answer, in order. Once `is_ending` is set no fit is begun.
pub fn each(
    sources: &[PathBuf],
    jobs: usize,
    recipe: &Recipe,
    is_ending: &AtomicBool,
    hear: impl FnMut(News<Result<Fitted, SourceError>>),
) -> io::Result<()> {
    in_order(jobs, sources, is_ending, |source| recipe.fit(source), hear)
}
