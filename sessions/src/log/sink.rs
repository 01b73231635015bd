//! The one door to the disk: appending bytes and making them durable.

use crate::folder::{SPARE_FILE, create_folder, segment_file};
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Takes bytes in order. After an error it is not used again.
pub trait Sink: Send {
    /// Writes all bytes at the end.
    fn append(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Returns once everything appended survives a power cut.
    fn sync(&mut self) -> io::Result<()>;

    /// Free room on its disk in bytes, if that is known. May wait for the disk.
    fn free_bytes(&self) -> Option<u64> {
        None
    }
}

/// Makes the files of a session that is written in segments.
pub trait SegmentSource: Send {
    /// What a segment is written to.
    type Sink: Sink;

    /// What errors call the segment.
    fn path(&self, number: u32) -> String;

    /// Makes the segment. Its first `sync` must make its name durable too.
    fn create(&mut self, number: u32) -> io::Result<Self::Sink>;

    /// Makes the segment in another place because its own cannot have it, and says where.
    fn create_elsewhere(&mut self, number: u32) -> io::Result<(Self::Sink, String)> {
        let path = self.path(number);
        Err(io::Error::other(format!(
            "there is no other place for {path}"
        )))
    }
}

/// Segments in a session folder: `000.mcap`, `001.mcap` and so on.
#[derive(Debug)]
pub struct FolderSegments {
    folder: PathBuf,
    spare: Option<PathBuf>,
}

impl FolderSegments {
    /// Segments in this folder.
    #[must_use]
    pub fn new(folder: &Path) -> Self {
        Self {
            folder: folder.into(),
            spare: None,
        }
    }

    /// Segments in this folder, or in one of the same name in `spare` when its disk fails. The
    /// session's folder says so in its file [`SPARE_FILE`], so that a reader finds them.
    pub fn with_spare(folder: &Path, spare: &Path) -> io::Result<Self> {
        let spare = std::path::absolute(spare)?.join(folder.file_name().unwrap_or_default());
        let text = spare
            .to_str()
            .ok_or_else(|| io::Error::other("the spare folder's name is not Unicode"))?;
        let mut pointer = FileSink::create(&folder.join(SPARE_FILE))?;
        pointer.append(text.as_bytes())?;
        pointer.sync()?;
        Ok(Self {
            folder: folder.into(),
            spare: Some(spare),
        })
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
        create_folder(spare)?;
        let path = spare.join(segment_file(number));
        Ok((FileSink::create(&path)?, path.display().to_string()))
    }
}

/// A new file that is only ever appended to.
#[derive(Debug)]
pub struct FileSink {
    file: File,
    /// The file's folder, until its entry for the file is known to be on disk.
    folder: Option<File>,
}

impl FileSink {
    /// Makes a file. An existing one is never touched.
    pub fn create(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new()
            .append(true)
            .create_new(true)
            .open(path)?;
        let folder = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => File::open(parent)?,
            _ => File::open(".")?,
        };
        Ok(Self {
            file,
            folder: Some(folder),
        })
    }
}

impl Sink for FileSink {
    fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.write_all(bytes)
    }

    fn sync(&mut self) -> io::Result<()> {
        self.file.sync_data()?;
        // A new file is only found after a power cut if its folder was synced too (fsync(2)).
        if let Some(folder) = &self.folder {
            folder.sync_all()?;
            self.folder = None;
        }
        Ok(())
    }

    fn free_bytes(&self) -> Option<u64> {
        let disk = rustix::fs::fstatvfs(&self.file).ok()?;
        Some(disk.f_bavail.saturating_mul(disk.f_frsize))
    }
}
