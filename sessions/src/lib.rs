//! Session logs on disk: write, read, recover, find.
//!
//! A session is a folder with one log in the MCAP container (<https://mcap.dev/spec>), a long one in segments. Flushed data
//! survives a crash, and a damaged log is refused, never misread.
//!
//! This crate never commands a rig, decides nothing about a run and draws nothing. The caller provides the time; only the
//! writer thread reads a clock, to pace its disk synchronisation.
//!
//! Start reading at [`record`] and [`manifest`] for the content of a session, then [`log::SessionWriter`] and
//! [`log::Session`].
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

pub mod analyses;
pub mod atomic;
pub mod block;
pub mod calibrations;
pub mod catalog;
mod chain;
pub mod checks;
pub mod compliances;
pub mod contacts;
pub mod document_store;
pub mod edits;
pub mod folder;
pub mod health;
pub mod import_origin;
pub mod journal;
mod lock;
pub mod locked_protocols;
pub mod log;
pub mod manifest;
mod packed;
pub mod populations;
pub mod program_log;
pub mod raw;
pub mod record;
pub mod recover;
pub mod schema;
pub mod specimen_queue;
pub mod text;
pub mod ticks;

pub use analyses::{ANALYSES_FILE, Analyses, AnalysisError};
pub use block::SampleBlock;
pub use calibrations::{CalibrationStore, read_calibration};
pub use catalog::Catalog;
pub use chain::{ChainError, ChainHead, HEAD_VERSION as LINES_VERSION};
pub use document_store::{LibraryError, age_days, save_document, supersede_document};
pub use edits::{
    DataQuality, EDITS_FILE, Edit, EditChange, EditError, Edits, Review, ReviewDecision, add_edit,
};
pub use folder::{
    FolderError, HolderLock, LOCK_FILE, LOG_FILE, LockError, SPARE_FILE, SessionFolder,
    check_free_space, library_folder, new_programme_folder, new_session_folder, segment_file,
    spare_folder,
};
pub use health::{HealthMessage, HealthSummary, MachineState};
pub use import_origin::{ImportOrigin, ORIGINAL_FOLDER};
pub use log::{
    Alteration, AuxiliaryData, FileSink, FolderSegments, LogBatch, LogError, LogNotice, LogPart,
    LogWriter, ReadError, RecordingPace, SegmentSource, Session, SessionOutline, SessionSummary,
    SessionWriter, Sink,
};
pub use manifest::{Manifest, RECORD_VERSION, new_session_id};
pub use raw::RawBlock;
pub use record::{EndRecord, EntryKind, LogEntry, SampleRow};
