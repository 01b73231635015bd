//! The catalog of a store on this computer's disk. It follows the table by its changes, so that a search needs no store.

use crate::delta::{Add, Commit, Snapshot};
use crate::error::StoreError;
use crate::location::{REQUESTS, Store};
use crate::rows::{SessionRow, rows_of};
use futures_util::stream::{self, StreamExt, TryStreamExt};
use palpate_sessions::Catalog;
use palpate_sessions::catalog::{CatalogEntry, MirroredSession, MirroredTable};
use std::ops::ControlFlow;
use std::path::Path;

/// Sessions done and to do; a break ends the work, and what is stored stays.
pub(crate) type Hear<'a> = &'a mut dyn FnMut(usize, usize) -> ControlFlow<()>;

/// A store's catalog on this computer.
#[derive(Debug)]
pub struct Mirror {
    pub(crate) catalog: Catalog,
}

impl Mirror {
    /// Opens or makes the catalog in a folder of its own for each store.
    pub fn open(folder: &Path) -> Result<Self, StoreError> {
        Ok(Self { catalog: Catalog::open(folder)? })
    }

    /// The catalog, whose entries have the session's identifier as their folder.
    #[must_use]
    pub fn catalog(&self) -> &Catalog {
        &self.catalog
    }

    pub(crate) fn table(&self) -> Result<Option<MirroredTable>, StoreError> {
        Ok(self.catalog.mirrored_table()?)
    }

    /// Whether the store was ever read.
    pub fn is_known(&self) -> Result<bool, StoreError> {
        Ok(self.table()?.is_some())
    }

    /// Reads what changed in the store's table. Returns the number of versions of sessions that were read; `hear` is called
    /// with the files of rows that were read and all.
    pub fn update(&mut self, store: &Store, hear: Hear<'_>) -> Result<usize, StoreError> {
        loop {
            let known = self.table()?;
            let change = store.wait(Change::since(store, known.as_ref()))?;
            let Some(change) = change else { return Ok(0) };
            let mut count = 0;
            let rows = rows_of_parts(store, &change.parts, hear);
            let sessions = rows.map(|row| row.map(mirrored)).inspect(|_| count += 1);
            if self.catalog.take_mirrored(change.was.as_ref(), &change.now, sessions)? {
                return Ok(count);
            }
        }
    }
}

fn mirrored(row: SessionRow) -> MirroredSession {
    let folder = row.entry.session_id.clone();
    let entry = CatalogEntry { folder, ..row.entry };
    MirroredSession { entry, version: row.version, content: row.content }
}

/// What a table has more than was known.
struct Change {
    /// None where everything is read again.
    was: Option<MirroredTable>,
    now: MirroredTable,
    parts: Vec<Add>,
}

impl Change {
    /// None where there is nothing new.
    async fn since(
        store: &Store,
        known: Option<&MirroredTable>,
    ) -> Result<Option<Self>, StoreError> {
        let Some(known) = known else { return Self::whole(store).await.map(Some) };
        // Another table may have been made at the same place.
        let first = store.sessions().read_commit(0).await?;
        let is_same = first.is_some_and(|first| id_of(&first) == Some(&known.id));
        if !is_same {
            return Self::whole(store).await.map(Some);
        }
        let commits = store.sessions().commits_from(known.version + 1).await?;
        let Some(last) = commits.last() else { return Ok(None) };
        let actions = || commits.iter().flat_map(|commit| &commit.actions);
        let removes = actions().any(|one| one.remove.as_ref().is_some_and(|one| one.data_change));
        if removes {
            // Another program took rows away.
            return Self::whole(store).await.map(Some);
        }
        let schema = actions().filter_map(|one| one.meta_data.as_ref()).next_back();
        let now = MirroredTable {
            version: last.version,
            schema: schema.map_or_else(|| known.schema.clone(), |one| one.schema_string.clone()),
            id: known.id.clone(),
        };
        let parts = actions().filter_map(|one| one.add.clone()).filter(|add| add.data_change);
        Ok(Some(Self { was: Some(known.clone()), now, parts: parts.collect() }))
    }

    async fn whole(store: &Store) -> Result<Self, StoreError> {
        let snapshot = store.sessions().snapshot().await?.ok_or_else(|| store.no_table())?;
        let metadata = snapshot.metadata(&store.sessions().log_folder())?;
        let (id, schema) = (metadata.id.clone(), metadata.schema_string.clone());
        let now = MirroredTable { id, version: snapshot.version, schema };
        let Snapshot { parts, .. } = snapshot;
        Ok(Self { was: None, now, parts: parts.into_values().collect() })
    }
}

fn id_of(commit: &Commit) -> Option<&String> {
    commit.actions.iter().find_map(|one| one.meta_data.as_ref()).map(|one| &one.id)
}

/// The rows of files, in their order. Files are fetched several at a time, and one is read at a time.
fn rows_of_parts<'a>(
    store: &'a Store,
    parts: &'a [Add],
    hear: Hear<'a>,
) -> impl Iterator<Item = Result<SessionRow, StoreError>> + use<'a> {
    let fetched = stream::iter(parts).map(|part| async {
        let path = store.sessions().path(&part.path);
        let missing = || StoreError::bad(&path, "it is missing");
        let bytes = store.read(&path).await?.ok_or_else(missing)?;
        Ok((path, bytes))
    });
    let mut fetched = Box::pin(fetched.buffered(REQUESTS));
    let mut done = 0;
    let files = std::iter::from_fn(move || {
        let next = store.wait(fetched.try_next()).transpose()?;
        Some(next.and_then(|(path, bytes)| {
            done += 1;
            match hear(done, parts.len()).is_break() {
                true => Err(StoreError::Ended),
                false => rows_of(&path, &bytes),
            }
        }))
    });
    files.flat_map(|file| {
        let (rows, err) = match file {
            Ok(rows) => (Some(rows), None),
            Err(err) => (None, Some(Err(err))),
        };
        rows.into_iter().flatten().chain(err)
    })
}
