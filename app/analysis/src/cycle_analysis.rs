//! Cycle analysis of recordings on disk.

use crate::cycles;
use crate::progress::Progress;
use crate::report::cycles::{CycleReport, CycleSettings};
use crate::source::SourceError;
use palpate_tables::import::ColumnNames;
use std::path::PathBuf;
use thiserror::Error;

#[derive(Debug, Error)]
pub enum CycleAnalysisError {
    #[error(transparent)]
    Source(#[from] SourceError),
    #[error(
        "{} has no loading with at least 20 samples; record a full cycle, or give the frequency if the record is a sine", .0.display()
    )]
    NoCycles(PathBuf),
    #[error("cancelled")]
    Cancelled,
}

pub fn analyse(
    paths: &[PathBuf],
    columns: Option<&ColumnNames>,
    question: &CycleSettings,
    progress: &dyn Progress,
) -> Result<Vec<CycleReport>, CycleAnalysisError> {
    let mut reports = Vec::with_capacity(paths.len());
    for path in paths {
        let name = path.display().to_string();
        if progress.report(reports.len(), paths.len(), &name).is_break() {
            return Err(CycleAnalysisError::Cancelled);
        }
        let report = CycleReport::of(name, cycles::read(path, columns)?, question);
        if report.cycles.is_empty() && report.sines.is_empty() {
            return Err(CycleAnalysisError::NoCycles(path.clone()));
        }
        reports.push(report);
    }
    Ok(reports)
}
