//! Strict parsing of MCAP records and chunks (<https://mcap.dev/spec>).
//!
//! Nothing is trusted: the file and 24 MiB bound every length, a chunk's checksum is verified before its content is
//! parsed, and no length inside a record allocates memory.

/// Largest frame, and largest decompressed chunk: the writer ends a chunk beyond 4 MiB, and a message has at most 16 MiB.
/// A frame and a decompressed chunk together stay below 64 MiB.
pub(crate) const FRAME_BYTES_MAX: usize = 24 << 20;
pub(crate) const FRAME_HEADER_BYTES: usize = 9;
/// Footer frame and closing magic.
pub(crate) const FOOTER_BYTES: usize = FRAME_HEADER_BYTES + 20 + mcap::MAGIC.len();

/// Takes little-endian fields off the front of a slice; `None` if it is too short.
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

    fn bytes(&mut self, length: usize) -> Option<&'a [u8]> {
        let (head, tail) = self.0.split_at_checked(length)?;
        self.0 = tail;
        Some(head)
    }

    /// A UTF-8 text after its length.
    pub fn text(&mut self) -> Option<&'a str> {
        let length = self.u32()? as usize;
        std::str::from_utf8(self.bytes(length)?).ok()
    }

    /// Opcode and body of a record.
    pub fn record(&mut self) -> Option<(u8, &'a [u8])> {
        let (opcode, length) = (self.u8()?, self.u64()?);
        Some((opcode, self.bytes(usize::try_from(length).ok()?)?))
    }
}

/// Verifies and decompresses chunks into one reused buffer.
pub(crate) struct ChunkReader {
    decompressor: zstd::bulk::Decompressor<'static>,
    records: Vec<u8>,
}

impl ChunkReader {
    pub fn new() -> std::io::Result<Self> {
        Ok(Self { decompressor: zstd::bulk::Decompressor::new()?, records: Vec::new() })
    }

    /// The records of a chunk.
    pub fn open(&mut self, body: &[u8]) -> Result<&[u8], String> {
        let too_short = || "a data block of the file is too short".to_owned();
        let mut fields = Fields(body);
        let _times = (fields.u64().ok_or_else(too_short)?, fields.u64().ok_or_else(too_short)?);
        let size = fields.u64().ok_or_else(too_short)?;
        let checksum = fields.u32().ok_or_else(too_short)?;
        let compression = fields.text().ok_or_else(too_short)?;
        let compressed_size = fields.u64().ok_or_else(too_short)?;
        if compressed_size != fields.0.len() as u64 {
            return Err(
                "the file states the length of a data block twice, and the two values differ"
                    .into(),
            );
        }
        let size = usize::try_from(size)
            .ok()
            .filter(|&size| size <= FRAME_BYTES_MAX)
            .ok_or("a data block of the file states a size above the largest possible size")?;
        self.records.clear();
        match compression {
            "" => self.records.extend_from_slice(fields.0),
            "zstd" => {
                self.records.reserve_exact(size);
                self.decompressor.decompress_to_buffer(fields.0, &mut self.records).map_err(
                    |err| format!("a data block of the file cannot be decompressed ({err})"),
                )?;
            }
            _ => return Err("a data block of the file uses an unknown compression method".into()),
        }
        if self.records.len() != size {
            return Err("a data block of the file has the wrong length".into());
        }
        if crc32fast::hash(&self.records) != checksum {
            return Err("the checksum of a data block of the file is wrong".into());
        }
        Ok(&self.records)
    }
}
