//! Goes through one file of a log and verifies every checksum on the way.

use super::content::Content;
use super::frames::{
    ChunkReader, FOOTER_BYTES, Fields, Frame, FrameError, frame_at, has_chunk_after,
};
use mcap::records::op;

/// Why the walk ended before the end of the data.
pub(crate) struct Stop {
    pub offset: usize,
    pub reason: String,
    /// Whether this is how an interrupted write looks, and not damage.
    pub is_torn: bool,
}

/// Everything behind the last byte that is not zero may never have reached the disk.
fn written_length(bytes: &[u8]) -> usize {
    bytes
        .iter()
        .rposition(|&byte| byte != 0)
        .map_or(0, |last| last + 1)
}

/// Whether the file was made but not even its first bytes reached the disk.
pub(crate) fn is_barely_begun(bytes: &[u8]) -> bool {
    let written = &bytes[..written_length(bytes)];
    written.len() < mcap::MAGIC.len() && mcap::MAGIC.starts_with(written)
}

/// Whether the record that starts at `offset` can hold samples or entries.
pub(crate) fn may_hold_data(bytes: &[u8], offset: usize) -> bool {
    !matches!(bytes.get(offset), Some(&(op::MESSAGE_INDEX | op::DATA_END)))
}

/// Whether the file claims to be finished: a footer and the closing magic are in their place.
pub(crate) fn has_footer(bytes: &[u8]) -> bool {
    bytes.len() >= mcap::MAGIC.len() + FOOTER_BYTES
        && bytes.ends_with(mcap::MAGIC)
        && bytes[bytes.len() - FOOTER_BYTES] == op::FOOTER
}

/// Goes through all frames of the data section.
pub(crate) fn walk(
    bytes: &[u8],
    chunks: &mut ChunkReader,
    content: &mut Content,
) -> Result<(), Stop> {
    let is_finished = has_footer(bytes);
    let written = written_length(bytes);
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
            op::DATA_END => return check_end(bytes, offset, frame),
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
fn check_end(bytes: &[u8], offset: usize, data_end: Frame<'_>) -> Result<(), Stop> {
    let stop = |offset: usize, reason: &str| Stop {
        offset,
        reason: reason.into(),
        is_torn: false,
    };
    if Fields(data_end.body).u32() != Some(crc32fast::hash(&bytes[..offset])) {
        return Err(stop(offset, "the checksum over all samples is wrong"));
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
