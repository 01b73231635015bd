//! Strict reading of a recorded session: it never returns a number that was not recorded.
//!
//! In a finished log, the checksums of every chunk, of all data and of the index must be right. A log without an end, as a
//! crash leaves it, opens with everything up to its last complete chunk and a note.
//!
//! The segments of a long recording are read like one file: sample numbers, message numbers and entries must continue where
//! the segment before stopped.

pub use super::error::ReadError;

use super::content::{Content, LogPart, Refusal, SegmentState};
use super::files::{absent_spare, check_files, describe_absent, find_files};
use super::frames::ChunkReader;
use super::log_file::LogFile;
use super::walk::walk;
use crate::block::SampleBlock;
use crate::health::HealthSummary;
use crate::manifest::Manifest;
use crate::record::{EndRecord, LogEntry, SampleRow};
use palpate_model::Nanos;
use std::path::{Path, PathBuf};

/// A recorded session in memory.
#[derive(Clone, Debug, PartialEq)]
pub struct Session {
    /// The log, or its first segment.
    pub path: PathBuf,
    pub manifest: Manifest,
    pub rows: Vec<SampleRow>,
    /// Every entry, by `order`.
    pub entries: Vec<LogEntry>,
    /// `None` if the recording was interrupted.
    pub end: Option<EndRecord>,
    /// Remarks for users of the data, one sentence each.
    pub notes: Vec<String>,
    pub auxiliary: AuxiliaryData,
}

/// Summary of a log's data other than samples and entries.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AuxiliaryData {
    /// Number of bytes exchanged with devices; [`Session::scan_parts`] visits them.
    pub raw_bytes: u64,
    pub health: HealthSummary,
}

/// A recorded session without its samples.
#[derive(Clone, Debug, PartialEq)]
pub struct SessionOutline {
    /// The log, or its first segment.
    pub path: PathBuf,
    pub manifest: Manifest,
    pub samples: u64,
    /// Every entry, by `order`.
    pub entries: Vec<LogEntry>,
    /// `None` if the recording was interrupted.
    pub end: Option<EndRecord>,
    /// Remarks for users of the data, one sentence each.
    pub notes: Vec<String>,
    pub auxiliary: AuxiliaryData,
}

impl Session {
    /// Opens a session folder, or a single file of it.
    ///
    /// A log without an end opens with its complete chunks; a damaged log is refused.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let mut rows = Vec::new();
        let mut visit = |block: &SampleBlock| rows.extend(block.rows());
        let outline = Self::scan(path, &mut visit)?;
        Ok(Self {
            path: outline.path,
            manifest: outline.manifest,
            rows,
            entries: outline.entries,
            end: outline.end,
            notes: outline.notes,
            auxiliary: outline.auxiliary,
        })
    }

    /// Whether the session is complete: not interrupted, cut off or recovered with losses. A change of files after a disk
    /// failure does not matter.
    pub fn is_whole(&self) -> bool {
        let recovered = self.manifest.recovered.as_ref();
        let is_cut = |note: &String| [NO_INDEX, LATER_PART].contains(&note.as_str());
        self.end.is_some()
            && recovered.is_none_or(|recovered| recovered.missing.sentences().is_empty())
            && !self.notes.iter().any(is_cut)
    }

    /// CRC-32 over tick, volts and pulses of every sample in order, eight bytes each, little-endian; independent of the
    /// division into segments.
    pub fn checksum(&self) -> u32 {
        let mut hasher = crc32fast::Hasher::new();
        for row in &self.rows {
            hasher.update(&row.tick.to_le_bytes());
            hasher.update(&row.volts.unwrap_or(f64::NAN).to_le_bytes());
            hasher.update(&row.pulses.unwrap_or(i64::MIN).to_le_bytes());
        }
        hasher.finalize()
    }

    /// Visits the samples block by block, with at most one block in memory. The visited data is valid only if this returns
    /// without an error.
    pub fn scan(
        path: &Path,
        visit: &mut dyn FnMut(&SampleBlock),
    ) -> Result<SessionOutline, ReadError> {
        Self::scan_parts(path, &mut |part| {
            if let LogPart::Samples(block) = part {
                visit(block);
            }
        })
    }

    /// Like [`scan`](Self::scan), with raw bytes and health, in the order of recording.
    pub fn scan_parts(
        path: &Path,
        visit: &mut dyn FnMut(LogPart<'_>),
    ) -> Result<SessionOutline, ReadError> {
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
enum SegmentOutcome {
    /// The next segment continues here.
    Content,
    /// The segment was begun but has no data.
    Nothing,
}

/// Damage, and the file it is in.
struct Damage {
    path: PathBuf,
    offset: u64,
    reason: String,
    /// Whether an interrupted write explains it.
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
    /// Damage at the end of former segments, until a later segment makes up for it.
    broken_off: Vec<Damage>,
    /// Name of the former segment if it is unfinished.
    unfinished: Option<String>,
    /// Whether the last file read has a checksum over its data, and an index.
    is_finished: bool,
    notes: Vec<String>,
}

impl<'v> Reader<'v> {
    fn new(path: &Path, visit: &'v mut dyn FnMut(LogPart<'_>)) -> Result<Self, ReadError> {
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

    fn read(mut self) -> Result<SessionOutline, ReadError> {
        let files = std::mem::take(&mut self.files);
        let mut damage = None;
        for (number, file) in files.iter().enumerate() {
            match self.read_file(file, number == 0, files.len() == 1)? {
                Ok(SegmentOutcome::Content) => {}
                Ok(SegmentOutcome::Nothing) => {
                    let name = name_of(file);
                    self.notes.push(format!(
                        "{name} is empty: the recording was interrupted before this file received data"
                    ));
                }
                Err(found) => {
                    damage = Some(found);
                    break;
                }
            }
        }
        // Damage that no later segment made up for.
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

    fn outline(
        mut self,
        path: PathBuf,
        end: Option<EndRecord>,
    ) -> Result<SessionOutline, ReadError> {
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
            let missing = recovered.missing.sentences();
            let missing =
                if missing.is_empty() { "nothing is missing".into() } else { missing.join("; ") };
            notes.push(format!("the session was recovered from {}: {missing}", recovered.from));
        }
        // Only a segment with a successor is finished without an end.
        let goes_on = !self.is_folder && self.is_finished && end.is_none();
        if goes_on {
            notes.push(format!(
                "this part of a recording ends at {last:.1} s and has no end record; open the session's folder for the later parts"
            ));
        } else if end.is_none()
            && let Some(spare) = &self.absent_spare
        {
            let absent = describe_absent(spare);
            notes.push(format!("the recording has no end record, and the data in this folder end at {last:.1} s; {absent}"));
        } else if end.is_none() {
            notes.push(format!(
                "the recording has no end record: it was interrupted at {last:.1} s; all data before that time are complete"
            ));
        } else if !self.is_finished {
            notes.push(NO_INDEX.into());
        }
        if self.content.is_later_part {
            notes.push(LATER_PART.into());
        }
        Ok(SessionOutline {
            path,
            manifest,
            samples: self.content.samples,
            entries,
            end,
            notes,
            auxiliary: AuxiliaryData {
                raw_bytes: self.content.raw_bytes,
                health: self.content.health,
            },
        })
    }

    /// Reads one file. The outer error also prevents a recovery.
    fn read_file(
        &mut self,
        path: &Path,
        is_first: bool,
        is_alone: bool,
    ) -> Result<Result<SegmentOutcome, Damage>, ReadError> {
        let damage = |offset: u64, reason: &str| Damage::at(path, offset, reason);
        let failed = |source| ReadError::Io { path: path.into(), source };
        if !path.is_file() {
            let mut reason = "this segment is missing, but a later segment exists".to_owned();
            if let Some(spare) = &self.absent_spare {
                reason = format!("{reason}; {}", describe_absent(spare));
            }
            return Ok(Err(damage(0, &reason)));
        }
        let source = LogFile::open(path).map_err(failed)?;
        let is_ours = source.begins_with(mcap::MAGIC).map_err(failed)?;
        if is_first && is_alone {
            check_beginning(path, &source, is_ours)?;
        } else if is_first && !is_ours {
            return Ok(Err(damage(0, NO_BEGINNING)));
        } else if !is_first && source.is_barely_begun().map_err(failed)? {
            // Its data, if any, is missed by the next segment.
            return Ok(Ok(SegmentOutcome::Nothing));
        } else if !is_ours {
            self.broken_off.push(damage(0, NO_BEGINNING));
            return Ok(Ok(SegmentOutcome::Content));
        }
        self.read_segment(path, &source, is_first)
    }

    /// Like [`read_file`](Self::read_file), for a file that begins like a segment.
    fn read_segment(
        &mut self,
        path: &Path,
        source: &LogFile,
        is_first: bool,
    ) -> Result<Result<SegmentOutcome, Damage>, ReadError> {
        let damage = |offset: u64, reason: &str| Damage::at(path, offset, reason);
        let failed = |source| ReadError::Io { path: path.into(), source };
        let had_end = self.content.end.is_some();
        self.content.enter_segment(SegmentState::default());
        let walked = walk(source, &mut self.chunks, &mut self.content).map_err(failed)?;
        self.last_sample = self.last_sample.max(self.content.last_sample);
        if let Some(refusal) = self.content.refusal.take() {
            return Err(refused(path, refusal));
        }
        let is_rewrite = self.content.segment.is_rewrite;
        if had_end && !is_rewrite {
            let reason = "a segment follows the segment with the end record";
            return Ok(Err(damage(0, reason)));
        }
        let is_finished = source.has_footer().map_err(failed)?;
        let stop = walked.err();
        if stop.as_ref().is_none_or(|stop| stop.is_torn) {
            if !self.content.segment.has_manifest {
                return Ok(if is_first || is_finished {
                    Err(damage(source.length(), NOT_BEGUN))
                } else {
                    Ok(SegmentOutcome::Nothing)
                });
            }
            // With an end record, everything that it counts must be present.
            if let Err(reason) = self.content.check_totals() {
                return Ok(Err(damage(source.length(), &reason)));
            }
        }
        let here =
            stop.map(|stop| Damage { is_torn: stop.is_torn, ..damage(stop.offset, &stop.reason) });
        let is_damaged = here.as_ref().is_some_and(|here| !here.is_torn);
        // Messages without a gap prove that nothing is missing. But only a rewriting segment makes up for damage that no
        // interrupted write explains.
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
                    "writing {name} failed; {name_here} repeats the data that {name} may have lost"
                )
            } else {
                format!("{name} is unfinished; the next segment continues where it stops")
            });
        }
        self.is_finished = is_finished;
        if !is_finished || is_damaged {
            self.unfinished = Some(name_of(path));
        }
        Ok(Ok(SegmentOutcome::Content))
    }
}

const NO_INDEX: &str = "the index at the end is missing; all samples and entries are present";
const LATER_PART: &str =
    "this is a later part of a recording; open the session's folder for the earlier parts";

pub(crate) const NO_BEGINNING: &str = "its first bytes are not those of a segment";
pub(crate) const NOT_BEGUN: &str =
    "the recording was interrupted before any data were written, or its beginning is lost";

pub(crate) fn damaged(path: &Path, offset: u64, reason: &str) -> ReadError {
    ReadError::Damaged { path: path.into(), offset, reason: reason.into() }
}

pub(crate) fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

pub(crate) fn check_beginning(
    path: &Path,
    source: &LogFile,
    is_ours: bool,
) -> Result<(), ReadError> {
    let reason = if source.length() == 0 {
        "it is empty: nothing was recorded"
    } else if !is_ours {
        "its first bytes are not those of a session log"
    } else {
        return Ok(());
    };
    Err(ReadError::NotASession { path: path.into(), reason: reason.into() })
}

pub(crate) fn refused(path: &Path, refusal: Refusal) -> ReadError {
    match refusal {
        Refusal::Foreign => ReadError::NotASession {
            path: path.into(),
            reason: "according to its header, another program wrote the file".into(),
        },
        Refusal::Newer(software_version, record_version) => {
            ReadError::Newer { path: path.into(), software_version, record_version }
        }
    }
}
