//! Verification: whether everything that the table names is in the store, with the right bytes.

use crate::error::StoreError;
use crate::files::{PIECE_BYTES, object_path};
use crate::location::{REQUESTS, Store};
use crate::mirror::Hear;
use crate::results::{ResultTable, VerifiedResults};
use crate::rows::{SessionRow, rows_of};
use crate::table::Table;
use futures_util::stream::{self, StreamExt, TryStreamExt};
use serde::Serialize;
use std::collections::BTreeSet;

/// What is wrong in a store.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct StoreFault {
    /// The session's version, or an object of the table.
    pub place: String,
    pub sentence: String,
}

/// What was looked at in a store, and what is wrong there.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct StoreVerification {
    /// Versions of sessions.
    pub versions: usize,
    pub results: usize,
    pub faults: Vec<StoreFault>,
}

impl Store {
    /// Looks at every version of every session and at every result: that it is in its table once, and its objects are there;
    /// where `is_deep`, also at every byte.
    pub fn verify(&self, is_deep: bool, hear: Hear<'_>) -> Result<StoreVerification, StoreError> {
        self.wait(async {
            let snapshot = self.sessions().snapshot().await?;
            let mut is_there = snapshot.is_some();
            let mut results = 0;
            let mut faults = Vec::new();
            let mut rows = Vec::new();
            for add in snapshot.iter().flat_map(|table| table.parts.values()) {
                let path = self.sessions().path(&add.path);
                let read = match self.read(&path).await? {
                    None => Err(StoreError::bad(&path, "it is missing")),
                    Some(bytes) => {
                        rows_of(&path, &bytes).and_then(Iterator::collect::<Result<Vec<_>, _>>)
                    }
                };
                match read {
                    Ok(read) => rows.extend(read),
                    Err(err) => faults.push(fault(&path, err)),
                }
            }
            let mut seen = BTreeSet::new();
            for (done, row) in rows.iter().enumerate() {
                if hear(done, rows.len()).is_break() {
                    return Err(StoreError::Ended);
                }
                let place = format!("version {} of {}", row.version, row.entry.session_id);
                if !seen.insert((row.entry.session_id.clone(), row.version)) {
                    faults.push(fault(&place, "it is in the table twice"));
                }
                if let Err(err) = self.verify_row(row, is_deep).await {
                    faults.push(fault(&place, err));
                }
            }
            for one in ResultTable::ALL {
                let table = Table { store: self, shape: one.shape() };
                let VerifiedResults { objects, faults: found } = table.verify_results().await?;
                faults.extend(found.iter().map(|(place, sentence)| fault(place, sentence)));
                is_there |= !objects.is_empty() || !found.is_empty();
                results += objects.len();
                let checked = stream::iter(objects.values())
                    .map(|content| self.verify_object(content, None, is_deep));
                let mut checked = checked.buffer_unordered(REQUESTS).zip(stream::iter(0..));
                while let Some((result, done)) = checked.next().await {
                    if hear(done, objects.len()).is_break() {
                        return Err(StoreError::Ended);
                    }
                    faults
                        .extend(result.err().map(|err| fault(&format!("a result in {one}"), err)));
                }
            }
            match is_there {
                true => Ok(StoreVerification { versions: rows.len(), results, faults }),
                false => Err(self.no_table()),
            }
        })
    }

    async fn verify_row(&self, row: &SessionRow, is_deep: bool) -> Result<(), StoreError> {
        let list = self.file_list(&row.content).await?;
        let pieces = list.files.iter().flat_map(|file| {
            let last = file.pieces.len().saturating_sub(1) as u64;
            file.pieces.iter().zip(0..).map(move |(sum, k)| {
                let bytes = if k < last {
                    PIECE_BYTES
                } else {
                    file.bytes.saturating_sub(last * PIECE_BYTES)
                };
                (sum, bytes)
            })
        });
        let checked =
            stream::iter(pieces).map(|(sum, bytes)| self.verify_object(sum, Some(bytes), is_deep));
        checked.buffer_unordered(REQUESTS).try_collect().await
    }

    /// That an object is there; with the bytes that its name says, or with so many.
    async fn verify_object(
        &self,
        sum: &str,
        bytes: Option<u64>,
        is_deep: bool,
    ) -> Result<(), StoreError> {
        if is_deep {
            return self.checked(sum).await.map(drop);
        }
        let path = object_path(sum);
        match (self.size(&path).await?, bytes) {
            (None, _) => Err(StoreError::bad(&path, "it is missing")),
            (Some(found), Some(bytes)) if found != bytes => {
                Err(StoreError::bad(&path, format!("it has {found} of {bytes} bytes")))
            }
            _ => Ok(()),
        }
    }
}

fn fault(place: &impl ToString, sentence: impl ToString) -> StoreFault {
    StoreFault { place: place.to_string(), sentence: sentence.to_string() }
}
