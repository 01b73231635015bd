//! The session log: an append-only writer, its thread, and a strict reader.

mod batch_writer;
pub(crate) mod content;
mod error;
pub(crate) mod files;
pub(crate) mod frames;
mod json;
pub(crate) mod log_file;
mod notices;
pub mod reader;
mod segment;
pub mod sink;
mod summary;
pub mod thread;
pub(crate) mod walk;
pub mod writer;

pub use content::LogPart;
pub use error::LogError;
pub use files::find_files;
pub use notices::{LogNotice, LogNotices};
pub use reader::{AuxiliaryData, ReadError, Session, SessionOutline};
pub use sink::{Alteration, FileSink, FolderSegments, SegmentSource, Sink};
pub use summary::SessionSummary;
pub use thread::{RecordingPace, SessionWriter};
pub use writer::{BATCHES_PER_SEGMENT, LogBatch, LogWriter};
