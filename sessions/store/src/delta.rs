//! The log of a Delta table: its changes, one JSON file each, and the state that they add up to (Delta Transaction Log
//! Protocol, <https://github.com/delta-io/delta/blob/master/PROTOCOL.md>, versions 1 for readers and 2 for writers).

use crate::error::StoreError;
use crate::location::{REQUESTS, Store};
use bytes::Bytes;
use chrono::{DateTime, Utc};
use futures_util::stream::{self, StreamExt, TryStreamExt};
use object_store::path::Path;
use palpate_sessions::text::sha256;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// Folder of the table of sessions.
const TABLE: &str = "sessions";
/// What this program knows of the protocol.
const READER_VERSION: u32 = 1;
const WRITER_VERSION: u32 = 2;

/// An object of the table.
pub(crate) fn table_path(name: &str) -> Path {
    Path::from(format!("{TABLE}/{name}"))
}

pub(crate) fn log_folder() -> Path {
    Path::from(format!("{TABLE}/_delta_log"))
}

pub(crate) fn commit_path(version: u64) -> Path {
    Path::from(format!("{TABLE}/_delta_log/{version:020}.json"))
}

/// A file of rows that joins the table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Add {
    pub path: String,
    pub partition_values: BTreeMap<String, Option<String>>,
    pub size: i64,
    /// In ms since 1970.
    pub modification_time: i64,
    /// False where the rows were in the table before.
    pub data_change: bool,
    pub stats: Option<String>,
}

/// A file of rows that leaves the table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Remove {
    pub path: String,
    pub deletion_timestamp: Option<i64>,
    #[serde(default = "changes")]
    pub data_change: bool,
}

/// What a change is where it does not say.
const fn changes() -> bool {
    true
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Metadata {
    pub id: String,
    #[serde(default)]
    pub name: Option<String>,
    pub format: Value,
    pub schema_string: String,
    pub partition_columns: Vec<String>,
    #[serde(default)]
    pub configuration: BTreeMap<String, String>,
    #[serde(default)]
    pub created_time: Option<i64>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Protocol {
    pub min_reader_version: u32,
    pub min_writer_version: u32,
}

/// One line of a change; what this program does not need is ignored.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(crate) struct Action {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub protocol: Option<Protocol>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub meta_data: Option<Metadata>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub add: Option<Add>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub remove: Option<Remove>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub commit_info: Option<Value>,
}

impl From<Add> for Action {
    fn from(add: Add) -> Self {
        Self { add: Some(add), ..Self::default() }
    }
}

impl From<Remove> for Action {
    fn from(remove: Remove) -> Self {
        Self { remove: Some(remove), ..Self::default() }
    }
}

/// One change of the table.
#[derive(Clone, Debug)]
pub(crate) struct Commit {
    pub version: u64,
    pub actions: Vec<Action>,
}

/// The state of a table after a change.
#[derive(Clone, Debug, Default)]
pub(crate) struct Snapshot {
    pub version: u64,
    pub protocol: Option<Protocol>,
    pub metadata: Option<Metadata>,
    /// Files of rows by their paths.
    pub parts: BTreeMap<String, Add>,
}

impl Snapshot {
    pub fn apply(&mut self, commit: &Commit) {
        for action in &commit.actions {
            self.protocol = action.protocol.clone().or(self.protocol.take());
            self.metadata = action.meta_data.clone().or(self.metadata.take());
            if let Some(remove) = &action.remove {
                self.parts.remove(&remove.path);
            }
            if let Some(add) = &action.add {
                self.parts.insert(add.path.clone(), add.clone());
            }
        }
        self.version = commit.version;
    }

    pub fn metadata(&self) -> Result<&Metadata, StoreError> {
        let missing = || StoreError::bad(&log_folder(), "no change describes the table");
        self.metadata.as_ref().ok_or_else(missing)
    }
}

/// Refuses what a newer program must read or write.
pub(crate) fn check_actions(actions: &[Action]) -> Result<(), StoreError> {
    for protocol in actions.iter().filter_map(|one| one.protocol.as_ref()) {
        if protocol.min_reader_version > READER_VERSION {
            let what = format!("Delta readers of version {}", protocol.min_reader_version);
            return Err(StoreError::Unknown { what });
        }
        if protocol.min_writer_version > WRITER_VERSION {
            let what = format!("Delta writers of version {}", protocol.min_writer_version);
            return Err(StoreError::Unknown { what });
        }
    }
    for metadata in actions.iter().filter_map(|one| one.meta_data.as_ref()) {
        let known = crate::rows::STORE_VERSION.to_string();
        match metadata.configuration.get(VERSION_KEY) {
            Some(version) if *version == known => {}
            Some(version) => return Err(StoreError::Newer { version: version.clone() }),
            None => return Err(StoreError::bad(&log_folder(), "another program made the table")),
        }
    }
    Ok(())
}

/// Key of the store's version among the table's settings.
const VERSION_KEY: &str = "palpate.storeVersion";

/// The first change of a new table.
pub(crate) fn first_actions(url: &str, schema: &str, now: DateTime<Utc>) -> Vec<Action> {
    let created = now.timestamp_millis();
    // A name that no other table has, in the form of a UUID of version 8 (RFC 9562, section 5.8).
    let seed = format!("{url} {:?} {}", now.timestamp_nanos_opt(), std::process::id());
    let hash = sha256(seed.as_bytes());
    let part = |range: std::ops::Range<usize>| hash.get(range).unwrap_or_default();
    let id = format!(
        "{}-{}-8{}-a{}-{}",
        part(0..8),
        part(8..12),
        part(13..16),
        part(17..20),
        part(20..32)
    );
    let protocol =
        Protocol { min_reader_version: READER_VERSION, min_writer_version: WRITER_VERSION };
    let metadata = Metadata {
        id,
        name: Some("palpate sessions".into()),
        format: json!({ "provider": "parquet", "options": {} }),
        schema_string: schema.to_owned(),
        partition_columns: Vec::new(),
        configuration: [(VERSION_KEY.to_owned(), crate::rows::STORE_VERSION.to_string())].into(),
        created_time: Some(created),
    };
    vec![
        Action { protocol: Some(protocol), ..Action::default() },
        Action { meta_data: Some(metadata), ..Action::default() },
        commit_info("CREATE TABLE", now),
    ]
}

/// Who changed the table and how.
pub(crate) fn commit_info(operation: &str, now: DateTime<Utc>) -> Action {
    let info = json!({
        "timestamp": now.timestamp_millis(), "operation": operation, "operationParameters": {},
        "engineInfo": concat!("palpate/", env!("CARGO_PKG_VERSION")),
    });
    Action { commit_info: Some(info), ..Action::default() }
}

impl Store {
    /// Writes the change of a version; `false` where another writer was faster.
    pub(crate) async fn commit(
        &self,
        version: u64,
        actions: &[Action],
    ) -> Result<bool, StoreError> {
        let lines = actions.iter().map(|action| json!(action).to_string() + "\n");
        let (path, bytes) = (commit_path(version), Bytes::from(lines.collect::<String>()));
        let is_first = self.put_new(&path, bytes.clone()).await?;
        // A store whose look at a name and whose writing are two steps may pass the probe and overwrite a change all the same.
        if is_first && self.read(&path).await?.is_none_or(|kept| kept != bytes) {
            return Err(self.unconditional());
        }
        Ok(is_first)
    }

    /// The change of a version; none where there is none yet.
    pub(crate) async fn read_commit(&self, version: u64) -> Result<Option<Commit>, StoreError> {
        let path = commit_path(version);
        let Some(bytes) = self.read(&path).await? else { return Ok(None) };
        let lines = bytes.split(|byte| *byte == b'\n').filter(|line| !line.is_empty());
        let actions = lines.map(serde_json::from_slice::<Action>).collect::<Result<Vec<_>, _>>();
        let actions = actions.map_err(|err| StoreError::bad(&path, err))?;
        check_actions(&actions)?;
        Ok(Some(Commit { version, actions }))
    }

    /// All changes from a version on, as far as no one is missing.
    pub(crate) async fn commits_from(&self, first: u64) -> Result<Vec<Commit>, StoreError> {
        let failed = StoreError::object(&log_folder());
        let listed = match first.checked_sub(1) {
            None => self.objects.list(Some(&log_folder())),
            Some(known) => self.objects.list_with_offset(Some(&log_folder()), &commit_path(known)),
        };
        let listed: Vec<_> = listed.try_collect().await.map_err(failed)?;
        let mut versions: Vec<u64> = listed
            .iter()
            .filter_map(|one| version_of(one.location.filename()?))
            .filter(|version| *version >= first)
            .collect();
        versions.sort_unstable();
        let unbroken = (first..).zip(versions).take_while(|(expected, found)| expected == found);
        let commits = stream::iter(unbroken).map(|(version, _)| self.read_commit(version));
        let commits: Vec<Option<Commit>> = commits.buffered(REQUESTS).try_collect().await?;
        Ok(commits.into_iter().map_while(|one| one).collect())
    }

    /// The state of the table; none where there is no table.
    pub(crate) async fn snapshot(&self) -> Result<Option<Snapshot>, StoreError> {
        let known = self.read_checkpoint().await?;
        let first = known.as_ref().map_or(0, |known| known.version + 1);
        let commits = self.commits_from(first).await?;
        if known.is_none() && commits.is_empty() {
            return Ok(None);
        }
        let mut snapshot = known.unwrap_or_default();
        commits.iter().for_each(|commit| snapshot.apply(commit));
        Ok(Some(snapshot))
    }
}

fn version_of(name: &str) -> Option<u64> {
    let digits = name.strip_suffix(".json").filter(|digits| digits.len() == 20)?;
    digits.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn newer_protocols_and_foreign_tables_are_refused() {
        let of = |text: &str| check_actions(&[serde_json::from_str(text).unwrap()]);
        let reader = of(r#"{"protocol":{"minReaderVersion":3,"minWriterVersion":7}}"#).unwrap_err();
        assert!(reader.to_string().contains("readers of version 3"), "{reader}");
        let writer = of(r#"{"protocol":{"minReaderVersion":1,"minWriterVersion":7}}"#).unwrap_err();
        assert!(writer.to_string().contains("writers of version 7"), "{writer}");
        let table = |settings: &str| {
            of(&format!(
                r#"{{"metaData":{{"id":"x","format":{{"provider":"parquet"}},"schemaString":"","partitionColumns":[],"configuration":{settings}}}}}"#
            ))
        };
        assert!(table("{}").unwrap_err().to_string().contains("another program"));
        assert!(matches!(table(r#"{"palpate.storeVersion":"2"}"#), Err(StoreError::Newer { .. })));
        table(r#"{"palpate.storeVersion":"1"}"#).unwrap();
    }

    #[test]
    fn only_changes_have_a_version() {
        assert_eq!(version_of("00000000000000000012.json"), Some(12));
        for bad in ["12.json", "00000000000000000012.crc", "_last_checkpoint"] {
            assert_eq!(version_of(bad), None, "{bad}");
        }
    }
}
