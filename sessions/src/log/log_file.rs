//! One file of a log, read frame by frame, so that at most one frame is in memory.

use super::frames::{FOOTER_BYTES, FRAME_BYTES_MAX, FRAME_HEADER_BYTES, Fields};
use mcap::records::op;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

/// Bytes per read while searching a file.
const WINDOW_BYTES: usize = 1 << 18;

#[derive(Debug)]
pub(crate) struct LogFile {
    file: File,
    length: u64,
}

/// Why a frame cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FrameError {
    /// The frame runs past the end.
    PastEnd,
    /// The frame exceeds [`FRAME_BYTES_MAX`].
    TooLong,
}

/// Header of a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FrameHead {
    pub opcode: u8,
    /// Offset of the next frame.
    pub next: u64,
}

impl LogFile {
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = File::open(path)?;
        let length = file.metadata()?.len();
        Ok(Self { file, length })
    }

    pub fn length(&self) -> u64 {
        self.length
    }

    /// Fills the buffer from `offset`, with fewer bytes at the end of the file.
    fn fill(&self, buffer: &mut Vec<u8>, offset: u64, count: usize) -> io::Result<()> {
        let count = count.min(usize::try_from(self.length.saturating_sub(offset)).unwrap_or(count));
        buffer.resize(count, 0);
        self.read_at(buffer, offset)
    }

    /// Moves the file's own position, so one thread at a time reads.
    fn read_at(&self, buffer: &mut [u8], offset: u64) -> io::Result<()> {
        let mut file = &self.file;
        file.seek(SeekFrom::Start(offset))?;
        file.read_exact(buffer)
    }

    pub fn begins_with(&self, bytes: &[u8]) -> io::Result<bool> {
        let mut beginning = Vec::new();
        self.fill(&mut beginning, 0, bytes.len())?;
        Ok(beginning == bytes)
    }

    /// Reads the frame at `offset`, header and body, into `bytes`.
    pub fn frame_at(
        &self,
        offset: u64,
        bytes: &mut Vec<u8>,
    ) -> io::Result<Result<FrameHead, FrameError>> {
        let head = match self.head_at(offset)? {
            Ok(head) => head,
            Err(reason) => return Ok(Err(reason)),
        };
        self.fill(bytes, offset, (head.next - offset) as usize)?;
        Ok(Ok(head))
    }

    /// Reads only the header of the frame at `offset`.
    pub fn head_at(&self, offset: u64) -> io::Result<Result<FrameHead, FrameError>> {
        let mut header = [0; FRAME_HEADER_BYTES];
        let body = offset.saturating_add(FRAME_HEADER_BYTES as u64);
        if body > self.length {
            return Ok(Err(FrameError::PastEnd));
        }
        self.read_at(&mut header, offset)?;
        let [opcode, length @ ..] = header;
        let length = u64::from_le_bytes(length);
        if length > self.length - body {
            return Ok(Err(FrameError::PastEnd));
        }
        if length > FRAME_BYTES_MAX as u64 {
            return Ok(Err(FrameError::TooLong));
        }
        Ok(Ok(FrameHead { opcode, next: body + length }))
    }

    /// Length without trailing zeros, which may be data that never reached the disk.
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

    /// Whether not even the first bytes of the file reached the disk.
    pub fn is_barely_begun(&self) -> io::Result<bool> {
        let written = self.written_length()?;
        if written >= mcap::MAGIC.len() as u64 {
            return Ok(false);
        }
        self.begins_with(&mcap::MAGIC[..written as usize])
    }

    /// Whether the file claims to be finished: it ends in a footer and the closing magic.
    pub fn has_footer(&self) -> io::Result<bool> {
        if self.length < (mcap::MAGIC.len() + FOOTER_BYTES) as u64 {
            return Ok(false);
        }
        let mut footer = Vec::new();
        self.fill(&mut footer, self.length - FOOTER_BYTES as u64, FOOTER_BYTES)?;
        Ok(footer.ends_with(mcap::MAGIC) && footer[0] == op::FOOTER)
    }

    /// Offset of a finished file's index; the file's length without an index.
    pub fn summary_start(&self) -> io::Result<u64> {
        let mut footer = Vec::new();
        self.fill(&mut footer, self.length - FOOTER_BYTES as u64, FOOTER_BYTES)?;
        let start = Fields(&footer[FRAME_HEADER_BYTES..]).u64();
        Ok(start.filter(|&start| start > 0).unwrap_or(self.length))
    }

    /// The stored checksum of the index, and the computed one of the bytes from `start`.
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

    /// The next offset where a chunk's frame may begin.
    pub fn next_chunk_mark(&self, offset: u64) -> io::Result<Option<u64>> {
        // The compression's name, and its offset in a chunk's frame.
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
            // The mark may straddle two windows.
            start += (window.len().max(MARK.len()) - MARK.len() + 1) as u64;
            if window.len() < WINDOW_BYTES {
                break;
            }
        }
        Ok(None)
    }
}
