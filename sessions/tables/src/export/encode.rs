//! Encoding of a table frame by frame, so that memory does not grow with its length.

use super::formula::escape_frame;
use super::parquet::ParquetFile;
use polars_arrow::io::ipc::write::{FileWriter, WriteOptions};
use polars_core::prelude::{CompatLevel, DataFrame, PolarsResult, SchemaExt};
use polars_io::csv::write::{BatchedWriter, CsvWriter};
use polars_io::prelude::SerWriter;
use std::collections::BTreeMap;
use std::io::Write;
use std::sync::Arc;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableFormat {
    /// Text with a header (RFC 4180) and this delimiter: decimal point, shortest digits that read back to the same number,
    /// empty cells for missing values. A text that a spreadsheet would take for a formula begins with `'`.
    Csv(u8),
    Parquet,
    /// Apache Arrow IPC file without compression, so that programs can map it into memory.
    Arrow,
}

impl TableFormat {
    #[must_use]
    pub fn ending(self) -> &'static str {
        match self {
            Self::Csv(_) => "csv",
            Self::Parquet => "parquet",
            Self::Arrow => "arrow",
        }
    }
}

/// Pairs of key and text in the file's metadata.
pub(crate) type Metadata = Vec<(String, String)>;

pub(crate) enum Encoder<W: Write> {
    Csv(BatchedWriter<W>),
    Parquet(Box<ParquetFile<W>>, Metadata),
    Arrow(FileWriter<W>),
}

impl<W: Write> Encoder<W> {
    /// Begins a table with frames like `empty`. CSV has no metadata.
    pub fn new(
        format: TableFormat,
        file: W,
        empty: &DataFrame,
        metadata: Metadata,
    ) -> PolarsResult<Self> {
        Ok(match format {
            TableFormat::Csv(delimiter) => {
                let writer = CsvWriter::new(file).with_separator(delimiter);
                let empty = escape_frame(empty.clone())?;
                Self::Csv(writer.batched(empty.schema())?)
            }
            TableFormat::Parquet => {
                Self::Parquet(Box::new(ParquetFile::new(file, empty)?), metadata)
            }
            TableFormat::Arrow => {
                let schema = empty.schema().to_arrow(CompatLevel::oldest());
                let options = WriteOptions { compression: None };
                let mut writer = FileWriter::new(file, Arc::new(schema), None, options);
                let pairs =
                    metadata.iter().map(|(key, text)| (key.as_str().into(), text.as_str().into()));
                writer.set_custom_schema_metadata(Arc::new(pairs.collect::<BTreeMap<_, _>>()));
                writer.start()?;
                Self::Arrow(writer)
            }
        })
    }

    pub fn write(&mut self, frame: DataFrame) -> PolarsResult<()> {
        match self {
            Self::Csv(writer) => writer.write_batch(&escape_frame(frame)?),
            Self::Parquet(file, _) => file.write(frame),
            Self::Arrow(writer) => frame
                .iter_chunks(CompatLevel::oldest(), true)
                .try_for_each(|chunk| writer.write(&chunk, None)),
        }
    }

    pub fn finish(self) -> PolarsResult<()> {
        match self {
            Self::Csv(mut writer) => writer.finish(),
            Self::Parquet(file, metadata) => file.finish(metadata),
            Self::Arrow(mut writer) => writer.finish(),
        }
    }
}
