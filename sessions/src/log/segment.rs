//! One file of a session log: the MCAP container, its buffer, and the sink.

use super::error::{LogError, encode_error};
use super::sink::{Alteration, Sink, WrittenFile};
use crate::schema::Channel;
use mcap::records::MessageHeader;
use std::io::{self, Seek, SeekFrom, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The profile in the file's header, which distinguishes palpate's files from other MCAP files.
pub(crate) const PROFILE: &str = "palpate";
/// A chunk ends when it exceeds this size.
const CHUNK_BYTES: u64 = 4 << 20;

/// Buffer between container and sink.
#[derive(Clone, Default)]
struct Tape(Arc<Mutex<TapeState>>);

#[derive(Default)]
struct TapeState {
    bytes: Vec<u8>,
    /// Bytes written so far, which is the position in the file.
    position: u64,
}

impl Tape {
    fn state(&self) -> MutexGuard<'_, TapeState> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Write for Tape {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut state = self.state();
        state.bytes.extend_from_slice(bytes);
        state.position += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for Tape {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let position = self.state().position;
        match to {
            SeekFrom::Current(0) => Ok(position),
            SeekFrom::Start(start) if start == position => Ok(position),
            // Seeking is disabled in the container; this keeps the file append-only in any case.
            _ => Err(io::Error::other("data can only be appended to a session log")),
        }
    }
}

/// An MCAP file being written.
pub(crate) struct Segment<S: Sink> {
    container: mcap::Writer<Tape>,
    tape: Tape,
    sink: S,
    path: String,
    channel_ids: [u16; Channel::ALL.len()],
}

impl<S: Sink> Segment<S> {
    /// Starts a file in memory; the sink gets nothing yet.
    pub fn begin(sink: S, path: String, library: &str) -> Result<Self, LogError> {
        let tape = Tape::default();
        let container = mcap::WriteOptions::new()
            .profile(PROFILE)
            .library(library)
            .compression(Some(mcap::Compression::Zstd))
            // Level 1 is the fastest; higher levels hardly compress packed doubles further.
            .compression_level(1)
            .compression_threads(0)
            .chunk_size(Some(CHUNK_BYTES))
            .disable_seeking(true)
            .emit_message_indexes(true)
            .create(tape.clone())
            .map_err(encode_error("manifest"))?;
        let mut segment =
            Self { container, tape, sink, path, channel_ids: [0; Channel::ALL.len()] };
        segment.add_channels()?;
        Ok(segment)
    }

    fn add_channels(&mut self) -> Result<(), LogError> {
        for channel in Channel::ALL {
            let (encoding, schema_encoding) = channel.encodings();
            let (name, schema) = (channel.schema_name(), channel.schema());
            let container = &mut self.container;
            self.channel_ids[channel as usize] = container
                .add_schema(&name, schema_encoding, &schema)
                .and_then(|schema_id| {
                    let metadata = channel.metadata();
                    container.add_channel(schema_id, channel.name(), encoding, &metadata)
                })
                .map_err(encode_error("list of channels"))?;
        }
        Ok(())
    }

    /// Adds a message; sets the header's channel.
    pub fn put(
        &mut self,
        channel: Channel,
        header: MessageHeader,
        data: &[u8],
    ) -> Result<(), LogError> {
        let header = MessageHeader { channel_id: self.channel_ids[channel as usize], ..header };
        self.container.write_to_known_channel(&header, data).map_err(encode_error(channel.name()))
    }

    /// Ends the chunk and passes everything so far to the sink.
    pub fn flush(&mut self) -> Result<(), LogError> {
        self.container.flush().map_err(encode_error("chunk"))?;
        self.hand_over()
    }

    /// Makes everything in the sink survive a power cut, and checks that no other program changed the file.
    pub fn sync(&mut self) -> Result<(), LogError> {
        let outcome = self.sink.sync();
        self.disk(outcome)?;
        self.unaltered(self.sink.written().map_or(Ok(()), WrittenFile::check))
    }

    /// The path, and what was written, to check the closed file.
    pub fn closed(self) -> (String, Option<WrittenFile>) {
        let written = self.sink.written().cloned();
        (self.path, written)
    }

    fn unaltered(&self, outcome: Result<(), Alteration>) -> Result<(), LogError> {
        outcome.map_err(|alteration| LogError::Altered { alteration, path: self.path.clone() })
    }

    /// Free space on the sink's disk in bytes, if known.
    pub fn free_bytes(&self) -> Option<u64> {
        self.sink.free_bytes()
    }

    /// Writes the index, synchronises the file and reads it back.
    pub fn finish(&mut self) -> Result<(), LogError> {
        self.container.finish().map_err(encode_error("index"))?;
        self.hand_over()?;
        self.sync()?;
        self.unaltered(self.sink.written().map_or(Ok(()), WrittenFile::read_back))
    }

    fn hand_over(&mut self) -> Result<(), LogError> {
        let mut bytes = std::mem::take(&mut self.tape.state().bytes);
        if bytes.is_empty() {
            return Ok(());
        }
        let outcome = self.sink.append(&bytes);
        bytes.clear();
        // The buffer is reused, so that no flush has to grow a new one.
        self.tape.state().bytes = bytes;
        self.disk(outcome)
    }

    fn disk(&self, outcome: io::Result<()>) -> Result<(), LogError> {
        outcome.map_err(|err| LogError::disk(&err, &self.path))
    }
}
