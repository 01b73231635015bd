//! Verification: whether everything that the table names is in the store, with the right bytes.

use crate::delta::table_path;
use crate::error::StoreError;
use crate::files::{PIECE_BYTES, object_path};
use crate::location::{REQUESTS, Store};
use crate::mirror::Hear;
use crate::rows::{SessionRow, rows_of};
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

impl Store {
    /// Looks at every version of every session: that it is in the table once, and its objects are there; where `is_deep`, also
    /// at every byte.
    pub fn verify(
        &self,
        is_deep: bool,
        hear: Hear<'_>,
    ) -> Result<(usize, Vec<StoreFault>), StoreError> {
        self.wait(async {
            let snapshot = self.snapshot().await?.ok_or_else(|| self.no_table())?;
            let mut faults = Vec::new();
            let mut rows = Vec::new();
            for add in snapshot.parts.values() {
                let path = table_path(&add.path);
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
            Ok((rows.len(), faults))
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
        let checked = stream::iter(pieces).map(|(sum, bytes)| async move {
            if is_deep {
                return self.checked(sum).await.map(drop);
            }
            let path = object_path(sum);
            match self.size(&path).await? {
                Some(found) if found == bytes => Ok(()),
                Some(found) => {
                    Err(StoreError::bad(&path, format!("it has {found} of {bytes} bytes")))
                }
                None => Err(StoreError::bad(&path, "it is missing")),
            }
        });
        checked.buffer_unordered(REQUESTS).try_collect().await
    }
}

fn fault(place: &impl ToString, sentence: impl ToString) -> StoreFault {
    StoreFault { place: place.to_string(), sentence: sentence.to_string() }
}
