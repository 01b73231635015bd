//! The library, session folders, and free space on the disk.

pub use crate::lock::{HolderLock, LockError, LockTimeout};
use chrono::{DateTime, Utc};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// The log in a session folder, or its first segment.
pub const LOG_FILE: &str = "000.mcap";
/// File in a session folder that names the spare folder, with segments that the session's disk could not take.
pub const SPARE_FILE: &str = "spare";
pub(crate) const PROGRAMMES_FOLDER: &str = "programmes";
pub const LOCK_FILE: &str = "lock";

#[derive(Debug, Error)]
pub enum FolderError {
    #[error("{} is not empty; choose a new folder", path.display())]
    NotEmpty { path: PathBuf },
    #[error("{} is a file, not a folder; choose a new folder", path.display())]
    NotAFolder { path: PathBuf },
    #[error("cannot make the session folder {} ({source}); choose a writable folder", path.display())]
    Io { path: PathBuf, source: io::Error },
    #[error(transparent)]
    Lock(#[from] LockError),
    #[error(
        "the disk that holds {} has {} of free space, but the session may need {}, and twice that must be free; free some space or choose another disk",
        path.display(), megabytes(*free_bytes), megabytes(*needed_bytes)
    )]
    NoSpace { path: PathBuf, free_bytes: u64, needed_bytes: u64 },
    /// Neither `PALPATE_HOME` nor a home folder is set.
    #[error("the folder for sessions is unknown; set PALPATE_HOME to a folder")]
    NoLibrary,
}

fn megabytes(bytes: u64) -> String {
    format!("{:.1} MB", bytes as f64 * 1e-6)
}

/// An empty, locked folder for a new session.
#[derive(Debug)]
pub struct SessionFolder {
    path: PathBuf,
    _lock: HolderLock,
}

impl SessionFolder {
    /// Makes and locks the folder and makes its parents. Refuses a folder that is not empty.
    pub fn create(path: &Path) -> Result<Self, FolderError> {
        let failed = |source| FolderError::Io { path: path.into(), source };
        if path.exists() && !path.is_dir() {
            return Err(FolderError::NotAFolder { path: path.into() });
        }
        create_folder(path).map_err(failed)?;
        let lock_path = path.join(LOCK_FILE);
        let had_lock = lock_path.exists();
        if !had_lock && holds_more_than_lock(path).map_err(failed)? {
            return Err(FolderError::NotEmpty { path: path.into() });
        }
        // A held lock is reported before a non-empty folder, because the holder is the better explanation.
        let lock = HolderLock::acquire(&lock_path)?;
        // Checked again under the lock, because another process may have recorded in between.
        if holds_more_than_lock(path).map_err(failed)? {
            return Err(FolderError::NotEmpty { path: path.into() });
        }
        Ok(Self { path: path.into(), _lock: lock })
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    pub fn log_path(&self) -> PathBuf {
        self.path.join(LOG_FILE)
    }
}

/// Makes a folder and its parents. Once this returns, the new ones survive a power cut.
pub(crate) fn create_folder(path: &Path) -> io::Result<()> {
    let path = std::path::absolute(path)?;
    let is_new = |folder: &&Path| !folder.exists();
    let new: Vec<&Path> = path.ancestors().take_while(is_new).collect();
    fs::create_dir_all(&path)?;
    new.iter().try_for_each(|folder| sync_folder_of(folder))
}

/// Makes the name of a file or folder survive a power cut, which requires synchronising its folder (fsync(2)).
pub(crate) fn sync_folder_of(path: &Path) -> io::Result<()> {
    let path = std::path::absolute(path)?;
    path.parent().map_or(Ok(()), sync_folder)
}

/// Makes the names in a folder survive a power cut. Windows has no such call: NTFS writes names to its own journal.
pub(crate) fn sync_folder(folder: &Path) -> io::Result<()> {
    if cfg!(windows) { Ok(()) } else { fs::File::open(folder)?.sync_all() }
}

fn holds_more_than_lock(path: &Path) -> io::Result<bool> {
    for item in fs::read_dir(path)? {
        if item?.file_name() != LOCK_FILE {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Name of a segment; number 0 is [`LOG_FILE`].
#[must_use]
pub fn segment_file(number: u32) -> String {
    format!("{number:03}.mcap")
}

/// Whether a folder holds a segment of a log; the first may be missing.
#[must_use]
pub fn is_session_folder(folder: &Path) -> bool {
    let is_segment = |name: std::ffi::OsString| name.to_str().and_then(segment_number).is_some();
    std::fs::read_dir(folder).is_ok_and(|mut items| {
        items.any(|item| item.is_ok_and(|item| is_segment(item.file_name())))
    })
}

pub(crate) fn segment_number(name: &str) -> Option<u32> {
    let number = name.strip_suffix(".mcap")?.parse().ok()?;
    (segment_file(number) == name).then_some(number)
}

/// A file beside a session's log, given the session's folder or a segment in it. A log file under another name stands
/// alone and has none.
pub(crate) fn file_beside(session: &Path, name: &str) -> Option<PathBuf> {
    if session.is_dir() {
        return Some(session.join(name));
    }
    segment_number(session.file_name()?.to_str()?)?;
    Some(session.with_file_name(name))
}

/// `PALPATE_HOME`, or `palpate` in the user's home folder.
pub fn library_folder() -> Result<PathBuf, FolderError> {
    library_from(std::env::var_os("PALPATE_HOME"), std::env::home_dir())
}

fn library_from(
    chosen: Option<std::ffi::OsString>,
    home: Option<PathBuf>,
) -> Result<PathBuf, FolderError> {
    match (chosen.filter(|path| !path.is_empty()), home) {
        (Some(path), _) => Ok(path.into()),
        (None, Some(home)) if !home.as_os_str().is_empty() => Ok(home.join("palpate")),
        _ => Err(FolderError::NoLibrary),
    }
}

/// `PALPATE_SPARE`, where a recording continues if its disk fails; `None` if unset.
#[must_use]
pub fn spare_folder() -> Option<PathBuf> {
    let chosen = std::env::var_os("PALPATE_SPARE")?;
    (!chosen.is_empty()).then(|| chosen.into())
}

#[must_use]
pub fn new_session_folder(library: &Path, session_id: &str) -> PathBuf {
    library.join("sessions").join(session_id)
}

#[must_use]
pub fn new_programme_folder(library: &Path, name: &str, started_at: DateTime<Utc>) -> PathBuf {
    let begun = crate::manifest::new_session_id(started_at);
    library.join(PROGRAMMES_FOLDER).join(format!("{name}-{begun}"))
}

/// Free space on the disk of a path, or of its nearest existing parent.
pub fn free_bytes(path: &Path) -> Result<u64, FolderError> {
    let existing = path
        .ancestors()
        .find(|one| !one.as_os_str().is_empty() && one.exists())
        .unwrap_or(Path::new("."));
    fs4::available_space(existing)
        .map_err(|source| FolderError::Io { path: existing.into(), source })
}

/// Refuses a disk with less than twice the space that a session needs.
///
/// If `path` does not exist yet, its nearest existing parent is checked.
pub fn check_free_space(path: &Path, needed_bytes: u64) -> Result<(), FolderError> {
    let free_bytes = free_bytes(path)?;
    if free_bytes < needed_bytes.saturating_mul(2) {
        return Err(FolderError::NoSpace { path: path.into(), free_bytes, needed_bytes });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn library_is_palpate_home_or_in_the_home_folder() {
        let home = Some(PathBuf::from("/home/ada"));
        let chosen = library_from(Some("/data/lab".into()), home.clone()).unwrap();
        assert_eq!(chosen, Path::new("/data/lab"));
        let default = library_from(Some("".into()), home).unwrap();
        assert_eq!(default, Path::new("/home/ada/palpate"));
        assert!(library_from(None, None).is_err());
    }

    #[test]
    fn only_names_by_the_writer_are_segments() {
        assert_eq!(segment_file(0), LOG_FILE);
        for number in [0, 7, 42, 999, 1000] {
            assert_eq!(segment_number(&segment_file(number)), Some(number));
        }
        for name in ["0001.mcap", "1.mcap", "+01.mcap", "001.mcap.bak", "a.mcap"] {
            assert_eq!(segment_number(name), None, "{name}");
        }
    }

    #[test]
    fn full_disk_is_refused_with_both_numbers() {
        let folder = tempfile::tempdir().unwrap();
        let deep = folder.path().join("not/yet/there");
        check_free_space(&deep, 1).unwrap();
        let refusal = check_free_space(&deep, u64::MAX / 4).unwrap_err();
        let FolderError::NoSpace { free_bytes, .. } = &refusal else {
            panic!("{refusal}");
        };
        let text = refusal.to_string();
        assert!(text.contains(&megabytes(*free_bytes)), "{text}");
        assert!(text.contains(&megabytes(u64::MAX / 4)), "{text}");
    }

    #[test]
    fn locked_folder_names_its_holder() {
        let parent = tempfile::tempdir().unwrap();
        let path = parent.path().join("a/b/session");
        let held = SessionFolder::create(&path).unwrap();
        let refusal = SessionFolder::create(&path).unwrap_err();
        let id = std::process::id().to_string();
        assert!(
            matches!(&refusal, FolderError::Lock(LockError::Held { holder, .. }) if *holder == id),
            "{refusal:?}"
        );
        // A session without a log leaves a reusable folder.
        drop(held);
        SessionFolder::create(&path).unwrap();
    }

    #[test]
    fn non_empty_folder_is_refused_and_unchanged() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("thesis.doc"), "irreplaceable").unwrap();
        let refusal = SessionFolder::create(folder.path()).unwrap_err();
        assert!(
            matches!(&refusal, FolderError::NotEmpty { path } if path == folder.path()),
            "{refusal:?}"
        );
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn file_at_the_path_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("session");
        fs::write(&file, "").unwrap();
        let refusal = SessionFolder::create(&file).unwrap_err();
        assert!(matches!(&refusal, FolderError::NotAFolder { path } if *path == file));
        let below = SessionFolder::create(&file.join("more")).unwrap_err();
        assert!(matches!(below, FolderError::Io { .. }), "{below:?}");
    }
}
