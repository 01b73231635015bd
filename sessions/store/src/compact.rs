//! Compaction: many small files of rows become one, so that a reader opens few. No row changes and no object is deleted.

use crate::delta::{Action, Add, Remove, Snapshot, commit_info};
use crate::error::StoreError;
use crate::location::{REQUESTS, Store};
use crate::part::{OTHER_BYTES, is_named, merged, row_count};
use crate::table::Table;
use bytes::Bytes;
use chrono::{DateTime, Utc};
use futures_util::stream::{self, StreamExt, TryStreamExt};
use object_store::ObjectStoreExt;
use object_store::path::Path;
use serde::Serialize;

/// Rows of a file that compaction writes, and above half of which it leaves a file alone. An entry has about 3 kB, so that
/// such a file has some 4 MB.
const ROWS: usize = 20_000;
/// How often another writer may be faster.
const TRIES_MAX: usize = 50;

/// What compaction did.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Compaction {
    /// Files of rows before.
    pub before: usize,
    /// Files of rows after.
    pub after: usize,
    pub rows: usize,
}

impl Store {
    /// Joins small files of rows of every table and writes checkpoints.
    pub fn compact(&self, now: fn() -> DateTime<Utc>) -> Result<Compaction, StoreError> {
        self.wait(async {
            self.probe(now()).await?;
            let mut all = None;
            for table in self.tables() {
                let Some(done) = table.compact(now).await? else { continue };
                let all = all.get_or_insert(Compaction::default());
                all.before += done.before;
                all.after += done.after;
                all.rows += done.rows;
            }
            all.ok_or_else(|| self.no_table())
        })
    }
}

impl Table<'_> {
    /// None where there is no table.
    async fn compact(self, now: fn() -> DateTime<Utc>) -> Result<Option<Compaction>, StoreError> {
        for _ in 0..TRIES_MAX {
            let Some(mut snapshot) = self.snapshot().await? else { return Ok(None) };
            let before = snapshot.parts.len();
            let rows = snapshot.parts.values().map(row_count).sum();
            let is_done = self.join_small(&mut snapshot, now()).await?;
            if is_done {
                self.write_checkpoint(&snapshot).await?;
                return Ok(Some(Compaction { before, after: snapshot.parts.len(), rows }));
            }
        }
        Err(StoreError::Crowded { tries: TRIES_MAX })
    }

    /// One change that puts the rows of small files into few; `false` where another writer was faster.
    async fn join_small(
        self,
        snapshot: &mut Snapshot,
        now: DateTime<Utc>,
    ) -> Result<bool, StoreError> {
        let groups = groups(snapshot);
        if groups.is_empty() {
            return Ok(true);
        }
        let mut actions = vec![commit_info("OPTIMIZE", now)];
        let mut written = Vec::new();
        for group in &groups {
            let part = merged(self.shape, &self.read_group(group).await?, now)?;
            let path = self.path(&part.add.path);
            self.store.put_new(&path, part.bytes).await?;
            actions.extend(group.iter().map(|add| Action::from(removal(add, now))));
            written.push((path, part.add.path.clone()));
            actions.push(part.add.into());
        }
        let version = snapshot.version + 1;
        let is_first = self.commit(version, &actions).await?;
        let first = written.first().map(|(_, name)| name.as_str()).unwrap_or_default();
        if is_first || self.names(version, first).await? {
            snapshot.apply(&crate::delta::Commit { version, actions });
            return Ok(true);
        }
        for (path, _) in &written {
            // Nothing names these rows.
            let _ = self.store.objects.delete(path).await;
        }
        Ok(false)
    }

    async fn read_group(self, group: &[Add]) -> Result<Vec<(Path, Bytes)>, StoreError> {
        let read = stream::iter(group).map(|add| async {
            let path = self.path(&add.path);
            let bytes = self.store.read(&path).await?;
            let bytes = bytes.ok_or_else(|| StoreError::bad(&path, "it is missing"))?;
            // Its bytes would be right by the name of the joined file.
            match is_named(&path, &bytes) {
                true => Ok((path, bytes)),
                false => Err(StoreError::bad(&path, OTHER_BYTES)),
            }
        });
        read.buffered(REQUESTS).try_collect().await
    }
}

/// Small files in groups of at most so many rows, two files or more each.
fn groups(snapshot: &Snapshot) -> Vec<Vec<Add>> {
    let small = snapshot.parts.values().filter(|add| row_count(add) < ROWS / 2);
    let (mut groups, mut rows) = (vec![Vec::new()], 0);
    for add in small {
        if rows + row_count(add) > ROWS {
            groups.push(Vec::new());
            rows = 0;
        }
        rows += row_count(add);
        if let Some(last) = groups.last_mut() {
            last.push(add.clone());
        }
    }
    groups.retain(|group| group.len() > 1);
    groups
}

fn removal(add: &Add, now: DateTime<Utc>) -> Remove {
    let deletion_timestamp = Some(now.timestamp_millis());
    Remove { path: add.path.clone(), deletion_timestamp, data_change: false }
}
