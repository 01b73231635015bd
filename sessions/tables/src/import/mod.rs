//! Foreign tables: one format per file.

mod cells;
mod foreign;
mod header;
mod table;
mod truncated;
mod weights;

pub use foreign::{
    ColumnChoice, Decimal, Delimiter, Fault, Foreign, ForeignError, ForeignPart, ForeignSample,
    Format, KeepError, Kept, TextEncoding, Told, UnitChoice, ZeroChoice, folder_name, keep,
    open_foreign, parse_foreign,
};
pub use table::{ColumnNames, Table, TableError, parse_table, read_table};
pub use weights::{WeightsError, parse_weights, read_weights};
