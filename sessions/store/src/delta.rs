//! The log of a Delta table: its changes, one JSON file each, and the state that they add up to (Delta Transaction Log
//! Protocol, <https://github.com/delta-io/delta/blob/master/PROTOCOL.md>, versions 1 for readers and 2 for writers).

use crate::error::StoreError;
use chrono::{DateTime, Utc};
use object_store::path::Path;
use palpate_sessions::text::sha256;
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;

/// What this program knows of the protocol.
const READER_VERSION: u32 = 1;
const WRITER_VERSION: u32 = 2;

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

    pub fn metadata(&self, log: &Path) -> Result<&Metadata, StoreError> {
        let missing = || StoreError::bad(log, "no change describes the table");
        self.metadata.as_ref().ok_or_else(missing)
    }
}

/// Refuses what a newer program must read or write.
pub(crate) fn check_actions(log: &Path, actions: &[Action]) -> Result<(), StoreError> {
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
            None => return Err(StoreError::bad(log, "another program made the table")),
        }
    }
    Ok(())
}

/// Key of the store's version among the table's settings.
const VERSION_KEY: &str = "palpate.storeVersion";

/// The first change of a new table. The address sets its identifier apart from those of other tables.
pub(crate) fn first_actions(
    (address, name): (&str, &str),
    schema: &str,
    now: DateTime<Utc>,
) -> Vec<Action> {
    let created = now.timestamp_millis();
    // A name that no other table has, in the form of a UUID of version 8 (RFC 9562, section 5.8).
    let seed = format!("{address} {name} {:?} {}", now.timestamp_nanos_opt(), std::process::id());
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
        name: Some(format!("palpate {name}")),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn newer_protocols_and_foreign_tables_are_refused() {
        let of =
            |text: &str| check_actions(&Path::from("log"), &[serde_json::from_str(text).unwrap()]);
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
}
