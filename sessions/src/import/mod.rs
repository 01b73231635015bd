//! Foreign tables: one format per file.

mod cells;
mod header;
mod table;

pub use table::{ColumnNames, Table, TableError, parse_table, read_table};
