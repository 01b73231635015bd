//! Opens a recorded session, or says why not. It never returns a number that was not recorded.
//!
//! A finished log must be whole: every chunk's checksum, the checksum over all data and that of
//! the index must be right. A log without an end, as a crash leaves it, opens with everything up
//! to its last whole chunk and a note that says so.
//!
//! The segments of a long recording are read one after the other as if they were one file: sample
//! numbers, message numbers and entries must go on where the segment before stopped.

use super::content::{Content, Refusal};
use super::frames::ChunkReader;
use super::walk::{has_footer, is_barely_begun, may_hold_data, walk};
use crate::folder::{LOG_FILE, segment_file, segment_number};
use crate::manifest::{Manifest, RECORD_VERSION};
use crate::record::{EndRecord, Entry, Row};
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
    /// The log it was read from, or its first segment.
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
    /// Opens a session folder, or one file of it alone.
    ///
    /// A log that was never ended opens with everything in its whole chunks; one that is damaged
    /// anywhere else is refused.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        Reader::new(path, OnDamage::Refuse)?.read()
    }

    /// Opens what stands before the first damage, with a note that says where it is.
    pub fn recover(path: &Path) -> Result<Self, ReadError> {
        Reader::new(path, OnDamage::StopBefore)?.read()
    }

    /// Session time of the newest sample or entry.
    #[must_use]
    pub fn last_time(&self) -> Nanos {
        let row = self.rows.last().map(|row| row.host);
        let entry = self.entries.last().map(|entry| entry.now);
        row.max(entry).unwrap_or(Nanos::ZERO)
    }
}

/// The files to read.
fn find_files(path: &Path) -> Result<Vec<PathBuf>, ReadError> {
    if !path.exists() {
        return Err(ReadError::Missing { path: path.into() });
    }
    if !path.is_dir() {
        return Ok(vec![path.into()]);
    }
    let failed = |source| ReadError::Io {
        path: path.into(),
        source,
    };
    let mut numbers = Vec::new();
    for item in std::fs::read_dir(path).map_err(failed)? {
        let name = item.map_err(failed)?.file_name();
        numbers.extend(name.to_str().and_then(segment_number));
    }
    numbers.sort_unstable();
    let whole = (0..).zip(&numbers).take_while(|(i, n)| i == *n).count();
    // With a gap, the first missing file is listed too: it will be looked for and not found.
    let count = if whole < numbers.len() {
        whole + 1
    } else {
        whole
    };
    Ok((0..count.max(1))
        .map(|number| path.join(segment_file(number as u32)))
        .collect())
}

/// What a segment adds to the session.
enum Outcome {
    /// The next segment goes on from here.
    GoOn,
    /// The segment was begun and holds nothing; it is the last.
    Nothing,
}

/// Damage, and the file it is in.
struct Damage {
    path: PathBuf,
    offset: usize,
    reason: String,
}

/// Reads the files of one session in order.
struct Reader {
    files: Vec<PathBuf>,
    is_folder: bool,
    policy: OnDamage,
    chunks: ChunkReader,
    content: Content,
    /// Where the segment before broke off, if something may be missing from it.
    broken_off: Option<Damage>,
    /// Name of the segment before, if it was not finished.
    unfinished: Option<String>,
    /// Whether the file read last has its data's checksum and its index.
    is_finished: bool,
    notes: Vec<String>,
}

impl Reader {
    fn new(path: &Path, policy: OnDamage) -> Result<Self, ReadError> {
        let files = find_files(path)?;
        let is_folder = path.is_dir();
        let first = &files[0];
        if !first.is_file() && (files.len() == 1 || !is_folder) {
            return Err(ReadError::NotASession {
                path: path.into(),
                reason: format!("it holds no {LOG_FILE}"),
            });
        }
        let chunks = ChunkReader::new().map_err(|source| ReadError::Io {
            path: first.clone(),
            source,
        })?;
        Ok(Self {
            files,
            is_folder,
            policy,
            chunks,
            content: Content::new(!is_folder),
            broken_off: None,
            unfinished: None,
            is_finished: false,
            notes: Vec::new(),
        })
    }

    fn read(mut self) -> Result<Session, ReadError> {
        let files = std::mem::take(&mut self.files);
        let mut damage = None;
        for (number, file) in files.iter().enumerate() {
            let is_last = number + 1 == files.len();
            match self.read_file(file, number == 0, is_last)? {
                Ok(Outcome::GoOn) => {}
                Ok(Outcome::Nothing) => {
                    let name = name_of(file);
                    self.notes.push(format!(
                        "{name} was begun but nothing was recorded in it before the interruption"
                    ));
                }
                Err(found) => {
                    damage = Some(found);
                    break;
                }
            }
        }
        let path = files[0].clone();
        let mut end = self.content.end.take();
        if let Some(Damage {
            path,
            offset,
            reason,
        }) = damage
        {
            if self.policy == OnDamage::Refuse || self.content.manifest.is_none() {
                return Err(ReadError::Damaged {
                    path,
                    offset: offset as u64,
                    reason,
                });
            }
            end = None;
            let place = if files.len() > 1 {
                format!("byte {offset} of {}", name_of(&path))
            } else {
                format!("byte {offset}")
            };
            self.notes.insert(
                0,
                format!(
                    "the recording is damaged at {place} ({reason}); everything after that place was left out"
                ),
            );
        }
        self.session(path, end)
    }

    fn session(mut self, path: PathBuf, end: Option<EndRecord>) -> Result<Session, ReadError> {
        let Some(manifest) = self.content.manifest.take() else {
            return Err(ReadError::Damaged {
                path,
                offset: 0,
                reason: NOT_BEGUN.into(),
            });
        };
        let mut session = Session {
            path,
            manifest,
            rows: self.content.rows,
            entries: self.content.entries,
            end,
            notes: self.notes,
        };
        let last = session.last_time().seconds().0;
        if let Some(imported) = &session.manifest.imported {
            session.notes.extend(imported.notes());
        }
        // Only a segment that others follow is finished without an end.
        let goes_on = !self.is_folder && self.is_finished && session.end.is_none();
        if goes_on {
            session.notes.push(format!(
                "no end record: this part of a recording goes to {last:.1} s; open the session's folder for what follows"
            ));
        } else if session.end.is_none() {
            session.notes.push(format!(
                "no end record: the recording was interrupted at {last:.1} s; everything before is complete"
            ));
        } else if !self.is_finished {
            session
                .notes
                .push("the index at the end is missing; all samples and entries are there".into());
        }
        if self.content.is_later_part {
            session.notes.push(
                "this is a later part of a recording; open the session's folder for what came before"
                    .into(),
            );
        }
        Ok(session)
    }

    /// Reads one file. The outer error is of a kind that even recovery cannot pass.
    fn read_file(
        &mut self,
        path: &Path,
        is_first: bool,
        is_last: bool,
    ) -> Result<Result<Outcome, Damage>, ReadError> {
        let damage = |offset: usize, reason: String| Damage {
            path: path.into(),
            offset,
            reason,
        };
        if !path.is_file() {
            let reason = "this segment is missing, though a later one is there".to_owned();
            return Ok(Err(damage(0, reason)));
        }
        let bytes = std::fs::read(path).map_err(|source| ReadError::Io {
            path: path.into(),
            source,
        })?;
        if is_first {
            check_beginning(path, &bytes)?;
        } else if self.content.end.is_some() {
            let reason = "a segment follows the one that ended the recording".to_owned();
            return Ok(Err(damage(0, reason)));
        } else if is_last && is_barely_begun(&bytes) {
            return Ok(Ok(Outcome::Nothing));
        } else if !bytes.starts_with(mcap::MAGIC) {
            return Ok(Err(damage(0, "it does not begin like a segment".into())));
        }
        self.content.begin_segment();
        let (row_count, entry_count) = (self.content.rows.len(), self.content.entries.len());
        let walked = walk(&bytes, &mut self.chunks, &mut self.content);
        if let Some(refusal) = self.content.refusal.take() {
            return Err(refused(path, refusal));
        }
        let torn = match walked {
            Err(stop) if !stop.is_torn => return Ok(Err(damage(stop.offset, stop.reason))),
            Err(stop) => Some(stop),
            Ok(()) => None,
        };
        // However a file ends: once there is an end record, all it counted must be there.
        if let Err(reason) = self.content.check_totals() {
            return Ok(Err(damage(bytes.len(), reason)));
        }
        let is_finished = has_footer(&bytes);
        if !self.content.has_manifest {
            return Ok(if !is_first && is_last && !is_finished {
                Ok(Outcome::Nothing)
            } else {
                Err(damage(bytes.len(), NOT_BEGUN.into()))
            });
        }
        if self.content.has_data {
            if let Some(broken_off) = self.broken_off.take() {
                self.content.rows.truncate(row_count);
                self.content.entries.truncate(entry_count);
                return Ok(Err(broken_off));
            }
            if let Some(name) = self.unfinished.take() {
                self.notes.push(format!(
                    "{name} was not finished; the next segment goes on where it stops"
                ));
            }
        }
        self.is_finished = is_finished;
        if !is_finished {
            self.unfinished = Some(name_of(path));
        }
        if let Some(stop) = torn.filter(|stop| may_hold_data(&bytes, stop.offset)) {
            self.broken_off = Some(damage(stop.offset, stop.reason));
        }
        Ok(Ok(Outcome::GoOn))
    }
}

const NOT_BEGUN: &str = "the recording was interrupted before it began, or its beginning is lost";

fn name_of(path: &Path) -> String {
    path.file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}

fn check_beginning(path: &Path, bytes: &[u8]) -> Result<(), ReadError> {
    let reason = if bytes.is_empty() {
        "it is empty: nothing was ever recorded"
    } else if !bytes.starts_with(mcap::MAGIC) {
        "it does not begin like one"
    } else {
        return Ok(());
    };
    Err(ReadError::NotASession {
        path: path.into(),
        reason: reason.into(),
    })
}

fn refused(path: &Path, refusal: Refusal) -> ReadError {
    match refusal {
        Refusal::Foreign => ReadError::NotASession {
            path: path.into(),
            reason: "its header names another program".into(),
        },
        Refusal::Newer(software_version, record_version) => ReadError::Newer {
            path: path.into(),
            software_version,
            record_version,
        },
    }
}
