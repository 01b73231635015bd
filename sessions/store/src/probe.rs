//! Whether a store refuses a name that is taken. One that does not would let two rigs overwrite each other.

use crate::error::StoreError;
use crate::location::Store;
use bytes::Bytes;
use object_store::ObjectStoreExt;
use object_store::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

impl Store {
    /// Puts one name twice; the second time must fail.
    pub(crate) async fn probe(&self) -> Result<(), StoreError> {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos());
        let path = Path::from(format!("probe/{now}-{}", std::process::id()));
        let (first, second) = (Bytes::from_static(b"first"), Bytes::from_static(b"second"));
        self.create(&path, first.clone()).await?;
        let is_overwritten = self.create(&path, second).await?;
        let kept = self.read(&path).await?;
        self.objects.delete(&path).await.map_err(StoreError::object(&path))?;
        match !is_overwritten && kept == Some(first) {
            true => Ok(()),
            false => Err(StoreError::Unconditional { url: self.url.as_str().to_owned() }),
        }
    }
}
