//! Raw bytes exchanged with devices, on disk in blocks of one device each.

use crate::packed::{Field, extend_numbers, read_fields, zigzag};
use palpate_model::Nanos;
use palpate_model::rig::RawBytes;

/// Largest number of bytes in a block, far below the largest message.
const BLOCK_BYTES_MAX: usize = 1 << 20;
const BLOCK_PIECES_MAX: usize = 1 << 16;
/// A packed number takes ten bytes at most.
const NUMBER_BYTES_MAX: usize = 10;

#[derive(Clone, PartialEq, prost::Message)]
pub(crate) struct RawMessage {
    /// Raw bytes of all devices before this block.
    #[prost(uint64, tag = "1")]
    pub first_byte: u64,
    #[prost(string, tag = "2")]
    pub device: String,
    /// Session time of each piece as the difference to the piece before, the first to zero, modulo 2^64.
    #[prost(sint64, repeated, tag = "3")]
    pub at_delta_ns: Vec<i64>,
    #[prost(bool, repeated, tag = "4")]
    pub is_sent: Vec<bool>,
    #[prost(uint32, repeated, tag = "5")]
    pub length: Vec<u32>,
    #[prost(bytes = "vec", tag = "6")]
    pub data: Vec<u8>,
}

/// Encodes pieces: the devices in the order of their first piece, each with its pieces in order. A piece longer than a block
/// is split; empty pieces are dropped.
pub(crate) fn raw_blocks(mut first_byte: u64, pieces: &[RawBytes]) -> Vec<RawMessage> {
    let mut devices: Vec<&str> = Vec::new();
    for piece in pieces {
        if !devices.contains(&&*piece.device) {
            devices.push(&piece.device);
        }
    }
    let mut blocks = Vec::new();
    for device in devices {
        let mut block = RawMessage::default();
        let mut last = 0;
        let own = pieces.iter().filter(|piece| &*piece.device == device);
        let parts = own.flat_map(|piece| {
            let parts = piece.bytes.chunks(BLOCK_BYTES_MAX);
            parts.map(|part| (piece.at.0, piece.is_sent, part))
        });
        for (at, is_sent, part) in parts {
            let is_full = block.data.len() + part.len() > BLOCK_BYTES_MAX;
            if is_full || block.length.len() == BLOCK_PIECES_MAX {
                blocks.push(std::mem::take(&mut block));
                last = 0;
            }
            block.device = device.into();
            block.at_delta_ns.push(at.wrapping_sub(last) as i64);
            block.is_sent.push(is_sent);
            block.length.push(part.len() as u32);
            block.data.extend_from_slice(part);
            last = at;
        }
        if !block.data.is_empty() {
            blocks.push(block);
        }
    }
    for block in &mut blocks {
        block.first_byte = first_byte;
        first_byte += block.data.len() as u64;
    }
    blocks
}

/// A verified block of raw bytes of one device.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RawBlock<'a> {
    first_byte: u64,
    device: &'a str,
    at_ns: Vec<i64>,
    is_sent: Vec<bool>,
    length: Vec<u32>,
    data: &'a [u8],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RawPiece<'a> {
    /// Session time at which the computer read or wrote it.
    pub at: Nanos,
    /// Whether the computer sent it; received otherwise.
    pub is_sent: bool,
    pub bytes: &'a [u8],
}

impl<'a> RawBlock<'a> {
    /// Raw bytes of all devices before this block.
    pub(crate) fn first_byte(&self) -> u64 {
        self.first_byte
    }

    pub fn device(&self) -> &'a str {
        self.device
    }

    pub fn len(&self) -> usize {
        self.data.len()
    }

    pub fn is_empty(&self) -> bool {
        self.data.is_empty()
    }

    /// The pieces in the order of the exchange.
    pub fn pieces(&self) -> impl Iterator<Item = RawPiece<'a>> {
        let mut rest = self.data;
        let places = self.at_ns.iter().zip(&self.is_sent).zip(&self.length);
        places.map(move |((at, is_sent), length)| {
            // Checked when the block was read.
            let (bytes, tail) = rest.split_at(*length as usize);
            rest = tail;
            RawPiece { at: Nanos(*at as u64), is_sent: *is_sent, bytes }
        })
    }

    pub(crate) fn read(data: &'a [u8]) -> Result<Self, String> {
        let mut block = Self::default();
        read_fields(data, "raw bytes", |number, field| block.take(number, field))?;
        block.check()?;
        Ok(block)
    }

    fn take(&mut self, number: u32, field: Field<'a>) -> Result<(), String> {
        let is_long = |bytes: &[u8]| bytes.len() > BLOCK_PIECES_MAX * NUMBER_BYTES_MAX;
        match (number, field) {
            (1, Field::Number(value)) => self.first_byte = value,
            (2, Field::Bytes(bytes)) => {
                self.device = std::str::from_utf8(bytes)
                    .map_err(|_| "the device's name is not UTF-8".to_owned())?;
            }
            (3..=5, Field::Bytes(bytes)) if is_long(bytes) => {
                return Err(format!("it has more than {BLOCK_PIECES_MAX} pieces"));
            }
            (3, Field::Bytes(bytes)) => extend_numbers(&mut self.at_ns, bytes, zigzag)?,
            (4, Field::Bytes(bytes)) => extend_numbers(&mut self.is_sent, bytes, |it| it != 0)?,
            (5, Field::Bytes(bytes)) => extend_numbers(&mut self.length, bytes, |it| it as u32)?,
            (6, Field::Bytes(bytes)) => self.data = bytes,
            _ => {}
        }
        Ok(())
    }

    fn check(&mut self) -> Result<(), String> {
        let count = self.length.len();
        if self.at_ns.len() != count || self.is_sent.len() != count {
            return Err("the columns of a block of raw bytes differ in length".into());
        }
        let total: u64 = self.length.iter().map(|length| u64::from(*length)).sum();
        if total != self.data.len() as u64 {
            let held = self.data.len();
            return Err(format!(
                "a block of raw data holds {held} bytes, but its pieces add up to {total} bytes"
            ));
        }
        let mut sum = 0i64;
        for at in &mut self.at_ns {
            sum = sum.wrapping_add(*at);
            *at = sum;
        }
        Ok(())
    }

    pub(crate) fn to_pieces(&self) -> Vec<RawBytes> {
        let device = std::sync::Arc::<str>::from(self.device);
        self.pieces()
            .map(|piece| RawBytes {
                at: piece.at,
                device: device.clone(),
                is_sent: piece.is_sent,
                bytes: piece.bytes.to_vec(),
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use prost::Message;

    fn piece(at: u64, device: &str, is_sent: bool, bytes: &[u8]) -> RawBytes {
        RawBytes { at: Nanos(at), device: device.into(), is_sent, bytes: bytes.into() }
    }

    #[test]
    fn blocks_keep_every_byte_of_every_device_in_order() {
        let long: Vec<u8> = (0..BLOCK_BYTES_MAX + 7).map(|i| (i % 251) as u8).collect();
        let mut pieces = vec![
            piece(5, "controller", true, b"SH\r"),
            piece(u64::MAX, "cell", false, &[0, 255, 128]),
            piece(7, "controller", false, b":"),
            piece(8, "controller", false, b""),
            piece(3, "controller", false, &long),
        ];
        pieces.extend((0..BLOCK_PIECES_MAX as u64 + 3).map(|i| piece(i, "cell", i % 3 == 0, b"x")));
        let blocks = raw_blocks(11, &pieces);
        assert!(blocks.len() >= 5, "{}", blocks.len());
        let mut next = 11;
        let mut back: Vec<RawBytes> = Vec::new();
        for block in &blocks {
            let bytes = block.encode_to_vec();
            let read = RawBlock::read(&bytes).unwrap();
            assert_eq!(read.first_byte(), next);
            next += read.len() as u64;
            assert!(read.len() <= BLOCK_BYTES_MAX);
            back.extend(read.to_pieces());
        }
        // Each device's stream is the same, however its pieces were cut.
        for device in ["controller", "cell"] {
            let stream = |pieces: &[RawBytes], is_sent: bool| -> Vec<(u64, u8)> {
                let own = pieces.iter().filter(|one| &*one.device == device);
                let own = own.filter(|one| one.is_sent == is_sent);
                own.flat_map(|one| one.bytes.iter().map(|byte| (one.at.0, *byte))).collect()
            };
            for is_sent in [false, true] {
                assert!(stream(&back, is_sent) == stream(&pieces, is_sent), "{device}");
            }
        }
    }

    #[test]
    fn inconsistent_blocks_are_refused() {
        let good = raw_blocks(0, &[piece(1, "a", true, b"xy"), piece(2, "a", false, b"z")]);
        type Edit = fn(&mut RawMessage);
        let edits: [(Edit, &str); 4] = [
            (|block| block.length[1] = 2, "3 bytes"),
            (|block| block.is_sent.clear(), "length"),
            (|block| block.at_delta_ns.push(1), "length"),
            (|block| block.data.clear(), "0 bytes"),
        ];
        for (edit, expected) in edits {
            let mut block = good[0].clone();
            edit(&mut block);
            let refusal = RawBlock::read(&block.encode_to_vec()).unwrap_err();
            assert!(refusal.contains(expected), "{refusal}");
        }
        let bytes = good[0].encode_to_vec();
        for length in 0..bytes.len() {
            let ours = RawBlock::read(&bytes[..length]).map(|block| block.data.to_vec());
            let theirs = RawMessage::decode(&bytes[..length]);
            assert!(theirs.is_ok() || ours.is_err(), "{length}");
        }
        let mut greedy = vec![0x2a, 0xff, 0xff, 0x7f];
        greedy.resize(4 + 0x001f_ffff, 1);
        assert!(RawBlock::read(&greedy).unwrap_err().contains("65536 pieces"));
    }
}
