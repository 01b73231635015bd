//! A session's samples as a table in a foreign format. Polars lives only here.

mod atomic;
mod columns;

pub use columns::COLUMNS;

use crate::log::Session;
use crate::manifest::RECORD_VERSION;
use polars::prelude::{
    CsvWriter, DataFrame, KeyValueMetadata, ParquetWriter, PolarsError, SerWriter,
};
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
pub fn export_csv(session: &Session, path: &Path) -> Result<(), ExportError> {
    let mut frame = frame(session, path)?;
    atomic::write(path, |file| {
        CsvWriter::new(file).include_header(true).finish(&mut frame)
    })
}

/// Writes the samples as Parquet. The file's metadata carries the units (`palpate.columns`, JSON
/// from column to unit) and where the numbers come from.
pub fn export_parquet(session: &Session, path: &Path) -> Result<(), ExportError> {
    let mut frame = frame(session, path)?;
    let units: serde_json::Map<String, serde_json::Value> = COLUMNS
        .iter()
        .map(|(name, unit)| ((*name).to_owned(), (*unit).into()))
        .collect();
    let manifest = &session.manifest;
    let metadata = KeyValueMetadata::from_static(vec![
        (
            "palpate.columns".to_owned(),
            serde_json::Value::Object(units).to_string(),
        ),
        ("palpate.session".to_owned(), manifest.session_id.clone()),
        (
            "palpate.software".to_owned(),
            manifest.software_version.clone(),
        ),
        (
            "palpate.record_version".to_owned(),
            RECORD_VERSION.to_string(),
        ),
    ]);
    atomic::write(path, |file| {
        ParquetWriter::new(file)
            .with_key_value_metadata(Some(metadata))
            .finish(&mut frame)
            .map(|_bytes| ())
    })
}

fn frame(session: &Session, path: &Path) -> Result<DataFrame, ExportError> {
    columns::frame(session).map_err(|source| ExportError::Table {
        path: path.to_owned(),
        source,
    })
}
