//! A library that many rigs share, in an object store: push finished sessions, pull them, search them, look after them.

use crate::compliance::ComplianceCorrectionError;
use crate::progress::Progress;
use crate::report::text::{counted, megabytes};
use chrono::{DateTime, Utc};
use palpate_runner::wall_now;
use palpate_sessions::Catalog;
use palpate_sessions::catalog::{CatalogError, LocalSession};
use palpate_sessions::{FolderError, library_folder};
pub use palpate_store::StoreVerification;
use palpate_store::{
    Compaction, Mirror, Pulled, PushOutcome, PushRequest, Store, StoreError, StoreUrl,
};
use palpate_tables::lake::LakeError;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Folder of the library with a catalog of each store that was used.
pub(crate) const STORES_FOLDER: &str = "stores";

#[derive(Debug, Error)]
pub enum SharedLibraryError {
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error(transparent)]
    Folder(#[from] FolderError),
    #[error(transparent)]
    Catalog(#[from] CatalogError),
    #[error(transparent)]
    Lake(#[from] LakeError),
    #[error(transparent)]
    Compliance(#[from] ComplianceCorrectionError),
    #[error("{} is not a session; give the folder of one", path.display())]
    NotASession { path: PathBuf },
}

impl SharedLibraryError {
    /// Whether what was given is wrong, and not the store, the disk or the network.
    #[must_use]
    pub fn is_wrong_use(&self) -> bool {
        matches!(
            self,
            Self::NotASession { .. }
                | Self::Folder(_)
                | Self::Store(
                    StoreError::Address { .. }
                        | StoreError::NoSession { .. }
                        | StoreError::NoTable { .. }
                        | StoreError::Different { .. }
                        | StoreError::Unconditional { .. }
                )
        )
    }
}

/// A store and this computer's catalog of it.
#[derive(Debug)]
pub struct SharedLibrary {
    store: Store,
    mirror: Mirror,
}

/// The address of a store as it is, unless it is none.
pub fn store_address(text: &str) -> Result<String, StoreError> {
    StoreUrl::parse(text).map(|url| url.as_str().to_owned())
}

pub(crate) fn now() -> DateTime<Utc> {
    DateTime::from(wall_now())
}

impl SharedLibrary {
    /// Opens the store of an address, which is there.
    pub fn open(address: &str) -> Result<Self, SharedLibraryError> {
        Self::with(address, Store::open)
    }

    /// Opens the store of an address, and makes its folder if there is none.
    pub fn create(address: &str) -> Result<Self, SharedLibraryError> {
        Self::with(address, Store::create)
    }

    fn with(
        address: &str,
        open: impl Fn(&StoreUrl) -> Result<Store, StoreError>,
    ) -> Result<Self, SharedLibraryError> {
        let url = StoreUrl::parse(address)?;
        let store = open(&url)?;
        Ok(Self { store, mirror: Mirror::open(&mirror_folder(&url)?)? })
    }

    /// The catalog of a store for a search; where the store is out of reach but was read before, as it was then, and why.
    pub fn last_seen(
        address: &str,
        progress: &dyn Progress,
    ) -> Result<(Mirror, Option<String>), SharedLibraryError> {
        let updated = Self::open(address).and_then(|mut library| {
            library.update(progress)?;
            Ok(library.mirror)
        });
        let reason = match updated {
            Ok(mirror) => return Ok((mirror, None)),
            Err(SharedLibraryError::Store(
                reason @ (StoreError::Object { .. } | StoreError::NoTable { .. }),
            )) => reason,
            Err(err) => return Err(err),
        };
        let folder = mirror_folder(&StoreUrl::parse(address)?)?;
        if folder.is_dir() {
            let mirror = Mirror::open(&folder)?;
            if mirror.is_known()? {
                return Ok((mirror, Some(reason.to_string())));
            }
        }
        Err(reason.into())
    }

    #[must_use]
    pub fn address(&self) -> &str {
        self.store.url().as_str()
    }

    /// The catalog as of the last update; the folder of an entry is the session's identifier.
    #[must_use]
    pub fn catalog(&self) -> &Catalog {
        self.mirror.catalog()
    }

    /// Reads what other rigs pushed since; number of versions of sessions that were read.
    pub fn update(&mut self, progress: &dyn Progress) -> Result<usize, SharedLibraryError> {
        let mut hear = |done, of| progress.report(done, of, "reading the table");
        Ok(self.mirror.update(&self.store, &mut hear)?)
    }

    /// Pushes sessions, or all of this computer's library where none is named. Those that are named are sent again where the store
    /// has lost a part of them.
    pub fn push(
        &mut self,
        sessions: &[PathBuf],
        progress: &dyn Progress,
    ) -> Result<PushOutcome, SharedLibraryError> {
        let mut hear = |done, of| progress.report(done, of, "pushing sessions");
        let (root, local) = match sessions {
            [] => {
                let library = library_folder()?;
                let local = sessions_of(&library)?;
                (library, local)
            }
            sessions => (PathBuf::new(), read_all(sessions)?),
        };
        let are_checked = !sessions.is_empty();
        let request = PushRequest { library: &root, sessions: &local, are_checked };
        Ok(self.store.push(&mut self.mirror, request, now, &mut hear)?)
    }

    /// Pulls sessions, or all where none is named, into folders below `out`.
    pub fn pull(
        &mut self,
        ids: &[String],
        out: &Path,
        progress: &dyn Progress,
    ) -> Result<Vec<Pulled>, SharedLibraryError> {
        self.update(progress)?;
        let all = if ids.is_empty() { self.catalog().mirrored_ids()? } else { ids.to_vec() };
        let mut hear = |done, of| progress.report(done, of, "pulling sessions");
        Ok(self.store.pull(&self.mirror, &all, out, &mut hear)?)
    }

    /// Looks at every session and result, and where `is_deep` at every byte.
    pub fn verify(
        &self,
        is_deep: bool,
        progress: &dyn Progress,
    ) -> Result<StoreVerification, SharedLibraryError> {
        let mut hear = |done, of| progress.report(done, of, "verifying");
        Ok(self.store.verify(is_deep, &mut hear)?)
    }

    pub fn compact(&self) -> Result<Compaction, SharedLibraryError> {
        Ok(self.store.compact(now)?)
    }
}

fn mirror_folder(url: &StoreUrl) -> Result<PathBuf, FolderError> {
    Ok(library_folder()?.join(STORES_FOLDER).join(url.folder_name()))
}

fn sessions_of(library: &Path) -> Result<Vec<LocalSession>, CatalogError> {
    Catalog::with(library, |catalog| {
        catalog.update(&mut |_, _| {})?;
        catalog.local_sessions()
    })
}

fn read_all(sessions: &[PathBuf]) -> Result<Vec<LocalSession>, SharedLibraryError> {
    let read = sessions.iter().map(|path| {
        let path = std::path::absolute(path).unwrap_or_else(|_| path.clone());
        match palpate_sessions::folder::is_session_folder(&path) {
            true => Ok(LocalSession::read(&path)),
            false => Err(SharedLibraryError::NotASession { path }),
        }
    });
    read.collect()
}

/// What a push did, in words.
#[must_use]
pub fn push_words(outcome: &PushOutcome) -> String {
    let pushed = counted(outcome.pushed.len(), "session");
    let mut text = format!("{pushed} pushed, {} sent", megabytes(outcome.bytes));
    if outcome.known > 0 {
        text += &format!("; the store had {} as they are", counted(outcome.known, "session"));
    }
    if !outcome.unfinished.is_empty() {
        let unfinished = counted(outcome.unfinished.len(), "session");
        text +=
            &format!("\n{unfinished} without an end left out: {}", outcome.unfinished.join(", "));
    }
    for one in &outcome.refused {
        text += &format!("\n{}: {}", one.session, one.reason);
    }
    text
}
