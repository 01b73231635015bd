//! Turns rows and entries into MCAP bytes, one whole chunk per call.
//!
//! The container is written in memory and handed to the [`Sink`] in one append per call, so the
//! file on disk always ends with a whole chunk plus at most one torn one, and the system's own
//! reason for a failed write is kept.
//!
//! The container keeps an index entry of about 600 bytes per chunk in memory until its file is
//! finished. A log is therefore written in segments: after [`BATCHES_PER_SEGMENT`] batches a new
//! file goes on where the old one stopped, and the old one's index is written and let go. No more
//! than the index of one segment is ever held, so the memory of a run does not grow with its
//! length.

use super::error::LogError;
use super::json::{entry_json, readable_json};
use super::segment::Segment;
use super::sink::{ClosedCheck, SegmentSource, Sink};
use crate::block::{block_slices, blocks_from_rows};
use crate::health::Health;
use crate::manifest::Manifest;
use crate::raw::raw_blocks;
use crate::record::{EndRecord, Entry, Row, View};
use crate::schema::Channel;
use mcap::records::MessageHeader;
use palpate_model::Nanos;
use palpate_model::rig::RawBytes;
use prost::Message;

/// Batches in one segment: ten minutes of batches of 100 ms. Each ends a chunk, whose index entry
/// of about 600 bytes stays in memory until the segment is finished: under 4 MB in all. Shorter
/// segments would save little more and leave many files.
pub const BATCHES_PER_SEGMENT: u32 = 6000;
/// Largest message the writer makes; the reader's limit for a whole chunk is four times this.
pub(crate) const MESSAGE_BYTES_MAX: usize = 16 << 20;
/// Session time between two samples of the thinned channel: a plot of 50 points a second shows
/// every step of a run, and its messages, each with an index entry of 16 bytes, stay below a tenth
/// of a log at 1 kHz.
const VIEW_EVERY: Nanos = Nanos::from_millis(20);

/// What is written together.
#[derive(Clone, Copy, Debug, Default)]
pub struct Parts<'a> {
    /// Samples.
    pub rows: &'a [Row],
    /// Entries, by strictly increasing `order`.
    pub entries: &'a [Entry],
    /// Bytes as exchanged with devices, at session times.
    pub raw: &'a [RawBytes],
    /// How the computer keeps up.
    pub health: &'a [Health],
}

impl Parts<'_> {
    /// Whether there is nothing.
    pub fn is_empty(&self) -> bool {
        let has_more = !self.raw.is_empty() || !self.health.is_empty();
        self.rows.is_empty() && self.entries.is_empty() && !has_more
    }
}

/// How far a log has come: what a segment that is written again begins with.
#[derive(Clone, Default)]
struct Counters {
    sequences: [u32; Channel::ALL.len()],
    controller_ns: u64,
    samples: u64,
    entries: u64,
    raw_bytes: u64,
    last_order: Option<u64>,
    /// Session time from which the next sample is shown in the thinned channel.
    next_view: Nanos,
}

/// Where the next segments come from and when.
struct Rotation<S: Sink> {
    source: Box<dyn SegmentSource<Sink = S>>,
    batches_per_segment: u32,
}

/// Writes one session log.
pub struct LogWriter<S: Sink> {
    segment: Segment<S>,
    /// `None` for a log that stays in one file.
    rotation: Option<Rotation<S>>,
    /// Number of the segment being written.
    number: u32,
    /// Batches in it.
    batches: u32,
    /// What every segment begins with.
    manifest_json: Vec<u8>,
    library: String,
    started_ns: u64,
    /// `None` in an imported session, whose ticks are picoseconds.
    tick_nanos: Option<u64>,
    at: Counters,
    /// Where `at` stood when everything before was known to survive a power cut.
    synced: Counters,
    failure: Option<LogError>,
    /// Segments that are finished: their paths and what checks them.
    closed: Vec<(String, ClosedCheck)>,
    /// What became of one of them; the log goes on all the same.
    altered: Option<LogError>,
}

impl<S: Sink> LogWriter<S> {
    /// Starts a log that stays in one file. When this returns, the manifest survives a power cut.
    ///
    /// `path` is only shown in errors.
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

    /// Starts a log that goes on in a new segment after every so many batches. When this returns,
    /// the manifest survives a power cut.
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

    /// Goes on in a new segment if the present one is full.
    ///
    /// The new one's manifest is durable before the old one is finished, and the old one is
    /// durable before the new one gets any data: wherever this is cut short, nothing is lost.
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
        let next = self.noted(outcome)?;
        let mut former = std::mem::replace(&mut self.segment, next);
        (self.number, self.batches) = (number, 0);
        self.put_manifest()?;
        let outcome = self.segment.sync();
        self.noted(outcome)?;
        match former.finish() {
            // Nothing can be written to it again; what comes goes into the new one.
            Err(err @ LogError::Altered { .. }) => drop(self.altered.get_or_insert(err)),
            outcome => {
                self.noted(outcome)?;
                self.closed.push(former.closed());
            }
        }
        Ok(())
    }

    /// Begins the segment with the manifest.
    fn put_manifest(&mut self) -> Result<(), LogError> {
        let json = std::mem::take(&mut self.manifest_json);
        // Timed at the session's start in every segment: it is the same manifest.
        let outcome = self.put(Channel::Manifest, Nanos::ZERO, &json);
        self.manifest_json = json;
        outcome?;
        self.flush()
    }

    /// Adds rows and entries and hands everything so far to the sink.
    ///
    /// Entries are JSON and must come in strictly increasing `order`.
    pub fn append(&mut self, rows: &[Row], entries: &[Entry]) -> Result<(), LogError> {
        self.append_parts(&Parts { rows, entries, ..Parts::default() })
    }

    /// As [`append`](Self::append), for everything that a log holds.
    pub fn append_parts(&mut self, parts: &Parts<'_>) -> Result<(), LogError> {
        self.check_alive()?;
        self.check_input(parts)?;
        if !parts.is_empty() {
            self.rotate_if_full()?;
        }
        self.put_batch(parts)?;
        self.flush()
    }

    fn put_batch(&mut self, parts: &Parts<'_>) -> Result<(), LogError> {
        self.batches += u32::from(!parts.is_empty());
        // What was exchanged stands before what was made of it.
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
            let json = readable_json("message of health", health)?;
            self.put(Channel::Health, health.now, &json)?;
        }
        Ok(())
    }

    /// Makes everything handed to the sink survive a power cut.
    pub fn sync(&mut self) -> Result<(), LogError> {
        self.check_alive()?;
        let outcome = self.segment.sync();
        self.noted(outcome)?;
        self.synced = self.at.clone();
        Ok(())
    }

    /// Goes on in a new segment after the disk failed, and writes again what the old one may have
    /// lost: `since_sync`, the batches appended since the last [`sync`](Self::sync) that
    /// succeeded, in order, the one that failed at their end. The old file is not touched again.
    ///
    /// When this returns, all of it survives a power cut. Returns the new segment's path, and
    /// whether it is in the other place.
    pub fn write_again(&mut self, since_sync: &[Parts<'_>]) -> Result<(String, bool), LogError> {
        let Some(cause) = self.failure.take() else {
            return Err(LogError::Closed);
        };
        for is_elsewhere in [false, true] {
            if let Ok(path) = self.try_write_again(&cause, since_sync, is_elsewhere) {
                return Ok((path, is_elsewhere));
            }
        }
        // What cannot be helped keeps its first cause.
        self.failure = Some(cause.clone());
        Err(cause)
    }

    fn try_write_again(
        &mut self,
        cause: &LogError,
        since_sync: &[Parts<'_>],
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
    fn put_view(&mut self, rows: &[Row]) -> Result<(), LogError> {
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

    /// Writes the end record and the index, makes them durable and reads the file back.
    ///
    /// `samples`, `entries` and `raw_bytes` of the record are replaced by what was really written.
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
        self.noted(outcome)?;
        for (path, check) in &self.closed {
            if let Err(alteration) = check() {
                let path = path.clone();
                let err = LogError::Altered { alteration, path };
                self.altered.get_or_insert(err);
            }
        }
        Ok(())
    }

    /// What another program did to a segment that was finished before; told once. Nothing of it can be made good here.
    pub fn take_altered(&mut self) -> Option<LogError> {
        self.altered.take()
    }

    /// Free room on the log's disk in bytes, if that is known.
    pub fn free_bytes(&self) -> Option<u64> {
        self.segment.free_bytes()
    }

    /// Samples written so far.
    pub fn samples(&self) -> u64 {
        self.at.samples
    }

    fn check_alive(&self) -> Result<(), LogError> {
        self.failure.clone().map_or(Ok(()), Err)
    }

    /// Refuses what a reader would refuse, before any of it is written.
    fn check_input(&self, parts: &Parts<'_>) -> Result<(), LogError> {
        check_rows(parts.rows)?;
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
                reason: format!("it has {} bytes, {MESSAGE_BYTES_MAX} are the most", data.len()),
            });
        }
        let index = channel as usize;
        let header = MessageHeader {
            channel_id: 0,
            sequence: self.at.sequences[index],
            log_time: self.started_ns.saturating_add(at.0),
            publish_time: self.at.controller_ns,
        };
        // A gap in the sequence shows a reader that a message is missing.
        self.at.sequences[index] = self.at.sequences[index].wrapping_add(1);
        self.segment.put(channel, header, data)
    }

    fn flush(&mut self) -> Result<(), LogError> {
        let outcome = self.segment.flush();
        self.noted(outcome)
    }

    /// Remembers a failure: nothing is written after it.
    fn noted<T>(&mut self, outcome: Result<T, LogError>) -> Result<T, LogError> {
        outcome.inspect_err(|err| self.failure = Some(err.clone()))
    }
}

pub(crate) fn check_rows(rows: &[Row]) -> Result<(), LogError> {
    match rows.iter().find_map(Row::non_finite) {
        Some(what) => Err(LogError::NotFinite { what: format!("{what} of a sample") }),
        None => Ok(()),
    }
}

pub(crate) fn check_order(order: u64, previous: Option<u64>) -> Result<(), LogError> {
    match previous {
        Some(previous) if order <= previous => Err(LogError::OutOfOrder { order, previous }),
        _ => Ok(()),
    }
}
