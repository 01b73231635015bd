//! Sessions as tables: import of foreign files, export to CSV, Parquet, Arrow, MCAP and Bluesky documents, and lakes.
//!
//! polars is used only here and in palpate-store, so that recording, reading and recovering a session compile without it. This crate decides
//! nothing about a run and draws nothing.
//!
//! Start reading at [`export::Selection`] for exports and at [`import`] for imports.
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

pub mod export;
pub mod import;
pub mod lake;

pub use export::ExportError;
pub use import::{parse_table, read_table};
