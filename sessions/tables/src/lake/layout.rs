//! Folders of a lake, and its division into shards.

use palpate_sessions::manifest::Manifest;
use sha2::{Digest, Sha256};
use std::fmt::Write;
use std::num::NonZeroU32;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use thiserror::Error;

/// Version of the layout; its folder is `v1`.
pub const LAKE_VERSION: u32 = 1;

/// A missing value in partitioned folders (Apache Hive).
const NO_VALUE: &str = "__HIVE_DEFAULT_PARTITION__";

palpate_model::named! {
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(super) enum LakePart {
        Samples = "samples",
        Sessions = "sessions",
        Events = "events",
        Checksums = "checksums",
    }
}

pub(super) fn root(lake: &Path) -> PathBuf {
    lake.join(format!("v{LAKE_VERSION}"))
}

pub(super) fn part_folder(lake: &Path, part: LakePart) -> PathBuf {
    root(lake).join(part.name())
}

/// Folder of a session's files below the folder of a part.
pub(super) fn partition(manifest: &Manifest) -> PathBuf {
    let rig = manifest.rig.as_ref().map(|rig| rig.name.as_str());
    let month = manifest.started_at.format("%Y-%m");
    Path::new(&format!("rig={}", encode_value(rig.unwrap_or_default())))
        .join(format!("month={month}"))
}

/// Encodes a value for a folder's name: every byte except letters, digits, `-`, `_` and `.` as `%XX`, which readers decode.
pub(super) fn encode_value(text: &str) -> String {
    if text.is_empty() {
        return NO_VALUE.into();
    }
    let mut name = String::new();
    for byte in text.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' | b'.' => {
                name.push(char::from(byte));
            }
            // Writing to a string cannot fail.
            _ => drop(write!(name, "%{byte:02X}")),
        }
    }
    name
}

/// Whether a session's name is safe as the name of a file in a lake.
pub(super) fn is_file_name(id: &str) -> bool {
    let is_plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-_.".contains(&byte);
    // File systems allow 255 bytes, including the ending and the draft's name.
    !id.is_empty() && id.len() <= 200 && !id.starts_with('.') && id.bytes().all(is_plain)
}

#[must_use]
pub fn is_lake(folder: &Path) -> bool {
    part_folder(folder, LakePart::Samples).is_dir()
        && part_folder(folder, LakePart::Sessions).is_dir()
}

/// One of several shards of a lake. A session's shard depends only on its name, so it is the same on every computer and for
/// every content of the lake.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    number: NonZeroU32,
    of: NonZeroU32,
}

#[derive(Debug, Error)]
#[error("{text} is not a shard of a lake; write i/n with i from 1 to n, as in 2/8")]
pub struct ShardError {
    text: String,
}

impl Shard {
    pub const WHOLE: Self = Self { number: NonZeroU32::MIN, of: NonZeroU32::MIN };

    #[must_use]
    pub fn has(self, session_id: &str) -> bool {
        let hash = Sha256::digest(session_id.as_bytes());
        let mut first = [0; 8];
        first.copy_from_slice(&hash[..8]);
        u64::from_be_bytes(first) % u64::from(self.of.get()) == u64::from(self.number.get() - 1)
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Self, ShardError> {
        let parsed = text.split_once('/').and_then(|(number, of)| {
            let (number, of) = (number.parse().ok()?, of.parse().ok()?);
            (number <= of).then_some(Self { number, of })
        });
        parsed.ok_or_else(|| ShardError { text: text.into() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_session_is_in_exactly_one_shard() {
        let ids: Vec<String> = (0..1000).map(|i| format!("20260305T1415{i:02}Z")).collect();
        for of in [1u32, 2, 7] {
            let shards: Vec<Shard> =
                (1..=of).map(|number| format!("{number}/{of}").parse().unwrap()).collect();
            let mut sizes = vec![0; of as usize];
            for id in &ids {
                let within: Vec<usize> = (0..shards.len()).filter(|&i| shards[i].has(id)).collect();
                assert_eq!(within.len(), 1, "{id}");
                sizes[within[0]] += 1;
            }
            let even = ids.len() / of as usize;
            assert!(sizes.iter().all(|size| *size > even / 2), "{sizes:?}");
        }
        // printf %s a | sha256sum begins with ca978112ca1bbdca, which is 2 modulo 4; b with 3e23e8160039594a.
        assert!("3/4".parse::<Shard>().unwrap().has("a"));
        assert!("3/4".parse::<Shard>().unwrap().has("b"));
        for bad in ["0/4", "5/4", "1", "1/0", "a/b", "-1/2"] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
    }

    #[test]
    fn names_never_lead_out_of_the_lake() {
        for bad in ["", "..", "../x", "a/b", ".hidden", "a b", "ä", "a\0"] {
            assert!(!is_file_name(bad), "{bad}");
        }
        assert!(is_file_name("20260305T141507Z-0badcafe"));
        assert_eq!(encode_value("../Rig 1=ä"), "..%2FRig%201%3D%C3%A4");
        assert_eq!(encode_value(""), NO_VALUE);
    }
}
