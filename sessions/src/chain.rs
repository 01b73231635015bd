//! Append-only JSON-lines files. Every line has a checksum over itself and the line before, which reveals a line that was
//! changed, moved or removed. The [`ChainHead`] in a file beside it, and the catalog (`catalog/heads.rs`), reveal lines that
//! were cut off the end.
//!
//! A line is `{"body": ..., "checksum": CRC-32}`. The checksum is over the checksum of the line before (of
//! the first, the CRC-32 of the name the file belongs to) as four bytes, lowest first, and the compact JSON
//! of the body with its keys in alphabetical order.
//!
//! The head's file has the name of the lines' file with `.head` appended. It is written after the line is on the disk, so a
//! crash leaves it a line behind, never ahead. Old versions of palpate wrote no head; their files are read without it.

use crate::atomic;
use crate::folder::{create_folder, sync_folder_of};
use crate::lock::{LockFailure, LockTimeout, lock_data};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use thiserror::Error;

#[derive(Debug, Error)]
pub enum ChainError {
    #[error("{} cannot be {what} ({source}); check its permissions and the disk", path.display())]
    Io {
        /// `read` or `added to`.
        what: &'static str,
        path: PathBuf,
        source: io::Error,
    },
    #[error("line {line} of {} was changed; restore the file from a backup, or move the file elsewhere to use the recording without it", path.display())]
    Changed {
        path: PathBuf,
        /// Which line, from 1.
        line: usize,
    },
    #[error("{} is incomplete: {}; restore the file from a backup, or move it, {} and the library's catalog elsewhere to use the recording without the file", path.display(), missing(*found, *written), ChainHead::file_of(path).display())]
    Shortened { path: PathBuf, found: u64, written: u64 },
    #[error("{} is damaged ({reason}); restore it from a backup, or move it elsewhere, but palpate then cannot detect that lines at the end of the record beside it are missing", path.display())]
    BadHead { path: PathBuf, reason: String },
    #[error("a newer version of palpate wrote {} (version {version} of such files, this one knows {HEAD_VERSION}); update palpate to read it or to add to it", path.display())]
    Newer { path: PathBuf, version: u64 },
    #[error("line {line} of {} is {what} of an unknown kind ({detail}); update palpate", path.display())]
    Unknown {
        /// What every line is, with its article.
        what: &'static str,
        path: PathBuf,
        /// Which line, from 1.
        line: usize,
        detail: String,
    },
    #[error(transparent)]
    LockTimeout(#[from] LockTimeout),
}

impl ChainError {
    /// Whether a newer version of palpate wrote the file.
    pub const fn is_newer(&self) -> bool {
        matches!(self, Self::Newer { .. } | Self::Unknown { .. })
    }
}

fn missing(found: u64, written: u64) -> String {
    if found < written {
        format!("the end of the file is missing: only {found} of {written} lines are present")
    } else {
        "its lines differ from the lines that were written".to_owned()
    }
}

#[derive(Serialize, Deserialize)]
struct Line {
    body: Value,
    checksum: u32,
}

/// Number of lines and the last checksum. Whoever remembers it notices that lines were cut off the end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChainHead {
    pub lines: u64,
    /// Checksum of the last line; 0 without lines.
    pub checksum: u32,
}

/// Version of the file of a head.
pub const HEAD_VERSION: u32 = 1;
/// Larger than any head.
const HEAD_BYTES_MAX: u64 = 4096;

#[derive(Serialize, Deserialize)]
struct ChainHeadFile {
    head_version: u32,
    #[serde(flatten)]
    head: ChainHead,
}

impl ChainHead {
    pub(crate) fn file_of(lines: &Path) -> PathBuf {
        with_ending(lines, ".head")
    }

    /// Reads the head; without a file, that of no lines.
    fn read(lines: &Path) -> Result<Self, ChainError> {
        let path = Self::file_of(lines);
        let mut text = String::new();
        let read =
            File::open(&path).and_then(|file| file.take(HEAD_BYTES_MAX).read_to_string(&mut text));
        match read {
            Err(err) if err.kind() == io::ErrorKind::NotFound => return Ok(Self::default()),
            outcome => outcome.map_err(|source| read_error(&path, source))?,
        };
        let bad = |reason: String| ChainError::BadHead { path: path.clone(), reason };
        // The version comes first, because the rest of a newer head may not parse.
        let value: Value = serde_json::from_str(&text).map_err(|err| bad(err.to_string()))?;
        match value["head_version"].as_u64() {
            Some(version) if version > u64::from(HEAD_VERSION) => {
                Err(ChainError::Newer { path: lines.into(), version })
            }
            _ => {
                let file = ChainHeadFile::deserialize(value).map_err(|err| bad(err.to_string()))?;
                Ok(file.head)
            }
        }
    }

    fn write(self, lines: &Path) -> io::Result<()> {
        let file = ChainHeadFile { head_version: HEAD_VERSION, head: self };
        let mut text = serde_json::to_vec(&file)?;
        text.push(b'\n');
        atomic::replace(&Self::file_of(lines), &text)
    }
}

#[derive(Debug)]
pub(crate) struct Chain {
    pub bodies: Vec<Value>,
    /// The seed, then the checksum of each line.
    checksums: Vec<u32>,
    /// Bytes up to the end of the last complete line.
    whole: usize,
    /// Whether an incomplete line follows, as a crash leaves it.
    pub is_torn: bool,
}

impl Chain {
    fn last(&self) -> u32 {
        self.checksums.last().copied().unwrap_or_default()
    }

    pub fn head(&self) -> ChainHead {
        match self.bodies.len() {
            0 => ChainHead::default(),
            lines => ChainHead { lines: lines as u64, checksum: self.last() },
        }
    }

    /// Refuses a chain that lacks lines of `head`.
    fn check(&self, path: &Path, head: ChainHead) -> Result<(), ChainError> {
        let index = usize::try_from(head.lines).unwrap_or(usize::MAX);
        match self.checksums.get(index) {
            Some(checksum) if index == 0 || *checksum == head.checksum => Ok(()),
            _ => Err(ChainError::Shortened {
                path: path.into(),
                found: self.bodies.len() as u64,
                written: head.lines,
            }),
        }
    }

    /// Parses the lines; errors name `path` and `what`, a record with its article.
    pub fn records<T: DeserializeOwned>(
        &self,
        path: &Path,
        what: &'static str,
    ) -> Result<Vec<T>, ChainError> {
        let record = |(index, body): (usize, &Value)| {
            T::deserialize(body).map_err(|err| ChainError::Unknown {
                what,
                path: path.into(),
                line: index + 1,
                detail: err.to_string(),
            })
        };
        self.bodies.iter().enumerate().map(record).collect()
    }
}

fn checksum(before: u32, body: &Value) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&before.to_le_bytes());
    hasher.update(body.to_string().as_bytes());
    hasher.finalize()
}

fn read_error(path: &Path, source: io::Error) -> ChainError {
    ChainError::Io { what: "read", path: path.into(), source }
}

/// The bytes of a file; none if it does not exist.
pub(crate) fn bytes_or_none(path: &Path) -> io::Result<Vec<u8>> {
    match std::fs::read(path) {
        Err(err) if err.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
        outcome => outcome,
    }
}

/// Bytes up to the end of the last complete line.
pub(crate) fn complete_length(bytes: &[u8]) -> usize {
    bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |at| at + 1)
}

/// Reads the lines whose checksums begin with `name`; a missing file has none.
pub(crate) fn read(path: &Path, name: &str) -> Result<Chain, ChainError> {
    read_since(path, name, ChainHead::default())
}

/// Like [`read`], and refuses a file that no longer holds the lines up to `since`.
pub(crate) fn read_since(path: &Path, name: &str, since: ChainHead) -> Result<Chain, ChainError> {
    // Read before the lines, because another process may append a line in between.
    let head = ChainHead::read(path)?;
    let bytes = bytes_or_none(path).map_err(|source| read_error(path, source))?;
    let chain = parse(path, name, &bytes)?;
    chain.check(path, head)?;
    chain.check(path, since)?;
    Ok(chain)
}

fn parse(path: &Path, name: &str, bytes: &[u8]) -> Result<Chain, ChainError> {
    let whole = complete_length(bytes);
    let mut chain = Chain {
        bodies: Vec::new(),
        checksums: vec![crc32fast::hash(name.as_bytes())],
        whole,
        is_torn: whole < bytes.len(),
    };
    for (index, line) in bytes[..whole].split_inclusive(|byte| *byte == b'\n').enumerate() {
        let line = serde_json::from_slice::<Line>(line).ok();
        let line = line.filter(|line| line.checksum == checksum(chain.last(), &line.body));
        let Some(Line { body, checksum }) = line else {
            return Err(ChainError::Changed { path: path.into(), line: index + 1 });
        };
        chain.checksums.push(checksum);
        chain.bodies.push(body);
    }
    Ok(chain)
}

/// Appends a line and synchronises it with the disk. An incomplete last line first moves to a file of the same name with
/// `.torn` appended.
pub(crate) fn append(path: &Path, name: &str, body: &impl Serialize) -> Result<(), ChainError> {
    let failed = |source| ChainError::Io { what: "added to", path: path.into(), source };
    let body = serde_json::to_value(body).map_err(|err| failed(err.into()))?;
    if let Some(folder) = path.parent() {
        create_folder(folder).map_err(failed)?;
    }
    let mut options = OpenOptions::new();
    let mut file = options.read(true).append(true).create(true).open(path).map_err(failed)?;
    // The lock is for two programs that append at the same time.
    let _lock = lock_data(&file, path).map_err(|err| match err {
        LockFailure::LockTimeout(busy) => busy.into(),
        LockFailure::Io(source) => failed(source),
    })?;
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(failed)?;
    let chain = parse(path, name, &bytes)?;
    chain.check(path, ChainHead::read(path)?)?;
    if chain.is_torn {
        store_torn(path, &bytes[chain.whole..]).map_err(failed)?;
        // A file opened for appending cannot be cut on Windows.
        let cut = OpenOptions::new().write(true).open(path);
        cut.and_then(|file| file.set_len(chain.whole as u64)).map_err(failed)?;
    }
    let line = Line { checksum: checksum(chain.last(), &body), body };
    write_line(&mut file, &line).map_err(failed)?;
    let head = ChainHead { lines: chain.bodies.len() as u64 + 1, checksum: line.checksum };
    head.write(path).map_err(failed)?;
    if chain.bodies.is_empty() {
        sync_folder_of(path).map_err(failed)?;
    }
    Ok(())
}

/// Appends an incomplete line to the `.torn` file.
fn store_torn(path: &Path, torn: &[u8]) -> io::Result<()> {
    let mut options = OpenOptions::new();
    let mut file = options.append(true).create(true).open(with_ending(path, ".torn"))?;
    file.write_all(torn)?;
    file.write_all(b"\n")?;
    file.sync_all()
}

pub(crate) fn with_ending(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    name.into()
}

fn write_line(file: &mut File, line: &Line) -> io::Result<()> {
    let mut text = serde_json::to_vec(line)?;
    text.push(b'\n');
    file.write_all(&text)?;
    file.sync_all()
}

#[cfg(test)]
mod tests;
