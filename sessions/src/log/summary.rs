//! Summary of a session from its first and last chunk, in constant time for any length.

use super::content::{Content, LogPart};
use super::files::find_files;
use super::frames::{ChunkReader, FRAME_HEADER_BYTES, Fields};
use super::log_file::LogFile;
use super::reader::{NOT_BEGUN, ReadError, check_beginning, damaged, refused};
use crate::manifest::Manifest;
use crate::record::EndRecord;
use mcap::records::op;
use palpate_model::Nanos;
use std::io;
use std::path::{Path, PathBuf};

/// Everything in the summary is verified; damage between the first and the last chunk goes unnoticed.
#[derive(Clone, Debug, PartialEq)]
pub struct SessionSummary {
    /// The log, or its first segment.
    pub path: PathBuf,
    pub manifest: Manifest,
    /// Samples up to the last complete chunk.
    pub samples: u64,
    /// Session time of the end record or, without it, of the last sample.
    pub last: Nanos,
    /// `None` if the recording was interrupted or is in progress.
    pub end: Option<EndRecord>,
    pub bytes: u64,
}

impl SessionSummary {
    /// `path` is a session folder or a file of it.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        let files = find_files(path)?;
        let first = &files[0];
        let failed = |source| ReadError::Io { path: path.into(), source };
        let mut chunks = ChunkReader::new().map_err(failed)?;
        let (manifest, mut found) = read_first_and_last_chunk(first, &mut chunks)?;
        let mut bytes = std::fs::metadata(first).map_err(failed)?.len();
        for file in &files[1..] {
            bytes += std::fs::metadata(file).map_err(failed)?.len();
        }
        // The last segment may be empty.
        for file in files[1..].iter().rev() {
            if let Ok((theirs, ends)) = read_first_and_last_chunk(file, &mut chunks)
                && theirs.session_id == manifest.session_id
                && (ends.samples > 0 || ends.end.is_some())
            {
                found = ends;
                break;
            }
        }
        Ok(Self {
            path: first.clone(),
            manifest,
            samples: found.end.as_ref().map_or(found.samples, |end| end.samples),
            last: found.end.as_ref().map_or(found.last, |end| end.ended_at),
            end: found.end,
            bytes,
        })
    }
}

struct LastChunk {
    samples: u64,
    last: Nanos,
    end: Option<EndRecord>,
}

fn read_first_and_last_chunk(
    path: &Path,
    chunks: &mut ChunkReader,
) -> Result<(Manifest, LastChunk), ReadError> {
    let failed = |source| ReadError::Io { path: path.into(), source };
    let source = LogFile::open(path).map_err(failed)?;
    let is_ours = source.begins_with(mcap::MAGIC).map_err(failed)?;
    check_beginning(path, &source, is_ours)?;
    let (mut samples, mut last) = (0, Nanos::ZERO);
    let mut visit = |part: LogPart<'_>| {
        if let LogPart::Samples(block) = part {
            samples = block.first_sample() + block.len() as u64;
            last = block.last_time().unwrap_or(last);
        }
    };
    let mut content = Content::new(true, &mut visit);
    let mut bytes = Vec::new();
    let header = source.frame_at(mcap::MAGIC.len() as u64, &mut bytes);
    if header.map_err(failed)?.is_ok_and(|frame| frame.opcode == op::HEADER) {
        content.take_header(&bytes[FRAME_HEADER_BYTES..]);
    }
    let offsets = chunk_offsets(&source).map_err(failed)?;
    for (number, offset) in offsets.iter().enumerate() {
        if number > 0 && content.manifest.is_some() {
            content.begin_anywhere();
        }
        let read = source.frame_at(*offset, &mut bytes).map_err(failed)?;
        if read.is_err() {
            return Err(damaged(path, *offset, "the index points to a wrong offset"));
        }
        let outcome = chunks
            .open(&bytes[FRAME_HEADER_BYTES..])
            .and_then(|records| content.take_chunk(records));
        if let Some(refusal) = content.refusal.take() {
            return Err(refused(path, refusal));
        }
        match outcome {
            Ok(()) => {}
            // The last chunk of an interrupted log may be incomplete.
            Err(_) if number + 1 == offsets.len() && number > 0 => {}
            Err(reason) => return Err(damaged(path, *offset, &reason)),
        }
    }
    let (manifest, end) = (content.manifest.take(), content.end.take());
    drop(content);
    let Some(manifest) = manifest else {
        return Err(damaged(path, 0, NOT_BEGUN));
    };
    Ok((manifest, LastChunk { samples, last, end }))
}

/// Offsets of the first chunk and of the last two, in order.
fn chunk_offsets(source: &LogFile) -> io::Result<Vec<u64>> {
    let mut offsets =
        if source.has_footer()? { indexed_chunks(source)? } else { walked_chunks(source)? };
    if offsets.len() > 3 {
        offsets.drain(1..offsets.len() - 2);
    }
    Ok(offsets)
}

/// Offsets of the chunks from the index.
fn indexed_chunks(source: &LogFile) -> io::Result<Vec<u64>> {
    let mut offsets = Vec::new();
    let mut bytes = Vec::new();
    let mut offset = source.summary_start()?;
    while let Ok(frame) = source.frame_at(offset, &mut bytes)? {
        if frame.opcode == op::CHUNK_INDEX {
            let mut fields = Fields(&bytes[FRAME_HEADER_BYTES..]);
            let _times = (fields.u64(), fields.u64());
            offsets.extend(fields.u64());
        }
        offset = frame.next;
    }
    Ok(offsets)
}

/// Offsets of the chunks of an unfinished file, from frame to frame without reading bodies.
fn walked_chunks(source: &LogFile) -> io::Result<Vec<u64>> {
    let mut offsets = Vec::new();
    let mut offset = mcap::MAGIC.len() as u64;
    while let Ok(frame) = source.head_at(offset)? {
        if frame.opcode == op::CHUNK {
            offsets.push(offset);
        }
        offset = frame.next;
    }
    Ok(offsets)
}
