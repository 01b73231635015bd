//! Atomic file writes: a file appears complete under its name, or not at all.
//!
//! A [`Draft`] is written under a hidden name in the target folder and stays locked meanwhile. The lock distinguishes
//! a draft in use from one that a killed process left behind.

use same_file::Handle;
use std::fs::{File, TryLockError};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use tempfile::{Builder, NamedTempFile};
use walkdir::WalkDir;

/// Form of the hidden names.
const ENDING: &str = ".palpate.tmp";
/// Letters of the file's name in the draft's name: file systems allow 255 bytes, and a letter has up to four.
const NAME_LETTERS_MAX: usize = 50;

/// What to do with a file that already has the name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExistingFile {
    /// The new file replaces it.
    Replace,
    /// It stays; the new file is refused with [`io::ErrorKind::AlreadyExists`].
    Keep,
}

/// A file being written. Dropping it without [`persist`](Self::persist) deletes it.
#[derive(Debug)]
pub struct Draft {
    file: NamedTempFile,
    path: PathBuf,
}

impl Draft {
    /// Begins the file that [`persist`](Self::persist) moves to `path`.
    pub fn new(path: &Path) -> io::Result<Self> {
        let name = path.file_name().ok_or(io::ErrorKind::InvalidInput)?;
        let name: String = name.to_string_lossy().chars().take(NAME_LETTERS_MAX).collect();
        let prefix = format!(".{name}.");
        loop {
            let mut builder = Builder::new();
            builder.prefix(&prefix).suffix(ENDING);
            // Like any new file, subject to the user's umask.
            #[cfg(unix)]
            builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
            let folder = folder_of(path);
            let file = builder.tempfile_in(folder).map_err(|err| match err.kind() {
                io::ErrorKind::NotFound => {
                    let words = format!("there is no folder {}", folder.display());
                    io::Error::new(io::ErrorKind::NotFound, words)
                }
                _ => without_hidden_name(err),
            })?;
            // Between creation and lock, a sweep may have deleted it as abandoned.
            match file.as_file().try_lock() {
                Err(TryLockError::WouldBlock) => continue,
                // On a file system without locks nothing is swept.
                Err(TryLockError::Error(_)) => {}
                Ok(()) if !is_at(file.as_file(), file.path()) => continue,
                Ok(()) => {}
            }
            let path = path.to_owned();
            return Ok(Self { file, path });
        }
    }

    pub fn writer(&self) -> BufWriter<&File> {
        BufWriter::new(self.file.as_file())
    }

    /// Another handle to the file, which stays open when the draft is gone. The hidden path cannot be opened again on
    /// Windows, because the draft is locked.
    pub fn reader(&self) -> io::Result<File> {
        self.file.as_file().try_clone()
    }

    /// Gives the file its name. Once this returns, name and content survive a power cut.
    pub fn persist(self, existing: ExistingFile) -> io::Result<()> {
        self.file.as_file().sync_all()?;
        let named = match existing {
            ExistingFile::Replace => self.file.persist(&self.path),
            ExistingFile::Keep => self.file.persist_noclobber(&self.path),
        };
        named.map_err(|err| err.error)?;
        // A folder without read permission can be written but not synchronised, and Windows has nothing to synchronise.
        match File::open(folder_of(&self.path)) {
            Ok(folder) => folder.sync_all(),
            Err(_) => Ok(()),
        }
    }
}

pub fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    write(path, bytes, ExistingFile::Replace)
}

/// Fails if `path` exists.
pub fn create(path: &Path, bytes: &[u8]) -> io::Result<()> {
    write(path, bytes, ExistingFile::Keep)
}

fn write(path: &Path, bytes: &[u8], existing: ExistingFile) -> io::Result<()> {
    let draft = Draft::new(path)?;
    draft.file.as_file().write_all(bytes)?;
    draft.persist(existing)
}

/// Abandoned drafts in a folder and its subfolders down to `depth`.
#[must_use]
pub fn find_leftovers(folder: &Path, depth: usize) -> Vec<PathBuf> {
    let found = unowned(folder, depth);
    found.into_iter().map(|(path, _lock)| path).collect()
}

/// Whether a file of this name is a draft.
#[must_use]
pub fn is_draft_name(name: &str) -> bool {
    name.starts_with('.') && name.ends_with(ENDING)
}

/// Deletes abandoned drafts as far as permissions allow; returns the deleted paths.
pub fn remove_leftovers(folder: &Path, depth: usize) -> Vec<PathBuf> {
    let mut found = unowned(folder, depth);
    // Held locks make a process that has just created this draft notice the deletion.
    found.retain(|(path, _lock)| std::fs::remove_file(path).is_ok());
    found.into_iter().map(|(path, _lock)| path).collect()
}

fn unowned(folder: &Path, depth: usize) -> Vec<(PathBuf, File)> {
    let here = Path::new(".");
    let folder = if folder == Path::new("") { here } else { folder };
    let entries = WalkDir::new(folder).max_depth(depth).sort_by_file_name();
    let files = entries.into_iter().flatten().filter(|entry| {
        entry.file_type().is_file() && entry.file_name().to_str().is_some_and(is_draft_name)
    });
    let locked = files.filter_map(|entry| {
        let file = File::open(entry.path()).ok()?;
        file.try_lock().ok()?;
        Some((entry.into_path(), file))
    });
    locked.collect()
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Whether `path` still names the open file.
fn is_at(file: &File, path: &Path) -> bool {
    let open = file.try_clone().and_then(Handle::from_file);
    open.is_ok_and(|open| Handle::from_path(path).is_ok_and(|there| there == open))
}

/// The system's error without the hidden name, which means nothing to a user.
fn without_hidden_name(err: io::Error) -> io::Error {
    match err.kind() {
        io::ErrorKind::Other => err,
        kind => kind.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    fn names(folder: &Path) -> Vec<String> {
        let names = fs::read_dir(folder).unwrap();
        let mut names: Vec<String> =
            names.map(|one| one.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_write_leaves_the_old_or_the_new_file_and_no_draft() {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path().join("table.csv");
        create(&at, b"one").unwrap();
        let refused = create(&at, b"two").unwrap_err();
        assert_eq!(refused.kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(fs::read(&at).unwrap(), b"one");
        let draft = Draft::new(&at).unwrap();
        draft.writer().write_all(b"half").unwrap();
        drop(draft);
        replace(&at, b"three").unwrap();
        assert_eq!(fs::read(&at).unwrap(), b"three");
        assert_eq!(names(folder.path()), ["table.csv"]);
        // Permissions are those of any file of this user.
        let plain = folder.path().join("plain");
        fs::write(&plain, "").unwrap();
        use std::os::unix::fs::PermissionsExt;
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&at), mode(&plain));
        let long = "ä".repeat(120);
        create(&folder.path().join(long), b"").unwrap();
    }

    #[test]
    fn only_abandoned_drafts_are_swept() {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        let written = Draft::new(&at.join("now.csv")).unwrap();
        let (_, abandoned) = Draft::new(&at.join("old.csv")).unwrap().file.keep().unwrap();
        fs::write(at.join(".another.tmp"), "another program's").unwrap();
        fs::create_dir(at.join("deep")).unwrap();
        let deep = Draft::new(&at.join("deep/old.csv")).unwrap().file.keep();
        let (_, deep) = deep.unwrap();
        assert_eq!(find_leftovers(at, 1), std::slice::from_ref(&abandoned));
        assert_eq!(remove_leftovers(at, 1), [abandoned]);
        assert_eq!(remove_leftovers(at, usize::MAX), [deep]);
        written.persist(ExistingFile::Keep).unwrap();
        assert_eq!(names(at), [".another.tmp", "deep", "now.csv"]);
    }
}
