//! The session log: an append-only writer, its thread, and a strict reader.

pub(crate) mod content;
mod error;
pub(crate) mod files;
pub(crate) mod frames;
mod json;
mod news;
pub mod reader;
mod scribe;
mod segment;
pub mod sink;
pub(crate) mod source;
mod summary;
pub mod thread;
pub(crate) mod walk;
pub mod writer;

pub use content::Part;
pub use error::LogError;
pub use news::{News, Notice};
pub use reader::{Beside, Outline, ReadError, Session};
pub use sink::{Alteration, ClosedCheck, FileSink, FolderSegments, SegmentSource, Sink};
pub use summary::Summary;
pub use thread::{Pace, SessionWriter};
pub use writer::{BATCHES_PER_SEGMENT, LogWriter, Parts};
