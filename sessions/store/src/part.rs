//! Files of rows: Parquet, each named by its content.

use crate::delta::Add;
use crate::error::StoreError;
use crate::probe::name_of_writer;
use crate::table::Shape;
use bytes::Bytes;
use chrono::{DateTime, Utc};
use object_store::path::Path;
use palpate_sessions::text::sha256;
use palpate_tables::export::parquet_bytes;
use polars_core::prelude::{
    Column, DataFrame, DataType, IntoColumn, NamedFrom, PolarsError, PolarsResult, Series,
};
use polars_core::utils::accumulate_dataframes_vertical;
use polars_io::SerReader;
use polars_io::parquet::read::{ParallelStrategy, ParquetReader};
use serde_json::{Value, json};
use std::io::Cursor;

/// A file of rows that is written but not yet in the table.
pub(crate) struct Part {
    pub bytes: Bytes,
    pub add: Add,
}

/// The schema of a table with the columns of `known` and those of this program, and whether there are more than before.
pub(crate) fn schema_with(shape: &Shape, known: Option<&str>) -> (String, bool) {
    let known = known.and_then(|text| serde_json::from_str::<Value>(text).ok());
    let mut fields = known
        .map_or_else(Vec::new, |known| known["fields"].as_array().cloned().unwrap_or_default());
    let before = fields.len();
    for (name, kind) in (shape.columns)() {
        if !fields.iter().any(|field| field["name"] == name) {
            fields.push(json!({ "name": name, "type": kind, "nullable": true, "metadata": {} }));
        }
    }
    let has_more = fields.len() > before;
    (json!({ "type": "struct", "fields": fields }).to_string(), has_more)
}

/// What is wrong with rows that make no file.
pub(crate) fn unwritable(shape: &Shape) -> impl Fn(PolarsError) -> StoreError + use<'_> {
    |err| StoreError::bad(&Path::from(format!("{}/part", shape.name)), err)
}

/// The file of a frame.
pub(crate) fn part_of(
    shape: &Shape,
    frame: DataFrame,
    data_change: bool,
    now: DateTime<Utc>,
) -> Result<Part, StoreError> {
    let failed = unwritable(shape);
    let key = shape.key;
    let keys = frame.column(key).and_then(|column| column.str().cloned()).map_err(&failed)?;
    let (first, last) = (keys.iter().flatten().min(), keys.iter().flatten().max());
    let stats = json!({
        "numRecords": frame.height(), "minValues": { key: first }, "maxValues": { key: last },
        "nullCount": { key: 0 },
    });
    let bytes = parquet_bytes(frame).map_err(failed)?;
    let add = Add {
        // Named by its content, its time and its writer, so that no two writers share a name.
        path: format!(
            "part-{}-{}Z-{}.parquet",
            now.format("%Y%m%dT%H%M%S%3f"),
            name_of_writer(),
            &sha256(&bytes)[..32]
        ),
        partition_values: std::collections::BTreeMap::new(),
        size: i64::try_from(bytes.len()).unwrap_or(i64::MAX),
        modification_time: now.timestamp_millis(),
        data_change,
        stats: Some(stats.to_string()),
    };
    Ok(Part { bytes: bytes.into(), add })
}

/// Number of rows of a file, by what the log says of it.
pub(crate) fn row_count(add: &Add) -> usize {
    let stats = add.stats.as_deref().and_then(|text| serde_json::from_str::<Value>(text).ok());
    let count = stats.and_then(|stats| stats["numRecords"].as_u64());
    count.and_then(|count| usize::try_from(count).ok()).unwrap_or(0)
}

/// One file of the rows of several.
pub(crate) fn merged(
    shape: &Shape,
    parts: &[(Path, Bytes)],
    now: DateTime<Utc>,
) -> Result<Part, StoreError> {
    let known = (shape.columns)();
    let mut frames = Vec::with_capacity(parts.len());
    for (path, bytes) in parts {
        let failed = |err| StoreError::bad(path, err);
        let mut frame = read_frame(bytes, None).map_err(failed)?;
        for (name, kind) in &known {
            if frame.column(name).is_err() {
                let kind = match *kind {
                    "long" => DataType::Int64,
                    "double" => DataType::Float64,
                    "boolean" => DataType::Boolean,
                    _ => DataType::String,
                };
                let empty = Series::full_null((*name).into(), frame.height(), &kind);
                frame.with_column(empty.into_column()).map_err(failed)?;
            }
        }
        let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
        let more =
            frame.get_column_names().into_iter().find(|name| !names.contains(&name.as_str()));
        if let Some(name) = more {
            return Err(StoreError::Unknown { what: format!("the column {name}") });
        }
        frames.push(frame.select(names).map_err(failed)?);
    }
    let frame = accumulate_dataframes_vertical(frames).map_err(unwritable(shape))?;
    part_of(shape, frame, false, now)
}

/// A column for each cell of a row.
pub(crate) fn columns_of<R, T>(rows: &[R], cells: &[(&str, impl Fn(&R) -> T)]) -> Vec<Column>
where
    Series: NamedFrom<Vec<T>, [T]>,
{
    let columns = cells.iter().map(|(name, of)| {
        Series::new((*name).into(), rows.iter().map(of).collect::<Vec<T>>()).into_column()
    });
    columns.collect()
}

pub(crate) fn read_frame(bytes: &Bytes, columns: Option<Vec<String>>) -> PolarsResult<DataFrame> {
    let reader = ParquetReader::new(Cursor::new(bytes)).with_columns(columns);
    reader.read_parallel(ParallelStrategy::None).finish()
}

/// What is wrong with an object whose bytes are not those that its name says.
pub(crate) const OTHER_BYTES: &str = "its bytes have another SHA-256 than its name";

/// Whether a file of rows has the bytes that its name says. Another program's name says nothing.
pub(crate) fn is_named(path: &Path, bytes: &Bytes) -> bool {
    let name =
        path.filename().and_then(|name| name.strip_prefix("part-")?.strip_suffix(".parquet"));
    let sum = name.and_then(|name| name.rsplit_once('Z')?.1.strip_prefix('-'));
    sum.is_none_or(|sum| sha256(bytes).starts_with(sum))
}
