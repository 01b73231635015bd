//! One holder at a time, across processes: a lock file that names who holds it.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;
use thiserror::Error;

/// A lock could not be taken.
#[derive(Debug, Error)]
#[non_exhaustive]
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

/// Tries to take a lock that is soon free, and the time between them: 2 s in all.
const TRIES: u32 = 80;
const BETWEEN_TRIES: Duration = Duration::from_millis(25);

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
        let failed = |source| LockError::Io {
            path: path.into(),
            source,
        };
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
                return Err(LockError::Held {
                    path: path.into(),
                    holder: read_holder(&file),
                });
            }
            Err(TryLockError::Error(source)) => return Err(failed(source)),
        }
        let text = format!("{}\n", std::process::id());
        file.set_len(0)
            .and_then(|()| file.seek(SeekFrom::Start(0)))
            .and_then(|_| file.write_all(text.as_bytes()))
            .map_err(failed)?;
        Ok(Self {
            file,
            path: path.into(),
        })
    }

    /// As [`acquire`](Self::acquire), for work that is done in a moment: whoever else does such work is waited for,
    /// 2 s at most.
    pub fn acquire_soon(path: &Path) -> Result<Self, LockError> {
        for _ in 0..TRIES {
            match Self::acquire(path) {
                Err(LockError::Held { .. }) => std::thread::sleep(BETWEEN_TRIES),
                done => return done,
            }
        }
        Self::acquire(path)
    }

    /// The lock file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// The process number in a lock file; digits only, whatever else the file may hold.
fn read_holder(file: &File) -> String {
    let mut bytes = Vec::new();
    // A process number has at most 10 digits.
    let has_read = file.take(16).read_to_end(&mut bytes).is_ok();
    let digits: String = bytes
        .iter()
        .map(|&byte| char::from(byte))
        .take_while(char::is_ascii_digit)
        .collect();
    if has_read && !digits.is_empty() {
        digits
    } else {
        "unknown".into()
    }
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
        assert!(matches!(
            HolderLock::acquire(&path),
            Err(LockError::Held { .. })
        ));
        drop(held);
        HolderLock::acquire(&path).unwrap();
        drop(of_a_child);
    }
}
