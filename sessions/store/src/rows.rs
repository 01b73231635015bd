//! Rows of the table of sessions: one of every version of every session.

use crate::delta::{Add, table_path};
use crate::error::StoreError;
use bytes::Bytes;
use chrono::{DateTime, Utc};
use object_store::path::Path;
use palpate_model::metadata::{MANIFEST_FIELDS, METADATA_KEYS, MetadataKind};
use palpate_sessions::catalog::{CatalogEntry, NamedValueSource};
use palpate_sessions::text::{checksum, sha256};
use palpate_tables::export::parquet_bytes;
use polars_core::prelude::{
    Column, DataFrame, DataType, IntoColumn, NamedFrom, PolarsResult, Series,
};
use polars_core::utils::accumulate_dataframes_vertical;
use polars_io::SerReader;
use polars_io::parquet::read::{ParallelStrategy, ParquetReader};
use serde_json::{Value, json};
use std::io::Cursor;

/// Version of the store's layout.
pub const STORE_VERSION: u32 = 1;

/// One version of a session.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SessionRow {
    /// From 1.
    pub version: u64,
    /// SHA-256 of the list of the session's files.
    pub content: String,
    /// UTC, RFC 3339.
    pub pushed_at: String,
    /// What the catalog knows of the session; its folder is the session's identifier.
    pub entry: CatalogEntry,
}

type Cell = fn(&SessionRow) -> Option<String>;
type Count = fn(&SessionRow) -> i64;

const WORDS: [(&str, Cell); 21] = [
    ("session_id", |row| Some(row.entry.session_id.clone())),
    ("content_sha256", |row| Some(row.content.clone())),
    ("pushed_at", |row| Some(row.pushed_at.clone())),
    ("started_at", |row| Some(row.entry.started_at.clone())),
    ("operator", |row| Some(row.entry.operator.clone())),
    ("specimen", |row| Some(row.entry.specimen.clone())),
    ("indenter", |row| Some(row.entry.indenter.clone())),
    ("protocol", |row| Some(row.entry.protocol.clone())),
    ("rig", |row| Some(row.entry.rig.clone())),
    ("rig_identity", |row| Some(row.entry.rig_identity.clone())),
    ("calibration", |row| Some(row.entry.calibration.clone())),
    ("calibration_sha256", |row| Some(row.entry.calibration_sha256.clone())),
    ("cell", |row| Some(row.entry.cell.clone())),
    ("software_version", |row| Some(row.entry.software_version.clone())),
    ("outcome", |row| row.entry.ending.clone()),
    ("verdict", |row| row.entry.verdict.map(|verdict| verdict.name().to_owned())),
    ("verdict_reason", |row| row.entry.verdict.map(|_| row.entry.verdict_reason.clone())),
    ("review", |row| row.entry.review.as_ref().map(|review| review.decision.to_string())),
    ("tags", |row| Some(row.entry.tags.join(" "))),
    ("entry", |row| Some(encoded(&row.entry))),
    ("entry_checksum", |row| Some(checksum(&encoded(&row.entry)))),
];

const COUNTS: [(&str, Count); 3] = [
    ("version", |row| count(row.version)),
    ("samples", |row| count(row.entry.samples)),
    ("bytes", |row| count(row.entry.bytes)),
];

fn count(value: u64) -> i64 {
    i64::try_from(value).unwrap_or(i64::MAX)
}

fn encoded(entry: &CatalogEntry) -> String {
    json!(entry).to_string()
}

/// Name and type of every column, in the words of Delta's schema.
fn columns() -> Vec<(&'static str, &'static str)> {
    let words = WORDS.iter().map(|(name, _)| (*name, "string"));
    let counts = COUNTS.iter().map(|(name, _)| (*name, "long"));
    let facts = facts().map(|(name, kind)| match kind {
        MetadataKind::Text | MetadataKind::Choice(_) => (name, "string"),
        MetadataKind::Number { .. } => (name, "double"),
        MetadataKind::Count => (name, "long"),
    });
    words.chain(counts).chain([("duration_s", "double")]).chain(facts).collect()
}

/// The facts about specimen, probe and series that have no column of their own.
fn facts() -> impl Iterator<Item = (&'static str, &'static MetadataKind)> {
    let keys = METADATA_KEYS.iter().filter(|key| !MANIFEST_FIELDS.contains(&key.name));
    keys.map(|key| (key.name, &key.kind))
}

/// The schema of a table with the columns of `known` and those of this program, and whether there are more than before.
pub(crate) fn schema_with(known: Option<&str>) -> (String, bool) {
    let known = known.and_then(|text| serde_json::from_str::<Value>(text).ok());
    let mut fields = known
        .map_or_else(Vec::new, |known| known["fields"].as_array().cloned().unwrap_or_default());
    let before = fields.len();
    for (name, kind) in columns() {
        if !fields.iter().any(|field| field["name"] == name) {
            fields.push(json!({ "name": name, "type": kind, "nullable": true, "metadata": {} }));
        }
    }
    let has_more = fields.len() > before;
    (json!({ "type": "struct", "fields": fields }).to_string(), has_more)
}

fn fact<'a>(row: &'a SessionRow, name: &str) -> Option<&'a palpate_sessions::catalog::NamedValue> {
    let is_it = |one: &&palpate_sessions::catalog::NamedValue| {
        one.source == NamedValueSource::About && one.name == name
    };
    row.entry.named.iter().find(is_it)
}

fn frame(rows: &[SessionRow]) -> PolarsResult<DataFrame> {
    let words = WORDS.iter().map(|(name, of)| {
        Series::new((*name).into(), rows.iter().map(of).collect::<Vec<_>>()).into_column()
    });
    let counts = COUNTS.iter().map(|(name, of)| {
        Series::new((*name).into(), rows.iter().map(of).collect::<Vec<_>>()).into_column()
    });
    let durations: Vec<f64> = rows.iter().map(|row| row.entry.duration_s).collect();
    let duration = Series::new("duration_s".into(), durations).into_column();
    let facts = facts().map(|(name, kind)| {
        let found = rows.iter().map(|row| fact(row, name));
        let series = match kind {
            MetadataKind::Text | MetadataKind::Choice(_) => Series::new(
                name.into(),
                found.map(|one| Some(one?.text.clone())).collect::<Vec<_>>(),
            ),
            MetadataKind::Number { .. } => {
                Series::new(name.into(), found.map(|one| one?.number).collect::<Vec<_>>())
            }
            MetadataKind::Count => {
                let whole = found.map(|one| one?.text.parse::<i64>().ok());
                Series::new(name.into(), whole.collect::<Vec<_>>())
            }
        };
        series.into_column()
    });
    let all: Vec<Column> = words.chain(counts).chain([duration]).chain(facts).collect();
    DataFrame::new(rows.len(), all)
}

/// A file of rows that is written but not yet in the table.
pub(crate) struct Part {
    pub bytes: Bytes,
    pub add: Add,
}

impl Part {
    pub fn path(&self) -> Path {
        table_path(&self.add.path)
    }
}

/// The bytes of a file of rows.
pub(crate) fn part(rows: &[SessionRow], now: DateTime<Utc>) -> Result<Part, StoreError> {
    let frame = frame(rows).map_err(|err| StoreError::bad(&table_path("part"), err))?;
    part_of(frame, true, now)
}

fn part_of(frame: DataFrame, data_change: bool, now: DateTime<Utc>) -> Result<Part, StoreError> {
    let failed = |err| StoreError::bad(&table_path("part"), err);
    let ids =
        frame.column("session_id").and_then(|column| column.str().cloned()).map_err(failed)?;
    let (first, last) = (ids.iter().flatten().min(), ids.iter().flatten().max());
    let stats = json!({
        "numRecords": frame.height(), "minValues": { "session_id": first },
        "maxValues": { "session_id": last }, "nullCount": { "session_id": 0 },
    });
    let bytes = parquet_bytes(frame).map_err(failed)?;
    let add = Add {
        // Named by its content and time, so that no two writers share a name.
        path: format!("part-{}-{}.parquet", now.format("%Y%m%dT%H%M%S%3fZ"), &sha256(&bytes)[..32]),
        partition_values: std::collections::BTreeMap::new(),
        size: count(bytes.len() as u64),
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
pub(crate) fn merged(parts: &[(Path, Bytes)], now: DateTime<Utc>) -> Result<Part, StoreError> {
    let known = columns();
    let mut frames = Vec::with_capacity(parts.len());
    for (path, bytes) in parts {
        let failed = |err| StoreError::bad(path, err);
        let mut frame = read_frame(bytes, None).map_err(failed)?;
        for (name, kind) in &known {
            if frame.column(name).is_err() {
                let kind = match *kind {
                    "long" => DataType::Int64,
                    "double" => DataType::Float64,
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
    let failed = |err| StoreError::bad(&table_path("part"), err);
    part_of(accumulate_dataframes_vertical(frames).map_err(failed)?, false, now)
}

fn read_frame(bytes: &Bytes, columns: Option<Vec<String>>) -> PolarsResult<DataFrame> {
    let reader = ParquetReader::new(Cursor::new(bytes)).with_columns(columns);
    reader.read_parallel(ParallelStrategy::None).finish()
}

/// Whether a file of rows has the bytes that its name says. Another program's name says nothing.
fn is_named(path: &Path, bytes: &Bytes) -> bool {
    let name =
        path.filename().and_then(|name| name.strip_prefix("part-")?.strip_suffix(".parquet"));
    let sum = name.and_then(|name| name.rsplit_once('Z')?.1.strip_prefix('-'));
    sum.is_none_or(|sum| sha256(bytes).starts_with(sum))
}

/// The rows of a file, each read when its turn comes.
pub(crate) fn rows_of(
    path: &Path,
    bytes: &Bytes,
) -> Result<impl Iterator<Item = Result<SessionRow, StoreError>> + use<>, StoreError> {
    let needed = ["version", "content_sha256", "pushed_at", "entry", "entry_checksum"];
    let path = path.clone();
    let is_named = is_named(&path, bytes);
    let failed = move |reason: String| StoreError::bad(&path, reason);
    if !is_named {
        return Err(failed("its bytes have another SHA-256 than its name".into()));
    }
    let needed = Some(needed.map(str::to_owned).to_vec());
    let frame = read_frame(bytes, needed).map_err(|err| failed(err.to_string()))?;
    let column = |name: &str| frame.column(name).map_err(|err| failed(err.to_string()));
    let words = |name: &str| {
        Ok::<_, StoreError>(column(name)?.str().map_err(|err| failed(err.to_string()))?.clone())
    };
    let versions = column("version")?.i64().map_err(|err| failed(err.to_string()))?.clone();
    let (contents, pushed) = (words("content_sha256")?, words("pushed_at")?);
    let (entries, sums) = (words("entry")?, words("entry_checksum")?);
    Ok((0..frame.height()).map(move |at| {
        let (Some(text), Some(sum)) = (entries.get(at), sums.get(at)) else {
            return Err(failed(format!("row {at} has no entry")));
        };
        if checksum(text) != sum {
            return Err(failed(format!("the checksum of row {at} is wrong")));
        }
        Ok(SessionRow {
            version: versions.get(at).and_then(|one| u64::try_from(one).ok()).unwrap_or(0),
            content: contents.get(at).unwrap_or_default().to_owned(),
            pushed_at: pushed.get(at).unwrap_or_default().to_owned(),
            entry: serde_json::from_str(text).map_err(|err| failed(err.to_string()))?,
        })
    }))
}
