//! Goes through a session's files and keeps everything that is whole.

use super::{Gap, Missing, Wound};
use crate::block::Block;
use crate::log::content::{Content, Part};
use crate::log::files::{check_files, find_files};
use crate::log::frames::{ChunkReader, FRAME_HEADER_BYTES};
use crate::log::reader::{NO_BEGINNING, NOT_BEGUN, check_beginning, damaged, name_of, refused};
use crate::log::source::Source;
use crate::log::walk::next_chunk;
use crate::log::{ReadError, Session};
use crate::manifest::Manifest;
use crate::record::{EndRecord, Entry};
use mcap::records::op;
use std::io;
use std::path::{Path, PathBuf};

/// What is left of a session, its samples apart.
#[derive(Clone, Debug, PartialEq)]
pub struct Salvage {
    /// What the session says about itself.
    pub manifest: Manifest,
    /// Samples that are left.
    pub samples: u64,
    /// Entries that are left, by `order`. Their `after_sample` counts the samples that were recorded.
    pub entries: Vec<Entry>,
    /// Whether every decision up to the last sample is among them.
    pub has_every_decision: bool,
    /// Whether a segment between others is not there at all.
    pub lacks_segments: bool,
    /// Raw bytes of devices that are left.
    pub raw_bytes: u64,
    /// How the session ended, if that is left.
    pub end: Option<EndRecord>,
    /// What is not.
    pub missing: Missing,
}

/// Hands out every block of samples that is whole, in order, and tells what is missing.
pub fn salvage(path: &Path, visit: &mut dyn FnMut(&Block)) -> Result<Salvage, ReadError> {
    let mut left = parts(path, &mut |part| {
        if let Part::Samples(block) = part {
            visit(block);
        }
    })?;
    // All that is kept may be whole and the file still be damaged where none of it is, as in its index.
    if !left.missing.is_lossy()
        && let Err(ReadError::Damaged { path, offset, reason }) = Session::scan(path, &mut |_| {})
    {
        left.missing.wounds.push(Wound { file: name_of(&path), offset, reason });
    }
    Ok(left)
}

/// As [`salvage`] for everything a log holds, and only what lies where samples are is looked at.
pub(super) fn parts(path: &Path, visit: &mut dyn FnMut(Part<'_>)) -> Result<Salvage, ReadError> {
    let files = find_files(path)?;
    check_files(path, &files)?;
    let failed = |source| ReadError::Io { path: path.into(), source };
    let mut tally = Tally::default();
    let mut note = |part: Part<'_>| {
        visit(part);
        if let Part::Samples(block) = part {
            tally.count(block);
        }
    };
    let mut content = Content::new(!path.is_dir(), &mut note);
    content.allow_gaps();
    let mut search = Search {
        files: &files,
        chunks: ChunkReader::new().map_err(failed)?,
        content,
        wounds: Vec::new(),
    };
    let mut next = 0;
    while next < files.len() {
        next = search.read(next)?;
    }
    let Search { mut content, wounds, .. } = search;
    let (mut lost_entries, later) = (content.lost_entries, content.is_later_part);
    let lost_decisions = content.lost_decisions;
    let (raw_bytes, mut lost_raw_bytes) = (content.raw_bytes, content.lost_raw_bytes);
    let raw_bytes_left = raw_bytes - lost_raw_bytes;
    let entries = std::mem::take(&mut content.entries);
    let (manifest, end) = (content.manifest.take(), content.end.take());
    drop(content);
    let Some(manifest) = manifest else {
        return Err(damaged(path, 0, NOT_BEGUN));
    };
    if let Some(end) = &end {
        tally.expect(end.samples, None);
    }
    let Tally { kept, mut gaps, .. } = tally;
    let mut lost_after_last = 0;
    if let Some(end) = &end
        && (!later || path.is_dir())
    {
        lost_raw_bytes += end.raw_bytes.saturating_sub(raw_bytes);
        lost_after_last = end.entries.saturating_sub(entries.len() as u64 + lost_entries);
        lost_entries += lost_after_last;
    }
    // The first sample of a later part that is read alone is not its first.
    if later && !path.is_dir() {
        gaps.retain(|gap| gap.after_sample > 0);
    }
    let missing = Missing {
        gaps,
        entries: lost_entries,
        raw_bytes: lost_raw_bytes,
        is_end_lost: end.is_none(),
        wounds,
        left_out: Vec::new(),
    };
    // Without the end nobody knows what the last damage took.
    let is_end_known = end.is_some() || !missing.is_lossy();
    Ok(Salvage {
        has_every_decision: lost_decisions + lost_after_last == 0 && is_end_known && !later,
        missing,
        lacks_segments: files.iter().any(|file| !file.is_file()),
        manifest,
        samples: kept,
        raw_bytes: raw_bytes_left,
        entries,
        end,
    })
}

/// Counts the samples that are whole, and those that are missing between them.
#[derive(Default)]
struct Tally {
    kept: u64,
    /// Number of the sample that comes next where none is missing.
    expected: u64,
    /// Session time of the last sample, in s.
    last_s: f64,
    gaps: Vec<Gap>,
}

impl Tally {
    fn count(&mut self, block: &Block) {
        let first = block.rows().next();
        let from_s = first.map_or(self.last_s, |row| row.host.seconds().0);
        self.expect(block.first_sample(), Some(from_s));
        let count = block.len() as u64;
        self.expected = block.first_sample() + count;
        self.kept += count;
        let last = block.last_time();
        self.last_s = last.map_or(self.last_s, |time| time.seconds().0);
    }

    /// The next sample has this number, and this session time in s where it is known.
    fn expect(&mut self, number: u64, to_s: Option<f64>) {
        if number > self.expected {
            self.gaps.push(Gap {
                after_sample: self.kept,
                samples: number - self.expected,
                from_s: self.last_s,
                to_s,
            });
        }
    }
}

/// Goes through the files of a session.
struct Search<'f, 'v> {
    files: &'f [PathBuf],
    chunks: ChunkReader,
    content: Content<'v>,
    wounds: Vec<Wound>,
}

impl Search<'_, '_> {
    /// Reads what is whole of one file; returns the number of the next one to read.
    ///
    /// Where a file is damaged and the next one was begun because of that, the next one is read first: it
    /// has everything from before the damage on. What lies behind the damage may still go further.
    fn read(&mut self, number: usize) -> Result<usize, ReadError> {
        let file = &self.files[number];
        let mut next = number + 1;
        if !file.is_file() {
            self.wound(file, 0, "this segment is missing");
            return Ok(next);
        }
        let failed = |source| ReadError::Io { path: file.clone(), source };
        let source = Source::open(file).map_err(failed)?;
        let is_ours = source.begins_with(mcap::MAGIC).map_err(failed)?;
        if !is_ours && self.content.manifest.is_none() {
            let refused = check_beginning(file, &source, is_ours);
            // Where others follow, it was one: a later one tells what the session is.
            if next == self.files.len() {
                refused?;
            }
            self.wound(file, 0, NO_BEGINNING);
        }
        self.content.begin_segment();
        let mut from = Some(mcap::MAGIC.len() as u64);
        while let Some(offset) = from {
            from = self.read_on(file, &source, offset).map_err(failed)?;
            if from.is_some() && next == number + 1 {
                let until = self.rewrite_after(number).map_err(failed)?;
                let left = self.content.leave_segment();
                while next <= until {
                    next = self.read(next)?;
                }
                self.content.return_to_segment(left);
            }
        }
        if let Some(refusal) = self.content.refusal.take() {
            // A first file that is another's is refused; a later one is left out.
            if self.content.manifest.is_none() {
                return Err(refused(file, refusal));
            }
            self.wound(file, 0, "this segment is of another recording");
        }
        Ok(next)
    }

    fn wound(&mut self, file: &Path, offset: u64, reason: &str) {
        self.wounds.push(Wound { file: name_of(file), offset, reason: reason.into() });
    }

    /// The number of the file that was begun because this one failed; its own if none was. What was begun
    /// in between and failed at once holds nothing.
    fn rewrite_after(&mut self, number: usize) -> io::Result<usize> {
        for (later, file) in self.files.iter().enumerate().skip(number + 1) {
            match kind_of(file, &mut self.chunks)? {
                Kind::Rewrite => return Ok(later),
                Kind::Nothing => {}
                Kind::Next => break,
            }
        }
        Ok(number)
    }

    /// Reads to the end of a file, or to where it is damaged: then the place from which to go on.
    fn read_on(&mut self, file: &Path, source: &Source, from: u64) -> io::Result<Option<u64>> {
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
            // The damaged record's length may be right, or may lead anywhere: what lies at its end tells.
            let resumed = match next {
                Some(next) if is_record(source, next)? => Some(next),
                _ => next_chunk(source, offset, &mut self.chunks)?,
            };
            if resumed.is_some() || source.has_footer()? {
                self.wound(file, offset, &reason);
            }
            return Ok(resumed);
        }
        Ok(None)
    }
}

/// What a file is to the one before.
enum Kind {
    /// It goes on where that one ends.
    Next,
    /// It was begun because that one failed.
    Rewrite,
    /// It holds no samples.
    Nothing,
}

fn kind_of(file: &Path, chunks: &mut ChunkReader) -> io::Result<Kind> {
    if !file.is_file() {
        return Ok(Kind::Next);
    }
    let source = Source::open(file)?;
    let mut ignore = |_: Part<'_>| {};
    let mut content = Content::new(true, &mut ignore);
    content.allow_gaps();
    let mut bytes = Vec::new();
    let mut offset = mcap::MAGIC.len() as u64;
    // A file says so in the chunk after the manifest's.
    while let Ok(frame) = source.frame_at(offset, &mut bytes)? {
        let had_manifest = content.has_manifest;
        if frame.opcode == op::CHUNK {
            let records = chunks.open(&bytes[FRAME_HEADER_BYTES..]);
            let is_read = records.is_ok_and(|records| content.take_chunk(records).is_ok());
            if content.is_rewrite {
                return Ok(Kind::Rewrite);
            }
            if !is_read {
                break;
            }
            if had_manifest {
                return Ok(Kind::Next);
            }
        }
        offset = frame.next;
    }
    match next_chunk(&source, offset, chunks)? {
        Some(_) => Ok(Kind::Next),
        None => Ok(Kind::Nothing),
    }
}

/// Whether a record that follows a chunk, or the end, is at a place.
fn is_record(source: &Source, offset: u64) -> io::Result<bool> {
    Ok(source
        .head_at(offset)?
        .is_ok_and(|head| matches!(head.opcode, op::CHUNK | op::MESSAGE_INDEX | op::DATA_END)))
}
