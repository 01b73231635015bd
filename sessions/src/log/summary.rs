//! What a session is, from its first and its last chunk alone: the same effort for any length.

use super::content::{Content, Part};
use super::files::find_files;
use super::frames::{ChunkReader, FRAME_HEADER_BYTES, Fields};
use super::reader::{NOT_BEGUN, ReadError, check_beginning, damaged, refused};
use super::source::Source;
use crate::manifest::Manifest;
use crate::record::EndRecord;
use mcap::records::op;
use palpate_model::Nanos;
use std::io;
use std::path::{Path, PathBuf};

/// What a session says about itself, and how far it goes.
///
/// Everything in it is verified; damage between the first and the last chunk is not looked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    /// The log, or its first segment.
    pub path: PathBuf,
    /// What the session says about itself.
    pub manifest: Manifest,
    /// Samples up to the last whole chunk.
    pub samples: u64,
    /// Session time of the last sample, or of the end.
    pub last: Nanos,
    /// How the session ended; `None` if it was interrupted or is being recorded.
    pub end: Option<EndRecord>,
    /// Bytes of all its files.
    pub bytes: u64,
}

impl Summary {
    /// Reads the summary of a session folder, or of one file of it.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        let files = find_files(path)?;
        let first = &files[0];
        let failed = |source| ReadError::Io { path: path.into(), source };
        let mut chunks = ChunkReader::new().map_err(failed)?;
        let (manifest, mut found) = read_ends(first, &mut chunks)?;
        let mut bytes = std::fs::metadata(first).map_err(failed)?.len();
        for file in &files[1..] {
            bytes += std::fs::metadata(file).map_err(failed)?.len();
        }
        // The last segment may have been begun only.
        for file in files[1..].iter().rev() {
            if let Ok((theirs, ends)) = read_ends(file, &mut chunks)
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

/// What the last chunk of a file tells.
struct Ends {
    samples: u64,
    last: Nanos,
    end: Option<EndRecord>,
}

fn read_ends(path: &Path, chunks: &mut ChunkReader) -> Result<(Manifest, Ends), ReadError> {
    let failed = |source| ReadError::Io { path: path.into(), source };
    let source = Source::open(path).map_err(failed)?;
    let is_ours = source.begins_with(mcap::MAGIC).map_err(failed)?;
    check_beginning(path, &source, is_ours)?;
    let (mut samples, mut last) = (0, Nanos::ZERO);
    let mut visit = |part: Part<'_>| {
        if let Part::Samples(block) = part {
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
    let places = chunk_places(&source).map_err(failed)?;
    for (number, place) in places.iter().enumerate() {
        if number > 0 && content.manifest.is_some() {
            content.begin_anywhere();
        }
        let read = source.frame_at(*place, &mut bytes).map_err(failed)?;
        if read.is_err() {
            return Err(damaged(path, *place, "a chunk is not where the index says"));
        }
        let outcome = chunks
            .open(&bytes[FRAME_HEADER_BYTES..])
            .and_then(|records| content.take_chunk(records));
        if let Some(refusal) = content.refusal.take() {
            return Err(refused(path, refusal));
        }
        match outcome {
            Ok(()) => {}
            // The last chunk of an interrupted log may be torn; the one before was whole.
            Err(_) if number + 1 == places.len() && number > 0 => {}
            Err(reason) => return Err(damaged(path, *place, &reason)),
        }
    }
    let (manifest, end) = (content.manifest.take(), content.end.take());
    drop(content);
    let Some(manifest) = manifest else {
        return Err(damaged(path, 0, NOT_BEGUN));
    };
    Ok((manifest, Ends { samples, last, end }))
}

/// Places of the first chunk and of the last two, in order.
fn chunk_places(source: &Source) -> io::Result<Vec<u64>> {
    let mut places =
        if source.has_footer()? { indexed_chunks(source)? } else { walked_chunks(source)? };
    if places.len() > 3 {
        places.drain(1..places.len() - 2);
    }
    Ok(places)
}

/// Where the index says the chunks are.
fn indexed_chunks(source: &Source) -> io::Result<Vec<u64>> {
    let mut places = Vec::new();
    let mut bytes = Vec::new();
    let mut offset = source.summary_start()?;
    while let Ok(frame) = source.frame_at(offset, &mut bytes)? {
        if frame.opcode == op::CHUNK_INDEX {
            let mut fields = Fields(&bytes[FRAME_HEADER_BYTES..]);
            let _times = (fields.u64(), fields.u64());
            places.extend(fields.u64());
        }
        offset = frame.next;
    }
    Ok(places)
}

/// Where the chunks of an unfinished file are: from frame to frame, their bodies not read.
fn walked_chunks(source: &Source) -> io::Result<Vec<u64>> {
    let mut places = Vec::new();
    let mut offset = mcap::MAGIC.len() as u64;
    while let Ok(frame) = source.head_at(offset)? {
        if frame.opcode == op::CHUNK {
            places.push(offset);
        }
        offset = frame.next;
    }
    Ok(places)
}
