//! A Delta table of a store: its folder, its log and what is added to it.

use crate::checkpoint::COMMITS;
use crate::delta::{Action, Commit, Metadata, Snapshot, check_actions, commit_info, first_actions};
use crate::error::StoreError;
use crate::location::{REQUESTS, Store};
use crate::part::{Part, schema_with};
use crate::results::ResultTable;
use crate::rows::SESSIONS;
use bytes::Bytes;
use chrono::{DateTime, Utc};
use futures_util::stream::{self, StreamExt, TryStreamExt};
use object_store::ObjectStoreExt;
use object_store::path::Path;
use serde_json::json;

/// What the rows of a table are.
#[derive(Debug)]
pub(crate) struct Shape {
    /// Its folder in the store.
    pub name: &'static str,
    /// Name and type of every column, in the words of Delta's schema.
    pub columns: fn() -> Vec<(&'static str, &'static str)>,
    /// A column of texts without which there is no row.
    pub key: &'static str,
}

/// A table of a store.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Table<'a> {
    pub store: &'a Store,
    pub shape: &'static Shape,
}

impl Store {
    /// The table of sessions.
    pub(crate) fn sessions(&self) -> Table<'_> {
        Table { store: self, shape: &SESSIONS }
    }

    /// All tables, whether they are there or not.
    pub(crate) fn tables(&self) -> impl Iterator<Item = Table<'_>> {
        let results = ResultTable::ALL.iter().map(|one| one.shape());
        std::iter::once(&SESSIONS).chain(results).map(|shape| Table { store: self, shape })
    }
}

impl Table<'_> {
    /// An object of the table.
    pub fn path(self, name: &str) -> Path {
        Path::from(format!("{}/{name}", self.shape.name))
    }

    pub fn log_folder(self) -> Path {
        self.path("_delta_log")
    }

    pub fn commit_path(self, version: u64) -> Path {
        self.path(&format!("_delta_log/{version:020}.json"))
    }

    /// What is wrong where the table was there a moment ago.
    pub fn gone(self) -> StoreError {
        StoreError::bad(&self.log_folder(), "the table is gone")
    }

    /// Makes the table, unless there is one.
    pub async fn ensure(self, now: DateTime<Utc>) -> Result<(), StoreError> {
        if self.read_commit(0).await?.is_none() {
            let (schema, _) = schema_with(self.shape, None);
            let place = (self.store.url.as_str(), self.shape.name);
            self.commit(0, &first_actions(place, &schema, now)).await?;
        }
        Ok(())
    }

    /// Adds rows to the table as its next version; `false` where another writer was faster. `schema` is that of the version before.
    pub async fn append(
        self,
        version: u64,
        schema: &str,
        part: Part,
        now: DateTime<Utc>,
    ) -> Result<bool, StoreError> {
        let path = self.path(&part.add.path);
        self.store.put_new(&path, part.bytes).await?;
        let mut actions = vec![commit_info("WRITE", now)];
        let (schema, has_more) = schema_with(self.shape, Some(schema));
        if has_more {
            actions.push(self.with_schema(schema).await?);
        }
        actions.push(part.add.clone().into());
        match self.commit(version, &actions).await {
            Ok(true) => {
                self.checkpoint_at(version).await;
                Ok(true)
            }
            // A change whose answer was lost is sent again, and then finds its own name taken.
            Ok(false) if self.names(version, &part.add.path).await? => Ok(true),
            Ok(false) => {
                // Nothing names these rows, and the next try writes its own.
                let _ = self.store.objects.delete(&path).await;
                Ok(false)
            }
            // The change may have arrived although its answer did not: the file of rows stays.
            Err(err) => Err(err),
        }
    }

    /// Whether the change of a version adds a file of rows.
    pub async fn names(self, version: u64, part: &str) -> Result<bool, StoreError> {
        let commit = self.read_commit(version).await?;
        let adds = commit.iter().flat_map(|one| &one.actions).filter_map(|one| one.add.as_ref());
        Ok(adds.into_iter().any(|add| add.path == part))
    }

    /// The table described again, with more columns.
    async fn with_schema(self, schema_string: String) -> Result<Action, StoreError> {
        let snapshot = self.snapshot().await?.ok_or_else(|| self.gone())?;
        let metadata = snapshot.metadata(&self.log_folder())?;
        let metadata = Metadata { schema_string, ..metadata.clone() };
        Ok(Action { meta_data: Some(metadata), ..Action::default() })
    }

    /// Writes a checkpoint where one is due. Without it everything can be read all the same, so that its failure is no fault.
    async fn checkpoint_at(self, version: u64) {
        if version.is_multiple_of(COMMITS)
            && let Ok(Some(snapshot)) = self.snapshot().await
        {
            let _ = self.write_checkpoint(&snapshot).await;
        }
    }

    /// Writes the change of a version; `false` where another writer was faster.
    pub async fn commit(self, version: u64, actions: &[Action]) -> Result<bool, StoreError> {
        let lines = actions.iter().map(|action| json!(action).to_string() + "\n");
        let (path, bytes) = (self.commit_path(version), Bytes::from(lines.collect::<String>()));
        let is_first = self.store.put_new(&path, bytes.clone()).await?;
        // A store whose look at a name and whose writing are two steps may pass the probe and overwrite a change all the same.
        if is_first && self.store.read(&path).await?.is_none_or(|kept| kept != bytes) {
            return Err(self.store.unconditional());
        }
        Ok(is_first)
    }

    /// The change of a version; none where there is none yet.
    pub async fn read_commit(self, version: u64) -> Result<Option<Commit>, StoreError> {
        let path = self.commit_path(version);
        let Some(bytes) = self.store.read(&path).await? else { return Ok(None) };
        let lines = bytes.split(|byte| *byte == b'\n').filter(|line| !line.is_empty());
        let actions = lines.map(serde_json::from_slice::<Action>).collect::<Result<Vec<_>, _>>();
        let actions = actions.map_err(|err| StoreError::bad(&path, err))?;
        check_actions(&self.log_folder(), &actions)?;
        Ok(Some(Commit { version, actions }))
    }

    /// All changes from a version on, as far as no one is missing.
    pub async fn commits_from(self, first: u64) -> Result<Vec<Commit>, StoreError> {
        let failed = StoreError::object(&self.log_folder());
        let listed = match first.checked_sub(1) {
            None => self.store.objects.list(Some(&self.log_folder())),
            Some(known) => self
                .store
                .objects
                .list_with_offset(Some(&self.log_folder()), &self.commit_path(known)),
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
    pub async fn snapshot(self) -> Result<Option<Snapshot>, StoreError> {
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
    fn only_changes_have_a_version() {
        assert_eq!(version_of("00000000000000000012.json"), Some(12));
        for bad in ["12.json", "00000000000000000012.crc", "_last_checkpoint"] {
            assert_eq!(version_of(bad), None, "{bad}");
        }
    }
}
