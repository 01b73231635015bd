//! Why a crate cannot be made or read.

use super::files::SUMS_FILE;
use palpate_protocols::file::ProtocolProblem;
use palpate_sessions::EditError;
use palpate_sessions::log::ReadError;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

#[derive(Debug, Error)]
pub enum CrateError {
    #[error("{}, {}", path.display(), problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
    Study { path: PathBuf, problems: Vec<ProtocolProblem> },
    #[error("{} exists already; give the crate another name", .0.display())]
    Exists(PathBuf),
    #[error("{} is not a session's folder; give the folder of a session", .0.display())]
    NoFolder(PathBuf),
    #[error("{} is still being recorded; make the crate when the run has ended", .0.display())]
    BeingRecorded(PathBuf),
    #[error("{} is given twice; give it once", .0.display())]
    Twice(PathBuf),
    #[error("{}: {reason}", path.display())]
    Session { path: PathBuf, reason: ReadError },
    #[error("{}: {reason}", path.display())]
    Edits { path: PathBuf, reason: EditError },
    #[error(transparent)]
    Recordings(#[from] crate::recordings::RecordingsError),
    #[error("{} is a link or a device, which another computer lacks; put a file in its place", .0.display())]
    NoPlainFile(PathBuf),
    #[error(
        "the study file names {0}, which leads out of its folder; put the file beside the study file"
    )]
    FileOutside(String),
    #[error("the study file names {} twice as a file of the crate; rename one of them", .0)]
    FileTwice(String),
    #[error("step '{step}' cannot be run: {reason}")]
    NotRun { step: String, reason: String },
    #[error("step '{step}' failed: {reason}")]
    Failed { step: String, reason: String },
    #[error(
        "step '{step}' wrote {file}, which is not in its folder results/{step}; name a file in that folder"
    )]
    Elsewhere { step: String, file: String },
    #[error(
        "the steps changed {file}, which they may only read; leave out the step that changes it"
    )]
    Changed { file: String },
    #[error("cannot read {} ({source}); check the path and its permissions", path.display())]
    Read { path: PathBuf, source: io::Error },
    #[error("cannot write {} ({source}); choose a folder that you may write to, with enough space", path.display())]
    Write { path: PathBuf, source: io::Error },
    #[error("{} is not a crate of palpate, because it has no {SUMS_FILE}; give the folder or the zip file of a crate", .0.display())]
    NoCrate(PathBuf),
    #[error("{} cannot be read as a crate: {reason}; give a crate that 'palpate crate' made", path.display())]
    NotOurs { path: PathBuf, reason: String },
    #[error("{} is not a zip file that can be read ({reason}); fetch the crate again", path.display())]
    Zip { path: PathBuf, reason: String },
    #[error("the zip file {} has the name '{name}', which leads out of the crate; nothing was unpacked, and the file is not to be trusted", path.display())]
    Escapes { path: PathBuf, name: String },
    #[error(
        "the crate unpacks to {needed_bytes} bytes, and the disk has {free_bytes} free; make room"
    )]
    NoSpace { needed_bytes: u64, free_bytes: u64 },
    #[error("the crate was cancelled")]
    Cancelled,
}

impl CrateError {
    pub(super) fn read(path: &Path, source: io::Error) -> Self {
        Self::Read { path: path.to_owned(), source }
    }

    pub(super) fn write(path: &Path, source: io::Error) -> Self {
        Self::Write { path: path.to_owned(), source }
    }

    /// Whether the request was wrong, and nothing was begun.
    #[must_use]
    pub const fn is_wrong_use(&self) -> bool {
        !matches!(
            self,
            Self::Failed { .. }
                | Self::Elsewhere { .. }
                | Self::Changed { .. }
                | Self::NotRun { .. }
                | Self::Read { .. }
                | Self::Write { .. }
                | Self::Zip { .. }
                | Self::Escapes { .. }
                | Self::NoSpace { .. }
                | Self::Cancelled
        )
    }
}
