//! Encoding of a row group apart from its Parquet file, so that several threads can work at once.

use super::columns::TIME_COLUMN;
use polars_arrow::datatypes::ArrowSchema;
use polars_core::prelude::{CompatLevel, DataFrame, PolarsError, PolarsResult};
use polars_parquet::write::{
    CompressedPage, DynIter, DynStreamingIterator, Encoding, FileWriter, ParquetType, WriteOptions,
    array_to_columns, compress, fallible_streaming_iterator, get_dtype_encoding,
};
use std::io::Write;

/// Encodes the row groups of a file.
pub(super) struct RowGroupEncoder {
    types: Vec<ParquetType>,
    encodings: Vec<Vec<Encoding>>,
    options: WriteOptions,
}

/// An encoded row group: its pages, column by column.
pub(super) struct RowGroup {
    rows: u64,
    columns: Vec<Vec<CompressedPage>>,
}

impl RowGroupEncoder {
    pub fn new<W: Write>(schema: &ArrowSchema, file: &FileWriter<W>) -> Self {
        let encodings = schema.iter_values().map(|one| {
            // Times never repeat, so a dictionary of values would only cost time.
            if one.name == TIME_COLUMN {
                vec![Encoding::Plain]
            } else {
                get_dtype_encoding(&one.dtype)
            }
        });
        Self {
            types: file.parquet_schema().fields().to_vec(),
            encodings: encodings.collect(),
            options: file.options(),
        }
    }

    /// Encodes and compresses a frame of the file's schema.
    pub fn row_group(&self, frame: DataFrame) -> PolarsResult<RowGroup> {
        let rows = frame.height() as u64;
        let mut columns = Vec::new();
        let of_file = self.types.iter().zip(&self.encodings);
        for (column, (kind, encodings)) in frame.into_columns().into_iter().zip(of_file) {
            let series = column.take_materialized_series().rechunk();
            let array = series.to_arrow(0, CompatLevel::newest());
            for pages in array_to_columns(&array, kind.clone(), self.options, encodings)? {
                let compressed = pages.map(|page| {
                    compress(page?, Vec::new(), self.options.compression).map_err(PolarsError::from)
                });
                columns.push(compressed.collect::<PolarsResult<_>>()?);
            }
        }
        Ok(RowGroup { rows, columns })
    }
}

impl RowGroup {
    pub fn write<W: Write>(self, file: &mut FileWriter<W>) -> PolarsResult<()> {
        let columns = self.columns.iter().map(|pages| {
            let pages = pages.iter().map(PolarsResult::Ok);
            Ok(DynStreamingIterator::new(fallible_streaming_iterator::convert(pages)))
        });
        file.write(self.rows, DynIter::new(columns))
    }
}
