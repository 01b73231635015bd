//! Parquet with units in the file's metadata.

use super::{Beside, COLUMNS, ExportError, atomic, frame};
use crate::log::Session;
use polars::prelude::{DataFrame, KeyValueMetadata, ParquetWriter, PolarsError, PolarsResult};
use std::io::Write;
use std::path::Path;
use std::sync::PoisonError;

/// Rows per row group: a reader of part of a session decodes little more than that part.
const ROW_GROUP: usize = 1 << 18;

/// Writes the samples as Parquet. The file's metadata carries the units (`palpate.columns`, JSON
/// from column to unit) and where the numbers come from (`palpate.session`, `palpate.software`,
/// `palpate.record_version`), of what (`palpate.specimen`, `palpate.about`, a JSON object) and what a reader
/// must know (`palpate.notes`, a JSON list of sentences), and what is told of the columns `beside`.
pub fn export_parquet(session: &Session, beside: &Beside, path: &Path) -> Result<(), ExportError> {
    let frame = frame(session, beside, path)?;
    let metadata = metadata(session, beside);
    atomic::write(path, |file| write(file, &frame, metadata))
}

fn metadata(session: &Session, beside: &Beside) -> KeyValueMetadata {
    let units: serde_json::Map<String, serde_json::Value> = COLUMNS
        .iter()
        .copied()
        .chain(beside.columns.iter().map(|(name, unit, _)| (*name, *unit)))
        .map(|(name, unit)| (name.to_owned(), unit.into()))
        .collect();
    let manifest = &session.manifest;
    let pairs = [
        (
            "palpate.columns",
            serde_json::Value::Object(units).to_string(),
        ),
        ("palpate.session", manifest.session_id.clone()),
        ("palpate.software", manifest.software_version.clone()),
        (
            "palpate.record_version",
            manifest.record_version.to_string(),
        ),
        ("palpate.specimen", manifest.specimen.clone()),
        (
            "palpate.about",
            serde_json::json!(manifest.about).to_string(),
        ),
        (
            "palpate.notes",
            serde_json::json!(session.notes).to_string(),
        ),
    ];
    KeyValueMetadata::from_static(
        pairs
            .into_iter()
            .map(|(key, value)| (key.to_owned(), value))
            .chain(beside.metadata.clone())
            .collect(),
    )
}

fn write(file: impl Write, frame: &DataFrame, metadata: KeyValueMetadata) -> PolarsResult<()> {
    let KeyValueMetadata::Static(pairs) = metadata else {
        return Err(PolarsError::ComputeError("metadata is not static".into()));
    };
    let mut writer = ParquetWriter::new(file).batched(frame.schema())?;
    let mut first = 0;
    while first == 0 || first < frame.height() {
        writer.write_batch(&frame.slice(first as i64, ROW_GROUP))?;
        first += ROW_GROUP;
    }
    // The footer is written here and not by `finish`, which adds the frame's Arrow schema: with
    // one in the file, Arrow readers show its metadata, which is empty, instead of ours
    // (Arrow issue 8980). All our types are told by Parquet's own.
    let mut footer = writer
        .get_writer()
        .lock()
        .unwrap_or_else(PoisonError::into_inner);
    footer.end(Some(pairs)).map(|_bytes| ())
}
