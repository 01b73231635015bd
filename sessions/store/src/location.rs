//! Where a store is, and how it is reached.

use crate::error::StoreError;
use object_store::aws::{AmazonS3Builder, S3ConditionalPut};
use object_store::local::LocalFileSystem;
use object_store::path::Path;
use object_store::prefix::PrefixStore;
use object_store::{ObjectStore, ObjectStoreExt, PutMode, PutOptions};
use palpate_sessions::text::sha256;
use std::sync::Arc;
use tokio::runtime::{Builder, Runtime};
use url::Url;

/// Requests under way at a time: enough to fill a link whose answers take some milliseconds.
pub(crate) const REQUESTS: usize = 16;

/// The address of a store, `s3://BUCKET/FOLDER` or `file:///FOLDER`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoreUrl(Url);

/// Whether a text is meant as the address of a store and not as a folder.
#[must_use]
pub fn is_store_url(text: &str) -> bool {
    text.contains("://")
}

impl StoreUrl {
    pub fn parse(text: &str) -> Result<Self, StoreError> {
        let refused = || StoreError::Address { url: text.to_owned() };
        let url = Url::parse(text.trim_end_matches('/')).map_err(|_| refused())?;
        let is_known = match url.scheme() {
            "s3" => url.host_str().is_some_and(|bucket| !bucket.is_empty()),
            "file" => url.to_file_path().is_ok_and(|folder| folder.parent().is_some()),
            _ => false,
        };
        is_known.then_some(Self(url)).ok_or_else(refused)
    }

    #[must_use]
    pub fn as_str(&self) -> &str {
        self.0.as_str()
    }

    /// A name for a folder, another for every address.
    #[must_use]
    pub fn folder_name(&self) -> String {
        sha256(self.as_str().as_bytes())[..16].to_owned()
    }
}

/// An opened store. Its calls wait for their answers; requests run on the calling thread, several at a time.
#[derive(Debug)]
pub struct Store {
    pub(crate) url: StoreUrl,
    pub(crate) objects: Arc<dyn ObjectStore>,
    runtime: Runtime,
}

impl Store {
    /// Opens a store. A folder that is not there has no table.
    pub fn open(url: &StoreUrl) -> Result<Self, StoreError> {
        Self::open_or_create(url, false)
    }

    /// Opens a store, whose folder is made if there is none.
    pub fn create(url: &StoreUrl) -> Result<Self, StoreError> {
        Self::open_or_create(url, true)
    }

    /// Credentials, region and endpoint of S3 come from the environment variables of AWS's own clients.
    fn open_or_create(url: &StoreUrl, is_made: bool) -> Result<Self, StoreError> {
        let refused = || StoreError::Address { url: url.as_str().to_owned() };
        let failed = |source| StoreError::Open { url: url.as_str().to_owned(), source };
        let objects: Arc<dyn ObjectStore> = match url.0.scheme() {
            "file" => {
                let folder = url.0.to_file_path().map_err(|()| refused())?;
                if is_made {
                    std::fs::create_dir_all(&folder).map_err(StoreError::file(&folder))?;
                } else if !folder.is_dir() {
                    return Err(StoreError::NoTable { url: url.as_str().to_owned() });
                }
                let local = LocalFileSystem::new_with_prefix(&folder).map_err(failed)?;
                Arc::new(local.with_fsync(true))
            }
            _ => {
                // A second store finds it chosen already.
                let _ = rustls::crypto::ring::default_provider().install_default();
                let bucket = AmazonS3Builder::from_env()
                    .with_url(url.as_str())
                    .with_conditional_put(S3ConditionalPut::ETagMatch)
                    .build()
                    .map_err(failed)?;
                let folder = Path::from_url_path(url.0.path()).map_err(|_| refused())?;
                Arc::new(PrefixStore::new(bucket, folder))
            }
        };
        Self::of(url.clone(), objects)
    }

    /// A store of these objects.
    pub(crate) fn of(url: StoreUrl, objects: Arc<dyn ObjectStore>) -> Result<Self, StoreError> {
        let runtime = Builder::new_current_thread().enable_all().build();
        Ok(Self { url, objects, runtime: runtime.map_err(StoreError::Runtime)? })
    }

    pub(crate) fn no_table(&self) -> StoreError {
        StoreError::NoTable { url: self.url.as_str().to_owned() }
    }

    pub(crate) fn unconditional(&self) -> StoreError {
        StoreError::Unconditional { url: self.url.as_str().to_owned() }
    }

    #[must_use]
    pub fn url(&self) -> &StoreUrl {
        &self.url
    }

    pub(crate) fn wait<T>(&self, work: impl Future<Output = T>) -> T {
        self.runtime.block_on(work)
    }

    /// Writes an object that must not exist yet; `false` where it does.
    pub(crate) async fn put_new(
        &self,
        path: &Path,
        bytes: bytes::Bytes,
    ) -> Result<bool, StoreError> {
        let options = PutOptions { mode: PutMode::Create, ..PutOptions::default() };
        match self.objects.put_opts(path, bytes.into(), options).await {
            Ok(_) => Ok(true),
            Err(
                object_store::Error::AlreadyExists { .. }
                | object_store::Error::Precondition { .. },
            ) => Ok(false),
            Err(source) => Err(StoreError::object(path)(source)),
        }
    }

    /// The bytes of an object; none where there is none.
    pub(crate) async fn read(&self, path: &Path) -> Result<Option<bytes::Bytes>, StoreError> {
        let failed = StoreError::object(path);
        match self.objects.get(path).await {
            Ok(found) => found.bytes().await.map(Some).map_err(failed),
            Err(object_store::Error::NotFound { .. }) => Ok(None),
            Err(source) => Err(failed(source)),
        }
    }

    /// The size of an object; none where there is none.
    pub(crate) async fn size(&self, path: &Path) -> Result<Option<u64>, StoreError> {
        match self.objects.head(path).await {
            Ok(found) => Ok(Some(found.size)),
            Err(object_store::Error::NotFound { .. }) => Ok(None),
            Err(source) => Err(StoreError::object(path)(source)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_buckets_and_folders_are_stores() {
        for good in ["s3://lab/rigs", "s3://lab", "s3://lab/", "file:///srv/palpate"] {
            assert!(StoreUrl::parse(good).is_ok(), "{good}");
        }
        for bad in
            ["lab", "/srv/palpate", "s3://", "file:///", "gs://lab/rigs", "http://lab", "s3:lab"]
        {
            let refused = StoreUrl::parse(bad).unwrap_err().to_string();
            assert!(refused.contains("s3://BUCKET/FOLDER"), "{bad}: {refused}");
        }
        assert_eq!(StoreUrl::parse("s3://lab/rigs/").unwrap().as_str(), "s3://lab/rigs");
        assert!(is_store_url("s3://lab") && !is_store_url("/srv/palpate"));
    }
}
