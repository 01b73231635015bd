//! Checksums of a session's files in a lake. Parquet files by polars have none, and a flipped bit must not become a wrong
//! number.

use super::layout::{LakePart, part_folder};
use super::read::LakeError;
use crate::export::atomic::{io_error, write_or_same};
use crate::export::{ExportError, WriteOutcome};
use palpate_sessions::text::crc32_of_file;
use serde::{Deserialize, Serialize};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

/// The CRC-32 of each of a session's files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct Checksums {
    samples_crc32: u32,
    events_crc32: u32,
    sessions_crc32: u32,
}

fn path_of(lake: &Path, partition: &Path, id: &str) -> PathBuf {
    let folder = part_folder(lake, LakePart::Checksums).join(partition);
    folder.join(format!("{id}.json"))
}

impl Checksums {
    /// Computes the checksums of two files, and of the third from its bytes.
    pub fn of(samples: &Path, events: &Path, sessions: &[u8]) -> Result<Self, ExportError> {
        let of_file = |path: &Path| crc32_of_file(path).map_err(io_error(path));
        Ok(Self {
            samples_crc32: of_file(samples)?,
            events_crc32: of_file(events)?,
            sessions_crc32: crc32fast::hash(sessions),
        })
    }

    pub fn of_part(&self, part: LakePart) -> Option<u32> {
        match part {
            LakePart::Samples => Some(self.samples_crc32),
            LakePart::Events => Some(self.events_crc32),
            LakePart::Sessions => Some(self.sessions_crc32),
            LakePart::Checksums => None,
        }
    }

    pub fn write(
        &self,
        lake: &Path,
        partition: &Path,
        id: &str,
    ) -> Result<WriteOutcome, ExportError> {
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
