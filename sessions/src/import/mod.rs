//! Foreign tables: one format per file.

mod header;
mod table;

pub use table::{Table, TableError, parse_table, read_table};
