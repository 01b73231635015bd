//! What stands beside a log: edits, analyses, the file that was imported.

use crate::analyses::Analyses;
use crate::edits::Edits;
use crate::imported::{Imported, ORIGINAL_FOLDER};
use crate::manifest::Manifest;
use std::path::Path;

/// What of it is not as it was written, one sentence each.
pub(super) fn wrong_beside(path: &Path, manifest: &Manifest) -> Vec<String> {
    let id = &manifest.session_id;
    let edits = Edits::read(path, id).err().map(|err| err.to_string());
    let analyses = Analyses::read(path, id).err().map(|err| err.to_string());
    // A file stands for the folder it is in.
    let folder = if path.is_file() {
        path.parent().unwrap_or(path)
    } else {
        path
    };
    let original = manifest
        .imported
        .as_ref()
        .and_then(|from| wrong_original(folder, from));
    [edits, analyses, original].into_iter().flatten().collect()
}

fn wrong_original(folder: &Path, from: &Imported) -> Option<String> {
    let path = folder.join(ORIGINAL_FOLDER).join(&from.file);
    let shown = path.display();
    match std::fs::read(&path) {
        Err(err) => Some(format!(
            "the imported file {shown} cannot be read ({err}); put it back, or go on without it: the samples are in the log"
        )),
        Ok(bytes) if format!("{:08x}", crc32fast::hash(&bytes)) != from.checksum => Some(format!(
            "the imported file {shown} is not the one that was imported; put that back, or go on without it: the samples are in the log"
        )),
        Ok(_) => None,
    }
}
