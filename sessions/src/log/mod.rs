//! The session log: an append-only writer, its thread, and a strict reader.

pub(crate) mod content;
pub(crate) mod frames;
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
pub use reader::{Beside, Outline, ReadError, Session};
pub use sink::{FileSink, FolderSegments, SegmentSource, Sink};
pub use summary::Summary;
pub use thread::{Notice, Pace, SessionWriter};
pub use writer::{BATCHES_PER_SEGMENT, LogError, LogWriter, Parts};
