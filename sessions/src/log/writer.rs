//! Turns rows and entries into MCAP bytes, one whole chunk per call.
//!
//! The container is written in memory and handed to the [`Sink`] in one append per call, so the
//! file on disk always ends with a whole chunk plus at most one torn one, and the system's own
//! reason for a failed write is kept.

use super::sink::Sink;
use crate::manifest::Manifest;
use crate::record::{EndRecord, Entry, EntryMessageRef, Row, block_slices, blocks_from_rows};
use crate::schema::Channel;
use mcap::records::MessageHeader;
use palpate_model::Nanos;
use prost::Message;
use std::io::{self, Seek, SeekFrom, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use thiserror::Error;

/// The profile in the file's header, which tells our files from other MCAP files.
pub(crate) const PROFILE: &str = "palpate";
/// Largest message the writer makes; the reader's limit for a whole chunk is four times this.
pub(crate) const MESSAGE_BYTES_MAX: usize = 16 << 20;
/// Deepest nesting of an entry; the JSON parser that reads it back stops at 128.
const JSON_DEPTH_MAX: usize = 100;
/// A chunk is cut when it grows beyond this.
const CHUNK_BYTES: u64 = 4 << 20;

/// A session could not be written.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum LogError {
    /// The disk refused. The file is not written to again: what a failed write or sync left
    /// behind is unknown.
    #[error("cannot write the session log ({reason}): {path}; everything saved before is kept")]
    Disk {
        /// What the system said.
        reason: String,
        /// The log.
        path: String,
    },
    /// The disk was too slow for too long.
    #[error(
        "the disk did not keep up for {seconds} s and no more samples fit in memory: {path}; everything saved before is kept, use a faster disk"
    )]
    TooSlow {
        /// Session time that waited in memory, in s.
        seconds: u64,
        /// The log.
        path: String,
    },
    /// A value is not a number.
    #[error(
        "the {what} is not a number and was not recorded; check the signal and the calibration"
    )]
    NotFinite {
        /// Which value.
        what: String,
    },
    /// Entries must be in order.
    #[error("entry {order} came after entry {previous}; entries must be recorded in order")]
    OutOfOrder {
        /// The entry's place.
        order: u64,
        /// The place of the entry before.
        previous: u64,
    },
    /// A message does not fit the file format.
    #[error("the {what} cannot be recorded ({reason})")]
    Encode {
        /// What was to be recorded.
        what: &'static str,
        /// Why not.
        reason: String,
    },
    /// The writer has ended.
    #[error("the session log is closed; start a new session")]
    Closed,
}

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

/// Writes one session log.
pub struct LogWriter<S: Sink> {
    container: mcap::Writer<Tape>,
    tape: Tape,
    sink: S,
    /// Shown in errors.
    path: String,
    channel_ids: [u16; Channel::ALL.len()],
    sequences: [u32; Channel::ALL.len()],
    started_ns: u64,
    tick_nanos: u64,
    controller_ns: u64,
    samples: u64,
    entries: u64,
    last_order: Option<u64>,
    failure: Option<LogError>,
}

impl<S: Sink> LogWriter<S> {
    /// Starts a log. When this returns, the manifest survives a power cut.
    ///
    /// `path` is only shown in errors.
    pub fn begin(sink: S, path: &str, manifest: &Manifest) -> Result<Self, LogError> {
        let tape = Tape::default();
        let container = mcap::WriteOptions::new()
            .profile(PROFILE)
            .library(format!("palpate {}", manifest.software_version))
            .compression(Some(mcap::Compression::Zstd))
            // Level 1 is the cheapest; packed doubles hardly shrink further at higher ones.
            .compression_level(1)
            .compression_threads(0)
            .chunk_size(Some(CHUNK_BYTES))
            .disable_seeking(true)
            .emit_message_indexes(true)
            .create(tape.clone())
            .map_err(encode_error("manifest"))?;
        let started_ns = manifest.started_at.timestamp_nanos_opt().unwrap_or(0);
        let mut writer = Self {
            container,
            tape,
            sink,
            path: path.into(),
            channel_ids: [0; Channel::ALL.len()],
            sequences: [0; Channel::ALL.len()],
            started_ns: u64::try_from(started_ns).unwrap_or(0),
            tick_nanos: manifest.rig.tick_nanos,
            controller_ns: 0,
            samples: 0,
            entries: 0,
            last_order: None,
            failure: None,
        };
        writer.add_channels()?;
        let json = readable_json("manifest", manifest)?;
        writer.put(Channel::Manifest, Nanos::ZERO, &json)?;
        writer.flush()?;
        writer.sync()?;
        Ok(writer)
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
                        channel.topic(),
                        channel.message_encoding(),
                        &channel.metadata(),
                    )
                })
                .map_err(encode_error("list of channels"))?;
            self.channel_ids[channel as usize] = id;
        }
        Ok(())
    }

    /// Adds rows and entries and hands everything so far to the sink.
    ///
    /// Entries are JSON and must come in strictly increasing `order`.
    pub fn append(&mut self, rows: &[Row], entries: &[Entry]) -> Result<(), LogError> {
        self.check_alive()?;
        self.check_input(rows, entries)?;
        for slice in block_slices(rows) {
            let Some(last) = slice.last() else { continue };
            let (daq, derived) = blocks_from_rows(self.samples, slice);
            self.controller_ns = last.tick.saturating_mul(self.tick_nanos);
            self.put(Channel::Daq, last.host, &daq.encode_to_vec())?;
            self.put(Channel::Derived, last.host, &derived.encode_to_vec())?;
            self.samples += slice.len() as u64;
        }
        for entry in entries {
            let json = entry_json(entry)?;
            self.put(Channel::of_entry(entry.kind), entry.now, &json)?;
            self.entries += 1;
            self.last_order = Some(entry.order);
        }
        self.flush()
    }

    /// Makes everything handed to the sink survive a power cut.
    pub fn sync(&mut self) -> Result<(), LogError> {
        self.check_alive()?;
        let outcome = self.sink.sync();
        self.disk(outcome)
    }

    /// Writes the end record and the index and makes them durable.
    ///
    /// `samples` and `entries` of the record are replaced by what was really written.
    pub fn finish(mut self, end: EndRecord) -> Result<(), LogError> {
        self.check_alive()?;
        if let Some((name, _)) = end.time_use.iter().find(|(_, secs)| !secs.is_finite()) {
            return Err(LogError::NotFinite {
                what: format!("time used by '{name}'"),
            });
        }
        let end = EndRecord {
            samples: self.samples,
            entries: self.entries,
            ..end
        };
        let json = readable_json("end record", &end)?;
        self.put(Channel::End, end.ended_at, &json)?;
        self.container.finish().map_err(encode_error("index"))?;
        self.hand_over()?;
        self.sync()
    }

    /// Samples written so far.
    #[must_use]
    pub fn samples(&self) -> u64 {
        self.samples
    }

    fn check_alive(&self) -> Result<(), LogError> {
        self.failure.clone().map_or(Ok(()), Err)
    }

    /// Refuses what a reader would refuse, before any of it is written.
    fn check_input(&self, rows: &[Row], entries: &[Entry]) -> Result<(), LogError> {
        check_rows(rows)?;
        let mut previous = self.last_order;
        for entry in entries {
            check_order(entry.order, previous)?;
            previous = Some(entry.order);
        }
        Ok(())
    }

    fn put(&mut self, channel: Channel, at: Nanos, data: &[u8]) -> Result<(), LogError> {
        if data.len() > MESSAGE_BYTES_MAX {
            return Err(LogError::Encode {
                what: channel.topic(),
                reason: format!(
                    "it has {} bytes, {MESSAGE_BYTES_MAX} are the most",
                    data.len()
                ),
            });
        }
        let index = channel as usize;
        let header = MessageHeader {
            channel_id: self.channel_ids[index],
            sequence: self.sequences[index],
            log_time: self.started_ns.saturating_add(at.0),
            publish_time: self.controller_ns,
        };
        // A gap in the sequence shows a reader that a message is missing.
        self.sequences[index] = self.sequences[index].wrapping_add(1);
        self.container
            .write_to_known_channel(&header, data)
            .map_err(encode_error(channel.topic()))
    }

    fn flush(&mut self) -> Result<(), LogError> {
        self.container.flush().map_err(encode_error("chunk"))?;
        self.hand_over()
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

    fn disk(&mut self, outcome: io::Result<()>) -> Result<(), LogError> {
        outcome.map_err(|err| {
            let failure = LogError::Disk {
                reason: err.to_string(),
                path: self.path.clone(),
            };
            self.failure = Some(failure.clone());
            failure
        })
    }
}

pub(crate) fn check_rows(rows: &[Row]) -> Result<(), LogError> {
    match rows.iter().find_map(Row::non_finite) {
        Some(what) => Err(LogError::NotFinite {
            what: format!("{what} of a sample"),
        }),
        None => Ok(()),
    }
}

pub(crate) fn check_order(order: u64, previous: Option<u64>) -> Result<(), LogError> {
    match previous {
        Some(previous) if order <= previous => Err(LogError::OutOfOrder { order, previous }),
        _ => Ok(()),
    }
}

/// An entry's message.
fn entry_json(entry: &Entry) -> Result<Vec<u8>, LogError> {
    if !is_shallow(&entry.body, JSON_DEPTH_MAX) {
        return Err(LogError::Encode {
            what: "entry",
            reason: format!("it is nested more than {JSON_DEPTH_MAX} levels deep"),
        });
    }
    let message = EntryMessageRef {
        order: entry.order,
        after_sample: entry.after_sample,
        now_ns: entry.now.0,
        body: &entry.body,
    };
    serde_json::to_vec(&message).map_err(json_error("entry"))
}

fn is_shallow(value: &serde_json::Value, depth: usize) -> bool {
    use serde_json::Value;
    let Some(below) = depth.checked_sub(1) else {
        return false;
    };
    match value {
        Value::Array(items) => items.iter().all(|item| is_shallow(item, below)),
        Value::Object(items) => items.values().all(|item| is_shallow(item, below)),
        _ => true,
    }
}

/// JSON that reads back as the same value; a number that is not finite would come back as null.
fn readable_json<T>(what: &'static str, value: &T) -> Result<Vec<u8>, LogError>
where
    T: serde::Serialize + serde::de::DeserializeOwned + PartialEq,
{
    let json = serde_json::to_vec(value).map_err(json_error(what))?;
    let back: T = serde_json::from_slice(&json).map_err(json_error(what))?;
    if back == *value {
        Ok(json)
    } else {
        Err(LogError::Encode {
            what,
            reason: "it does not read back as it was written".into(),
        })
    }
}

fn json_error(what: &'static str) -> impl Fn(serde_json::Error) -> LogError {
    move |err| LogError::Encode {
        what,
        reason: err.to_string(),
    }
}

fn encode_error(what: &'static str) -> impl Fn(mcap::McapError) -> LogError {
    move |err| LogError::Encode {
        what,
        reason: err.to_string(),
    }
}
