//! Checkpoints: the whole state of the table in one Parquet file, so that a reader needs only the changes after it.

use crate::delta::{Action, Add, Metadata, Protocol, Snapshot, check_actions};
use crate::error::StoreError;
use crate::table::Table;
use bytes::Bytes;
use object_store::path::Path;
use object_store::{ObjectStoreExt, PutPayload};
use polars_arrow::array::{
    Array, BooleanArray, ListArray, PrimitiveArray, StructArray, Utf8ViewArray,
};
use polars_arrow::bitmap::Bitmap;
use polars_arrow::datatypes::{ArrowDataType, ArrowSchema, Field};
use polars_arrow::offset::OffsetsBuffer;
use polars_core::prelude::{DataFrame, PolarsError, PolarsResult, StructChunked};
use polars_io::SerReader;
use polars_io::parquet::read::{ParallelStrategy, ParquetReader};
use polars_parquet::parquet::metadata::SchemaDescriptor;
use polars_parquet::parquet::schema::Repetition;
use polars_parquet::parquet::schema::types::{
    FieldInfo, GroupConvertedType, GroupLogicalType, ParquetType,
};
use polars_parquet::write::{
    CompressionOptions, DynIter, DynStreamingIterator, FileWriter, StatisticsOptions, Version,
    WriteOptions, array_to_columns, compress, fallible_streaming_iterator, get_dtype_encoding,
    to_parquet_schema,
};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::Cursor;

/// A checkpoint follows every so many changes, as other writers of Delta tables make one by default.
pub(crate) const COMMITS: u64 = 100;

/// What `_last_checkpoint` says.
#[derive(Debug, Serialize, Deserialize)]
struct LastCheckpoint {
    version: u64,
    /// Rows of the checkpoint.
    size: u64,
}

impl Table<'_> {
    fn last_path(self) -> Path {
        self.path("_delta_log/_last_checkpoint")
    }

    fn checkpoint_path(self, version: u64) -> Path {
        self.path(&format!("_delta_log/{version:020}.checkpoint.parquet"))
    }

    /// Writes the state of the table as a checkpoint, and then its number where readers look for it.
    pub(crate) async fn write_checkpoint(self, snapshot: &Snapshot) -> Result<(), StoreError> {
        let path = self.checkpoint_path(snapshot.version);
        let bytes = encode(snapshot).map_err(|err| StoreError::bad(&path, err))?;
        // All writers of a version's checkpoint write the same state.
        self.store.put_new(&path, bytes.into()).await?;
        let last =
            LastCheckpoint { version: snapshot.version, size: snapshot.parts.len() as u64 + 2 };
        let last = PutPayload::from(serde_json::to_vec(&last).unwrap_or_default());
        let path = self.last_path();
        self.store.objects.put(&path, last).await.map(drop).map_err(StoreError::object(&path))
    }

    /// The newest checkpoint; none where there is none. Where two writers wrote its number in turn, it may be an older one,
    /// which is as right.
    pub(crate) async fn read_checkpoint(self) -> Result<Option<Snapshot>, StoreError> {
        let Some(last) = self.store.read(&self.last_path()).await? else { return Ok(None) };
        let last: LastCheckpoint =
            serde_json::from_slice(&last).map_err(|err| StoreError::bad(&self.last_path(), err))?;
        let path = self.checkpoint_path(last.version);
        let missing = || StoreError::bad(&path, "it is missing");
        let bytes = self.store.read(&path).await?.ok_or_else(missing)?;
        let found = decode(last.version, &bytes).map_err(|err| StoreError::bad(&path, err))?;
        let described = Action {
            protocol: found.protocol.clone(),
            meta_data: found.metadata.clone(),
            ..Action::default()
        };
        check_actions(&self.log_folder(), &[described])?;
        found.metadata(&path)?;
        Ok(Some(found))
    }
}

/// The columns of a checkpoint: the protocol and the table in rows of their own, then a row a file. Files that left the table
/// are not in it: only programs that delete them look for them, and they are in the changes all the same.
fn encode(snapshot: &Snapshot) -> PolarsResult<Vec<u8>> {
    let parts: Vec<&Add> = snapshot.parts.values().collect();
    let columns = [
        ("protocol", protocol(snapshot.protocol.as_ref(), parts.len())?),
        ("metaData", metadata(snapshot.metadata.as_ref(), parts.len())?),
        ("add", adds(&parts)?),
    ];
    let field = |(name, array): &(&str, Box<dyn Array>)| {
        let field = Field::new((*name).into(), array.dtype().clone(), true);
        (field.name.clone(), field)
    };
    let schema: ArrowSchema = columns.iter().map(field).collect();
    let options = WriteOptions {
        statistics: StatisticsOptions::empty(),
        version: Version::V1,
        compression: CompressionOptions::Snappy,
        data_page_size: None,
    };
    let mut bytes = Vec::new();
    let types = to_parquet_schema(&schema)?.fields().to_vec();
    let described = types.iter().cloned().map(with_maps).collect();
    let described = SchemaDescriptor::new("root".into(), described);
    let mut file = FileWriter::new_with_parquet_schema(&mut bytes, schema, described, options);
    let mut pages = Vec::new();
    for ((_, array), kind) in columns.iter().zip(types) {
        let encodings = get_dtype_encoding(array.dtype());
        for column in array_to_columns(array, kind, options, &encodings)? {
            let column: PolarsResult<Vec<_>> = column
                .map(|page| {
                    compress(page?, Vec::new(), options.compression).map_err(PolarsError::from)
                })
                .collect();
            pages.push(column?);
        }
    }
    let columns = pages.iter().map(|pages| {
        let pages = pages.iter().map(PolarsResult::Ok);
        Ok(DynStreamingIterator::new(fallible_streaming_iterator::convert(pages)))
    });
    file.write(parts.len() as u64 + 2, DynIter::new(columns))?;
    file.end(Some(Vec::new()))?;
    drop(file);
    Ok(bytes)
}

type Fields = Vec<(&'static str, bool, Box<dyn Array>)>;

/// A structure of these fields: name, whether a value may be missing, and values; `is_there` says which rows have it.
fn structure(fields: Fields, is_there: Option<Vec<bool>>) -> PolarsResult<Box<dyn Array>> {
    let rows = fields.first().map_or(0, |(_, _, values)| values.len());
    let types = fields.iter().map(|(name, is_nullable, values)| {
        Field::new((*name).into(), values.dtype().clone(), *is_nullable)
    });
    let kind = ArrowDataType::Struct(types.collect());
    let values = fields.into_iter().map(|(_, _, values)| values).collect();
    let is_there = is_there.map(Bitmap::from_iter);
    Ok(StructArray::try_new(kind, rows, values, is_there)?.boxed())
}

fn texts<'a>(values: impl Iterator<Item = Option<&'a str>>) -> Box<dyn Array> {
    Utf8ViewArray::from_slice(values.collect::<Vec<_>>()).boxed()
}

fn numbers(values: impl Iterator<Item = Option<i64>>) -> Box<dyn Array> {
    PrimitiveArray::<i64>::from_iter(values).boxed()
}

/// Fields that are maps.
const MAPS: [&str; 3] = ["partitionValues", "options", "configuration"];

/// A type with maps in the place of lists of pairs, which the library cannot describe. Both have the same pages: a list's
/// element and a map's pair are always there (Parquet's LogicalTypes.md, on lists and maps).
fn with_maps(kind: ParquetType) -> ParquetType {
    let ParquetType::GroupType { field_info, logical_type, converted_type, fields } = kind else {
        return kind;
    };
    if MAPS.contains(&field_info.name.as_str())
        && let Some(pair) = fields.first().and_then(|list| fields_of(list).first())
    {
        let pair = ParquetType::GroupType {
            field_info: FieldInfo {
                name: "key_value".into(),
                repetition: Repetition::Repeated,
                id: None,
            },
            logical_type: None,
            converted_type: None,
            fields: fields_of(pair).to_vec(),
        };
        return ParquetType::GroupType {
            field_info,
            logical_type: Some(GroupLogicalType::Map),
            converted_type: Some(GroupConvertedType::Map),
            fields: vec![pair],
        };
    }
    let fields = fields.into_iter().map(with_maps).collect();
    ParquetType::GroupType { field_info, logical_type, converted_type, fields }
}

fn fields_of(kind: &ParquetType) -> &[ParquetType] {
    match kind {
        ParquetType::GroupType { fields, .. } => fields,
        ParquetType::PrimitiveType(_) => &[],
    }
}

/// A list of pairs of texts for each row.
fn maps<'a>(
    rows: impl Iterator<Item = Vec<(&'a str, Option<&'a str>)>>,
) -> PolarsResult<Box<dyn Array>> {
    let (mut ends, mut keys, mut values) = (vec![0i64], Vec::new(), Vec::new());
    for row in rows {
        keys.extend(row.iter().map(|(key, _)| Some(*key)));
        values.extend(row.iter().map(|(_, value)| *value));
        ends.push(i64::try_from(keys.len()).unwrap_or(i64::MAX));
    }
    let (keys, values) = (texts(keys.into_iter()), texts(values.into_iter()));
    let pairs = structure(vec![("key", false, keys), ("value", true, values)], None)?;
    let kind = Field::new("element".into(), pairs.dtype().clone(), false);
    let kind = ArrowDataType::LargeList(Box::new(kind));
    Ok(ListArray::try_new(kind, OffsetsBuffer::try_from(ends)?, pairs, None)?.boxed())
}

/// One value, in the row of this place.
fn at<T>(place: usize, rows: usize, value: Option<T>) -> impl Iterator<Item = Option<T>> {
    let mut value = value;
    (0..rows).map(move |row| if row == place { value.take() } else { None })
}

fn protocol(protocol: Option<&Protocol>, parts: usize) -> PolarsResult<Box<dyn Array>> {
    let rows = parts + 2;
    let number = |of: fn(&Protocol) -> u32| -> Box<dyn Array> {
        let value = protocol.map(|protocol| of(protocol) as i32);
        PrimitiveArray::<i32>::from_iter(at(0, rows, value)).boxed()
    };
    let fields = vec![
        ("minReaderVersion", true, number(|one| one.min_reader_version)),
        ("minWriterVersion", true, number(|one| one.min_writer_version)),
    ];
    structure(fields, Some((0..rows).map(|row| row == 0).collect()))
}

fn metadata(metadata: Option<&Metadata>, parts: usize) -> PolarsResult<Box<dyn Array>> {
    let rows = parts + 2;
    let text = |value: Option<&str>| -> Box<dyn Array> {
        texts(
            at(1, rows, value.map(str::to_owned)).collect::<Vec<_>>().iter().map(Option::as_deref),
        )
    };
    let no_pairs = || maps((0..rows).map(|_| Vec::new()));
    let provider = metadata.and_then(|one| one.format["provider"].as_str());
    let format =
        structure(vec![("provider", true, text(provider)), ("options", true, no_pairs()?)], None)?;
    let settings = metadata.map(|one| {
        let pairs = one.configuration.iter();
        pairs.map(|(key, value)| (key.as_str(), Some(value.as_str()))).collect::<Vec<_>>()
    });
    let settings = at(1, rows, settings).map(Option::unwrap_or_default);
    let column = Field::new("element".into(), ArrowDataType::Utf8View, true);
    let no_columns = ListArray::<i64>::try_new(
        ArrowDataType::LargeList(Box::new(column)),
        OffsetsBuffer::try_from(vec![0i64; rows + 1])?,
        texts(std::iter::empty()),
        None,
    )?;
    let created = at(1, rows, metadata.and_then(|one| one.created_time));
    let fields = vec![
        ("id", true, text(metadata.map(|one| one.id.as_str()))),
        ("name", true, text(metadata.and_then(|one| one.name.as_deref()))),
        ("format", true, format),
        ("schemaString", true, text(metadata.map(|one| one.schema_string.as_str()))),
        ("partitionColumns", true, no_columns.boxed()),
        ("configuration", true, maps(settings)?),
        ("createdTime", true, numbers(created)),
    ];
    structure(fields, Some((0..rows).map(|row| row == 1).collect()))
}

fn adds(parts: &[&Add]) -> PolarsResult<Box<dyn Array>> {
    let rows = || [None, None].into_iter().chain(parts.iter().map(|one| Some(*one)));
    let changes = BooleanArray::from_iter(rows().map(|one| one.map(|_| false))).boxed();
    let fields = vec![
        ("path", true, texts(rows().map(|one| Some(one?.path.as_str())))),
        ("partitionValues", true, maps(rows().map(|_| Vec::new()))?),
        ("size", true, numbers(rows().map(|one| Some(one?.size)))),
        ("modificationTime", true, numbers(rows().map(|one| Some(one?.modification_time)))),
        ("dataChange", true, changes),
        ("stats", true, texts(rows().map(|one| one?.stats.as_deref()))),
    ];
    structure(fields, Some(rows().map(|one| one.is_some()).collect()))
}

fn decode(version: u64, bytes: &Bytes) -> PolarsResult<Snapshot> {
    let columns = ["protocol", "metaData", "add"].map(str::to_owned).to_vec();
    let reader = ParquetReader::new(Cursor::new(bytes)).with_columns(Some(columns));
    let frame = reader.read_parallel(ParallelStrategy::None).finish()?;
    let column =
        |name: &str| -> PolarsResult<StructChunked> { Ok(frame.column(name)?.struct_()?.clone()) };
    let mut parts = BTreeMap::new();
    let add = column("add")?;
    let text = |of: &StructChunked, name: &str| {
        Ok::<_, PolarsError>(of.field_by_name(name)?.str()?.clone())
    };
    let whole = |name: &str| Ok::<_, PolarsError>(add.field_by_name(name)?.i64()?.clone());
    let (paths, stats) = (text(&add, "path")?, text(&add, "stats")?);
    let (sizes, times) = (whole("size")?, whole("modificationTime")?);
    for row in 0..frame.height() {
        let Some(path) = paths.get(row) else { continue };
        let add = Add {
            path: path.to_owned(),
            partition_values: BTreeMap::new(),
            size: sizes.get(row).unwrap_or_default(),
            modification_time: times.get(row).unwrap_or_default(),
            data_change: false,
            stats: stats.get(row).map(str::to_owned),
        };
        parts.insert(path.to_owned(), add);
    }
    let (protocol, metadata) = (decode_protocol(&frame)?, decode_metadata(&column("metaData")?)?);
    Ok(Snapshot { version, protocol, metadata, parts })
}

fn decode_protocol(frame: &DataFrame) -> PolarsResult<Option<Protocol>> {
    let column = frame.column("protocol")?.struct_()?.clone();
    let number = |name: &str| -> PolarsResult<Option<u32>> {
        let values = column.field_by_name(name)?.i32()?.clone();
        Ok(values.iter().flatten().next().and_then(|one| u32::try_from(one).ok()))
    };
    let found = number("minReaderVersion")?.zip(number("minWriterVersion")?);
    Ok(found.map(|(min_reader_version, min_writer_version)| Protocol {
        min_reader_version,
        min_writer_version,
    }))
}

fn decode_metadata(column: &StructChunked) -> PolarsResult<Option<Metadata>> {
    let ids = column.field_by_name("id")?.str()?.clone();
    let Some(row) = (0..ids.len()).find(|row| ids.get(*row).is_some()) else { return Ok(None) };
    let text = |name: &str| -> PolarsResult<Option<String>> {
        Ok(column.field_by_name(name)?.str()?.get(row).map(str::to_owned))
    };
    let settings = column.field_by_name("configuration")?.list()?.get_as_series(row);
    let mut configuration = BTreeMap::new();
    if let Some(pairs) = settings {
        let pairs = pairs.struct_()?.clone();
        let (keys, values) = (pairs.field_by_name("key")?, pairs.field_by_name("value")?);
        for (key, value) in keys.str()?.iter().zip(values.str()?.iter()) {
            configuration
                .extend(key.zip(value).map(|(key, value)| (key.to_owned(), value.to_owned())));
        }
    }
    Ok(Some(Metadata {
        id: text("id")?.unwrap_or_default(),
        name: text("name")?,
        format: serde_json::json!({ "provider": "parquet", "options": {} }),
        schema_string: text("schemaString")?.unwrap_or_default(),
        partition_columns: Vec::new(),
        configuration,
        created_time: column.field_by_name("createdTime")?.i64()?.get(row),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::delta::{Commit, first_actions};

    #[test]
    fn a_checkpoint_is_the_state() {
        let now = chrono::DateTime::from_timestamp(1_700_000_000, 0).unwrap();
        let mut snapshot = Snapshot::default();
        snapshot.apply(&Commit {
            version: 0,
            actions: first_actions(("s3://lab", "sessions"), "{}", now),
        });
        for parts in 0..3 {
            let found = decode(7, &encode(&snapshot).unwrap().into()).unwrap();
            assert_eq!(found.version, 7);
            assert_eq!(
                (&found.protocol, &found.metadata),
                (&snapshot.protocol, &snapshot.metadata)
            );
            assert_eq!(found.parts, snapshot.parts);
            let add = Add {
                path: format!("part-{parts}.parquet"),
                partition_values: BTreeMap::new(),
                size: 12,
                modification_time: 1,
                data_change: false,
                stats: (parts == 0).then(|| r#"{"numRecords":1}"#.to_owned()),
            };
            snapshot.parts.insert(add.path.clone(), add);
        }
    }
}
