//! Encodes rows and entries as MCAP, one complete chunk per call.
//!
//! Each call passes its bytes to the [`Sink`] in one append, so the file on disk ends with a complete chunk and at most one
//! incomplete one.
//!
//! The container holds an index entry of about 600 bytes per chunk in memory until its file is finished. A log is therefore
//! written in segments: after [`BATCHES_PER_SEGMENT`] batches a new file continues, and the index of the old one is written
//! and freed. So memory does not grow with the length of a run.

use super::error::LogError;
use super::json::{entry_json, readable_json};
use super::segment::Segment;
use super::sink::{SegmentSource, Sink, WrittenFile};
use crate::block::{block_slices, blocks_from_rows};
use crate::health::HealthMessage;
use crate::manifest::Manifest;
use crate::raw::raw_blocks;
use crate::record::{EndRecord, LogEntry, SampleRow, View};
use crate::schema::Channel;
use mcap::records::MessageHeader;
use palpate_model::Nanos;
use palpate_model::rig::RawBytes;
use prost::Message;

/// Batches in one segment: ten minutes of 100 ms. Their index entries of about 600 bytes take under 4 MB. Shorter segments
/// would save little and leave many files.
pub const BATCHES_PER_SEGMENT: u32 = 6000;
/// Largest message that the writer accepts.
pub(crate) const MESSAGE_BYTES_MAX: usize = 16 << 20;
/// Session time between two samples of the thinned channel: 50 points a second show every step of a run, and the messages,
/// each with an index entry of 16 bytes, stay below a tenth of a log at 1 kHz.
const VIEW_EVERY: Nanos = Nanos::from_millis(20);

#[derive(Clone, Copy, Debug, Default)]
pub struct LogBatch<'a> {
    pub rows: &'a [SampleRow],
    /// Entries, by strictly increasing `order`.
    pub entries: &'a [LogEntry],
    /// Bytes exchanged with devices, at session times.
    pub raw: &'a [RawBytes],
    pub health: &'a [HealthMessage],
}

impl LogBatch<'_> {
    pub fn is_empty(&self) -> bool {
        let has_more = !self.raw.is_empty() || !self.health.is_empty();
        self.rows.is_empty() && self.entries.is_empty() && !has_more
    }
}

/// Progress of a log, and the state in which a rewriting segment begins.
#[derive(Clone, Default)]
struct Counters {
    sequences: [u32; Channel::ALL.len()],
    controller_ns: u64,
    samples: u64,
    entries: u64,
    raw_bytes: u64,
    last_order: Option<u64>,
    /// Session time of the next sample in the thinned channel.
    next_view: Nanos,
}

struct Rotation<S: Sink> {
    source: Box<dyn SegmentSource<Sink = S>>,
    batches_per_segment: u32,
}

pub struct LogWriter<S: Sink> {
    segment: Segment<S>,
    /// `None` for a log that stays in one file.
    rotation: Option<Rotation<S>>,
    /// Number of the segment being written.
    number: u32,
    batches: u32,
    manifest_json: Vec<u8>,
    library: String,
    started_ns: u64,
    /// `None` in an imported session, whose ticks are picoseconds.
    tick_nanos: Option<u64>,
    at: Counters,
    /// Value of `at` at the last synchronisation.
    synced: Counters,
    failure: Option<LogError>,
    /// Finished segments: path and written content.
    closed: Vec<(String, Option<WrittenFile>)>,
    /// Alteration of a finished segment, which does not stop the recording.
    altered: Option<LogError>,
}

impl<S: Sink> LogWriter<S> {
    /// Starts a log in a single file. Once this returns, the manifest survives a power cut.
    ///
    /// `path` is only for messages.
    pub fn begin(sink: S, path: &str, manifest: &Manifest) -> Result<Self, LogError> {
        let library = format!("palpate {}", manifest.software_version);
        let started_ns = manifest.started_at.timestamp_nanos_opt().unwrap_or(0);
        let mut writer = Self {
            segment: Segment::begin(sink, path.into(), &library)?,
            rotation: None,
            number: 0,
            batches: 0,
            manifest_json: readable_json("manifest", manifest)?,
            library,
            started_ns: u64::try_from(started_ns).unwrap_or(0),
            tick_nanos: manifest.rig.as_ref().map(|rig| rig.tick_nanos),
            at: Counters::default(),
            synced: Counters::default(),
            failure: None,
            closed: Vec::new(),
            altered: None,
        };
        writer.put_manifest()?;
        writer.sync()?;
        Ok(writer)
    }

    /// Starts a log with a new segment after every `batches_per_segment` batches. Once this returns, the manifest survives a
    /// power cut.
    pub fn begin_in_segments(
        mut source: Box<dyn SegmentSource<Sink = S>>,
        batches_per_segment: u32,
        manifest: &Manifest,
    ) -> Result<Self, LogError> {
        let path = source.path(0);
        let sink = source.create(0).map_err(|err| LogError::disk(&err, &path))?;
        let mut writer = Self::begin(sink, &path, manifest)?;
        writer.rotation = Some(Rotation { source, batches_per_segment });
        Ok(writer)
    }

    /// Begins a new segment if the present one is full.
    ///
    /// The new manifest is durable before the old segment is finished, and the old segment is durable before the new one gets
    /// data, so an interruption at any point loses nothing.
    fn rotate_if_full(&mut self) -> Result<(), LogError> {
        let Some(rotation) = &mut self.rotation else {
            return Ok(());
        };
        if self.batches < rotation.batches_per_segment {
            return Ok(());
        }
        let number = self.number + 1;
        let path = rotation.source.path(number);
        let outcome = rotation
            .source
            .create(number)
            .map_err(|err| LogError::disk(&err, &path))
            .and_then(|sink| Segment::begin(sink, path, &self.library));
        let next = self.remember_failure(outcome)?;
        let mut former = std::mem::replace(&mut self.segment, next);
        (self.number, self.batches) = (number, 0);
        self.put_manifest()?;
        let outcome = self.segment.sync();
        self.remember_failure(outcome)?;
        match former.finish() {
            // The recording continues in the new segment.
            Err(err @ LogError::Altered { .. }) => drop(self.altered.get_or_insert(err)),
            outcome => {
                self.remember_failure(outcome)?;
                self.closed.push(former.closed());
            }
        }
        Ok(())
    }

    /// Begins the segment with the manifest.
    fn put_manifest(&mut self) -> Result<(), LogError> {
        let json = std::mem::take(&mut self.manifest_json);
        // Timed at the session's start in every segment.
        let outcome = self.put(Channel::Manifest, Nanos::ZERO, &json);
        self.manifest_json = json;
        outcome?;
        self.flush()
    }

    /// Adds rows and entries, in strictly increasing `order`, and passes everything so far to the sink.
    pub fn append(&mut self, rows: &[SampleRow], entries: &[LogEntry]) -> Result<(), LogError> {
        self.append_batch(&LogBatch { rows, entries, ..LogBatch::default() })
    }

    /// Like [`append`](Self::append), for all kinds of data.
    pub fn append_batch(&mut self, parts: &LogBatch<'_>) -> Result<(), LogError> {
        self.check_alive()?;
        self.check_input(parts)?;
        if !parts.is_empty() {
            self.rotate_if_full()?;
        }
        self.put_batch(parts)?;
        self.flush()
    }

    fn put_batch(&mut self, parts: &LogBatch<'_>) -> Result<(), LogError> {
        self.batches += u32::from(!parts.is_empty());
        // Exchanged bytes precede the samples made from them.
        for block in raw_blocks(self.at.raw_bytes, parts.raw) {
            let at = Nanos(block.at_delta_ns.first().map_or(0, |at| *at as u64));
            self.put(Channel::Raw, at, &block.encode_to_vec())?;
            self.at.raw_bytes += block.data.len() as u64;
        }
        for slice in block_slices(parts.rows) {
            let Some(last) = slice.last() else { continue };
            let (daq, derived) = blocks_from_rows(self.at.samples, slice);
            self.at.controller_ns = match self.tick_nanos {
                Some(nanos) => last.tick.saturating_mul(nanos),
                None => last.tick / 1000,
            };
            self.put(Channel::Daq, last.host, &daq.encode_to_vec())?;
            self.put(Channel::Derived, last.host, &derived.encode_to_vec())?;
            self.put_view(slice)?;
            self.at.samples += slice.len() as u64;
        }
        for entry in parts.entries {
            let json = entry_json(entry)?;
            self.put(Channel::of_entry(entry.kind), entry.now, &json)?;
            self.at.entries += 1;
            self.at.last_order = Some(entry.order);
        }
        for health in parts.health {
            let json = readable_json("health message", health)?;
            self.put(Channel::Health, health.now, &json)?;
        }
        Ok(())
    }

    /// Makes everything in the sink survive a power cut.
    pub fn sync(&mut self) -> Result<(), LogError> {
        self.check_alive()?;
        let outcome = self.segment.sync();
        self.remember_failure(outcome)?;
        self.synced = self.at.clone();
        Ok(())
    }

    /// Continues in a new segment after a disk failure and rewrites `since_sync`, the batches since the last successful
    /// [`sync`](Self::sync) in order, with the failed one at the end. The old file is not touched again.
    ///
    /// Once this returns, all of it survives a power cut. Returns the new segment's path, and whether it is in the spare
    /// folder.
    pub fn rewrite(&mut self, since_sync: &[LogBatch<'_>]) -> Result<(String, bool), LogError> {
        let Some(cause) = self.failure.take() else {
            return Err(LogError::Closed);
        };
        for is_elsewhere in [false, true] {
            if let Ok(path) = self.try_rewrite(&cause, since_sync, is_elsewhere) {
                return Ok((path, is_elsewhere));
            }
        }
        self.failure = Some(cause.clone());
        Err(cause)
    }

    fn try_rewrite(
        &mut self,
        cause: &LogError,
        since_sync: &[LogBatch<'_>],
        is_elsewhere: bool,
    ) -> Result<String, LogError> {
        let Some(rotation) = &mut self.rotation else {
            return Err(cause.clone());
        };
        let number = self.number + 1;
        let own = rotation.source.path(number);
        let (sink, path) = if is_elsewhere {
            rotation.source.create_elsewhere(number)
        } else {
            rotation.source.create(number).map(|sink| (sink, own.clone()))
        }
        .map_err(|err| LogError::disk(&err, &own))?;
        self.failure = None;
        self.number = number;
        self.batches = 0;
        self.at = self.synced.clone();
        self.segment = Segment::begin(sink, path.clone(), &self.library)?;
        let rewrite = serde_json::json!({
            "reason": cause.to_string(),
            "samples": self.at.samples,
            "entries": self.at.entries,
        });
        self.put_manifest()?;
        self.put(Channel::Rewrite, Nanos::ZERO, rewrite.to_string().as_bytes())?;
        for parts in since_sync {
            self.put_batch(parts)?;
        }
        self.flush()?;
        self.sync()?;
        Ok(path)
    }

    /// Adds a thinned copy of rows.
    fn put_view(&mut self, rows: &[SampleRow]) -> Result<(), LogError> {
        for row in rows {
            if row.host < self.at.next_view {
                continue;
            }
            self.at.next_view = row.host + VIEW_EVERY;
            let view = View {
                t_s: row.host.seconds().0,
                signal_v: row.volts,
                force_n: row.force,
                depth_mm: row.depth,
                cycle: row.cycle,
            };
            self.put(Channel::View, row.host, &view.encode_to_vec())?;
        }
        Ok(())
    }

    /// Writes the end record and the index, synchronises them and reads the file back.
    ///
    /// Sets `samples`, `entries` and `raw_bytes` of the record to the numbers written.
    pub fn finish(&mut self, end: EndRecord) -> Result<(), LogError> {
        self.check_alive()?;
        if let Some((name, _)) = end.time_use.iter().find(|(_, secs)| !secs.is_finite()) {
            return Err(LogError::NotFinite { what: format!("time used by '{name}'") });
        }
        let end = EndRecord {
            samples: self.at.samples,
            entries: self.at.entries,
            raw_bytes: self.at.raw_bytes,
            ..end
        };
        let json = readable_json("end record", &end)?;
        self.put(Channel::End, end.ended_at, &json)?;
        let outcome = self.segment.finish();
        self.remember_failure(outcome)?;
        for (path, written) in &self.closed {
            if let Some(Err(alteration)) = written.as_ref().map(WrittenFile::read_back) {
                let path = path.clone();
                self.altered.get_or_insert(LogError::Altered { alteration, path });
            }
        }
        Ok(())
    }

    /// Takes the alteration of a finished segment by another program.
    pub fn take_altered(&mut self) -> Option<LogError> {
        self.altered.take()
    }

    /// Free space on the log's disk in bytes, if known.
    pub fn free_bytes(&self) -> Option<u64> {
        self.segment.free_bytes()
    }

    fn check_alive(&self) -> Result<(), LogError> {
        self.failure.clone().map_or(Ok(()), Err)
    }

    /// Refuses data that a reader would refuse.
    fn check_input(&self, parts: &LogBatch<'_>) -> Result<(), LogError> {
        if let Some(what) = parts.rows.iter().find_map(SampleRow::non_finite) {
            return Err(LogError::NotFinite { what: format!("{what} of a sample") });
        }
        let mut previous = self.at.last_order;
        for entry in parts.entries {
            check_order(entry.order, previous)?;
            previous = Some(entry.order);
        }
        Ok(())
    }

    fn put(&mut self, channel: Channel, at: Nanos, data: &[u8]) -> Result<(), LogError> {
        if data.len() > MESSAGE_BYTES_MAX {
            return Err(LogError::Encode {
                what: channel.name(),
                reason: format!("it has {} bytes, more than {MESSAGE_BYTES_MAX}", data.len()),
            });
        }
        let index = channel as usize;
        let header = MessageHeader {
            channel_id: 0,
            sequence: self.at.sequences[index],
            log_time: self.started_ns.saturating_add(at.0),
            publish_time: self.at.controller_ns,
        };
        // A gap in the sequence reveals a missing message to a reader.
        self.at.sequences[index] = self.at.sequences[index].wrapping_add(1);
        self.segment.put(channel, header, data)
    }

    fn flush(&mut self) -> Result<(), LogError> {
        let outcome = self.segment.flush();
        self.remember_failure(outcome)
    }

    /// Stores a failure; nothing is written after it.
    fn remember_failure<T>(&mut self, outcome: Result<T, LogError>) -> Result<T, LogError> {
        outcome.inspect_err(|err| self.failure = Some(err.clone()))
    }
}

pub(crate) fn check_order(order: u64, previous: Option<u64>) -> Result<(), LogError> {
    match previous {
        Some(previous) if order <= previous => Err(LogError::OutOfOrder { order, previous }),
        _ => Ok(()),
    }
}
