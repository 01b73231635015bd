//! Pulling sessions: each appears whole under its name, or not at all.

use crate::error::StoreError;
use crate::files::{FileList, is_below, object_path};
use crate::location::Store;
use crate::mirror::{Hear, Mirror};
use serde::Serialize;
use std::fs;
use std::path::{Path, PathBuf};

/// What became of a session that was to be pulled.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Pulled {
    pub session: String,
    pub folder: PathBuf,
    /// Whether the folder was there with the same content.
    pub was_there: bool,
    /// Bytes of all files.
    pub bytes: u64,
}

impl Store {
    /// Writes sessions into folders named by them below `out`. A folder that is there stays as it is: it must have all that
    /// the store has, and may have more lines.
    pub fn pull(
        &self,
        mirror: &Mirror,
        ids: &[String],
        out: &Path,
        hear: Hear<'_>,
    ) -> Result<Vec<Pulled>, StoreError> {
        let mut pulled = Vec::with_capacity(ids.len());
        for (done, id) in ids.iter().enumerate() {
            if hear(done, ids.len()).is_break() {
                return Err(StoreError::Ended);
            }
            let found = mirror.catalog.mirrored_content(id)?;
            let (_, content) = found.ok_or_else(|| StoreError::NoSession { id: id.clone() })?;
            let list = self.wait(self.file_list(&content))?;
            // The identifier names a folder, and anybody may have written the table.
            if list.session_id != *id || !is_below(id) || id.contains('/') {
                let reason = format!("it is of session {:?}, not of {id:?}", list.session_id);
                return Err(StoreError::bad(&object_path(&content), reason));
            }
            pulled.push(self.pull_one(id, &list, out)?);
        }
        let _ = hear(ids.len(), ids.len());
        Ok(pulled)
    }

    fn pull_one(&self, id: &str, list: &FileList, out: &Path) -> Result<Pulled, StoreError> {
        let folder = out.join(id);
        let bytes = list.bytes();
        let named = |folder, was_there| Pulled { session: id.to_owned(), folder, was_there, bytes };
        if folder.exists() {
            return match list.first_not_continued(&folder)? {
                None => Ok(named(folder, true)),
                Some(file) => Err(StoreError::Different { folder, file }),
            };
        }
        // Hidden until it is whole, and removed where this process dies, by the next that pulls it.
        let draft = out.join(format!(".{id}.pulling"));
        let failed = StoreError::file(&draft);
        if draft.exists() {
            fs::remove_dir_all(&draft).map_err(&failed)?;
        }
        fs::create_dir_all(&draft).map_err(&failed)?;
        self.wait(self.fetch_files(list, &draft))?;
        fs::rename(&draft, &folder).map_err(StoreError::file(&folder))?;
        Ok(named(folder, false))
    }
}
