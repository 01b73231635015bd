//! Comparison of models on recordings on disk.

use crate::compliance::Corrections;
use crate::progress::Progress;
use crate::source::Wanted;
use crate::sources::{self, Naming, Reading, Recordings, SourcesError};
use palpate_rheology::select::{SelectError, SelectOptions, Selection, select};
use palpate_runner::Stopwatch;
use palpate_tables::import::ColumnNames;
use std::path::PathBuf;
use thiserror::Error;

#[derive(Debug, Default)]
pub struct SelectRequest {
    /// Recordings, or folders of them.
    pub paths: Vec<PathBuf>,
    /// Names of the columns of tables without a header.
    pub columns: Option<ColumnNames>,
    /// Which part of each, and whether rejected ones are taken.
    pub wanted: Wanted,
    /// Families, tolerance and what is held out; specimens are those of `specimens`.
    pub options: SelectOptions,
    /// The specimen of each recording in turn; without it what they say of themselves.
    pub specimens: Option<Vec<String>>,
    pub naming: Naming,
}

#[derive(Clone, Debug)]
pub struct Selected {
    pub selection: Selection,
    /// Remarks about the recordings, each with the name of its own.
    pub notes: Vec<String>,
    /// Wall seconds of the comparison alone.
    pub seconds: f64,
}

#[derive(Debug, Error)]
pub enum SelectFailure {
    #[error(transparent)]
    Sources(#[from] SourcesError),
    #[error("{names} specimens are named and there are {sources} sources; give one name for each")]
    Specimens { names: usize, sources: usize },
    #[error(transparent)]
    Select(#[from] SelectError),
}

/// Reads every recording and compares models on all of them together.
pub fn select_sources(
    mut request: SelectRequest,
    progress: &dyn Progress,
) -> Result<Selected, SelectFailure> {
    let found = sources::find(&request.paths)?;
    let how = Reading {
        columns: request.columns.as_ref(),
        wanted: request.wanted,
        corrections: &Corrections::none(None),
        naming: request.naming,
    };
    let records = sources::read(&found.paths, how)?;
    request.options.specimens = specimens(request.specimens.take(), &records)?;
    let watch = Stopwatch::start();
    let selection = select(&records.borrowed(), &request.options, &|news| {
        progress.tell(news.done, news.total, &news.family)
    })?;
    Ok(Selected {
        selection,
        seconds: watch.seconds(),
        notes: found.note().into_iter().chain(records.notes).collect(),
    })
}

fn specimens(
    names: Option<Vec<String>>,
    records: &Recordings,
) -> Result<Vec<Option<String>>, SelectFailure> {
    let Some(names) = names else {
        return Ok(records.all.iter().map(|one| one.specimen.clone()).collect());
    };
    let known = names.iter().filter(|name| !name.is_empty()).count();
    if known != names.len() || known != records.all.len() {
        return Err(SelectFailure::Specimens { names: known, sources: records.all.len() });
    }
    Ok(names.into_iter().map(Some).collect())
}
