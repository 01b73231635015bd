//! A Parquet file whose row groups are made side by side and written in their order.
//!
//! Polars' own writer compresses in the thread that writes, one column after the other. Here a whole row
//! group is one thread's work.

use super::row_group::{Recipe, RowGroup};
use polars_core::prelude::{CompatLevel, DataFrame, PolarsResult, SchemaExt};
use polars_parquet::write::{
    CompressionOptions, FileWriter, KeyValue, StatisticsOptions, Version, WriteOptions, ZstdLevel,
};
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use std::io::Write;

/// More row groups at once than this gain little, and each is held in memory.
const AT_ONCE_MAX: usize = 4;

/// What zstd calls fast; the levels above cost more time than they save bytes of doubles with noise.
const ZSTD_LEVEL: i32 = 1;

pub(crate) struct ParquetFile<W: Write> {
    file: FileWriter<W>,
    recipe: Recipe,
    /// Frames whose row groups are not made yet, in the order of the file.
    waiting: Vec<DataFrame>,
}

impl<W: Write> ParquetFile<W> {
    /// Begins a file of frames like `empty`.
    pub fn new(file: W, empty: &DataFrame) -> PolarsResult<Self> {
        let schema = empty.schema().to_arrow(CompatLevel::newest());
        let options = WriteOptions {
            statistics: StatisticsOptions::default(),
            version: Version::V1,
            compression: CompressionOptions::Zstd(Some(ZstdLevel::try_new(ZSTD_LEVEL)?)),
            data_page_size: None,
        };
        let file = FileWriter::try_new(file, schema.clone(), options)?;
        let recipe = Recipe::new(&schema, &file);
        Ok(Self { file, recipe, waiting: Vec::new() })
    }

    /// Adds a frame.
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
            frames.map(|frame| self.recipe.row_group(frame)).collect();
        row_groups.into_iter().try_for_each(|row_group| row_group?.write(&mut self.file))
    }

    /// Ends the file. Its metadata is ours alone: with the frame's Arrow schema in the file, Arrow readers show the
    /// metadata of that, which is empty, instead of ours (Arrow issue 8980), and texts as views, which
    /// pyarrow cannot compare with texts. All our types are told by Parquet's own.
    pub fn finish(mut self, metadata: Vec<(String, String)>) -> PolarsResult<()> {
        self.write_waiting()?;
        let pairs = metadata.into_iter().map(|(key, value)| KeyValue { key, value: Some(value) });
        self.file.end(Some(pairs.collect())).map(|_bytes| ())
    }
}
