//! Adding sessions to a lake.

use super::checksums::Checksums;
use super::layout::{LAKE_VERSION, LakePart, is_file_name, part_folder, partition};
use super::rows::SAMPLE_COLUMNS;
use crate::export::atomic::{io_error, write_or_same};
use crate::export::{
    Encoder, ExportError, ExtraColumns, RowFeed, SampleSelection, TableExport, TableFormat,
    WriteOutcome,
};
use palpate_model::metadata::{
    MANIFEST_FIELDS, METADATA_KEYS, MetadataKey, MetadataKind, SessionMetadata,
};
use palpate_sessions::edits::DataQuality;
use palpate_sessions::log::SessionOutline;
use palpate_sessions::record::{EntryKind, LogEntry};
use palpate_sessions::text::sha256;
use polars_core::prelude::{Column, DataFrame, IntoColumn, NamedFrom, PolarsResult, Series};
use serde_json::{Value, json};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The quality of a session, from its edits.
#[derive(Clone, Copy, Debug, Default)]
pub struct LakeQuality<'a> {
    /// With author and reason.
    pub quality: Option<(DataQuality, &'a str)>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LakeAddition {
    pub samples: PathBuf,
    /// Whether all files existed with the same content.
    pub was_there: bool,
}

/// Adds a session to a lake. Existing files must have the same content.
pub fn add_session(
    lake: &Path,
    outline: &SessionOutline,
    quality: LakeQuality,
    feed: RowFeed,
) -> Result<LakeAddition, ExportError> {
    let manifest = &outline.manifest;
    let id = &manifest.session_id;
    if !is_file_name(id) {
        return Err(ExportError::BadName { name: id.clone() });
    }
    let place = |of| -> Result<PathBuf, ExportError> {
        let folder = part_folder(lake, of).join(partition(manifest));
        fs::create_dir_all(&folder)
            .map_err(|source| ExportError::Io { path: folder.clone(), source })?;
        Ok(folder.join(format!("{id}.parquet")))
    };
    let samples = place(LakePart::Samples)?;
    let table = TableExport {
        manifest,
        notes: &outline.notes,
        extra: &ExtraColumns {
            metadata: vec![("palpate.lake_version".into(), LAKE_VERSION.to_string())],
            ..ExtraColumns::default()
        },
        selection: &SampleSelection {
            columns: SAMPLE_COLUMNS.map(String::from).into(),
            ..SampleSelection::default()
        },
    };
    let mut outcomes = vec![table.write_to_lake(&samples, feed)?];
    let (of_events, of_session) = (place(LakePart::Events)?, place(LakePart::Sessions)?);
    outcomes.push(write_bytes(&of_events, &encode(&of_events, events(outline))?)?);
    let last = encode(&of_session, session(outline, quality))?;
    let checksums = Checksums::of(&samples, &of_events, &last)?;
    outcomes.push(checksums.write(lake, &partition(manifest), id)?);
    // Written last, because readers list the sessions by it.
    outcomes.push(write_bytes(&of_session, &last)?);
    Ok(LakeAddition {
        samples,
        was_there: outcomes.iter().all(|one| *one == WriteOutcome::Unchanged),
    })
}

/// The bytes of a table's file.
fn encode(path: &Path, frame: PolarsResult<DataFrame>) -> Result<Vec<u8>, ExportError> {
    let failed = |source| ExportError::Table { path: path.to_owned(), source };
    let frame = frame.map_err(failed)?;
    let metadata = vec![("palpate.lake_version".into(), LAKE_VERSION.to_string())];
    let mut bytes = Vec::new();
    let mut encoder =
        Encoder::new(TableFormat::Parquet, &mut bytes, &frame, metadata).map_err(failed)?;
    encoder.write(frame).map_err(failed)?;
    encoder.finish().map_err(failed)?;
    Ok(bytes)
}

fn write_bytes(path: &Path, bytes: &[u8]) -> Result<WriteOutcome, ExportError> {
    write_or_same(path, |file| file.write_all(bytes).map_err(io_error(path)))
}

/// The name of a kind of entry.
pub(crate) const fn kind_name(kind: EntryKind) -> &'static str {
    match kind {
        EntryKind::Input => "input",
        EntryKind::Decision => "decision",
        EntryKind::Fit => "fit",
    }
}

fn events(outline: &SessionOutline) -> PolarsResult<DataFrame> {
    let entries = &outline.entries;
    let id = outline.manifest.session_id.as_str();
    fn each<T>(entries: &[LogEntry], of: impl Fn(&LogEntry) -> T) -> Vec<T> {
        entries.iter().map(of).collect()
    }
    let columns = [
        Series::new("session_id".into(), vec![id; entries.len()]),
        Series::new("kind".into(), each(entries, |one| kind_name(one.kind))),
        Series::new("order".into(), each(entries, |one| one.order)),
        Series::new("after_sample".into(), each(entries, |one| one.after_sample)),
        Series::new("now_ns".into(), each(entries, |one| one.now.0)),
        Series::new("body".into(), each(entries, |one| one.body.to_string())),
    ];
    DataFrame::new(entries.len(), columns.map(Column::from).into())
}

fn session(outline: &SessionOutline, quality: LakeQuality) -> PolarsResult<DataFrame> {
    let manifest = &outline.manifest;
    let text = |name: &str, text: &str| Series::new(name.into(), [text]).into_column();
    let word = |name: &str, text: Option<&str>| Series::new(name.into(), [text]).into_column();
    let number = |name: &str, value: u64| Series::new(name.into(), [value]).into_column();
    let named = |value: &serde_json::Value| value["name"].as_str().map(str::to_owned);
    let calibration = &manifest.calibration;
    let hash = (!calibration.is_null()).then(|| sha256(calibration.to_string().as_bytes()));
    let end = outline.end.as_ref();
    let ended = end.map(|end| end.ended_at.seconds().0);
    let verdict = quality.quality.map(|(verdict, _)| verdict.to_string());
    let mut columns = vec![
        text("session_id", &manifest.session_id),
        text("started_at", &manifest.started_at_text()),
        text("operator", &manifest.operator),
        text("specimen", &manifest.specimen),
        text("indenter", &manifest.indenter),
        word("protocol", named(&manifest.plan).as_deref()),
        number("samples", outline.samples),
        Series::new("duration_s".into(), [ended]).into_column(),
        word("outcome", end.map(|end| end.outcome.as_str())),
        word("verdict", verdict.as_deref()),
        word("verdict_reason", quality.quality.map(|(_, reason)| reason)),
        word("calibration", named(calibration).as_deref()),
        word("calibration_sha256", hash.as_deref()),
        text("software_version", &manifest.software_version),
        number("record_version", manifest.record_version.into()),
        number("lake_version", LAKE_VERSION.into()),
        // JSON for the conversion back to a session.
        text("about", &json!(manifest.about).to_string()),
        text("notes", &json!(outline.notes).to_string()),
        text("manifest", &json!(manifest).to_string()),
        text("end", &json!(outline.end).to_string()),
    ];
    columns.extend(METADATA_KEYS.iter().filter_map(|key| entry(key, &manifest.about)));
    DataFrame::new(1, columns)
}

/// The column of a metadata entry, empty where the session lacks it; `None` of those with a field of their own.
fn entry(key: &MetadataKey, about: &SessionMetadata) -> Option<Column> {
    let (name, value) = (key.name.into(), about.get(key.name));
    let series = match key.kind {
        _ if MANIFEST_FIELDS.contains(&key.name) => return None,
        MetadataKind::Text | MetadataKind::Choice(_) => {
            Series::new(name, [value.and_then(Value::as_str)])
        }
        MetadataKind::Number { .. } => Series::new(name, [value.and_then(Value::as_f64)]),
        MetadataKind::Count => Series::new(name, [value.and_then(Value::as_u64)]),
    };
    Some(series.into_column())
}

#[cfg(test)]
mod tests {
    use super::*;
    use polars_core::prelude::{AnyValue, DataType};

    #[test]
    fn every_metadata_entry_is_a_typed_column_also_where_it_is_missing() {
        let mut about = SessionMetadata::default();
        let empty = about.clone();
        for key in METADATA_KEYS {
            let text = match key.kind {
                MetadataKind::Text => "words",
                MetadataKind::Choice(words) => words[0],
                MetadataKind::Number { .. } | MetadataKind::Count => "3",
            };
            about.set(key.name, text).unwrap();
        }
        let mut columns = 0;
        for key in METADATA_KEYS {
            let Some(full) = entry(key, &about) else { continue };
            let missing = entry(key, &empty).unwrap();
            let (kind, value) = match key.kind {
                MetadataKind::Text => (DataType::String, AnyValue::String("words")),
                MetadataKind::Choice(words) => (DataType::String, AnyValue::String(words[0])),
                MetadataKind::Number { .. } => (DataType::Float64, AnyValue::Float64(3.0)),
                MetadataKind::Count => (DataType::UInt64, AnyValue::UInt64(3)),
            };
            assert_eq!((full.name().as_str(), full.dtype()), (key.name, &kind));
            assert_eq!(full.get(0).unwrap(), value, "{}", key.name);
            assert_eq!((missing.dtype(), missing.null_count()), (&kind, 1), "{}", key.name);
            columns += 1;
        }
        assert_eq!(columns, METADATA_KEYS.len() - MANIFEST_FIELDS.len());
    }
}
