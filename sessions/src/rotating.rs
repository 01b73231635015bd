//! Text appended to a file that begins anew when it is full, with a few full ones kept beside it.
//!
//! Nothing is held between two calls, so that several programs can append to one file.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Bytes after which a file is full: some weeks of runs.
const BYTES_MAX: u64 = 1 << 20;
/// Files at most, the one in use included.
const FILES_MAX: usize = 5;

/// The folder of the program's own log in a library.
#[must_use]
pub fn log_folder(library: &Path) -> PathBuf {
    library.join("log")
}

/// Where the file is that so many were begun after.
fn file(folder: &Path, age: usize) -> PathBuf {
    match age {
        0 => folder.join("palpate.log"),
        _ => folder.join(format!("palpate.{age}.log")),
    }
}

/// The files of a log that are there, newest first.
#[must_use]
pub fn log_files(folder: &Path) -> Vec<PathBuf> {
    let files = (0..FILES_MAX).map(|age| file(folder, age));
    files.filter(|path| path.is_file()).collect()
}

/// Appends text to a log, in one write. A new file begins with `head`.
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

/// Gives every file the next age, the oldest none. Whether there is a new file to open: another program may be at it.
fn rotate(folder: &Path, full: &File) -> io::Result<bool> {
    // Held until `full` is closed; a file system without locks rotates all the same.
    if matches!(full.try_lock(), Err(fs::TryLockError::WouldBlock)) {
        return Ok(false);
    }
    // Somebody may have done it before the lock was ours.
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
    fn a_log_is_bounded_in_size_and_number_and_loses_the_oldest_first() {
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
        let mut kept = Vec::new();
        for path in files.iter().rev() {
            let text = fs::read_to_string(path).unwrap();
            assert!(text.len() as u64 <= BYTES_MAX + (1 << 17), "{}", text.len());
            let lines = text.strip_prefix("head\n").unwrap().lines();
            kept.extend(lines.map(|line| line[..8].trim().parse::<usize>().unwrap()));
        }
        // Without a gap, up to the newest.
        assert_eq!(kept, (count - kept.len()..count).collect::<Vec<_>>());
        assert!(kept.len() < count);
    }

    #[test]
    fn a_file_that_another_program_is_rotating_is_appended_to() {
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
    fn a_folder_that_cannot_be_made_is_an_error() {
        let home = tempfile::tempdir().unwrap();
        let taken = home.path().join("log");
        fs::write(&taken, "").unwrap();
        assert!(append(&taken, "", b"x").is_err());
    }
}
