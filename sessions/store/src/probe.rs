//! Whether a store refuses a name that is taken. One that does not would let two rigs overwrite each other, and so would one
//! that looks for the name before it has received the bytes, as some small servers do.

use crate::error::StoreError;
use crate::location::Store;
use bytes::Bytes;
use chrono::{DateTime, Utc};
use futures_util::future::join_all;
use object_store::ObjectStoreExt;
use object_store::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// Writers of one name at a time.
const WRITERS: u8 = 8;
/// Bytes of each: enough that a server is still receiving one while it looks at another's name.
const BYTES: usize = 1 << 16;

/// A name that no other writer on this computer has, and none twice.
pub(crate) fn name_of_writer() -> String {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    format!("{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed))
}

impl Store {
    /// Puts one name several times at once and once more: one of them may succeed, and its bytes must stay.
    pub(crate) async fn probe(&self, now: DateTime<Utc>) -> Result<(), StoreError> {
        let now = now.timestamp_nanos_opt().unwrap_or_default();
        let path = Path::from(format!("probe/{now}-{}", name_of_writer()));
        let body = |writer: u8| Bytes::from(vec![writer; BYTES]);
        let racing = (0..WRITERS).map(|writer| self.put_new(&path, body(writer)));
        let mut written = join_all(racing).await.into_iter().collect::<Result<Vec<bool>, _>>()?;
        written.push(self.put_new(&path, body(WRITERS)).await?);
        let kept = self.read(&path).await?;
        self.objects.delete(&path).await.map_err(StoreError::object(&path))?;
        let winners: Vec<usize> = (0..written.len()).filter(|writer| written[*writer]).collect();
        // Where the answer to the one that succeeded was lost and it was sent again, none says that it did.
        let is_kept = match winners[..] {
            [] => kept.is_some_and(|kept| kept.first() != Some(&WRITERS)),
            [one] => kept == u8::try_from(one).ok().map(body),
            _ => false,
        };
        match is_kept {
            true => Ok(()),
            false => Err(self.unconditional()),
        }
    }
}
