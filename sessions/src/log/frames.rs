//! A strict walk over the frames of an MCAP file: opcode, length, body.
//!
//! Nothing is trusted: lengths are bounded by the file and by 24 MiB, the checksum of every chunk
//! is verified before anything in it is looked at, and record bodies are parsed here so that no
//! length inside a record can ask for memory. See <https://mcap.dev/spec>.

/// Largest frame, and largest chunk once decompressed: a chunk is cut at 4 MiB, by a message of at
/// most 16 MiB. Both together stay below 64 MiB.
pub(crate) const FRAME_BYTES_MAX: usize = 24 << 20;
/// Opcode and length.
pub(crate) const FRAME_HEADER_BYTES: usize = 9;
/// Footer frame and closing magic.
pub(crate) const FOOTER_BYTES: usize = FRAME_HEADER_BYTES + 20 + mcap::MAGIC.len();

/// One frame within a slice.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame<'a> {
    pub opcode: u8,
    pub body: &'a [u8],
    /// Place of the next frame.
    pub next: usize,
}

/// Why there is no frame at a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FrameError {
    /// The frame runs past the end.
    PastEnd,
    /// The frame is larger than any this program writes.
    TooLong,
}

/// The frame at `offset`.
pub(crate) fn frame_at(bytes: &[u8], offset: usize) -> Result<Frame<'_>, FrameError> {
    let mut fields = Fields(bytes.get(offset..).unwrap_or_default());
    let opcode = fields.u8().ok_or(FrameError::PastEnd)?;
    let length = fields.u64().ok_or(FrameError::PastEnd)?;
    let remaining = fields.0.len();
    let length = usize::try_from(length)
        .ok()
        .filter(|&length| length <= remaining)
        .ok_or(FrameError::PastEnd)?;
    if length > FRAME_BYTES_MAX {
        return Err(FrameError::TooLong);
    }
    Ok(Frame { opcode, body: &fields.0[..length], next: offset + FRAME_HEADER_BYTES + length })
}

/// Reads little-endian fields off the front of a slice; `None` when it is too short.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fields<'a>(pub &'a [u8]);

impl<'a> Fields<'a> {
    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (head, tail) = self.0.split_first_chunk::<N>()?;
        self.0 = tail;
        Some(*head)
    }

    pub fn u8(&mut self) -> Option<u8> {
        self.array::<1>().map(|[byte]| byte)
    }

    pub fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    pub fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    /// A UTF-8 text behind its length.
    pub fn text(&mut self) -> Option<&'a str> {
        let length = self.u32()? as usize;
        let (head, tail) = self.0.split_at_checked(length)?;
        self.0 = tail;
        std::str::from_utf8(head).ok()
    }
}

/// Verifies and decompresses chunks, reusing its memory.
pub(crate) struct ChunkReader {
    decompressor: zstd::bulk::Decompressor<'static>,
    records: Vec<u8>,
}

impl ChunkReader {
    pub fn new() -> std::io::Result<Self> {
        Ok(Self { decompressor: zstd::bulk::Decompressor::new()?, records: Vec::new() })
    }

    /// The records of a chunk, or what is wrong with it.
    pub fn open(&mut self, body: &[u8]) -> Result<&[u8], String> {
        let too_short = || "a chunk is too short".to_owned();
        let mut fields = Fields(body);
        let _times = (fields.u64().ok_or_else(too_short)?, fields.u64().ok_or_else(too_short)?);
        let size = fields.u64().ok_or_else(too_short)?;
        let checksum = fields.u32().ok_or_else(too_short)?;
        let compression = fields.text().ok_or_else(too_short)?;
        let compressed_size = fields.u64().ok_or_else(too_short)?;
        if compressed_size != fields.0.len() as u64 {
            return Err("a chunk's lengths contradict each other".into());
        }
        let size = usize::try_from(size)
            .ok()
            .filter(|&size| size <= FRAME_BYTES_MAX)
            .ok_or("a chunk claims to be larger than any chunk can be")?;
        self.records.clear();
        match compression {
            "" => self.records.extend_from_slice(fields.0),
            "zstd" => {
                self.records.reserve_exact(size);
                self.decompressor
                    .decompress_to_buffer(fields.0, &mut self.records)
                    .map_err(|err| format!("a chunk does not decompress ({err})"))?;
            }
            _ => return Err("a chunk is compressed in an unknown way".into()),
        }
        if self.records.len() != size {
            return Err("a chunk has the wrong length".into());
        }
        if crc32fast::hash(&self.records) != checksum {
            return Err("a chunk's checksum is wrong".into());
        }
        Ok(&self.records)
    }
}
