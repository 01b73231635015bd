//! Export of a session's samples as a table. Polars is used only here and in [`crate::lake`].

pub(crate) mod atomic;
mod columns;
mod dictionary;
mod documents;
mod encode;
mod formula;
mod memory;
mod messages;
mod parquet;
mod row_group;
mod select;

pub use atomic::WriteOutcome;
pub use columns::{ExtraColumns, SensorColumn};
pub use dictionary::dictionary_path;
pub use documents::LogFacts;
pub(crate) use encode::Encoder;
pub use encode::TableFormat;
pub use formula::escape_formula;
pub use memory::{ArrowArrayStream, SampleTable};
pub use select::SampleSelection;

use columns::{Cells, Layout, Samples, time_of};
use encode::Metadata;
use palpate_sessions::log::ReadError;
use palpate_sessions::manifest::Manifest;
use palpate_sessions::record::SampleRow;
use palpate_sessions::text::sha256;
use polars_core::prelude::{DataFrame, PolarsError, PolarsResult};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Version of the tables' columns, units and metadata; a changed meaning raises it.
pub const TABLE_VERSION: u32 = 1;

/// Samples in a frame and in a row group: limits the writer's memory, and the excess that a reader of a part decodes.
const FRAME_ROWS: usize = 1 << 18;

/// Samples that are copied into columns at once: few enough to stay in the processor's cache for all columns.
const HAND_ROWS: usize = 1 << 10;

/// A Parquet file of one frame.
pub fn parquet_bytes(frame: DataFrame) -> PolarsResult<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(TableFormat::Parquet, &mut bytes, &frame, Vec::new())?;
    encoder.write(frame)?;
    encoder.finish()?;
    Ok(bytes)
}

/// A table could not be written.
#[derive(Debug, Error)]
pub enum ExportError {
    #[error("{} exists already; move it away or export to another folder", path.display())]
    Exists { path: PathBuf },
    #[error("{} already exists with different content, and files in a lake are never overwritten; use another lake, or move the existing file away if it is wrong", path.display())]
    Different { path: PathBuf },
    #[error("{0}")]
    Columns(String),
    #[error(
        "the session's name {name:?} cannot be a file name in a lake; export the session as a table"
    )]
    BadName { name: String },
    #[error(transparent)]
    Read(#[from] ReadError),
    #[error("cannot write {} ({source}); choose a writable folder with free space", path.display())]
    Io { path: PathBuf, source: io::Error },
    #[error("cannot write {} ({source}); check the disk's free space", path.display())]
    Table { path: PathBuf, source: PolarsError },
    #[error("the samples cannot be made a table ({0}); select fewer columns or samples")]
    Memory(PolarsError),
}

#[derive(Clone, Copy, Debug)]
pub struct TableExport<'a> {
    pub manifest: &'a Manifest,
    /// Remarks for users of the data.
    pub notes: &'a [String],
    pub extra: &'a ExtraColumns,
    pub selection: &'a SampleSelection,
}

/// Passes every sample of a session in order, some at a time, to its argument.
pub type RowFeed<'f> = &'f mut dyn FnMut(&mut dyn FnMut(&[SampleRow])) -> Result<(), ReadError>;

impl TableExport<'_> {
    /// Writes the table and, beside it, its data dictionary ([`dictionary_path`]), both as new files; returns the number of
    /// rows. At most one frame of samples is in memory.
    ///
    /// The metadata of Parquet and Arrow has the units (`palpate.columns`, JSON from column to unit), the source
    /// (`palpate.session`, `palpate.software`, `palpate.record_version`, `palpate.calibration_sha256`), the specimen
    /// (`palpate.specimen`, `palpate.about`, a JSON object), the content (`palpate.table_version`, `palpate.selection`, a JSON
    /// object), remarks (`palpate.notes`, a JSON list of sentences), and the metadata of the extra columns.
    pub fn write(
        &self,
        format: TableFormat,
        path: &Path,
        feed: RowFeed,
    ) -> Result<u64, ExportError> {
        let layout = self.layout()?;
        let dictionary = dictionary_path(path);
        atomic::check_new(&dictionary)?;
        let rows = atomic::write(path, |file| self.encode(&layout, format, path, file, feed))?;
        let text = dictionary::dictionary(
            path,
            self.manifest,
            self.notes,
            &layout.columns,
            self.selection,
        );
        atomic::write(&dictionary, |file| {
            file.write_all(text.as_bytes()).map_err(atomic::io_error(&dictionary))
        })?;
        Ok(rows)
    }

    /// Writes the table as Parquet without a dictionary; accepts an existing file with the same content.
    pub(crate) fn write_to_lake(
        &self,
        path: &Path,
        feed: RowFeed,
    ) -> Result<WriteOutcome, ExportError> {
        let layout = self.layout()?;
        atomic::write_or_same(path, |file| {
            self.encode(&layout, TableFormat::Parquet, path, file, feed).map(|_rows| ())
        })
    }

    fn layout(&self) -> Result<Layout<'_>, ExportError> {
        let (columns, every) = (&self.selection.columns, self.selection.step());
        Layout::new(self.manifest, self.extra, columns, every).map_err(ExportError::Columns)
    }

    fn encode(
        &self,
        layout: &Layout,
        format: TableFormat,
        path: &Path,
        file: impl Write,
        feed: RowFeed,
    ) -> Result<u64, ExportError> {
        let failed = |source| ExportError::Table { path: path.to_owned(), source };
        let empty = layout.frame(layout.empty_cells(0), 0).map_err(failed)?;
        let metadata = self.metadata(layout);
        let mut encoder = Encoder::new(format, file, &empty, metadata).map_err(failed)?;
        let mut put = |frame| encoder.write(frame);
        let mut frames = FrameMaker::new(self, layout, &mut put);
        feed(&mut |rows| frames.take(rows))?;
        let rows = frames.finish().map_err(failed)?;
        encoder.finish().map_err(failed)?;
        Ok(rows)
    }

    fn metadata(&self, layout: &Layout) -> Metadata {
        let units: serde_json::Map<String, serde_json::Value> =
            layout.columns.iter().map(|one| (one.name.clone(), one.unit.as_ref().into())).collect();
        let manifest = self.manifest;
        let mut pairs = vec![
            ("columns", serde_json::Value::Object(units).to_string()),
            ("session", manifest.session_id.clone()),
            ("software", manifest.software_version.clone()),
            ("record_version", manifest.record_version.to_string()),
            ("table_version", TABLE_VERSION.to_string()),
            ("specimen", manifest.specimen.clone()),
            ("about", serde_json::json!(manifest.about).to_string()),
            ("notes", serde_json::json!(self.notes).to_string()),
            ("selection", self.selection.to_json()),
        ];
        if !manifest.calibration.is_null() {
            let hash = sha256(manifest.calibration.to_string().as_bytes());
            pairs.push(("calibration_sha256", hash));
        }
        let own = pairs.into_iter().map(|(key, text)| (format!("palpate.{key}"), text));
        own.chain(self.extra.metadata.iter().cloned()).collect()
    }
}

/// Makes frames of samples that pass by, and hands out each when it is full.
struct FrameMaker<'a> {
    table: &'a TableExport<'a>,
    layout: &'a Layout<'a>,
    put: &'a mut dyn FnMut(DataFrame) -> PolarsResult<()>,
    /// The selected ones of the present samples.
    numbers: Vec<u64>,
    rows: Vec<SampleRow>,
    frame: Vec<Cells>,
    frame_rows: usize,
    /// Samples seen so far, those selected of them, and those written.
    seen: u64,
    selected: u64,
    written: u64,
    first_tick: Option<u64>,
    /// The first failure; nothing is written after it.
    failure: Option<PolarsError>,
}

impl<'a> FrameMaker<'a> {
    fn new(
        table: &'a TableExport<'a>,
        layout: &'a Layout<'a>,
        put: &'a mut dyn FnMut(DataFrame) -> PolarsResult<()>,
    ) -> Self {
        Self {
            table,
            layout,
            put,
            numbers: Vec::new(),
            rows: Vec::new(),
            // Grows on demand, because most sessions are shorter than a frame.
            frame: layout.empty_cells(0),
            frame_rows: 0,
            seen: 0,
            selected: 0,
            written: 0,
            first_tick: None,
            failure: None,
        }
    }

    fn take(&mut self, mut rows: &[SampleRow]) {
        let Some(first) = rows.first() else {
            return;
        };
        let first_tick = *self.first_tick.get_or_insert(first.tick);
        while !rows.is_empty() && self.failure.is_none() {
            let count = rows.len().min(HAND_ROWS).min(FRAME_ROWS - self.frame_rows);
            let (now, rest) = rows.split_at(count);
            self.select(now, first_tick);
            let samples = Samples {
                numbers: &self.numbers,
                rows: if self.numbers.len() == count { now } else { &self.rows },
                first_tick,
            };
            self.layout.fill(&mut self.frame, samples);
            self.frame_rows += self.numbers.len();
            if self.frame_rows == FRAME_ROWS {
                self.failure = self.flush().err();
            }
            rows = rest;
        }
    }

    fn select(&mut self, rows: &[SampleRow], first_tick: u64) {
        let first = self.seen;
        self.seen += rows.len() as u64;
        self.numbers.clear();
        self.rows.clear();
        let selection = self.table.selection;
        if !selection.is_partial() {
            self.numbers.extend(first..self.seen);
            return;
        }
        for (number, row) in (first..).zip(rows) {
            if selection.takes(time_of(self.table.manifest, row, first_tick), row) {
                if self.selected.is_multiple_of(selection.step()) {
                    self.numbers.push(number);
                    self.rows.push(*row);
                }
                self.selected += 1;
            }
        }
    }

    fn flush(&mut self) -> PolarsResult<()> {
        let rows = std::mem::take(&mut self.frame_rows);
        let next = self.layout.empty_cells(rows);
        let full = std::mem::replace(&mut self.frame, next);
        self.written += rows as u64;
        (self.put)(self.layout.frame(full, rows)?)
    }

    fn finish(mut self) -> PolarsResult<u64> {
        if let Some(failure) = self.failure.take() {
            return Err(failure);
        }
        // A table without rows still has its columns.
        if self.frame_rows > 0 || self.written == 0 {
            self.flush()?;
        }
        Ok(self.written)
    }
}
