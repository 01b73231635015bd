//! The session folders of a library, with fingerprints that reveal changes.

use crate::folder::{LOCK_FILE, SPARE_FILE, segment_number};
use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::UNIX_EPOCH;
use walkdir::WalkDir;

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct LibrarySession {
    /// Path below the library, separated by `/`; bytes that are not Unicode become replacement characters.
    pub name: String,
    pub path: PathBuf,
    /// Name, size and modification time of every file. Taken before the session is read, so that the next update
    /// notices a change in between.
    pub fingerprint: String,
}

/// Every session below a library, by name, and a sentence for each unreadable folder.
///
/// Links are not followed, so the walk ends and nothing counts twice; hidden folders are skipped.
pub(super) fn walk(library: &Path) -> (Vec<LibrarySession>, Vec<String>) {
    let (mut sessions, mut remarks) = (Vec::new(), Vec::new());
    let mut entries = WalkDir::new(library).into_iter();
    while let Some(entry) = entries.next() {
        let entry = match entry {
            Ok(entry) => entry,
            Err(err) => {
                remarks.push(remark(library, err));
                continue;
            }
        };
        let is_below = entry.depth() > 0;
        if is_below && entry.file_name().to_string_lossy().starts_with('.') {
            if entry.file_type().is_dir() {
                entries.skip_current_dir();
            }
        } else if (entry.file_type().is_dir() || !is_below)
            // The walk itself reports an unreadable folder.
            && let Ok(files) = files_of(entry.path())
            && files.iter().any(is_segment)
        {
            sessions.push(LibrarySession {
                name: name_below(library, entry.path()),
                fingerprint: fingerprint(entry.path(), &files),
                path: entry.into_path(),
            });
            entries.skip_current_dir();
        }
    }
    sessions.sort_by(|a, b| a.name.cmp(&b.name));
    (sessions, remarks)
}

fn remark(library: &Path, err: walkdir::Error) -> String {
    let folder = err.path().unwrap_or(library).display().to_string();
    let words = err.to_string();
    let reason = err.into_io_error().map_or(words, |err| err.to_string());
    format!("{folder} cannot be read ({reason}); its sessions are missing from the catalog")
}

fn name_below(library: &Path, folder: &Path) -> String {
    let below = folder.strip_prefix(library).unwrap_or(folder);
    let parts = below.iter().map(|part| part.to_string_lossy());
    parts.collect::<Vec<_>>().join("/")
}

/// Sorted names of everything in a folder that is not a folder.
fn files_of(folder: &Path) -> io::Result<Vec<OsString>> {
    let mut files = Vec::new();
    for item in fs::read_dir(folder)? {
        let item = item?;
        if !item.file_type()?.is_dir() {
            files.push(item.file_name());
        }
    }
    files.sort();
    Ok(files)
}

fn is_segment(name: &OsString) -> bool {
    name.to_str().and_then(segment_number).is_some()
}

/// Sizes and times of the files of a folder; empty where it cannot be read.
pub(super) fn fingerprint_of(folder: &Path) -> String {
    files_of(folder).map_or_else(|_| String::new(), |files| fingerprint(folder, &files))
}

fn fingerprint(folder: &Path, files: &[OsString]) -> String {
    let mut text = String::new();
    for name in files.iter().filter(|name| *name != LOCK_FILE) {
        text += &stamp(&folder.join(name), &name.to_string_lossy());
        if name == SPARE_FILE
            && let Ok(spare) = fs::read_to_string(folder.join(name))
            && let Ok(files) = files_of(Path::new(&spare))
        {
            for name in &files {
                text += &stamp(&Path::new(&spare).join(name), &name.to_string_lossy());
            }
        }
    }
    text
}

/// A file's name, size, and modification time in ns.
pub(super) fn stamp(path: &Path, name: &str) -> String {
    let Ok(facts) = fs::metadata(path) else {
        return format!("{name} gone;");
    };
    let changed = facts.modified().ok();
    let nanos = changed.and_then(|at| at.duration_since(UNIX_EPOCH).ok());
    let nanos = nanos.map_or(0, |since| since.as_nanos());
    format!("{name} {} {nanos};", facts.len())
}
