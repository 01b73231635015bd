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

pub use content::Part;
pub use error::LogError;
pub use notices::{LogNotices, Notice};
pub use reader::{Beside, Outline, ReadError, Session};
pub use sink::{Alteration, FileSink, FolderSegments, SegmentSource, Sink};
pub use summary::Summary;
pub use thread::{Pace, SessionWriter};
pub use writer::{BATCHES_PER_SEGMENT, LogWriter, Parts};
