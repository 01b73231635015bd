//! A Parquet file whose row groups are made side by side and written in their order.
//!
//! Polars' own writer compresses in the thread that writes, one column after the other. Here a whole row
//! group is one thread's work, and the session is read meanwhile.

use super::row_group::{Recipe, RowGroup};
use polars::prelude::{CompatLevel, DataFrame, PolarsError, PolarsResult, SchemaExt};
use polars_parquet::write::{
    CompressionOptions, FileWriter, KeyValue, StatisticsOptions, Version, WriteOptions, ZstdLevel,
};
use std::collections::VecDeque;
use std::io::Write;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};

/// More threads than this would only wait for the one that reads, and each holds a row group in memory.
const THREADS_MAX: usize = 4;

/// What zstd calls fast; the levels above cost more time than they save bytes of doubles with noise.
const ZSTD_LEVEL: i32 = 1;

/// A frame, and where its row group goes.
type Job = (DataFrame, SyncSender<PolarsResult<RowGroup>>);

pub(crate) struct ParquetFile<W: Write> {
    file: FileWriter<W>,
    jobs: SyncSender<Job>,
    threads: usize,
    /// Row groups that are being made, in the order of the file.
    under_way: VecDeque<Receiver<PolarsResult<RowGroup>>>,
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
        let recipe = Arc::new(Recipe::new(&schema, &file));
        let threads = std::thread::available_parallelism().map_or(1, usize::from).min(THREADS_MAX);
        // A frame is handed over when a thread is free for it, so none waits in a queue.
        let (jobs, receiver) = sync_channel(0);
        let receiver = Arc::new(Mutex::new(receiver));
        for _ in 0..threads {
            let (recipe, receiver) = (Arc::clone(&recipe), Arc::clone(&receiver));
            std::thread::Builder::new()
                .name("row-groups".into())
                .spawn(move || make_row_groups(&recipe, &receiver))?;
        }
        Ok(Self { file, jobs, threads, under_way: VecDeque::new() })
    }

    /// Adds a frame.
    pub fn write(&mut self, frame: DataFrame) -> PolarsResult<()> {
        if frame.height() == 0 {
            return Ok(());
        }
        if self.under_way.len() == self.threads {
            self.write_first()?;
        }
        let (reply, row_group) = sync_channel(1);
        self.jobs.send((frame, reply)).map_err(|_| is_gone())?;
        self.under_way.push_back(row_group);
        Ok(())
    }

    fn write_first(&mut self) -> PolarsResult<()> {
        match self.under_way.pop_front() {
            Some(first) => first.recv().map_err(|_| is_gone())??.write(&mut self.file),
            None => Ok(()),
        }
    }

    /// Ends the file. Its metadata is ours alone: with the frame's Arrow schema in the file, Arrow readers show the
    /// metadata of that, which is empty, instead of ours (Arrow issue 8980), and texts as views, which
    /// pyarrow cannot compare with texts. All our types are told by Parquet's own.
    pub fn finish(mut self, metadata: Vec<(String, String)>) -> PolarsResult<()> {
        while !self.under_way.is_empty() {
            self.write_first()?;
        }
        let pairs = metadata.into_iter().map(|(key, value)| KeyValue { key, value: Some(value) });
        self.file.end(Some(pairs.collect())).map(|_bytes| ())
    }
}

/// Makes row groups until nobody wants any more.
fn make_row_groups(recipe: &Recipe, jobs: &Mutex<Receiver<Job>>) {
    loop {
        let next = jobs.lock().unwrap_or_else(PoisonError::into_inner).recv();
        let Ok((frame, reply)) = next else {
            return;
        };
        // Whoever asked may have given up.
        let _ = reply.send(recipe.row_group(frame));
    }
}

fn is_gone() -> PolarsError {
    PolarsError::ComputeError("a thread that makes row groups has ended".into())
}
