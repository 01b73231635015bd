//! A Parquet file whose row groups are encoded in parallel and written in order.
//!
//! Polars' own writer compresses one column after the other in the writing thread. Here each thread encodes a whole row
//! group.

use super::row_group::{RowGroup, RowGroupEncoder};
use polars_core::prelude::{CompatLevel, DataFrame, PolarsResult, SchemaExt};
use polars_parquet::write::{
    CompressionOptions, FileWriter, KeyValue, StatisticsOptions, Version, WriteOptions, ZstdLevel,
};
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use std::io::Write;

/// Largest number of row groups encoded at once; more would gain little and take memory.
const AT_ONCE_MAX: usize = 4;

/// Fast; higher levels hardly compress noisy doubles further.
const ZSTD_LEVEL: i32 = 1;

pub(crate) struct ParquetFile<W: Write> {
    file: FileWriter<W>,
    encoder: RowGroupEncoder,
    /// Frames that are not encoded yet, in the order of the file.
    waiting: Vec<DataFrame>,
}

impl<W: Write> ParquetFile<W> {
    /// Begins a file with frames like `empty`.
    pub fn new(file: W, empty: &DataFrame) -> PolarsResult<Self> {
        let schema = empty.schema().to_arrow(CompatLevel::newest());
        let options = WriteOptions {
            statistics: StatisticsOptions::default(),
            version: Version::V1,
            compression: CompressionOptions::Zstd(Some(ZstdLevel::try_new(ZSTD_LEVEL)?)),
            data_page_size: None,
        };
        let file = FileWriter::try_new(file, schema.clone(), options)?;
        let encoder = RowGroupEncoder::new(&schema, &file);
        Ok(Self { file, encoder, waiting: Vec::new() })
    }

    pub fn write(&mut self, frame: DataFrame) -> PolarsResult<()> {
        if frame.height() == 0 {
            return Ok(());
        }
        self.waiting.push(frame);
        match self.waiting.len() < rayon::current_num_threads().min(AT_ONCE_MAX) {
            true => Ok(()),
            false => self.write_waiting(),
        }
    }

    fn write_waiting(&mut self) -> PolarsResult<()> {
        let frames = std::mem::take(&mut self.waiting).into_par_iter();
        let row_groups: Vec<PolarsResult<RowGroup>> =
            frames.map(|frame| self.encoder.row_group(frame)).collect();
        row_groups.into_iter().try_for_each(|row_group| row_group?.write(&mut self.file))
    }

    /// Ends the file. The metadata omits the frame's Arrow schema: with it, Arrow readers would show the schema's empty metadata
    /// instead (Arrow issue 8980), and texts as views, which pyarrow cannot compare with texts. Parquet's own types suffice.
    pub fn finish(mut self, metadata: Vec<(String, String)>) -> PolarsResult<()> {
        self.write_waiting()?;
        let pairs = metadata.into_iter().map(|(key, value)| KeyValue { key, value: Some(value) });
        self.file.end(Some(pairs.collect())).map(|_bytes| ())
    }
}
