//! Sessions as tables: foreign files into sessions, sessions into CSV, Parquet, Arrow and lakes.
//!
//! polars lives here and nowhere else, so that recording, reading and recovering a session never
//! wait for it to compile. This crate decides nothing about a run and draws nothing.
//!
//! Start reading at [`export::Selection`] for what leaves a session, [`import`] for what becomes one.
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

pub mod export;
pub mod import;
pub mod lake;

pub use export::{ExportError, Format, Selection};
pub use import::{ColumnNames, Table, TableError, parse_table, read_table};
