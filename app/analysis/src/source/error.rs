//! Why there is nothing to fit or to analyse.

use crate::compliance::CorrectionError;
use palpate_sessions::analyses::AnalysisError;
use palpate_sessions::edits::EditError;
use palpate_sessions::log::ReadError;
use palpate_tables::import::TableError;
use thiserror::Error;

/// Nothing to fit or to analyse could be read.
#[derive(Debug, Error)]
pub enum SourceError {
    /// The session cannot be read.
    #[error(transparent)]
    Session(#[from] ReadError),
    /// The session's edits cannot be read.
    #[error(transparent)]
    Edits(#[from] EditError),
    /// The session's analyses cannot be read, or have none of that name.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// Somebody, or the program, decided that the session is not to be used.
    #[error("the session was rejected ({reason}) and is not used")]
    Rejected {
        /// Why.
        reason: String,
    },
    /// A table has no analyses.
    #[error("a table has no analyses, so there is no '{name}'; name a session")]
    TableAnalysis {
        /// What was asked for.
        name: String,
    },
    /// The table cannot be read.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The session was made from another program's file.
    #[error(
        "the session was imported from {file}: it has no plan and no decisions, so there is nothing to report"
    )]
    Imported {
        /// The file it was made from.
        file: String,
    },
    /// Without a raw signal there is nothing to make forces of.
    #[error(
        "the session was imported from {file} and has no raw signal, so its forces cannot be made anew; import the file again with other units if they are wrong"
    )]
    NoSignal {
        /// The file it was made from.
        file: String,
    },
    /// The session ended before there was anything to fit.
    #[error(
        "the session has no ramp and hold with known force and depth, so there is nothing to fit"
    )]
    Empty,
    /// The session ended before there was anything to analyse.
    #[error(
        "the session has no way in and no sine with known force and depth, so there are no cycles to analyse"
    )]
    NoCycles,
    /// A recorded decision is not what this version knows.
    #[error(
        "a recorded decision cannot be understood ({detail}); read the session with the version that wrote it, or replay it to find the entry"
    )]
    Decision {
        /// The parser's words.
        detail: String,
    },
    /// The session's plan is not what this version knows.
    #[error(
        "the session's plan cannot be understood ({detail}); read the session with the version that wrote it"
    )]
    Plan {
        /// The parser's words.
        detail: String,
    },
    /// Depths cannot be corrected as asked.
    #[error(transparent)]
    Correction(#[from] CorrectionError),
    /// The session's calibration is not what this version knows.
    #[error("the session's calibration cannot be understood ({detail})")]
    Calibration {
        /// The parser's words.
        detail: String,
    },
}
