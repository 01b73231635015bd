//! Session logs on disk: write, read, export, import.
//!
//! A session is a folder with one log in the MCAP container (<https://mcap.dev/spec>). What was
//! flushed survives a crash, and a damaged log is refused, never read wrong.
//!
//! This crate never commands a rig, decides nothing about a run and draws nothing. Time is the
//! caller's; only the writer thread looks at a clock, to pace its disk synchronisation.
//!
//! Start reading at [`record`] for what a session holds and [`manifest`] for what it says about
//! itself.

pub mod manifest;
pub mod record;
mod schema;

pub use manifest::{Manifest, RECORD_VERSION, new_session_id};
pub use record::{EndRecord, Entry, EntryKind, Row};
