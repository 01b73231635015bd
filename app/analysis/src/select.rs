//! Comparison of models on recordings on disk.

use crate::compliance::ComplianceCorrections;
use crate::progress::Progress;
use crate::recordings::{self, RecordingNames, RecordingOptions, Recordings, RecordingsError};
use crate::source::SourceSelection;
use palpate_rheology::select::{ModelSelection, SelectError, SelectOptions, select};
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
    pub wanted: SourceSelection,
    /// Families, tolerance and what is held out; specimens are those of `specimens`.
    pub options: SelectOptions,
    /// The specimen of each recording in turn; without it what they say of themselves.
    pub specimens: Option<Vec<String>>,
    pub naming: RecordingNames,
}

#[derive(Clone, Debug)]
pub struct SelectionReport {
    pub selection: ModelSelection,
    /// Remarks about the recordings, each with the name of its own.
    pub notes: Vec<String>,
    /// Wall seconds of the comparison alone.
    pub seconds: f64,
}

#[derive(Debug, Error)]
pub enum ModelSelectionError {
    #[error(transparent)]
    Sources(#[from] RecordingsError),
    #[error(
        "{names} specimen names are given for {sources} sources; give one name for each source"
    )]
    Specimens { names: usize, sources: usize },
    #[error(transparent)]
    Select(#[from] SelectError),
}

/// Reads every recording and compares models on all of them together.
pub fn select_sources(
    mut request: SelectRequest,
    progress: &dyn Progress,
) -> Result<SelectionReport, ModelSelectionError> {
    let found = recordings::find(&request.paths)?;
    let how = RecordingOptions {
        columns: request.columns.as_ref(),
        wanted: request.wanted,
        corrections: &ComplianceCorrections::none(None),
        naming: request.naming,
    };
    let records = recordings::read(&found.paths, how)?;
    request.options.specimens = specimens(request.specimens.take(), &records)?;
    let watch = Stopwatch::start();
    let selection = select(&records.borrowed(), &request.options, &|news| {
        progress.report(news.done, news.total, &news.family)
    })?;
    Ok(SelectionReport {
        selection,
        seconds: watch.seconds(),
        notes: found.note().into_iter().chain(records.notes).collect(),
    })
}

fn specimens(
    names: Option<Vec<String>>,
    records: &Recordings,
) -> Result<Vec<Option<String>>, ModelSelectionError> {
    let Some(names) = names else {
        return Ok(records.all.iter().map(|one| one.specimen.clone()).collect());
    };
    let known = names.iter().filter(|name| !name.is_empty()).count();
    if known != names.len() || known != records.all.len() {
        return Err(ModelSelectionError::Specimens { names: known, sources: records.all.len() });
    }
    Ok(names.into_iter().map(Some).collect())
}
