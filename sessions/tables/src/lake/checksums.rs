//! Checksums of a session's files in a lake: Parquet as polars writes it has none of its own, and what a
//! flipped bit makes of a number must not be read.

use super::layout::{Part, part};
use super::read::LakeError;
use crate::export::atomic::{io_error, write_or_same};
use crate::export::{ExportError, Kept};
use serde::{Deserialize, Serialize};
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// The CRC-32 of each of a session's files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Checksums {
    samples_crc32: u32,
    events_crc32: u32,
    sessions_crc32: u32,
}

/// The file of a session's checksums, below the folder of its partition.
fn path_of(lake: &Path, partition: &Path, id: &str) -> PathBuf {
    let folder = part(lake, Part::Checksums).join(partition);
    folder.join(format!("{id}.json"))
}

/// CRC-32 of what is left to read.
pub(super) fn crc32_of(mut from: impl Read) -> io::Result<u32> {
    let mut hasher = crc32fast::Hasher::new();
    let mut window = vec![0; 1 << 16];
    loop {
        match from.read(&mut window)? {
            0 => return Ok(hasher.finalize()),
            count => hasher.update(&window[..count]),
        }
    }
}

impl Checksums {
    /// Of two files that are there, and of the bytes of the third that is to come.
    pub fn of(samples: &Path, events: &Path, sessions: &[u8]) -> Result<Self, ExportError> {
        let of_file = |path: &Path| File::open(path).and_then(crc32_of).map_err(io_error(path));
        Ok(Self {
            samples_crc32: of_file(samples)?,
            events_crc32: of_file(events)?,
            sessions_crc32: crc32fast::hash(sessions),
        })
    }

    pub fn of_part(&self, part: Part) -> Option<u32> {
        match part {
            Part::Samples => Some(self.samples_crc32),
            Part::Events => Some(self.events_crc32),
            Part::Sessions => Some(self.sessions_crc32),
            Part::Checksums => None,
        }
    }

    pub fn write(&self, lake: &Path, partition: &Path, id: &str) -> Result<Kept, ExportError> {
        let path = path_of(lake, partition, id);
        let failed = io_error(&path);
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder).map_err(&failed)?;
        }
        let text = serde_json::json!(self).to_string();
        write_or_same(&path, |out| writeln!(out, "{text}").map_err(&failed))
    }

    pub fn read(lake: &Path, partition: &Path, id: &str) -> Result<Self, LakeError> {
        let path = path_of(lake, partition, id);
        let bytes =
            fs::read(&path).map_err(|source| LakeError::Io { path: path.clone(), source })?;
        serde_json::from_slice(&bytes)
            .map_err(|err| LakeError::Bad { path, reason: err.to_string() })
    }
}
