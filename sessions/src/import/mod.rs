//! Foreign tables: one format per file.

mod cells;
mod header;
mod table;
mod weights;

pub use table::{ColumnNames, Table, TableError, parse_table, read_table};
pub use weights::{WeightsError, parse_weights, read_weights};
