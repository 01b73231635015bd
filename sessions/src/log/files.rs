//! The files of a session's log.

use super::reader::ReadError;
use crate::folder::{LOG_FILE, SPARE_FILE, segment_file, segment_number};
use std::collections::BTreeMap;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Limit of missing segments, so that the name of one file cannot cause endless work.
const MISSING_MAX: usize = 1000;

/// The files of a session's log in order, those in its spare folder among them. One that is missing is listed too.
pub fn find_files(path: &Path) -> Result<Vec<PathBuf>, ReadError> {
    if !path.exists() {
        return Err(ReadError::Missing { path: path.into() });
    }
    if !path.is_dir() {
        return Ok(vec![path.into()]);
    }
    let failed = |source| ReadError::Io { path: path.into(), source };
    let mut found = BTreeMap::new();
    let mut add = |folder: &Path| -> io::Result<()> {
        for item in std::fs::read_dir(folder)? {
            let name = item?.file_name();
            if let Some(number) = name.to_str().and_then(segment_number) {
                found.entry(number).or_insert(folder.join(name));
            }
        }
        Ok(())
    };
    add(path).map_err(failed)?;
    // Without the folder its disk is missing too: see `absent_spare`.
    if let Some(spare) = spare_of(path).filter(|spare| spare.is_dir()) {
        add(&spare).map_err(failed)?;
    }
    // Missing segments are listed, so that the reader reports them.
    let last = found.last_key_value().map_or(0, |(number, _)| *number);
    let many = last as usize > found.len() + MISSING_MAX;
    let last = if many { found.len() as u32 } else { last };
    Ok((0..=last)
        .map(|number| {
            let own = || path.join(segment_file(number));
            found.remove(&number).unwrap_or_else(own)
        })
        .collect())
}

/// The session's spare folder.
fn spare_of(path: &Path) -> Option<PathBuf> {
    let pointer = path.join(SPARE_FILE);
    // A pipe or device in place of the file must not block or flood the reader.
    if !std::fs::symlink_metadata(&pointer).ok()?.is_file() {
        return None;
    }
    let mut spare = String::new();
    let mut file = std::fs::File::open(pointer).ok()?.take(SPARE_BYTES_MAX);
    file.read_to_string(&mut spare).ok()?;
    (!spare.is_empty()).then(|| spare.into())
}

/// The longest path that Linux takes (`PATH_MAX`).
const SPARE_BYTES_MAX: u64 = 4096;

/// The session's spare folder if it is missing, as on a disconnected disk. The writer creates it before the log.
pub(crate) fn absent_spare(path: &Path) -> Option<PathBuf> {
    spare_of(path).filter(|spare| !spare.is_dir())
}

/// The remark about a missing spare folder.
pub(crate) fn describe_absent(spare: &Path) -> String {
    let spare = spare.display();
    format!(
        "a part of the session may be in the folder {spare}, which is missing; connect its disk"
    )
}

/// Refuses a folder without a log.
pub(crate) fn check_files(path: &Path, files: &[PathBuf]) -> Result<(), ReadError> {
    if files[0].is_file() || (files.len() > 1 && path.is_dir()) {
        return Ok(());
    }
    Err(ReadError::NotASession { path: path.into(), reason: format!("it has no {LOG_FILE}") })
}
