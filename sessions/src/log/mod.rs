//! The session log: an append-only writer, its thread, and a strict reader.

mod content;
mod frames;
pub mod reader;
pub mod sink;
pub mod thread;
pub mod writer;

pub use reader::{ReadError, Session};
pub use sink::{FileSink, Sink};
pub use thread::{Pace, SessionWriter};
pub use writer::{LogError, LogWriter};
