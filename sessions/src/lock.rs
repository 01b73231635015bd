//! Locks across processes: lock files that name their holder, and waits with a limit.

use crate::chain::with_ending;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;
use thiserror::Error;

#[derive(Debug, Error)]
pub enum LockError {
    #[error("{} is in use by process {holder}; wait for that process to end, or close it", path.display())]
    Held {
        path: PathBuf,
        /// Process number of the holder, `unknown` if it has not written it yet.
        holder: String,
    },
    #[error("cannot lock {} ({source}); choose a writable folder", path.display())]
    Io { path: PathBuf, source: std::io::Error },
}

/// Longest wait for a lock that palpate holds only briefly.
const PATIENCE: Duration = Duration::from_secs(3);
const BETWEEN_TRIES: Duration = Duration::from_millis(25);

/// Repeats an attempt until it returns a value, at most for [`PATIENCE`].
fn retry<T>(mut attempt: impl FnMut() -> Option<T>) -> Option<T> {
    let tries = PATIENCE.as_millis() / BETWEEN_TRIES.as_millis();
    for _ in 0..tries {
        if let Some(done) = attempt() {
            return Some(done);
        }
        std::thread::sleep(BETWEEN_TRIES);
    }
    attempt()
}

/// Another program held a lock for longer than palpate ever does.
#[derive(Debug, PartialEq, Eq, Error)]
#[error("{} has been locked by {} for more than {} s; wait for that program to end, or close it", path.display(), holder_name(*holder), PATIENCE.as_secs())]
pub struct LockTimeout {
    pub path: PathBuf,
    /// Process number of the holder, if the system shows it.
    pub holder: Option<u32>,
}

impl LockTimeout {
    pub(crate) fn of(path: &Path) -> Self {
        Self { path: path.into(), holder: holder_of(path) }
    }
}

pub(crate) fn holder_name(holder: Option<u32>) -> String {
    holder.map_or("another program".into(), |number| format!("process {number}"))
}

#[derive(Debug)]
pub(crate) enum LockFailure {
    LockTimeout(LockTimeout),
    Io(io::Error),
}

/// Locks an open file; waits up to [`PATIENCE`] for another holder.
pub(crate) fn lock_waiting(file: &File, path: &Path) -> Result<(), LockFailure> {
    let locked = retry(|| match file.try_lock() {
        Err(TryLockError::WouldBlock) => None,
        Err(TryLockError::Error(source)) => Some(Err(LockFailure::Io(source))),
        Ok(()) => Some(Ok(())),
    });
    locked.unwrap_or_else(|| Err(LockFailure::LockTimeout(LockTimeout::of(path))))
}

/// Locks a file that others read meanwhile, until it and what is returned are closed. Windows lets no one else read a locked
/// file, so there a file beside it is locked in its place.
pub(crate) fn lock_data(file: &File, path: &Path) -> Result<Option<File>, LockFailure> {
    if !cfg!(windows) {
        return lock_waiting(file, path).map(|()| None);
    }
    let mut options = OpenOptions::new();
    let options = options.write(true).create(true).truncate(false);
    let beside = options.open(with_ending(path, ".lock")).map_err(LockFailure::Io)?;
    lock_waiting(&beside, path).map(|()| Some(beside))
}

/// Process number of a lock's holder; only Linux tells it.
#[cfg(not(target_os = "linux"))]
pub(crate) fn holder_of(_path: &Path) -> Option<u32> {
    None
}

/// Process number of a lock's holder, for flock and POSIX locks (proc(5), `/proc/locks`).
#[cfg(target_os = "linux")]
pub(crate) fn holder_of(path: &Path) -> Option<u32> {
    use std::os::unix::fs::MetadataExt;
    let facts = std::fs::metadata(path).ok()?;
    let (major, minor) = (rustix::fs::major(facts.dev()), rustix::fs::minor(facts.dev()));
    let file = format!("{major:02x}:{minor:02x}:{}", facts.ino());
    let locks = std::fs::read_to_string("/proc/locks").ok()?;
    let of_line = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            // `1: FLOCK ADVISORY WRITE 4711 fd:01:1234 0 EOF`; a waiting process has an arrow before its kind.
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
        // Closing is not enough: a child process that is just starting shares the file, and with it the lock.
        let _ = self.file.unlock();
    }
}

impl HolderLock {
    /// Takes the lock at `path` and writes the own process number into the file; creates file and folder if needed.
    pub fn acquire(path: &Path) -> Result<Self, LockError> {
        let failed = |source| LockError::Io { path: path.into(), source };
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).map_err(failed)?;
        }
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            // The number of another holder must stay until the lock is taken.
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

    /// Like [`acquire`](Self::acquire), for short work: waits up to [`PATIENCE`] for another holder.
    pub fn acquire_waiting(path: &Path) -> Result<Self, LockError> {
        let taken = retry(|| match Self::acquire(path) {
            Err(LockError::Held { .. }) => None,
            done => Some(done),
        });
        taken.unwrap_or_else(|| Self::acquire(path))
    }

    pub fn path(&self) -> &Path {
        &self.path
    }
}

/// The process number in a lock file.
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

    /// A child process inherits the open file.
    #[test]
    fn dropped_lock_is_free_although_a_child_has_the_file_open() {
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
