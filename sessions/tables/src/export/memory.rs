//! A table in memory, handed to other programs of the same process through Arrow's C stream interface
//! (<https://arrow.apache.org/docs/format/CStreamInterface.html>): they read the same cells, and nothing is copied.

pub use polars_arrow::ffi::ArrowArrayStream;

use super::columns::Layout;
use super::{ExportError, FrameMaker, RowFeed, TableExport};
use palpate_sessions::record::SampleRow;
use polars_arrow::array::{Array, StructArray};
use polars_arrow::datatypes::{ArrowDataType, ArrowSchema, Field, Metadata};
use polars_arrow::ffi::export_iterator;
use polars_core::prelude::{CompatLevel, DataFrame, DataType, PolarsResult, SchemaExt};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::{panic, thread};

/// Samples that go to the thread that fills the columns in one piece, a megabyte, and the most pieces on their way: both
/// threads stay busy, and the pieces stay in the processor's cache.
const PIECE_ROWS: usize = 1 << 13;
const PIECES: usize = 2;

/// Samples as columns in memory.
#[derive(Clone, Debug)]
pub struct SampleTable {
    /// At least one, all of the same columns.
    frames: Vec<DataFrame>,
    metadata: Metadata,
}

impl TableExport<'_> {
    /// The table in memory, with the metadata of its files. Columns are filled on a thread of their own, while this one
    /// reads on: each is about half of the work.
    pub fn collect(&self, feed: RowFeed) -> Result<SampleTable, ExportError> {
        let layout = self.layout()?;
        let frames = thread::scope(|scope| {
            let (to_fill, pieces) = sync_channel(PIECES);
            let (to_reuse, reused) = sync_channel(PIECES + 2);
            let layout = &layout;
            let filler = thread::Builder::new()
                .name("columns".into())
                .spawn_scoped(scope, move || self.fill(layout, &pieces, &to_reuse))
                .map_err(|err| ExportError::Memory(err.into()))?;
            feed(&mut |rows| {
                for some in rows.chunks(PIECE_ROWS) {
                    let mut piece: Vec<SampleRow> = reused.try_recv().unwrap_or_default();
                    piece.clear();
                    piece.extend_from_slice(some);
                    // Its receiver goes only in a panic, which is resumed below.
                    let _ = to_fill.send(piece);
                }
            })?;
            drop(to_fill);
            let frames = filler.join().unwrap_or_else(|payload| panic::resume_unwind(payload));
            frames.map_err(ExportError::Memory)
        })?;
        let pairs = self.metadata(&layout).into_iter();
        let metadata = pairs.map(|(key, text)| (key.into(), text.into())).collect();
        Ok(SampleTable { frames, metadata })
    }

    /// Frames of all pieces that come; each piece goes back, so that its memory is used again.
    fn fill(
        &self,
        layout: &Layout,
        pieces: &Receiver<Vec<SampleRow>>,
        to_reuse: &SyncSender<Vec<SampleRow>>,
    ) -> PolarsResult<Vec<DataFrame>> {
        let mut frames = Vec::new();
        let mut put = |frame| {
            frames.push(frame);
            Ok(())
        };
        let mut maker = FrameMaker::new(self, layout, &mut put);
        for piece in pieces {
            maker.take(&piece);
            // After the last piece nobody waits for it, and what finds no room is freed.
            let _ = to_reuse.try_send(piece);
        }
        maker.finish()?;
        Ok(frames)
    }
}

impl SampleTable {
    pub fn rows(&self) -> usize {
        self.frames.iter().map(DataFrame::height).sum()
    }

    /// Names of the columns, in order.
    pub fn names(&self) -> Vec<String> {
        let first = self.frames.first();
        first.map_or_else(Vec::new, |frame| {
            frame.columns().iter().map(|column| column.name().to_string()).collect()
        })
    }

    /// Units and provenance, as in files.
    pub fn metadata(&self) -> Vec<(String, String)> {
        let pairs = self.metadata.iter();
        pairs.map(|(key, text)| (key.to_string(), text.to_string())).collect()
    }

    /// A column of numbers, NaN where a cell is empty; `None` for text and for an unknown name.
    pub fn numbers(&self, name: &str) -> Option<Vec<f64>> {
        let mut numbers = Vec::with_capacity(self.rows());
        for frame in &self.frames {
            let column = frame.column(name).ok()?;
            if !column.dtype().is_primitive_numeric() {
                return None;
            }
            let column = column.cast(&DataType::Float64).ok()?;
            numbers.extend(column.f64().ok()?.iter().map(|cell| cell.unwrap_or(f64::NAN)));
        }
        Some(numbers)
    }

    /// A stream over the table, one chunk per frame. Texts are views as polars has them; `has_plain_texts` makes them
    /// Arrow's large strings, which every Arrow reader computes with.
    pub fn stream(&self, has_plain_texts: bool) -> ArrowArrayStream {
        let level = if has_plain_texts { CompatLevel::oldest() } else { CompatLevel::newest() };
        let schema = self.frames.first().map(|frame| frame.schema().to_arrow(level));
        let dtype = struct_of(&schema.unwrap_or_default());
        let field = Field::new("".into(), dtype.clone(), false);
        let field = field.with_metadata(self.metadata.clone());
        let chunks = self.frames.clone().into_iter().map(move |frame| chunk(&frame, level, &dtype));
        export_iterator(Box::new(chunks), field)
    }
}

fn struct_of(schema: &ArrowSchema) -> ArrowDataType {
    ArrowDataType::Struct(schema.iter_values().cloned().collect())
}

/// A frame as one array; it has one chunk, as it was made.
fn chunk(
    frame: &DataFrame,
    level: CompatLevel,
    dtype: &ArrowDataType,
) -> PolarsResult<Box<dyn Array>> {
    let columns = frame.columns().iter();
    let arrays = columns.map(|column| column.as_materialized_series().to_arrow(0, level));
    let made = StructArray::try_new(dtype.clone(), frame.height(), arrays.collect(), None)?;
    Ok(Box::new(made))
}
