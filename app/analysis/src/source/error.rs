//! Reasons why a source cannot be fitted or analysed.

use crate::compliance::ComplianceCorrectionError;
use palpate_sessions::{AnalysisError, EditError, ReadError};
use palpate_tables::import::TableError;
use thiserror::Error;

#[derive(Debug, Error)]
pub enum SourceError {
    #[error(transparent)]
    Session(#[from] ReadError),
    #[error(transparent)]
    Edits(#[from] EditError),
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    #[error("the session was rejected ({reason}) and is not used")]
    Rejected { reason: String },
    #[error("a table has no analyses, so it has no analysis '{name}'; give a session")]
    TableAnalysis { name: String },
    #[error(transparent)]
    Table(#[from] TableError),
    #[error("the session was imported from {file}, so it contains no record of a run to report on")]
    Imported { file: String },
    #[error(
        "the session was imported from {file} and has no raw signal, so its forces cannot be recalculated; if the forces are wrong, import the file again with other units"
    )]
    NoSignal { file: String },
    #[error(
        "the session has no ramp and hold with a known force and depth, so there is nothing to fit"
    )]
    Empty,
    #[error("the session has no loading and no sine with known force and depth to analyse")]
    NoCycles,
    #[error(
        "a recorded decision cannot be understood ({detail}); read the session with the version of palpate that wrote it, or replay the session to find the entry"
    )]
    Decision { detail: String },
    #[error(
        "the session's plan cannot be understood ({detail}); read the session with the version of palpate that wrote it"
    )]
    Plan { detail: String },
    #[error(transparent)]
    Correction(#[from] ComplianceCorrectionError),
    #[error("the session's calibration cannot be understood ({detail})")]
    Calibration { detail: String },
}
