//! A session's samples as a table in a foreign format. Polars lives only here.

mod atomic;
mod columns;
mod parquet;

pub use columns::{Beside, COLUMNS};
pub use parquet::export_parquet;

use crate::log::Session;
use polars::prelude::{CsvWriter, DataFrame, PolarsError, SerWriter};
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A table could not be written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ExportError {
    /// Exports never replace a file.
    #[error("{} exists already; move it away or export to another folder", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The disk refused.
    #[error("cannot write {} ({source}); choose a folder that may be written and has room", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The table could not be formed or encoded.
    #[error("cannot write {} ({source}); check the disk's free space", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// What polars said.
        source: PolarsError,
    },
}

/// Writes the samples as comma-separated text: names with units in the header, `.` as decimal
/// mark, shortest digits that read back to the same number, empty cells for missing values.
pub fn export_csv(session: &Session, beside: &Beside, path: &Path) -> Result<(), ExportError> {
    let mut frame = frame(session, beside, path)?;
    atomic::write(path, |file| {
        CsvWriter::new(file).include_header(true).finish(&mut frame)
    })
}

fn frame(session: &Session, beside: &Beside, path: &Path) -> Result<DataFrame, ExportError> {
    columns::frame(session, beside).map_err(|source| ExportError::Table {
        path: path.to_owned(),
        source,
    })
}
