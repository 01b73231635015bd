//! Opens a recorded session, or says why not. It never returns a number that was not recorded.
//!
//! A finished log must be whole: every chunk's checksum, the checksum over all data and that of
//! the index must be right. A log without an end, as a crash leaves it, opens with everything up
//! to its last whole chunk and a note that says so.

use super::content::{Content, Refusal};
use super::frames::{
    ChunkReader, FOOTER_BYTES, Fields, Frame, FrameError, frame_at, has_chunk_after,
};
use crate::folder::LOG_FILE;
use crate::manifest::{Manifest, RECORD_VERSION};
use crate::record::{EndRecord, Entry, Row};
use mcap::records::op;
use palpate_model::Nanos;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A session could not be opened.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReadError {
    /// Nothing is at the path.
    #[error("there is no session at {}; check the path", path.display())]
    Missing {
        /// The path given.
        path: PathBuf,
    },
    /// Something is at the path, but not a session.
    #[error("{} is not a palpate session ({reason}); choose a session folder or its {LOG_FILE}", path.display())]
    NotASession {
        /// The path given.
        path: PathBuf,
        /// How it differs.
        reason: String,
    },
    /// The session was written by a newer version of the program.
    #[error(
        "{} was written by palpate {software_version} with record version {record_version}; this palpate reads up to {RECORD_VERSION}; update palpate", path.display()
    )]
    Newer {
        /// The log.
        path: PathBuf,
        /// The program that wrote it.
        software_version: String,
        /// Its record version.
        record_version: u64,
    },
    /// The session is not as it was written.
    #[error(
        "{} is damaged at byte {offset} ({reason}); restore it from a backup, or recover the part before the damage", path.display()
    )]
    Damaged {
        /// The log.
        path: PathBuf,
        /// Where in the file.
        offset: u64,
        /// What is wrong there.
        reason: String,
    },
    /// The system does not let the session be read.
    #[error("cannot read {} ({source}); check its permissions and the disk", path.display())]
    Io {
        /// The log.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

/// A recorded session in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Session {
    /// The log it was read from.
    pub path: PathBuf,
    /// What the session says about itself.
    pub manifest: Manifest,
    /// Every sample, in order.
    pub rows: Vec<Row>,
    /// Every entry, by `order`.
    pub entries: Vec<Entry>,
    /// How the session ended; `None` if it was interrupted.
    pub end: Option<EndRecord>,
    /// What a user of the data must know, one sentence each.
    pub notes: Vec<String>,
}

/// What to do about damage.
#[derive(Clone, Copy, PartialEq, Eq)]
enum OnDamage {
    Refuse,
    StopBefore,
}

impl Session {
    /// Opens a session folder or its log.
    ///
    /// A log that was never ended opens with everything in its whole chunks; one that is damaged
    /// anywhere else is refused.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let (log, bytes) = read_log(path)?;
        read_session(log, &bytes, OnDamage::Refuse)
    }

    /// Opens what stands before the first damage, with a note that says where it is.
    pub fn recover(path: &Path) -> Result<Self, ReadError> {
        let (log, bytes) = read_log(path)?;
        read_session(log, &bytes, OnDamage::StopBefore)
    }

    /// Session time of the newest sample or entry.
    #[must_use]
    pub fn last_time(&self) -> Nanos {
        let row = self.rows.last().map(|row| row.host);
        let entry = self.entries.last().map(|entry| entry.now);
        row.max(entry).unwrap_or(Nanos::ZERO)
    }
}

fn read_log(path: &Path) -> Result<(PathBuf, Vec<u8>), ReadError> {
    if !path.exists() {
        return Err(ReadError::Missing { path: path.into() });
    }
    let log = if path.is_dir() {
        path.join(LOG_FILE)
    } else {
        path.to_owned()
    };
    if !log.is_file() {
        return Err(ReadError::NotASession {
            path: path.into(),
            reason: format!("it holds no {LOG_FILE}"),
        });
    }
    match std::fs::read(&log) {
        Ok(bytes) => Ok((log, bytes)),
        Err(source) => Err(ReadError::Io { path: log, source }),
    }
}

/// Why the walk ended before the end of the data.
struct Stop {
    offset: usize,
    reason: String,
    /// Whether this is how an interrupted write looks, and not damage.
    is_torn: bool,
}

fn read_session(path: PathBuf, bytes: &[u8], policy: OnDamage) -> Result<Session, ReadError> {
    let not_a_session = |reason: &str| ReadError::NotASession {
        path: path.clone(),
        reason: reason.into(),
    };
    if bytes.is_empty() {
        return Err(not_a_session("it is empty: nothing was ever recorded"));
    }
    if !bytes.starts_with(mcap::MAGIC) {
        return Err(not_a_session("it does not begin like one"));
    }
    let mut chunks = ChunkReader::new().map_err(|source| ReadError::Io {
        path: path.clone(),
        source,
    })?;
    let mut content = Content::default();
    let walked = match walk(bytes, &mut chunks, &mut content) {
        Err(stop) if !stop.is_torn => Err(stop),
        // However a file ends: once there is an end record, all it counted must be there.
        Ok(()) | Err(_) => content.check_totals().map_err(|reason| Stop {
            offset: bytes.len(),
            reason,
            is_torn: false,
        }),
    };
    if let Some(refusal) = content.refusal {
        return Err(match refusal {
            Refusal::Foreign => not_a_session("its header names another program"),
            Refusal::Newer(software_version, record_version) => ReadError::Newer {
                path,
                software_version,
                record_version,
            },
        });
    }
    let mut notes = Vec::new();
    let mut end = content.end;
    match walked {
        Ok(()) => {}
        Err(stop) if policy == OnDamage::StopBefore => {
            end = None;
            notes.push(format!(
                "the recording is damaged at byte {} ({}); everything after that place was left out",
                stop.offset, stop.reason
            ));
        }
        Err(stop) => {
            return Err(ReadError::Damaged {
                path,
                offset: stop.offset as u64,
                reason: stop.reason,
            });
        }
    }
    let Some(manifest) = content.manifest else {
        return Err(ReadError::Damaged {
            path,
            offset: bytes.len() as u64,
            reason: "the recording was interrupted before it began, or its beginning is lost"
                .into(),
        });
    };
    let mut session = Session {
        path,
        manifest,
        rows: content.rows,
        entries: content.entries,
        end,
        notes,
    };
    if session.end.is_none() {
        let note = format!(
            "no end record: the recording was interrupted at {:.1} s; everything before is complete",
            session.last_time().seconds().0
        );
        session.notes.push(note);
    } else if !has_footer(bytes) {
        session
            .notes
            .push("the index at the end is missing; all samples and entries are there".into());
    }
    Ok(session)
}

/// Whether the file claims to be finished: a footer and the closing magic are in their place.
fn has_footer(bytes: &[u8]) -> bool {
    bytes.len() >= mcap::MAGIC.len() + FOOTER_BYTES
        && bytes.ends_with(mcap::MAGIC)
        && bytes[bytes.len() - FOOTER_BYTES] == op::FOOTER
}

/// Goes through all frames of the data section.
fn walk(bytes: &[u8], chunks: &mut ChunkReader, content: &mut Content) -> Result<(), Stop> {
    let is_finished = has_footer(bytes);
    // Everything behind the last byte that is not zero may never have reached the disk.
    let written = bytes
        .iter()
        .rposition(|&byte| byte != 0)
        .map_or(0, |i| i + 1);
    let mut offset = mcap::MAGIC.len();
    while offset < bytes.len() {
        let damage = |reason: String, frame_end: usize| Stop {
            offset,
            reason,
            // Zeros from within this frame to the end of the file are what a power cut leaves.
            is_torn: !is_finished && written <= frame_end && written < bytes.len(),
        };
        let frame = match frame_at(bytes, offset) {
            Ok(frame) => frame,
            Err(FrameError::TooLong) => {
                return Err(damage("a record is longer than 64 MiB".into(), offset));
            }
            Err(FrameError::PastEnd) => {
                return Err(Stop {
                    offset,
                    reason: "a record runs past the end of the file".into(),
                    is_torn: !is_finished && !has_chunk_after(bytes, offset, chunks),
                });
            }
        };
        match frame.opcode {
            op::HEADER => content.take_header(frame.body),
            op::MESSAGE_INDEX => {}
            op::CHUNK => {
                let records = chunks
                    .open(frame.body)
                    .map_err(|reason| damage(reason, frame.next))?;
                content.take_chunk(records).map_err(|reason| Stop {
                    offset,
                    reason,
                    is_torn: false,
                })?;
            }
            op::DATA_END => return check_end(bytes, offset, frame, content),
            // Other tools may add these to a finished file, whose checksums prove them.
            op::ATTACHMENT | op::METADATA | 0x80.. if is_finished => {}
            _ => {
                return Err(damage(
                    "a record is of an unexpected kind".into(),
                    frame.next,
                ));
            }
        }
        if content.refusal.is_some() {
            return Ok(());
        }
        offset = frame.next;
    }
    Ok(())
}

/// Checks the checksums of the data and of the index.
fn check_end(
    bytes: &[u8],
    offset: usize,
    data_end: Frame<'_>,
    content: &Content,
) -> Result<(), Stop> {
    let stop = |offset: usize, reason: &str| Stop {
        offset,
        reason: reason.into(),
        is_torn: false,
    };
    if Fields(data_end.body).u32() != Some(crc32fast::hash(&bytes[..offset])) {
        return Err(stop(offset, "the checksum over all samples is wrong"));
    }
    if content.end.is_none() {
        return Err(stop(offset, "the end record is missing"));
    }
    if has_footer(bytes) {
        let footer = bytes.len() - FOOTER_BYTES;
        let checksum = bytes.len() - mcap::MAGIC.len() - 4;
        // The footer's own first two fields are part of the sum.
        let summed = bytes.get(data_end.next..checksum).map(crc32fast::hash);
        let is_right = summed.is_some() && Fields(&bytes[checksum..]).u32() == summed;
        if !is_right {
            return Err(stop(footer, "the checksum of the index is wrong"));
        }
    }
    Ok(())
}
