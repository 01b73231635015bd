//! Reads one file of a log and verifies every checksum.

use super::content::Content;
use super::frames::{ChunkReader, FRAME_HEADER_BYTES, Fields};
use super::log_file::{FrameError, LogFile};
use mcap::records::op;
use std::io;

/// Why reading stopped before the end of the data.
pub(crate) struct Stop {
    pub offset: u64,
    pub reason: String,
    /// Whether an interrupted write explains it.
    pub is_torn: bool,
}

/// Reads all frames of the data section.
pub(crate) fn walk(
    source: &LogFile,
    chunks: &mut ChunkReader,
    content: &mut Content<'_>,
) -> io::Result<Result<(), Stop>> {
    let is_finished = source.has_footer()?;
    let mut bytes = Vec::new();
    let mut offset = mcap::MAGIC.len() as u64;
    // Of everything before `offset`.
    let mut sum = crc32fast::Hasher::new();
    sum.update(mcap::MAGIC);
    while offset < source.length() {
        let damage = |reason: String, is_torn: bool| Ok(Err(Stop { offset, reason, is_torn }));
        // A power cut leaves zeros from within a frame to the end of the file.
        let is_zeroed = |frame_end: u64| -> io::Result<bool> {
            let written = source.written_length()?;
            Ok(!is_finished && written <= frame_end && written < source.length())
        };
        let frame = match source.frame_at(offset, &mut bytes)? {
            Ok(frame) => frame,
            Err(FrameError::TooLong) => {
                let is_torn = is_zeroed(offset)?;
                return damage(
                    "a record is longer than the longest possible record".into(),
                    is_torn,
                );
            }
            Err(FrameError::PastEnd) => {
                // A later chunk distinguishes damage from an incomplete end.
                let is_torn = !is_finished && next_chunk(source, offset, chunks)?.is_none();
                return damage("a record runs past the end of the file".into(), is_torn);
            }
        };
        let body = &bytes[FRAME_HEADER_BYTES..];
        match frame.opcode {
            op::HEADER => content.take_header(body),
            op::MESSAGE_INDEX => {}
            op::CHUNK => match chunks.open(body) {
                Ok(records) => {
                    if let Err(reason) = content.take_chunk(records) {
                        return damage(reason, false);
                    }
                }
                Err(reason) => {
                    let is_torn = is_zeroed(frame.next)?;
                    return damage(reason, is_torn);
                }
            },
            op::DATA_END => {
                if Fields(body).u32() != Some(sum.finalize()) {
                    return damage("the checksum over all samples is wrong".into(), false);
                }
                return check_index(source, frame.next, is_finished);
            }
            // Other tools may add these to a finished file; its checksums cover them.
            op::ATTACHMENT | op::METADATA | 0x80.. if is_finished => {}
            _ => {
                let is_torn = is_zeroed(frame.next)?;
                return damage("a record is of an unexpected kind".into(), is_torn);
            }
        }
        if content.refusal.is_some() {
            return Ok(Ok(()));
        }
        sum.update(&bytes);
        offset = frame.next;
    }
    Ok(Ok(()))
}

/// Verifies the checksum of everything after the data, including the footer's first two fields.
fn check_index(source: &LogFile, start: u64, is_finished: bool) -> io::Result<Result<(), Stop>> {
    if is_finished {
        let (stored, summed) = source.index_checksums(start)?;
        if stored != summed {
            return Ok(Err(Stop {
                offset: start,
                reason: "the checksum of the index is wrong".into(),
                is_torn: false,
            }));
        }
    }
    Ok(Ok(()))
}

/// Offset of the next undamaged chunk after `offset`.
pub(crate) fn next_chunk(
    source: &LogFile,
    offset: u64,
    chunks: &mut ChunkReader,
) -> io::Result<Option<u64>> {
    let mut bytes = Vec::new();
    let mut search = offset;
    while let Some(place) = source.next_chunk_mark(search)? {
        if let Ok(frame) = source.frame_at(place, &mut bytes)?
            && frame.opcode == op::CHUNK
            && chunks.open(&bytes[FRAME_HEADER_BYTES..]).is_ok()
        {
            return Ok(Some(place));
        }
        search = place;
    }
    Ok(None)
}
