//! One holder at a time, across processes: a lock file that names who holds it, and locks that are waited for, but not
//! for ever.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Duration;
use thiserror::Error;

/// A lock could not be taken.
#[derive(Debug, Error)]
pub enum LockError {
    /// Another process, or another part of this one, holds it.
    #[error("{} is in use by process {holder}; wait for it to end, or close it", path.display())]
    Held {
        /// The lock file.
        path: PathBuf,
        /// Process number of the holder, `unknown` if it has not written it yet.
        holder: String,
    },
    /// The lock file cannot be made or written.
    #[error("cannot lock {} ({source}); choose a folder that may be written", path.display())]
    Io {
        /// The lock file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
}

/// Longest wait for a lock that palpate itself holds for a moment only.
const PATIENCE: Duration = Duration::from_secs(3);
const BETWEEN_TRIES: Duration = Duration::from_millis(25);

/// Does what may find a lock taken until it does not, or for [`PATIENCE`].
fn soon<T>(mut tried: impl FnMut() -> Option<T>) -> Option<T> {
    let tries = PATIENCE.as_millis() / BETWEEN_TRIES.as_millis();
    for _ in 0..tries {
        if let Some(done) = tried() {
            return Some(done);
        }
        std::thread::sleep(BETWEEN_TRIES);
    }
    tried()
}

/// Another program holds a lock for longer than palpate ever does.
#[derive(Debug, PartialEq, Eq, Error)]
#[error("{} is locked by {} and was not free within {} s; wait for that program to end, or close it", path.display(), named(*holder), PATIENCE.as_secs())]
pub struct Busy {
    /// The file.
    pub path: PathBuf,
    /// Process number of who holds it, where the system tells.
    pub holder: Option<u32>,
}

impl Busy {
    pub(crate) fn of(path: &Path) -> Self {
        Self { path: path.into(), holder: holder_of(path) }
    }
}

pub(crate) fn named(holder: Option<u32>) -> String {
    holder.map_or("another program".into(), |number| format!("process {number}"))
}

/// Why a file was not locked.
#[derive(Debug)]
pub(crate) enum NotLocked {
    /// Somebody else holds it.
    Busy(Busy),
    /// What the system said.
    Io(io::Error),
}

/// Locks an open file, and waits a little for whoever has locked it.
pub(crate) fn lock_soon(file: &File, path: &Path) -> Result<(), NotLocked> {
    let locked = soon(|| match file.try_lock() {
        Err(TryLockError::WouldBlock) => None,
        Err(TryLockError::Error(source)) => Some(Err(NotLocked::Io(source))),
        Ok(()) => Some(Ok(())),
    });
    locked.unwrap_or_else(|| Err(NotLocked::Busy(Busy::of(path))))
}

/// Who holds a lock on a file, whichever of the two kinds there are (proc(5), `/proc/locks`).
pub(crate) fn holder_of(path: &Path) -> Option<u32> {
    let facts = std::fs::metadata(path).ok()?;
    let (major, minor) = (rustix::fs::major(facts.dev()), rustix::fs::minor(facts.dev()));
    let file = format!("{major:02x}:{minor:02x}:{}", facts.ino());
    let locks = std::fs::read_to_string("/proc/locks").ok()?;
    let of_line = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            // `1: FLOCK ADVISORY WRITE 4711 fd:01:1234 0 EOF`; one that waits has an arrow before its kind.
            [_, kind, _, _, process, place, ..] if *kind != "->" && *place == file => {
                process.parse().ok()
            }
            _ => None,
        }
    };
    locks.lines().find_map(of_line)
}

/// Holds a lock file until dropped. The system releases it when the process dies.
#[derive(Debug)]
pub struct HolderLock {
    file: File,
    path: PathBuf,
}

impl Drop for HolderLock {
    fn drop(&mut self) {
        // Closing alone is not enough: a program that this process starts at this moment has the
        // file too until it is loaded, and with it the lock.
        let _ = self.file.unlock();
    }
}

impl HolderLock {
    /// Takes the lock at `path`, making the file and its folder if needed, and writes our process
    /// number in it.
    pub fn acquire(path: &Path) -> Result<Self, LockError> {
        let failed = |source| LockError::Io { path: path.into(), source };
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).map_err(failed)?;
        }
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            // Another holder's number must not be erased before the lock is ours.
            .truncate(false)
            .open(path)
            .map_err(failed)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                return Err(LockError::Held { path: path.into(), holder: read_holder(&file) });
            }
            Err(TryLockError::Error(source)) => return Err(failed(source)),
        }
        let text = format!("{}\n", std::process::id());
        file.set_len(0)
            .and_then(|()| file.seek(SeekFrom::Start(0)))
            .and_then(|_| file.write_all(text.as_bytes()))
            .map_err(failed)?;
        Ok(Self { file, path: path.into() })
    }

    /// As [`acquire`](Self::acquire), for work that is done in a moment: whoever else does such work is waited for,
    /// a few seconds at most.
    pub fn acquire_soon(path: &Path) -> Result<Self, LockError> {
        let taken = soon(|| match Self::acquire(path) {
            Err(LockError::Held { .. }) => None,
            done => Some(done),
        });
        taken.unwrap_or_else(|| Self::acquire(path))
    }

    /// The lock file.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// The process number in a lock file; digits only, whatever else the file may hold.
fn read_holder(file: &File) -> String {
    let mut bytes = Vec::new();
    // A process number has at most 10 digits.
    let has_read = file.take(16).read_to_end(&mut bytes).is_ok();
    let digits: String =
        bytes.iter().map(|&byte| char::from(byte)).take_while(char::is_ascii_digit).collect();
    if has_read && !digits.is_empty() { digits } else { "unknown".into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file that a child of this process got with its start is the same open file.
    #[test]
    fn a_lock_ends_with_its_holder_whoever_else_has_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lock");
        let held = HolderLock::acquire(&path).unwrap();
        let of_a_child = held.file.try_clone().unwrap();
        assert!(matches!(HolderLock::acquire(&path), Err(LockError::Held { .. })));
        drop(held);
        HolderLock::acquire(&path).unwrap();
        drop(of_a_child);
    }
}
