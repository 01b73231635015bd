//! Output of a log: appends bytes, synchronises them with the disk, and checks that they are still there.

use crate::folder::{SPARE_FILE, create_folder, segment_file, sync_folder_of};
use crate::text::crc32_of_file;
use same_file::Handle;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use thiserror::Error;

/// Difference between a file and what was written to it, caused by another program or a failing disk.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Alteration {
    #[error("the file was deleted")]
    Gone,
    #[error("another file replaced it")]
    Replaced,
    #[error("it has {found} bytes, but {written} were written")]
    Length { found: u64, written: u64 },
    #[error("its content differs from what was written")]
    Content,
    #[error("it cannot be read back ({0})")]
    Unreadable(String),
}

/// Takes bytes in order. It is not used again after an error.
pub trait Sink: Send {
    /// Appends all bytes.
    fn append(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Returns when everything appended survives a power cut.
    fn sync(&mut self) -> io::Result<()>;

    /// What was written so far, to compare with the disk; `None` for a sink without a file.
    fn written(&self) -> Option<&WrittenFile> {
        None
    }

    /// Free space on the disk in bytes, if known. May wait for the disk.
    fn free_bytes(&self) -> Option<u64> {
        None
    }
}

/// Creates the segments of a session.
pub trait SegmentSource: Send {
    type Sink: Sink;

    /// Name of the segment in messages.
    fn path(&self, number: u32) -> String;

    /// Creates a segment, whose first `sync` must make its name durable too.
    fn create(&mut self, number: u32) -> io::Result<Self::Sink>;

    /// Creates the segment in another place after a failure; returns its path too.
    fn create_elsewhere(&mut self, number: u32) -> io::Result<(Self::Sink, String)> {
        let path = self.path(number);
        Err(io::Error::other(format!("{path} has no spare folder")))
    }
}

/// Segments in a session folder: `000.mcap`, `001.mcap` and so on.
#[derive(Debug)]
pub struct FolderSegments {
    folder: PathBuf,
    spare: Option<PathBuf>,
}

impl FolderSegments {
    #[must_use]
    pub fn new(folder: &Path) -> Self {
        Self { folder: folder.into(), spare: None }
    }

    /// Segments in this folder or, after a disk failure, in the subfolder `session_id` of `spare`. The file [`SPARE_FILE`] in
    /// the session's folder leads a reader there.
    pub fn with_spare(folder: &Path, spare: &Path, session_id: &str) -> io::Result<Self> {
        let spare = std::path::absolute(spare)?.join(session_id);
        let text = spare
            .to_str()
            .ok_or_else(|| io::Error::other("the spare folder's name is not Unicode"))?;
        // Created now, so that a missing folder later means a missing disk.
        create_folder(&spare)?;
        let mut pointer = FileSink::create(&folder.join(SPARE_FILE))?;
        pointer.append(text.as_bytes())?;
        pointer.sync()?;
        Ok(Self { folder: folder.into(), spare: Some(spare) })
    }
}

impl SegmentSource for FolderSegments {
    type Sink = FileSink;

    fn path(&self, number: u32) -> String {
        self.folder.join(segment_file(number)).display().to_string()
    }

    fn create(&mut self, number: u32) -> io::Result<FileSink> {
        FileSink::create(&self.folder.join(segment_file(number)))
    }

    fn create_elsewhere(&mut self, number: u32) -> io::Result<(FileSink, String)> {
        let Some(spare) = &self.spare else {
            return Err(io::Error::other("no spare folder was chosen"));
        };
        let path = spare.join(segment_file(number));
        Ok((FileSink::create(&path)?, path.display().to_string()))
    }
}

/// A new, append-only file.
#[derive(Debug)]
pub struct FileSink {
    file: File,
    /// Whether the file's name survives a power cut.
    is_named: bool,
    written: WrittenFile,
}

impl FileSink {
    /// Fails if the file exists.
    pub fn create(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().append(true).create_new(true).open(path)?;
        let written = WrittenFile {
            // The current folder of the process may change.
            path: std::path::absolute(path)?,
            id: Arc::new(Handle::from_file(file.try_clone()?)?),
            bytes: 0,
            sum: crc32fast::Hasher::new(),
        };
        Ok(Self { file, is_named: false, written })
    }
}

impl Sink for FileSink {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.write_all(bytes)?;
        self.written.bytes += bytes.len() as u64;
        self.written.sum.update(bytes);
        Ok(())
    }

    fn sync(&mut self) -> io::Result<()> {
        self.file.sync_data()?;
        // The name of a new file survives a power cut only if its folder is synchronised (fsync(2)).
        if !self.is_named {
            sync_folder_of(&self.written.path)?;
            self.is_named = true;
        }
        Ok(())
    }

    fn written(&self) -> Option<&WrittenFile> {
        Some(&self.written)
    }

    fn free_bytes(&self) -> Option<u64> {
        fs4::available_space(self.written.path.parent()?).ok()
    }
}

/// Identity, size and checksum of a written file.
#[derive(Clone, Debug)]
pub struct WrittenFile {
    path: PathBuf,
    /// Which file it is, whatever its name.
    id: Arc<Handle>,
    bytes: u64,
    /// CRC-32 of them.
    sum: crc32fast::Hasher,
}

impl WrittenFile {
    /// Quick check of name and length.
    pub fn check(&self) -> Result<(), Alteration> {
        // A pipe would keep whoever opens it waiting.
        if !std::fs::metadata(&self.path).map_err(unreadable)?.is_file() {
            return Err(Alteration::Replaced);
        }
        let there = Handle::from_path(&self.path).map_err(unreadable)?;
        if there != *self.id {
            return Err(Alteration::Replaced);
        }
        match there.as_file().metadata().map_err(unreadable)?.len() {
            found if found == self.bytes => Ok(()),
            found => Err(Alteration::Length { found, written: self.bytes }),
        }
    }

    /// Like [`check`](Self::check), and compares every byte.
    pub fn read_back(&self) -> Result<(), Alteration> {
        self.check()?;
        match crc32_of_file(&self.path).map_err(unreadable)? == self.sum.clone().finalize() {
            true => Ok(()),
            false => Err(Alteration::Content),
        }
    }
}

fn unreadable(err: io::Error) -> Alteration {
    match err.kind() {
        io::ErrorKind::NotFound => Alteration::Gone,
        _ => Alteration::Unreadable(err.to_string()),
    }
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use super::*;

    /// Opening a pipe waits for whoever writes into it, and a run must not wait for that.
    #[test]
    fn log_replaced_by_a_pipe_is_noticed_without_waiting() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("000.mcap");
        let mut sink = FileSink::create(&path).unwrap();
        sink.append(b"samples").unwrap();
        sink.sync().unwrap();
        assert_eq!(sink.written().unwrap().check(), Ok(()));
        std::fs::remove_file(&path).unwrap();
        let mode = rustix::fs::Mode::from_raw_mode(0o600);
        rustix::fs::mknodat(rustix::fs::CWD, &path, rustix::fs::FileType::Fifo, mode, 0).unwrap();
        assert_eq!(sink.written().unwrap().check(), Err(Alteration::Replaced));
    }
}
