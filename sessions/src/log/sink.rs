//! The one door to the disk: appending bytes, making them durable, and finding out whether they are still there.

use crate::folder::{SPARE_FILE, create_folder, segment_file};
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// How a file differs from what was written to it. Only another program can have done that, or a disk that lies.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Alteration {
    /// No file has its name.
    #[error("it is not there any more")]
    Gone,
    /// Another file has its name.
    #[error("another file is in its place")]
    Replaced,
    /// It was cut, emptied or added to.
    #[error("it has {found} bytes and {written} were written")]
    Length {
        /// Bytes it has.
        found: u64,
        /// Bytes that were written.
        written: u64,
    },
    /// As many bytes as were written, but others.
    #[error("its content is not what was written")]
    Content,
    /// The system does not let it be read.
    #[error("it cannot be read back ({0})")]
    Unreadable(String),
}

/// Checks a file that was closed.
pub type ClosedCheck = Box<dyn Fn() -> Result<(), Alteration> + Send>;

/// Takes bytes in order. After an error it is not used again.
pub trait Sink: Send {
    /// Writes all bytes at the end.
    fn append(&mut self, bytes: &[u8]) -> io::Result<()>;

    /// Returns once everything appended survives a power cut.
    fn sync(&mut self) -> io::Result<()>;

    /// Compares what the disk says of the file with what was written: name and length. That is quickly done.
    fn check(&self) -> Result<(), Alteration> {
        Ok(())
    }

    /// As [`check`](Self::check), and compares every byte.
    fn read_back(&self) -> Result<(), Alteration> {
        self.check()
    }

    /// What checks the file as [`read_back`](Self::read_back) does once it is finished and closed.
    fn closed_check(&self) -> ClosedCheck {
        Box::new(|| Ok(()))
    }

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
        Err(io::Error::other(format!("there is no other place for {path}")))
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
        Self { folder: folder.into(), spare: None }
    }

    /// Segments in this folder, or in one in `spare`, named by the session's id, when its disk fails. The
    /// session's folder says so in its file [`SPARE_FILE`], so that a reader finds them.
    pub fn with_spare(folder: &Path, spare: &Path, session_id: &str) -> io::Result<Self> {
        let spare = std::path::absolute(spare)?.join(session_id);
        let text = spare
            .to_str()
            .ok_or_else(|| io::Error::other("the spare folder's name is not Unicode"))?;
        // Made now, so that a reader knows: if it is not there, neither is its disk.
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

/// A new file that is only ever appended to.
#[derive(Debug)]
pub struct FileSink {
    file: File,
    /// The file's folder, until its entry for the file is known to be on disk.
    folder: Option<File>,
    written: WrittenFile,
}

impl FileSink {
    /// Makes a file. An existing one is never touched.
    pub fn create(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new().append(true).create_new(true).open(path)?;
        let folder = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => File::open(parent)?,
            _ => File::open(".")?,
        };
        let own = file.metadata()?;
        let written = WrittenFile {
            // The program may go to another folder before the file is looked for again.
            path: std::path::absolute(path)?,
            id: (own.dev(), own.ino()),
            bytes: 0,
            sum: crc32fast::Hasher::new(),
        };
        Ok(Self { file, folder: Some(folder), written })
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
        // A new file is only found after a power cut if its folder was synced too (fsync(2)).
        if let Some(folder) = &self.folder {
            folder.sync_all()?;
            self.folder = None;
        }
        Ok(())
    }

    fn check(&self) -> Result<(), Alteration> {
        self.written.check()
    }

    fn read_back(&self) -> Result<(), Alteration> {
        self.written.read_back()
    }

    fn closed_check(&self) -> ClosedCheck {
        let written = self.written.clone();
        Box::new(move || written.read_back())
    }

    fn free_bytes(&self) -> Option<u64> {
        let disk = rustix::fs::fstatvfs(&self.file).ok()?;
        Some(disk.f_bavail.saturating_mul(disk.f_frsize))
    }
}

/// What was written to a file, by which it is known again.
#[derive(Clone, Debug)]
struct WrittenFile {
    path: PathBuf,
    /// The device and the file's number on it.
    id: (u64, u64),
    bytes: u64,
    /// CRC-32 of them.
    sum: crc32fast::Hasher,
}

/// Bytes that are read back at once.
const WINDOW_BYTES: usize = 1 << 18;

impl WrittenFile {
    /// Whether the file still has its name, and so many bytes.
    fn check(&self) -> Result<(), Alteration> {
        let there = std::fs::metadata(&self.path).map_err(unreadable)?;
        if (there.dev(), there.ino()) != self.id {
            return Err(Alteration::Replaced);
        }
        match there.len() {
            found if found == self.bytes => Ok(()),
            found => Err(Alteration::Length { found, written: self.bytes }),
        }
    }

    fn read_back(&self) -> Result<(), Alteration> {
        self.check()?;
        let mut file = File::open(&self.path).map_err(unreadable)?;
        let mut sum = crc32fast::Hasher::new();
        let mut window = vec![0; WINDOW_BYTES];
        loop {
            match file.read(&mut window).map_err(unreadable)? {
                0 => break,
                count => sum.update(&window[..count]),
            }
        }
        match sum.finalize() == self.sum.clone().finalize() {
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
