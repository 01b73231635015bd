//! The program's own log: a text file that rotates when it is full.
//!
//! No file stays open between calls, so several programs can append to the same log.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Size of a full file in bytes: some weeks of runs.
const BYTES_MAX: u64 = 1 << 20;
/// Largest number of files, including the current one.
const FILES_MAX: usize = 5;

#[must_use]
pub fn log_folder(library: &Path) -> PathBuf {
    library.join("log")
}

/// The current file has age 0.
fn file(folder: &Path, age: usize) -> PathBuf {
    match age {
        0 => folder.join("palpate.log"),
        _ => folder.join(format!("palpate.{age}.log")),
    }
}

/// The existing files of a log, newest first.
#[must_use]
pub fn log_files(folder: &Path) -> Vec<PathBuf> {
    let files = (0..FILES_MAX).map(|age| file(folder, age));
    files.filter(|path| path.is_file()).collect()
}

/// Appends text in one write. A new file begins with `head`.
pub fn append(folder: &Path, head: &str, text: &[u8]) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    let newest = file(folder, 0);
    let open = || OpenOptions::new().append(true).create(true).open(&newest);
    let mut log = open()?;
    if is_full(&log)? && rotate(folder, &log)? {
        log = open()?;
    }
    if log.metadata()?.len() == 0 {
        log.write_all(&[head.as_bytes(), text].concat())
    } else {
        log.write_all(text)
    }
}

fn is_full(log: &File) -> io::Result<bool> {
    Ok(log.metadata()?.len() >= BYTES_MAX)
}

/// Renames every file to the next age; the oldest is overwritten. Returns false if another program is rotating.
fn rotate(folder: &Path, full: &File) -> io::Result<bool> {
    // Locked until `full` is closed; a file system without locks rotates too.
    if matches!(full.try_lock(), Err(fs::TryLockError::WouldBlock)) {
        return Ok(false);
    }
    // Another program may have rotated before this one got the lock.
    if fs::metadata(file(folder, 0))?.len() < BYTES_MAX {
        return Ok(true);
    }
    for age in (0..FILES_MAX - 1).rev() {
        match fs::rename(file(folder, age), file(folder, age + 1)) {
            Err(err) if err.kind() != io::ErrorKind::NotFound => return Err(err),
            _ => {}
        }
    }
    Ok(true)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn log_is_bounded_and_drops_the_oldest_file_first() {
        let home = tempfile::tempdir().unwrap();
        let folder = log_folder(home.path());
        assert!(log_files(&folder).is_empty());
        let line = |number: usize| format!("{number:>8} {}\n", "x".repeat(1 << 16));
        let count = 8 * (BYTES_MAX as usize >> 16);
        for number in 0..count {
            append(&folder, "head\n", line(number).as_bytes()).unwrap();
        }
        let files = log_files(&folder);
        assert_eq!(files.len(), FILES_MAX);
        assert_eq!(fs::read_dir(&folder).unwrap().count(), FILES_MAX);
        let mut numbers = Vec::new();
        for path in files.iter().rev() {
            let text = fs::read_to_string(path).unwrap();
            assert!(text.len() as u64 <= BYTES_MAX + (1 << 17), "{}", text.len());
            let lines = text.strip_prefix("head\n").unwrap().lines();
            numbers.extend(lines.map(|line| line[..8].trim().parse::<usize>().unwrap()));
        }
        // No gap up to the newest.
        assert_eq!(numbers, (count - numbers.len()..count).collect::<Vec<_>>());
        assert!(numbers.len() < count);
    }

    #[test]
    fn file_that_another_program_rotates_is_appended_to() {
        let home = tempfile::tempdir().unwrap();
        let full = vec![b'x'; BYTES_MAX as usize];
        append(home.path(), "", &full).unwrap();
        let other = File::open(file(home.path(), 0)).unwrap();
        other.lock().unwrap();
        append(home.path(), "", b"more\n").unwrap();
        assert_eq!(log_files(home.path()).len(), 1);
        drop(other);
        append(home.path(), "", b"last\n").unwrap();
        assert_eq!(log_files(home.path()).len(), 2);
        assert_eq!(fs::read(file(home.path(), 0)).unwrap(), b"last\n");
    }

    #[test]
    fn unusable_folder_is_an_error() {
        let home = tempfile::tempdir().unwrap();
        let taken = home.path().join("log");
        fs::write(&taken, "").unwrap();
        assert!(append(&taken, "", b"x").is_err());
    }
}
