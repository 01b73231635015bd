//! Files that only grow, one JSON object a line. Every line carries a checksum over itself and the line
//! before, so that a line that was changed, moved or taken out of the middle is noticed. One taken off the end
//! is noticed by the [`Head`], which stands in a file beside it, and by the catalog (`catalog/heads.rs` says what is noticed
//! and what is not).
//!
//! A line is `{"body": ..., "checksum": CRC-32}`. The checksum is over the checksum of the line before (of
//! the first, the CRC-32 of the name the file belongs to) as four bytes, lowest first, and the compact JSON
//! of the body with its keys in alphabetical order.
//!
//! The file of the head is named like that of the lines with `.head` behind. It is written after the line is on the
//! disk, so a crash leaves it a line behind, never ahead. A file of lines without one comes from a palpate that wrote none:
//! then nothing can be confirmed.

use crate::atomic;
use crate::folder::{create_folder, sync_folder_of};
use crate::lock::{Busy, NotLocked, lock_soon};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A file of lines could not be read or added to.
#[derive(Debug, Error)]
pub enum ChainError {
    /// The disk refused.
    #[error("{} cannot be {what} ({source}); check its permissions and the disk", path.display())]
    Io {
        /// `read` or `added to`.
        what: &'static str,
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Other content than was written.
    #[error("line {line} of {} is not as it was written; restore the file from a backup, or move it away to go back to what was recorded", path.display())]
    Changed {
        /// The file.
        path: PathBuf,
        /// Which line, from 1.
        line: usize,
    },
    /// Fewer lines than were written, or others.
    #[error("{} is not all that was written: {}; restore the file from a backup, or move it, its head and the catalog of the library away to go back to what was recorded", path.display(), missing(*found, *written))]
    Shortened {
        /// The file.
        path: PathBuf,
        /// Lines in it.
        found: u64,
        /// Lines that were written.
        written: u64,
    },
    /// The file that tells how many lines there are cannot be understood.
    #[error("{} is not as it was written ({reason}); restore it from a backup, or move it away: nobody can tell then whether lines are missing at the end", path.display())]
    BadHead {
        /// The file of the head.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A later version wrote a line.
    #[error("line {line} of {} is {what} that this palpate does not know ({detail}); update palpate", path.display())]
    Unknown {
        /// What every line is, with its article.
        what: &'static str,
        /// The file.
        path: PathBuf,
        /// Which line, from 1.
        line: usize,
        /// The parser's words.
        detail: String,
    },
    /// Another program has locked the file and does not let go.
    #[error(transparent)]
    Busy(#[from] Busy),
}

fn missing(found: u64, written: u64) -> String {
    match written.checked_sub(found) {
        None | Some(0) => "its lines are others than its head tells".to_owned(),
        Some(1) => format!("its last line is missing, {found} of {written} are there"),
        Some(count) => {
            format!("its last {count} lines are missing, {found} of {written} are there")
        }
    }
}

#[derive(Serialize, Deserialize)]
struct Line {
    body: Value,
    checksum: u32,
}

/// How far a file of lines goes: who knows it notices that lines were taken off the end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Head {
    /// Lines there are.
    pub lines: u64,
    /// Checksum of the last of them; 0 where there is none.
    pub checksum: u32,
}

/// Version of the file of a head.
const HEAD_VERSION: u32 = 1;
/// A longer file is something else.
const HEAD_BYTES_MAX: u64 = 4096;

#[derive(Serialize, Deserialize)]
struct HeadFile {
    head_version: u32,
    #[serde(flatten)]
    head: Head,
}

impl Head {
    /// The file of the head of a file of lines.
    pub(crate) fn file_of(lines: &Path) -> PathBuf {
        named(lines, ".head")
    }

    /// The head that was written; of no lines where there is no file of it.
    fn read(lines: &Path) -> Result<Self, ChainError> {
        let path = Self::file_of(lines);
        let mut text = String::new();
        let read =
            File::open(&path).and_then(|file| file.take(HEAD_BYTES_MAX).read_to_string(&mut text));
        match read {
            Ok(_) => {}
            Err(err) if err.kind() == io::ErrorKind::NotFound => return Ok(Self::default()),
            Err(source) => {
                return Err(ChainError::Io { what: "read", path, source });
            }
        }
        let bad = |reason: String| ChainError::BadHead { path: path.clone(), reason };
        let file: HeadFile = serde_json::from_str(&text).map_err(|err| bad(err.to_string()))?;
        match file.head_version {
            HEAD_VERSION => Ok(file.head),
            version => Err(bad(format!("it is of version {version}; update palpate"))),
        }
    }

    fn write(self, lines: &Path) -> io::Result<()> {
        let file = HeadFile { head_version: HEAD_VERSION, head: self };
        let mut text = serde_json::to_vec(&file)?;
        text.push(b'\n');
        atomic::replace(&Self::file_of(lines), &text)
    }
}

/// What stands in a file of lines.
#[derive(Debug)]
pub(crate) struct Chain {
    pub bodies: Vec<Value>,
    /// Checksum before the first line, and of each.
    checksums: Vec<u32>,
    /// Bytes up to the end of the last whole line.
    whole: usize,
    /// Whether something follows that was never finished, as a crash leaves it.
    pub is_torn: bool,
}

impl Chain {
    fn last(&self) -> u32 {
        self.checksums.last().copied().unwrap_or_default()
    }

    /// How far it goes.
    pub fn head(&self) -> Head {
        match self.bodies.len() {
            0 => Head::default(),
            lines => Head { lines: lines as u64, checksum: self.last() },
        }
    }

    /// Refuses a chain of which lines are gone that were there.
    fn check(&self, path: &Path, head: Head) -> Result<(), ChainError> {
        let place = usize::try_from(head.lines).unwrap_or(usize::MAX);
        match self.checksums.get(place) {
            Some(checksum) if place == 0 || *checksum == head.checksum => Ok(()),
            _ => Err(ChainError::Shortened {
                path: path.into(),
                found: self.bodies.len() as u64,
                written: head.lines,
            }),
        }
    }

    /// The lines of the file `path` as what they are; `what` is one of them with its article.
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

/// Reads the lines that belong to `name`; a file that is not there has none.
pub(crate) fn read(path: &Path, name: &str) -> Result<Chain, ChainError> {
    read_since(path, name, Head::default())
}

/// As [`read`], and refuses a file that does not hold what it held once.
pub(crate) fn read_since(path: &Path, name: &str, since: Head) -> Result<Chain, ChainError> {
    // Read before the lines: a line that is added meanwhile is in the lines, not in the head.
    let head = Head::read(path)?;
    let chain = match std::fs::read(path) {
        Ok(bytes) => parse(path, name, &bytes),
        Err(err) if err.kind() == io::ErrorKind::NotFound => parse(path, name, &[]),
        Err(source) => Err(ChainError::Io { what: "read", path: path.into(), source }),
    }?;
    chain.check(path, head)?;
    chain.check(path, since)?;
    Ok(chain)
}

fn parse(path: &Path, name: &str, bytes: &[u8]) -> Result<Chain, ChainError> {
    let whole = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |at| at + 1);
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

/// Adds a line and sees it to the disk. What a crash left unfinished at the end is first moved to a file beside it,
/// which is named like it with `.torn` behind.
pub(crate) fn append(path: &Path, name: &str, body: &impl Serialize) -> Result<(), ChainError> {
    let failed = |source| ChainError::Io { what: "added to", path: path.into(), source };
    let body = serde_json::to_value(body).map_err(|err| failed(err.into()))?;
    if let Some(folder) = path.parent() {
        create_folder(folder).map_err(failed)?;
    }
    let mut options = OpenOptions::new();
    let mut file = options.read(true).append(true).create(true).open(path).map_err(failed)?;
    // Two programs that add at the same time: the second continues the line of the first.
    lock_soon(&file, path).map_err(|err| match err {
        NotLocked::Busy(busy) => busy.into(),
        NotLocked::Io(source) => failed(source),
    })?;
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(failed)?;
    let chain = parse(path, name, &bytes)?;
    chain.check(path, Head::read(path)?)?;
    if chain.is_torn {
        keep_torn(path, &bytes[chain.whole..]).map_err(failed)?;
        file.set_len(chain.whole as u64).map_err(failed)?;
    }
    let line = Line { checksum: checksum(chain.last(), &body), body };
    write_line(&mut file, &line).map_err(failed)?;
    let head = Head { lines: chain.bodies.len() as u64 + 1, checksum: line.checksum };
    head.write(path).map_err(failed)?;
    if chain.bodies.is_empty() {
        sync_folder_of(path).map_err(failed)?;
    }
    Ok(())
}

/// Adds what was never finished to the file beside, a line for each time.
fn keep_torn(path: &Path, torn: &[u8]) -> io::Result<()> {
    let mut options = OpenOptions::new();
    let mut file = options.append(true).create(true).open(named(path, ".torn"))?;
    file.write_all(torn)?;
    file.write_all(b"\n")?;
    file.sync_all()
}

/// A path with something behind its name.
fn named(path: &Path, ending: &str) -> PathBuf {
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
#[path = "chain_tests.rs"]
mod tests;
