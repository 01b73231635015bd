//! One file of a log, read frame by frame: no more of it is in memory than its longest frame.

use super::frames::{FOOTER_BYTES, FRAME_BYTES_MAX, FRAME_HEADER_BYTES, Fields};
use mcap::records::op;
use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::Path;

/// Bytes looked at together where a file is searched.
const WINDOW_BYTES: usize = 1 << 18;

/// A file and its length.
#[derive(Debug)]
pub(crate) struct Source {
    file: File,
    length: u64,
}

/// Why there is no frame at a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NoFrame {
    /// The frame runs past the end.
    PastEnd,
    /// The frame is larger than any this program writes.
    TooLong,
}

/// What a frame is; its body is in the buffer it was read into.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameHead {
    pub opcode: u8,
    /// Place of the next frame.
    pub next: u64,
}

impl Source {
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = File::open(path)?;
        let length = file.metadata()?.len();
        Ok(Self { file, length })
    }

    pub fn length(&self) -> u64 {
        self.length
    }

    /// Fills the buffer from a place, or with less where the file ends.
    fn fill(&self, buffer: &mut Vec<u8>, offset: u64, count: usize) -> io::Result<()> {
        let count = count.min(usize::try_from(self.length.saturating_sub(offset)).unwrap_or(count));
        buffer.resize(count, 0);
        self.file.read_exact_at(buffer, offset)
    }

    /// Whether the file begins with these bytes.
    pub fn begins_with(&self, bytes: &[u8]) -> io::Result<bool> {
        let mut beginning = Vec::new();
        self.fill(&mut beginning, 0, bytes.len())?;
        Ok(beginning == bytes)
    }

    /// Reads the frame at `offset`: header and body, together, into `bytes`.
    pub fn frame_at(
        &self,
        offset: u64,
        bytes: &mut Vec<u8>,
    ) -> io::Result<Result<FrameHead, NoFrame>> {
        let head = match self.head_at(offset)? {
            Ok(head) => head,
            Err(reason) => return Ok(Err(reason)),
        };
        self.fill(bytes, offset, (head.next - offset) as usize)?;
        Ok(Ok(head))
    }

    /// Reads only the header of the frame at `offset`.
    pub fn head_at(&self, offset: u64) -> io::Result<Result<FrameHead, NoFrame>> {
        let mut header = [0; FRAME_HEADER_BYTES];
        let body = offset.saturating_add(FRAME_HEADER_BYTES as u64);
        if body > self.length {
            return Ok(Err(NoFrame::PastEnd));
        }
        self.file.read_exact_at(&mut header, offset)?;
        let mut fields = Fields(&header);
        let (Some(opcode), Some(length)) = (fields.u8(), fields.u64()) else {
            return Ok(Err(NoFrame::PastEnd));
        };
        if length > self.length - body {
            return Ok(Err(NoFrame::PastEnd));
        }
        if length > FRAME_BYTES_MAX as u64 {
            return Ok(Err(NoFrame::TooLong));
        }
        Ok(Ok(FrameHead { opcode, next: body + length }))
    }

    /// Everything behind the last byte that is not zero may never have reached the disk.
    pub fn written_length(&self) -> io::Result<u64> {
        let mut window = Vec::new();
        let mut stop = self.length;
        while stop > 0 {
            let start = stop.saturating_sub(WINDOW_BYTES as u64);
            self.fill(&mut window, start, (stop - start) as usize)?;
            if let Some(last) = window.iter().rposition(|&byte| byte != 0) {
                return Ok(start + last as u64 + 1);
            }
            stop = start;
        }
        Ok(0)
    }

    /// Whether the file was made but not even its first bytes reached the disk.
    pub fn is_barely_begun(&self) -> io::Result<bool> {
        let written = self.written_length()?;
        if written >= mcap::MAGIC.len() as u64 {
            return Ok(false);
        }
        self.begins_with(&mcap::MAGIC[..written as usize])
    }

    /// Whether the file claims to be finished: a footer and the closing magic are in their place.
    pub fn has_footer(&self) -> io::Result<bool> {
        if self.length < (mcap::MAGIC.len() + FOOTER_BYTES) as u64 {
            return Ok(false);
        }
        let mut footer = Vec::new();
        self.fill(&mut footer, self.length - FOOTER_BYTES as u64, FOOTER_BYTES)?;
        Ok(footer.ends_with(mcap::MAGIC) && footer[0] == op::FOOTER)
    }

    /// Where a finished file's index begins; its end if it has none.
    pub fn summary_start(&self) -> io::Result<u64> {
        let mut footer = Vec::new();
        self.fill(&mut footer, self.length - FOOTER_BYTES as u64, FOOTER_BYTES)?;
        let start = Fields(&footer[FRAME_HEADER_BYTES..]).u64();
        Ok(start.filter(|&start| start > 0).unwrap_or(self.length))
    }

    /// The checksum stored at the end of the file and the one of the bytes from `start` to it.
    pub fn index_checksums(&self, start: u64) -> io::Result<(u32, u32)> {
        let stored = self.length - mcap::MAGIC.len() as u64 - 4;
        let mut sum = crc32fast::Hasher::new();
        let mut window = Vec::new();
        let mut offset = start;
        while offset < stored {
            let count = (stored - offset).min(WINDOW_BYTES as u64) as usize;
            self.fill(&mut window, offset, count)?;
            sum.update(&window);
            offset += count as u64;
        }
        self.fill(&mut window, stored, 4)?;
        Ok((Fields(&window).u32().unwrap_or(0), sum.finalize()))
    }

    /// The next place after `offset` where a chunk's frame may begin.
    pub fn next_chunk_mark(&self, offset: u64) -> io::Result<Option<u64>> {
        // The compression's name, and how far into a chunk's frame it stands.
        const MARK: &[u8] = b"\x04\0\0\0zstd";
        const MARK_OFFSET: u64 = (FRAME_HEADER_BYTES + 8 + 8 + 8 + 4) as u64;
        let mut window = Vec::new();
        let mut start = offset + 1 + MARK_OFFSET;
        while start < self.length {
            self.fill(&mut window, start, WINDOW_BYTES)?;
            let mut marks = window.windows(MARK.len());
            if let Some(found) = marks.position(|bytes| bytes == MARK) {
                return Ok(Some(start + found as u64 - MARK_OFFSET));
            }
            // The mark may lie across the edge of two windows.
            start += (window.len().max(MARK.len()) - MARK.len() + 1) as u64;
            if window.len() < WINDOW_BYTES {
                break;
            }
        }
        Ok(None)
    }
}
