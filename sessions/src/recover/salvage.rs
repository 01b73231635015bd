//! Reads everything undamaged from a session's files.

use super::{DamageSite, MissingData, SampleGap};
use crate::block::SampleBlock;
use crate::log::content::{Content, LogPart, SegmentState};
use crate::log::files::{check_files, find_files};
use crate::log::frames::{ChunkReader, FRAME_HEADER_BYTES};
use crate::log::log_file::LogFile;
use crate::log::reader::{NO_BEGINNING, NOT_BEGUN, check_beginning, damaged, name_of, refused};
use crate::log::walk::next_chunk;
use crate::log::{ReadError, Session};
use crate::manifest::Manifest;
use crate::record::{EndRecord, LogEntry};
use mcap::records::op;
use std::io;
use std::path::{Path, PathBuf};

/// The readable part of a session, without its samples.
#[derive(Clone, Debug, PartialEq)]
pub struct Salvage {
    pub manifest: Manifest,
    pub samples: u64,
    /// Readable entries, by `order`. Their `after_sample` counts the recorded samples.
    pub entries: Vec<LogEntry>,
    /// Whether the entries include every decision up to the last sample.
    pub has_every_decision: bool,
    /// Whether a segment between others is missing.
    pub lacks_segments: bool,
    pub raw_bytes: u64,
    pub end: Option<EndRecord>,
    pub missing: MissingData,
}

/// Visits every undamaged block of samples in order.
pub fn salvage(path: &Path, visit: &mut dyn FnMut(&SampleBlock)) -> Result<Salvage, ReadError> {
    let mut salvage = salvage_parts(path, &mut |part| {
        if let LogPart::Samples(block) = part {
            visit(block);
        }
    })?;
    // The file may be damaged outside the data, as in its index.
    if !salvage.missing.is_lossy()
        && let Err(ReadError::Damaged { path, offset, reason }) = Session::scan(path, &mut |_| {})
    {
        salvage.missing.damage.push(DamageSite { file: name_of(&path), offset, reason });
    }
    Ok(salvage)
}

/// Like [`salvage`], for all kinds of data, without a check of the index.
pub(super) fn salvage_parts(
    path: &Path,
    visit: &mut dyn FnMut(LogPart<'_>),
) -> Result<Salvage, ReadError> {
    let files = find_files(path)?;
    check_files(path, &files)?;
    let failed = |source| ReadError::Io { path: path.into(), source };
    let mut tally = Tally::default();
    let mut note = |part: LogPart<'_>| {
        visit(part);
        if let LogPart::Samples(block) = part {
            tally.count(block);
        }
    };
    let mut content = Content::new(!path.is_dir(), &mut note);
    content.allow_gaps();
    let mut search = Search {
        files: &files,
        chunks: ChunkReader::new().map_err(failed)?,
        content,
        damage: Vec::new(),
    };
    let mut next = 0;
    while next < files.len() {
        next = search.read(next)?;
    }
    let Search { mut content, damage, .. } = search;
    let (mut missing_entries, is_later) = (content.missing_entries, content.is_later_part);
    let missing_decisions = content.missing_decisions;
    let (raw_bytes, mut missing_raw_bytes) = (content.raw_bytes, content.missing_raw_bytes);
    let readable_raw_bytes = raw_bytes - missing_raw_bytes;
    let entries = std::mem::take(&mut content.entries);
    let (manifest, end) = (content.manifest.take(), content.end.take());
    drop(content);
    let Some(manifest) = manifest else {
        return Err(damaged(path, 0, NOT_BEGUN));
    };
    if let Some(end) = &end {
        tally.add_gap_before(end.samples, None);
    }
    let Tally { readable, mut gaps, .. } = tally;
    let mut missing_after_last = 0;
    if let Some(end) = &end
        && (!is_later || path.is_dir())
    {
        missing_raw_bytes += end.raw_bytes.saturating_sub(raw_bytes);
        missing_after_last = end.entries.saturating_sub(entries.len() as u64 + missing_entries);
        missing_entries += missing_after_last;
    }
    // A later segment that is read alone does not begin with the first sample.
    if is_later && !path.is_dir() {
        gaps.retain(|gap| gap.after_sample > 0);
    }
    let missing = MissingData {
        gaps,
        entries: missing_entries,
        raw_bytes: missing_raw_bytes,
        is_end_lost: end.is_none(),
        damage,
        left_out: Vec::new(),
    };
    // Without the end, the extent of the last damage is unknown.
    let is_end_known = end.is_some() || !missing.is_lossy();
    Ok(Salvage {
        has_every_decision: missing_decisions + missing_after_last == 0
            && is_end_known
            && !is_later,
        missing,
        lacks_segments: files.iter().any(|file| !file.is_file()),
        manifest,
        samples: readable,
        raw_bytes: readable_raw_bytes,
        entries,
        end,
    })
}

/// Counts readable samples and the gaps between them.
#[derive(Default)]
struct Tally {
    readable: u64,
    /// Number of the next sample if none is missing.
    expected: u64,
    /// Session time of the last sample, in s.
    last_s: f64,
    gaps: Vec<SampleGap>,
}

impl Tally {
    fn count(&mut self, block: &SampleBlock) {
        let first = block.rows().next();
        let from_s = first.map_or(self.last_s, |row| row.host.seconds().0);
        self.add_gap_before(block.first_sample(), Some(from_s));
        let count = block.len() as u64;
        self.expected = block.first_sample() + count;
        self.readable += count;
        let last = block.last_time();
        self.last_s = last.map_or(self.last_s, |time| time.seconds().0);
    }

    /// Records a gap if the next sample, at session time `to_s` if known, has a number beyond the expected one.
    fn add_gap_before(&mut self, number: u64, to_s: Option<f64>) {
        if number > self.expected {
            self.gaps.push(SampleGap {
                after_sample: self.readable,
                samples: number - self.expected,
                from_s: self.last_s,
                to_s,
            });
        }
    }
}

struct Search<'f, 'v> {
    files: &'f [PathBuf],
    chunks: ChunkReader,
    content: Content<'v>,
    damage: Vec<DamageSite>,
}

impl Search<'_, '_> {
    /// Reads the undamaged part of one file; returns the number of the next one to read.
    ///
    /// If a file is damaged and the next one rewrites it, the next one is read at the damage, because it has everything from
    /// there on. Data after the damage may still go further.
    fn read(&mut self, number: usize) -> Result<usize, ReadError> {
        let file = &self.files[number];
        let mut next = number + 1;
        if !file.is_file() {
            self.add_damage(file, 0, "this segment is missing");
            return Ok(next);
        }
        let failed = |source| ReadError::Io { path: file.clone(), source };
        let source = LogFile::open(file).map_err(failed)?;
        let is_ours = source.begins_with(mcap::MAGIC).map_err(failed)?;
        if !is_ours && self.content.manifest.is_none() {
            let refused = check_beginning(file, &source, is_ours);
            // A later segment shows what the session is.
            if next == self.files.len() {
                refused?;
            }
            self.add_damage(file, 0, NO_BEGINNING);
        }
        self.content.enter_segment(SegmentState::default());
        let mut from = Some(mcap::MAGIC.len() as u64);
        while let Some(offset) = from {
            from = self.read_on(file, &source, offset).map_err(failed)?;
            if from.is_some() && next == number + 1 {
                let until = self.rewrite_after(number).map_err(failed)?;
                let segment = self.content.enter_segment(SegmentState::default());
                while next <= until {
                    next = self.read(next)?;
                }
                self.content.enter_segment(segment);
            }
        }
        if let Some(refusal) = self.content.refusal.take() {
            // A first file of another program is refused; a later one is left out.
            if self.content.manifest.is_none() {
                return Err(refused(file, refusal));
            }
            self.add_damage(file, 0, "this segment belongs to another recording");
        }
        Ok(next)
    }

    fn add_damage(&mut self, file: &Path, offset: u64, reason: &str) {
        self.damage.push(DamageSite { file: name_of(file), offset, reason: reason.into() });
    }

    /// Number of the file that rewrites this one; its own if there is none. Files in between that failed at once are empty.
    fn rewrite_after(&mut self, number: usize) -> io::Result<usize> {
        for (later, file) in self.files.iter().enumerate().skip(number + 1) {
            match segment_kind(file, &mut self.chunks)? {
                SegmentKind::Rewrite => return Ok(later),
                SegmentKind::Nothing => {}
                SegmentKind::Next => break,
            }
        }
        Ok(number)
    }

    /// Reads to the end of a file, or to a damaged place; then returns the offset of the next undamaged data.
    fn read_on(&mut self, file: &Path, source: &LogFile, from: u64) -> io::Result<Option<u64>> {
        let mut bytes = Vec::new();
        let mut offset = from;
        while offset < source.length() && self.content.refusal.is_none() {
            let frame = source.frame_at(offset, &mut bytes)?;
            let body = bytes.get(FRAME_HEADER_BYTES..).unwrap_or_default();
            let (reason, next) = match frame {
                Err(_) => ("a record's length is wrong".to_owned(), None),
                Ok(frame) => match frame.opcode {
                    op::HEADER if offset == mcap::MAGIC.len() as u64 => {
                        self.content.take_header(body);
                        offset = frame.next;
                        continue;
                    }
                    op::CHUNK => {
                        let records = self.chunks.open(body);
                        match records.and_then(|records| self.content.take_chunk(records)) {
                            Ok(()) => {
                                offset = frame.next;
                                continue;
                            }
                            Err(reason) => (reason, Some(frame.next)),
                        }
                    }
                    op::DATA_END | op::FOOTER => break,
                    op::MESSAGE_INDEX | op::ATTACHMENT | op::METADATA | 0x80.. => {
                        offset = frame.next;
                        continue;
                    }
                    _ => ("a record is of an unexpected kind".to_owned(), None),
                },
            };
            // The damaged record's length is credible if another record follows it.
            let resumed = match next {
                Some(next) if is_record(source, next)? => Some(next),
                _ => next_chunk(source, offset, &mut self.chunks)?,
            };
            if resumed.is_some() || source.has_footer()? {
                self.add_damage(file, offset, &reason);
            }
            return Ok(resumed);
        }
        Ok(None)
    }
}

/// Relation of a segment to the one before.
enum SegmentKind {
    /// It continues the segment before.
    Next,
    /// It was begun because the segment before failed.
    Rewrite,
    Nothing,
}

fn segment_kind(file: &Path, chunks: &mut ChunkReader) -> io::Result<SegmentKind> {
    if !file.is_file() {
        return Ok(SegmentKind::Next);
    }
    let source = LogFile::open(file)?;
    let mut ignore = |_: LogPart<'_>| {};
    let mut content = Content::new(true, &mut ignore);
    content.allow_gaps();
    let mut bytes = Vec::new();
    let mut offset = mcap::MAGIC.len() as u64;
    // The mark of a rewriting segment is in the chunk after the manifest's.
    while let Ok(frame) = source.frame_at(offset, &mut bytes)? {
        let had_manifest = content.segment.has_manifest;
        if frame.opcode == op::CHUNK {
            let records = chunks.open(&bytes[FRAME_HEADER_BYTES..]);
            let is_read = records.is_ok_and(|records| content.take_chunk(records).is_ok());
            if content.segment.is_rewrite {
                return Ok(SegmentKind::Rewrite);
            }
            if !is_read {
                break;
            }
            if had_manifest {
                return Ok(SegmentKind::Next);
            }
        }
        offset = frame.next;
    }
    match next_chunk(&source, offset, chunks)? {
        Some(_) => Ok(SegmentKind::Next),
        None => Ok(SegmentKind::Nothing),
    }
}

/// Whether a record that may follow a chunk is at `offset`.
fn is_record(source: &LogFile, offset: u64) -> io::Result<bool> {
    Ok(source
        .head_at(offset)?
        .is_ok_and(|head| matches!(head.opcode, op::CHUNK | op::MESSAGE_INDEX | op::DATA_END)))
}
