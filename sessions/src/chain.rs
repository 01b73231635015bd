//! Files that only grow, one JSON object a line. Every line carries a checksum over itself and the line
//! before, so that a line that was changed, moved or taken out of the middle is noticed; not one taken off
//! the end.
//!
//! A line is `{"body": ..., "checksum": CRC-32}`. The checksum is over the checksum of the line before (of
//! the first, the CRC-32 of the name the file belongs to) as four bytes, lowest first, and the compact JSON
//! of the body with its keys in alphabetical order.

use crate::folder::{create_folder, sync_folder_of};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A file of lines could not be read or added to.
#[derive(Debug, Error)]
#[non_exhaustive]
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
}

#[derive(Serialize, Deserialize)]
struct Line {
    body: Value,
    checksum: u32,
}

/// What stands in a file of lines.
#[derive(Debug)]
pub(crate) struct Chain {
    pub bodies: Vec<Value>,
    /// Checksum of the last line.
    last: u32,
    /// Bytes up to the end of the last whole line.
    whole: usize,
    /// Whether something follows that was never finished, as a crash leaves it.
    pub is_torn: bool,
}

impl Chain {
    /// The bodies as what they are, or the first line, from 1, that is not and why.
    pub fn records<T: DeserializeOwned>(&self) -> Result<Vec<T>, (usize, String)> {
        let bodies = self.bodies.iter().enumerate();
        bodies
            .map(|(index, body)| T::deserialize(body).map_err(|err| (index + 1, err.to_string())))
            .collect()
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
    match std::fs::read(path) {
        Ok(bytes) => parse(path, name, &bytes),
        Err(err) if err.kind() == io::ErrorKind::NotFound => parse(path, name, &[]),
        Err(source) => Err(ChainError::Io {
            what: "read",
            path: path.into(),
            source,
        }),
    }
}

fn parse(path: &Path, name: &str, bytes: &[u8]) -> Result<Chain, ChainError> {
    let whole = bytes
        .iter()
        .rposition(|byte| *byte == b'\n')
        .map_or(0, |at| at + 1);
    let mut chain = Chain {
        bodies: Vec::new(),
        last: crc32fast::hash(name.as_bytes()),
        whole,
        is_torn: whole < bytes.len(),
    };
    for (index, line) in bytes[..whole]
        .split_inclusive(|byte| *byte == b'\n')
        .enumerate()
    {
        let line = serde_json::from_slice::<Line>(line).ok();
        let line = line.filter(|line| line.checksum == checksum(chain.last, &line.body));
        let Some(Line { body, checksum }) = line else {
            return Err(ChainError::Changed {
                path: path.into(),
                line: index + 1,
            });
        };
        chain.last = checksum;
        chain.bodies.push(body);
    }
    Ok(chain)
}

/// Adds a line and sees it to the disk. What a crash left unfinished at the end is first moved to a file beside it,
/// which is named like it with `.torn` behind.
pub(crate) fn append(path: &Path, name: &str, body: Value) -> Result<(), ChainError> {
    let failed = |source| ChainError::Io {
        what: "added to",
        path: path.into(),
        source,
    };
    if let Some(folder) = path.parent() {
        create_folder(folder).map_err(failed)?;
    }
    let mut options = OpenOptions::new();
    let mut file = options
        .read(true)
        .append(true)
        .create(true)
        .open(path)
        .map_err(failed)?;
    // Two programs that add at the same time: the second continues the line of the first.
    file.lock().map_err(failed)?;
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes).map_err(failed)?;
    let chain = parse(path, name, &bytes)?;
    if chain.is_torn {
        keep_torn(path, &bytes[chain.whole..]).map_err(failed)?;
        file.set_len(chain.whole as u64).map_err(failed)?;
    }
    let line = Line {
        checksum: checksum(chain.last, &body),
        body,
    };
    write_line(&mut file, &line).map_err(failed)?;
    if chain.bodies.is_empty() {
        sync_folder_of(path).map_err(failed)?;
    }
    Ok(())
}

/// Adds what was never finished to the file beside, a line for each time.
fn keep_torn(path: &Path, torn: &[u8]) -> io::Result<()> {
    let mut name = path.as_os_str().to_owned();
    name.push(".torn");
    let mut file = OpenOptions::new().append(true).create(true).open(name)?;
    file.write_all(torn)?;
    file.write_all(b"\n")?;
    file.sync_all()
}

fn write_line(file: &mut File, line: &Line) -> io::Result<()> {
    let mut text = serde_json::to_vec(line)?;
    text.push(b'\n');
    file.write_all(&text)?;
    file.sync_all()
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;
    use std::fs;

    fn three(path: &Path) {
        for (number, word) in [(1, "one"), (2, "two"), (3, "three")] {
            append(
                path,
                "session",
                json!({"word": word, "depth": 0.1 * f64::from(number)}),
            )
            .unwrap();
        }
    }

    #[test]
    fn lines_come_back_and_every_change_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("deep/lines.jsonl");
        assert!(read(&path, "session").unwrap().bodies.is_empty());
        three(&path);
        let chain = read(&path, "session").unwrap();
        assert_eq!(chain.bodies.len(), 3);
        assert_eq!(
            chain.bodies[2],
            json!({"word": "three", "depth": 0.1 * 3.0})
        );
        assert!(!chain.is_torn);
        let text = fs::read_to_string(&path).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        let joined = |lines: &[&str]| lines.join("\n") + "\n";
        for (changed, line) in [
            (text.replacen("two", "tvo", 1), 2),
            (text.replacen("three", "thr", 1), 3),
            (joined(&[lines[0], lines[2]]), 2),
            (joined(&[lines[1], lines[2]]), 1),
            (joined(&[lines[1], lines[0], lines[2]]), 1),
            (joined(&[lines[0], lines[0], lines[1]]), 2),
            (joined(&[lines[0], "", lines[1]]), 2),
        ] {
            fs::write(&path, changed).unwrap();
            let refusal = read(&path, "session").unwrap_err().to_string();
            assert!(
                refusal.starts_with(&format!("line {line} of ")),
                "{refusal}"
            );
            // Nothing is added to what was changed.
            assert!(append(&path, "session", json!({})).is_err());
        }
        // The file of another session, whole as it is.
        fs::write(&path, text).unwrap();
        assert!(read(&path, "other").is_err());
    }

    #[test]
    fn every_bit_of_a_line_counts() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lines.jsonl");
        three(&path);
        let whole = read(&path, "session").unwrap().bodies;
        let bytes = fs::read(&path).unwrap();
        for at in 0..bytes.len() - 1 {
            let mut changed = bytes.clone();
            changed[at] ^= 1;
            fs::write(&path, &changed).unwrap();
            if let Ok(chain) = read(&path, "session") {
                // A key of no meaning may differ; what is said may not.
                assert_eq!(chain.bodies, whole, "bit 0 of byte {at}");
            }
        }
    }

    #[test]
    fn what_a_crash_left_unfinished_is_moved_away_and_kept() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("lines.jsonl");
        three(&path);
        let bytes = fs::read(&path).unwrap();
        fs::write(&path, &bytes[..bytes.len() - 9]).unwrap();
        let torn = read(&path, "session").unwrap();
        assert!(torn.is_torn && torn.bodies.len() == 2);
        append(&path, "session", json!({"word": "four"})).unwrap();
        let chain = read(&path, "session").unwrap();
        assert_eq!(chain.bodies[2], json!({"word": "four"}));
        let kept = fs::read(folder.path().join("lines.jsonl.torn")).unwrap();
        let line = bytes[..bytes.len() - 1]
            .rsplit(|byte| *byte == b'\n')
            .next();
        let torn = &line.unwrap()[..line.unwrap().len() - 8];
        assert_eq!(kept, [torn, b"\n"].concat());
        assert!(!chain.is_torn);
    }
}
