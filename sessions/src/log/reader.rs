//! Opens a recorded session, or says why not. It never returns a number that was not recorded.
//!
//! A finished log must be whole: every chunk's checksum, the checksum over all data and that of
//! the index must be right. A log without an end, as a crash leaves it, opens with everything up
//! to its last whole chunk and a note that says so.
//!
//! The segments of a long recording are read one after the other as if they were one file: sample
//! numbers, message numbers and entries must go on where the segment before stopped.

pub use super::error::ReadError;

use super::content::{Content, Part, Refusal};
use super::files::{absent_spare, away, check_files, find_files};
use super::frames::ChunkReader;
use super::source::Source;
use super::walk::walk;
use crate::block::Block;
use crate::health::HealthSummary;
use crate::manifest::Manifest;
use crate::record::{EndRecord, Entry, Row};
use palpate_model::Nanos;
use std::path::{Path, PathBuf};

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
    /// What is recorded beside samples and entries.
    pub beside: Beside,
}

/// What a log holds beside samples and entries, counted and summed up.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Beside {
    /// Bytes as exchanged with devices; [`Session::scan_parts`] hands them out.
    pub raw_bytes: u64,
    /// How the computer kept up.
    pub health: HealthSummary,
}

/// A recorded session without its samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    /// The log it was read from, or its first segment.
    pub path: PathBuf,
    /// What the session says about itself.
    pub manifest: Manifest,
    /// How many samples there are.
    pub samples: u64,
    /// Every entry, by `order`.
    pub entries: Vec<Entry>,
    /// How the session ended; `None` if it was interrupted.
    pub end: Option<EndRecord>,
    /// What a user of the data must know, one sentence each.
    pub notes: Vec<String>,
    /// What is recorded beside samples and entries.
    pub beside: Beside,
}

impl Session {
    /// Opens a session folder, or one file of it alone.
    ///
    /// A log that was never ended opens with everything in its whole chunks; one that is damaged
    /// anywhere else is refused.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let mut rows = Vec::new();
        let mut visit = |block: &Block| rows.extend(block.rows());
        let outline = Self::scan(path, &mut visit)?;
        Ok(Self {
            path: outline.path,
            manifest: outline.manifest,
            rows,
            entries: outline.entries,
            end: outline.end,
            notes: outline.notes,
            beside: outline.beside,
        })
    }

    /// Whether it is as it was recorded, to the end: nothing was interrupted, lost, cut off or left out. Files that a
    /// failing disk made a recording go on in do not make it less.
    pub fn is_whole(&self) -> bool {
        let recovered = self.manifest.recovered.as_ref();
        let is_cut = |note: &String| [NO_INDEX, LATER_PART].contains(&note.as_str());
        self.end.is_some()
            && recovered.is_none_or(|recovered| recovered.missing.sentences().is_empty())
            && !self.notes.iter().any(is_cut)
    }

    /// CRC-32 over the raw of every sample in order: tick, volts and pulses, eight bytes each, lowest first.
    /// How the log is cut into files is not in it.
    pub fn checksum(&self) -> u32 {
        let mut hasher = crc32fast::Hasher::new();
        for row in &self.rows {
            hasher.update(&row.tick.to_le_bytes());
            hasher.update(&row.volts.unwrap_or(f64::NAN).to_le_bytes());
            hasher.update(&row.pulses.unwrap_or(i64::MIN).to_le_bytes());
        }
        hasher.finalize()
    }

    /// Goes through the samples of a session block by block, so that no more than one block is in
    /// memory. Nothing of it counts before this has returned without an error.
    pub fn scan(path: &Path, visit: &mut dyn FnMut(&Block)) -> Result<Outline, ReadError> {
        Self::scan_parts(path, &mut |part| {
            if let Part::Samples(block) = part {
                visit(block);
            }
        })
    }

    /// As [`scan`](Self::scan), with raw bytes and health too, in the order in which they were written.
    pub fn scan_parts(path: &Path, visit: &mut dyn FnMut(Part<'_>)) -> Result<Outline, ReadError> {
        Reader::new(path, visit)?.read()
    }

    /// Session time of the newest sample or entry.
    pub fn last_time(&self) -> Nanos {
        let row = self.rows.last().map(|row| row.host);
        let entry = self.entries.last().map(|entry| entry.now);
        row.max(entry).unwrap_or(Nanos::ZERO)
    }
}

/// What a segment adds to the session.
enum Outcome {
    /// The next segment goes on from here.
    GoOn,
    /// The segment was begun and holds nothing.
    Nothing,
}

/// Damage, and the file it is in.
struct Damage {
    path: PathBuf,
    offset: u64,
    reason: String,
    /// Whether this is how an interrupted write looks.
    is_torn: bool,
}

impl Damage {
    /// Damage that no interrupted write explains.
    fn at(path: &Path, offset: u64, reason: &str) -> Self {
        Self { path: path.into(), offset, reason: reason.into(), is_torn: false }
    }
}

/// Reads the files of one session in order.
struct Reader<'v> {
    files: Vec<PathBuf>,
    is_folder: bool,
    absent_spare: Option<PathBuf>,
    chunks: ChunkReader,
    content: Content<'v>,
    /// Session time of the newest sample.
    last_sample: Nanos,
    /// Where the segments before broke off, until a later one has made that good.
    broken_off: Vec<Damage>,
    /// Name of the segment before, if it was not finished.
    unfinished: Option<String>,
    /// Whether the file read last has its data's checksum and its index.
    is_finished: bool,
    notes: Vec<String>,
}

impl<'v> Reader<'v> {
    fn new(path: &Path, visit: &'v mut dyn FnMut(Part<'_>)) -> Result<Self, ReadError> {
        let files = find_files(path)?;
        let is_folder = path.is_dir();
        let first = &files[0];
        check_files(path, &files)?;
        let chunks =
            ChunkReader::new().map_err(|source| ReadError::Io { path: first.clone(), source })?;
        Ok(Self {
            absent_spare: absent_spare(path),
            files,
            is_folder,
            chunks,
            content: Content::new(!is_folder, visit),
            last_sample: Nanos::ZERO,
            broken_off: Vec::new(),
            unfinished: None,
            is_finished: false,
            notes: Vec::new(),
        })
    }

    fn read(mut self) -> Result<Outline, ReadError> {
        let files = std::mem::take(&mut self.files);
        let mut damage = None;
        for (number, file) in files.iter().enumerate() {
            match self.read_file(file, number == 0, files.len() == 1)? {
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
        // Damage that no later segment made good.
        let damage = damage.or_else(|| {
            let is_damaged = self.broken_off.iter().any(|one| !one.is_torn);
            is_damaged.then(|| self.broken_off.swap_remove(0))
        });
        let path = files[0].clone();
        if let Some(damage) = damage {
            return Err(damaged(&damage.path, damage.offset, &damage.reason));
        }
        let end = self.content.end.take();
        self.outline(path, end)
    }

    fn outline(mut self, path: PathBuf, end: Option<EndRecord>) -> Result<Outline, ReadError> {
        let Some(manifest) = self.content.manifest.take() else {
            return Err(ReadError::Damaged { path, offset: 0, reason: NOT_BEGUN.into() });
        };
        let entries = std::mem::take(&mut self.content.entries);
        let last =
            entries.last().map_or(Nanos::ZERO, |entry| entry.now).max(self.last_sample).seconds().0;
        let mut notes = self.notes;
        if let Some(imported) = &manifest.imported {
            notes.extend(imported.notes());
        }
        if let Some(recovered) = &manifest.recovered {
            let lost = recovered.missing.sentences();
            let lost = if lost.is_empty() { "nothing is missing".into() } else { lost.join("; ") };
            notes.push(format!("recovered from {}: {lost}", recovered.from));
        }
        // Only a segment that others follow is finished without an end.
        let goes_on = !self.is_folder && self.is_finished && end.is_none();
        if goes_on {
            notes.push(format!(
                "no end record: this part of a recording goes to {last:.1} s; open the session's folder for what follows"
            ));
        } else if end.is_none()
            && let Some(spare) = &self.absent_spare
        {
            let away = away(spare);
            notes.push(format!("no end record: the recording stops at {last:.1} s here; {away}"));
        } else if end.is_none() {
            notes.push(format!(
                "no end record: the recording was interrupted at {last:.1} s; everything before is complete"
            ));
        } else if !self.is_finished {
            notes.push(NO_INDEX.into());
        }
        if self.content.is_later_part {
            notes.push(LATER_PART.into());
        }
        Ok(Outline {
            path,
            manifest,
            samples: self.content.samples,
            entries,
            end,
            notes,
            beside: Beside { raw_bytes: self.content.raw_bytes, health: self.content.health },
        })
    }

    /// Reads one file. The outer error is of a kind that even recovery cannot pass.
    fn read_file(
        &mut self,
        path: &Path,
        is_first: bool,
        is_alone: bool,
    ) -> Result<Result<Outcome, Damage>, ReadError> {
        let damage = |offset: u64, reason: &str| Damage::at(path, offset, reason);
        let failed = |source| ReadError::Io { path: path.into(), source };
        if !path.is_file() {
            let mut reason = "this segment is missing, though a later one is there".to_owned();
            if let Some(spare) = &self.absent_spare {
                reason = format!("{reason}; {}", away(spare));
            }
            return Ok(Err(damage(0, &reason)));
        }
        let source = Source::open(path).map_err(failed)?;
        let is_ours = source.begins_with(mcap::MAGIC).map_err(failed)?;
        if is_first && is_alone {
            check_beginning(path, &source, is_ours)?;
        } else if is_first && !is_ours {
            return Ok(Err(damage(0, NO_BEGINNING)));
        } else if !is_first && source.is_barely_begun().map_err(failed)? {
            // What should be in it shows as missing in the next, if anything follows.
            return Ok(Ok(Outcome::Nothing));
        } else if !is_ours {
            self.broken_off.push(damage(0, NO_BEGINNING));
            return Ok(Ok(Outcome::GoOn));
        }
        self.read_segment(path, &source, is_first)
    }

    /// As [`read_file`](Self::read_file), of a file that begins like a segment.
    fn read_segment(
        &mut self,
        path: &Path,
        source: &Source,
        is_first: bool,
    ) -> Result<Result<Outcome, Damage>, ReadError> {
        let damage = |offset: u64, reason: &str| Damage::at(path, offset, reason);
        let failed = |source| ReadError::Io { path: path.into(), source };
        let had_end = self.content.end.is_some();
        self.content.begin_segment();
        let walked = walk(source, &mut self.chunks, &mut self.content).map_err(failed)?;
        self.last_sample = self.last_sample.max(self.content.last_sample);
        if let Some(refusal) = self.content.refusal.take() {
            return Err(refused(path, refusal));
        }
        let is_rewrite = self.content.is_rewrite;
        if had_end && !is_rewrite {
            let reason = "a segment follows the one that ended the recording";
            return Ok(Err(damage(0, reason)));
        }
        let is_finished = source.has_footer().map_err(failed)?;
        let stop = walked.err();
        if stop.as_ref().is_none_or(|stop| stop.is_torn) {
            if !self.content.has_manifest {
                return Ok(if is_first || is_finished {
                    Err(damage(source.length(), NOT_BEGUN))
                } else {
                    Ok(Outcome::Nothing)
                });
            }
            // However a file ends: once there is an end record, all it counted must be there.
            if let Err(reason) = self.content.check_totals() {
                return Ok(Err(damage(source.length(), &reason)));
            }
        }
        let here =
            stop.map(|stop| Damage { is_torn: stop.is_torn, ..damage(stop.offset, &stop.reason) });
        let is_damaged = here.as_ref().is_some_and(|here| !here.is_torn);
        // Messages that go on without a gap prove that nothing is missing. But what is damaged, and
        // not only torn, is made good by nothing but a segment that was begun because of it.
        let is_strange = self.broken_off.iter().any(|one| !one.is_torn);
        if !self.broken_off.is_empty() && !is_rewrite && (is_damaged || is_strange) {
            return Ok(Err(self.broken_off.swap_remove(0)));
        }
        if !is_damaged {
            self.broken_off.clear();
        }
        self.broken_off.extend(here);
        if let Some(name) = self.unfinished.take() {
            self.notes.push(if is_rewrite {
                let name_here = name_of(path);
                format!(
                    "{name} failed while it was written; {name_here} holds what it may have lost"
                )
            } else {
                format!("{name} was not finished; the next segment goes on where it stops")
            });
        }
        self.is_finished = is_finished;
        if !is_finished || is_damaged {
            self.unfinished = Some(name_of(path));
        }
        Ok(Ok(Outcome::GoOn))
    }
}

const NO_INDEX: &str = "the index at the end is missing; all samples and entries are there";
const LATER_PART: &str =
    "this is a later part of a recording; open the session's folder for what came before";

pub(crate) const NO_BEGINNING: &str = "it does not begin like a segment";
pub(crate) const NOT_BEGUN: &str =
    "the recording was interrupted before it began, or its beginning is lost";

pub(crate) fn damaged(path: &Path, offset: u64, reason: &str) -> ReadError {
    ReadError::Damaged { path: path.into(), offset, reason: reason.into() }
}

pub(crate) fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

pub(crate) fn check_beginning(
    path: &Path,
    source: &Source,
    is_ours: bool,
) -> Result<(), ReadError> {
    let reason = if source.length() == 0 {
        "it is empty: nothing was ever recorded"
    } else if !is_ours {
        "it does not begin like one"
    } else {
        return Ok(());
    };
    Err(ReadError::NotASession { path: path.into(), reason: reason.into() })
}

pub(crate) fn refused(path: &Path, refusal: Refusal) -> ReadError {
    match refusal {
        Refusal::Foreign => ReadError::NotASession {
            path: path.into(),
            reason: "its header names another program".into(),
        },
        Refusal::Newer(software_version, record_version) => {
            ReadError::Newer { path: path.into(), software_version, record_version }
        }
    }
}
