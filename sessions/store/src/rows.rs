//! Rows of the table of sessions: one of every version of every session.

use crate::error::StoreError;
use crate::part::{OTHER_BYTES, Part, columns_of, is_named, part_of, read_frame, unwritable};
use crate::table::Shape;
use bytes::Bytes;
use chrono::{DateTime, Utc};
use object_store::path::Path;
use palpate_model::metadata::{MANIFEST_FIELDS, METADATA_KEYS, MetadataKind};
use palpate_sessions::catalog::{CatalogEntry, NamedValueSource};
use palpate_sessions::text::checksum;
use polars_core::prelude::{DataFrame, IntoColumn, NamedFrom, PolarsResult, Series};
use serde_json::json;

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

/// The table of sessions.
pub(crate) static SESSIONS: Shape = Shape { name: "sessions", columns, key: "session_id" };

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

fn fact<'a>(row: &'a SessionRow, name: &str) -> Option<&'a palpate_sessions::catalog::NamedValue> {
    let is_it = |one: &&palpate_sessions::catalog::NamedValue| {
        one.source == NamedValueSource::About && one.name == name
    };
    row.entry.named.iter().find(is_it)
}

fn frame(rows: &[SessionRow]) -> PolarsResult<DataFrame> {
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
    let (words, counts) = (columns_of(rows, &WORDS), columns_of(rows, &COUNTS));
    let all = words.into_iter().chain(counts).chain([duration]).chain(facts).collect();
    DataFrame::new(rows.len(), all)
}

/// The bytes of a file of rows.
pub(crate) fn part(rows: &[SessionRow], now: DateTime<Utc>) -> Result<Part, StoreError> {
    let frame = frame(rows).map_err(unwritable(&SESSIONS))?;
    part_of(&SESSIONS, frame, true, now)
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
        return Err(failed(OTHER_BYTES.into()));
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
