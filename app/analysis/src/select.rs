//! From sources on disk to a comparison of models, as the command line and the window both make it.

use crate::source::{self, SourceError, Stretch};
use palpate_rheology::fit::FitSample;
use palpate_rheology::select::{SelectError, SelectOptions, Selection, select};
use std::fmt;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// A source read for a comparison.
#[derive(Clone, Debug)]
pub struct SelectSource {
    /// Its name: that of the folder or file.
    pub name: String,
    /// What is fitted.
    pub samples: Vec<FitSample>,
    /// What its reader remarked.
    pub notes: Vec<String>,
    /// The specimen pressed, where the source says so.
    pub specimen: Option<String>,
}

/// A comparison and what it was made of.
#[derive(Clone, Debug)]
pub struct Selected {
    /// The comparison.
    pub selection: Selection,
    /// Remarks about the sources, each with the name of its source.
    pub notes: Vec<String>,
}

/// No comparison.
#[derive(Debug)]
pub enum SelectFailure {
    /// This source cannot be read.
    Source(PathBuf, Box<SourceError>),
    /// The records cannot be compared.
    Select(SelectError),
}

impl fmt::Display for SelectFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Source(path, reason) => write!(f, "{}: {reason}", path.display()),
            Self::Select(reason) => reason.fmt(f),
        }
    }
}

/// Reads every source and compares models on all of them together.
pub fn select_sources(
    paths: &[PathBuf],
    stretch: Stretch,
    mut options: SelectOptions,
    progress: &dyn Fn(usize, usize, &str) -> ControlFlow<()>,
) -> Result<Selected, SelectFailure> {
    let sources = paths
        .iter()
        .map(|path| read(path, stretch))
        .collect::<Result<Vec<SelectSource>, _>>()?;
    let records: Vec<(&str, &[FitSample])> = sources
        .iter()
        .map(|source| (source.name.as_str(), source.samples.as_slice()))
        .collect();
    options.specimens = sources
        .iter()
        .map(|source| source.specimen.clone())
        .collect();
    let selection = select(&records, &options, &|news| {
        progress(news.done, news.total, &format!("fitting {}", news.family))
    })
    .map_err(SelectFailure::Select)?;
    let notes = sources.iter().flat_map(|source| {
        source
            .notes
            .iter()
            .map(|note| format!("{}: {note}", source.name))
    });
    Ok(Selected {
        notes: notes.collect(),
        selection,
    })
}

fn read(path: &Path, stretch: Stretch) -> Result<SelectSource, SelectFailure> {
    let source = source::read_stretch(path, None, stretch)
        .map_err(|reason| SelectFailure::Source(path.to_path_buf(), Box::new(reason)))?;
    let name = path.file_stem().map_or_else(
        || path.display().to_string(),
        |stem| stem.to_string_lossy().into_owned(),
    );
    Ok(SelectSource {
        name,
        samples: source.samples,
        notes: source.notes,
        specimen: source.specimen,
    })
}
