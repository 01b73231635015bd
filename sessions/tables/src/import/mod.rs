//! Foreign tables: one format per file.

pub mod cells;
mod foreign;
mod header;
mod table;
mod truncated;
mod weights;

pub use foreign::{
    ColumnChoice, DecimalSign, Delimiter, ForeignError, ForeignFile, ForeignFormat, ForeignPart,
    ForeignSample, ImportOptions, ImportTarget, RowFault, StoreImportError, TextEncoding,
    UnitChoice, ZeroChoice, folder_name, open_foreign, parse_foreign, store_import,
};
pub use table::{ColumnNames, MeasurementTable, TableError, parse_table, read_table};
pub use weights::{WeightsError, parse_weights, read_weights};
