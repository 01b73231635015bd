//! One file of a session log: the container, its bytes on their way to the sink, and the sink.

use super::error::{LogError, encode_error};
use super::sink::{Alteration, ClosedCheck, Sink};
use crate::schema::Channel;
use mcap::records::MessageHeader;
use std::io::{self, Seek, SeekFrom, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The profile in the file's header, which tells our files from other MCAP files.
pub(crate) const PROFILE: &str = "palpate";
/// A chunk is cut when it grows beyond this.
const CHUNK_BYTES: u64 = 4 << 20;

/// The container's bytes on their way to the sink.
#[derive(Clone, Default)]
struct Tape(Arc<Mutex<TapeState>>);

#[derive(Default)]
struct TapeState {
    bytes: Vec<u8>,
    /// Bytes ever written, which is the place in the file.
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
            SeekFrom::Start(place) if place == position => Ok(position),
            // The container is told not to seek; this keeps the file append-only if it tries.
            _ => Err(io::Error::other("a session log is only ever appended to")),
        }
    }
}

/// A complete MCAP file in the making.
pub(crate) struct Segment<S: Sink> {
    container: mcap::Writer<Tape>,
    tape: Tape,
    sink: S,
    /// Shown in errors.
    path: String,
    channel_ids: [u16; Channel::ALL.len()],
}

impl<S: Sink> Segment<S> {
    /// Starts a file in memory; nothing is handed to the sink yet.
    pub fn begin(sink: S, path: String, library: &str) -> Result<Self, LogError> {
        let tape = Tape::default();
        let container = mcap::WriteOptions::new()
            .profile(PROFILE)
            .library(library)
            .compression(Some(mcap::Compression::Zstd))
            // Level 1 is the cheapest; packed doubles hardly shrink further at higher ones.
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
            let (name, encoding) = (channel.schema_name(), channel.schema_encoding());
            let id = self
                .container
                .add_schema(name, encoding, &channel.schema())
                .and_then(|schema_id| {
                    self.container.add_channel(
                        schema_id,
                        channel.name(),
                        channel.message_encoding(),
                        &channel.metadata(),
                    )
                })
                .map_err(encode_error("list of channels"))?;
            self.channel_ids[channel as usize] = id;
        }
        Ok(())
    }

    /// Adds a message. The header's channel is filled in here.
    pub fn put(
        &mut self,
        channel: Channel,
        header: MessageHeader,
        data: &[u8],
    ) -> Result<(), LogError> {
        let header = MessageHeader { channel_id: self.channel_ids[channel as usize], ..header };
        self.container.write_to_known_channel(&header, data).map_err(encode_error(channel.name()))
    }

    /// Ends the chunk and hands everything so far to the sink.
    pub fn flush(&mut self) -> Result<(), LogError> {
        self.container.flush().map_err(encode_error("chunk"))?;
        self.hand_over()
    }

    /// Makes everything handed to the sink survive a power cut, and sees that it is still there.
    pub fn sync(&mut self) -> Result<(), LogError> {
        let outcome = self.sink.sync();
        self.disk(outcome)?;
        self.unaltered(self.sink.check())
    }

    /// Its path, and what checks it once it is closed.
    pub fn closed(self) -> (String, ClosedCheck) {
        (self.path, self.sink.closed_check())
    }

    fn unaltered(&self, outcome: Result<(), Alteration>) -> Result<(), LogError> {
        outcome.map_err(|alteration| LogError::Altered { alteration, path: self.path.clone() })
    }

    /// Free room on the sink's disk in bytes, if that is known.
    pub fn free_bytes(&self) -> Option<u64> {
        self.sink.free_bytes()
    }

    /// Writes the index, makes the whole file durable and reads it back.
    pub fn finish(&mut self) -> Result<(), LogError> {
        self.container.finish().map_err(encode_error("index"))?;
        self.hand_over()?;
        self.sync()?;
        self.unaltered(self.sink.read_back())
    }

    fn hand_over(&mut self) -> Result<(), LogError> {
        let mut bytes = std::mem::take(&mut self.tape.state().bytes);
        if bytes.is_empty() {
            return Ok(());
        }
        let outcome = self.sink.append(&bytes);
        bytes.clear();
        // The buffer is handed back so that no flush has to grow a new one.
        self.tape.state().bytes = bytes;
        self.disk(outcome)
    }

    fn disk(&self, outcome: io::Result<()>) -> Result<(), LogError> {
        outcome.map_err(|err| LogError::disk(&err, &self.path))
    }
}
