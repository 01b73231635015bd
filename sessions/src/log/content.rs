//! Content of a session log: parses and checks the records in their order.

use super::frames::Fields;
use super::segment::PROFILE;
use crate::block::SampleBlock;
use crate::health::{HealthMessage, HealthSummary};
use crate::manifest::{Manifest, RECORD_VERSION};
use crate::raw::RawBlock;
use crate::record::{EndRecord, EntryKind, EntryMessage, LogEntry};
use crate::schema::Channel;
use mcap::records::op;
use palpate_model::Nanos;
use std::collections::BTreeMap;

/// A verified part of a session, in the order of recording.
#[derive(Clone, Copy, Debug)]
pub enum LogPart<'a> {
    Samples(&'a SampleBlock),
    /// Bytes exchanged with a device.
    Raw(&'a RawBlock<'a>),
    Health(&'a HealthMessage),
}

/// Why this program cannot read an undamaged log.
pub(crate) enum Refusal {
    Foreign,
    /// Program version and record version.
    Newer(String, u64),
}

/// What belongs to one segment alone.
#[derive(Default)]
pub(crate) struct SegmentState {
    topics: BTreeMap<u16, Option<Channel>>,
    pub has_manifest: bool,
    /// Whether the segment repeats what the segments before may have lost.
    pub is_rewrite: bool,
}

/// Everything read so far, over all segments.
pub(crate) struct Content<'v> {
    /// Receives every verified part.
    visit: &'v mut dyn FnMut(LogPart<'_>),
    block: SampleBlock,
    /// Whether `block` has a raw half without its derived half.
    has_raw: bool,
    pub samples: u64,
    /// Session time of the newest sample.
    pub last_sample: Nanos,
    pub segment: SegmentState,
    /// Number of the next message of each channel; `None` allows any, as in a later segment that is read alone.
    sequences: [Option<u32>; Channel::ALL.len()],
    /// Number of the first sample; `None` until a later segment that is read alone shows it.
    first_sample: Option<u64>,
    /// Raw bytes up to the newest, missing ones included.
    pub raw_bytes: u64,
    /// Like `first_sample`, for raw bytes.
    first_raw_byte: Option<u64>,
    pub health: HealthSummary,
    /// Whether the first segment read is not the first of the session.
    pub is_later_part: bool,
    pub manifest: Option<Manifest>,
    pub refusal: Option<Refusal>,
    pub entries: Vec<LogEntry>,
    pub end: Option<EndRecord>,
    /// Whether gaps are counted instead of refused.
    allows_gaps: bool,
    /// Missing messages with entries.
    pub missing_entries: u64,
    /// Missing messages with decisions.
    pub missing_decisions: u64,
    /// Raw bytes missing between others.
    pub missing_raw_bytes: u64,
}

impl<'v> Content<'v> {
    /// A file that is read alone may be a later segment.
    pub fn new(is_alone: bool, visit: &'v mut dyn FnMut(LogPart<'_>)) -> Self {
        let mut sequences = [Some(0); Channel::ALL.len()];
        if is_alone {
            sequences[Channel::Manifest as usize] = None;
        }
        Self {
            visit,
            block: SampleBlock::default(),
            has_raw: false,
            samples: 0,
            last_sample: Nanos::ZERO,
            segment: SegmentState::default(),
            sequences,
            first_sample: Some(0),
            raw_bytes: 0,
            first_raw_byte: Some(0),
            health: HealthSummary::default(),
            is_later_part: false,
            manifest: None,
            refusal: None,
            entries: Vec::new(),
            end: None,
            allows_gaps: false,
            missing_entries: 0,
            missing_decisions: 0,
            missing_raw_bytes: 0,
        }
    }

    /// Counts gaps instead of refusing them. Blocks must still be in order.
    pub fn allow_gaps(&mut self) {
        self.allows_gaps = true;
    }

    /// Continues with another segment: a new one, or one that was left. Returns the state of the present one.
    pub fn enter_segment(&mut self, segment: SegmentState) -> SegmentState {
        // A raw half without its derived half is rewritten in the next segment, if at all.
        self.has_raw = false;
        std::mem::replace(&mut self.segment, segment)
    }

    /// Continues at any later chunk of the same segment; the part in between is not a gap.
    pub fn begin_anywhere(&mut self) {
        self.sequences = [None; Channel::ALL.len()];
        self.first_sample = None;
        self.samples = 0;
        self.first_raw_byte = None;
        self.raw_bytes = 0;
        self.has_raw = false;
    }

    /// Reads the file's header, whose profile names the program.
    pub fn take_header(&mut self, body: &[u8]) {
        if Fields(body).text() != Some(PROFILE) {
            self.refusal = Some(Refusal::Foreign);
        }
    }

    /// Reads the records of a verified chunk.
    pub fn take_chunk(&mut self, records: &[u8]) -> Result<(), String> {
        let mut rest = Fields(records);
        while !rest.0.is_empty() && self.refusal.is_none() {
            match rest.record().ok_or("a record runs past the end of its data block")? {
                (op::SCHEMA, _) => {}
                (op::CHANNEL, body) => self.take_channel(body)?,
                (op::MESSAGE, body) => self.take_message(body)?,
                _ => return Err("a data block contains a record of an unexpected kind".into()),
            }
        }
        Ok(())
    }

    fn take_channel(&mut self, body: &[u8]) -> Result<(), String> {
        let mut fields = Fields(body);
        let id = fields.u16();
        let topic = fields.u16().and_then(|_schema| fields.text());
        let (Some(id), Some(topic)) = (id, topic) else {
            return Err("the list of channels is cut short".into());
        };
        self.segment.topics.insert(id, Channel::from_topic(topic));
        Ok(())
    }

    fn take_message(&mut self, body: &[u8]) -> Result<(), String> {
        let mut fields = Fields(body);
        let (id, sequence) = (fields.u16(), fields.u32());
        let times = (fields.u64(), fields.u64());
        let (Some(id), Some(sequence), (Some(_), Some(_))) = (id, sequence, times) else {
            return Err("a message is cut short".into());
        };
        let channel = match self.segment.topics.get(&id) {
            Some(Some(channel)) => *channel,
            // A channel of another program or of a later version.
            Some(None) if self.segment.has_manifest => return Ok(()),
            Some(None) => {
                self.refusal = Some(Refusal::Foreign);
                return Ok(());
            }
            None => return Err("a message is on an unknown channel".into()),
        };
        if !self.segment.has_manifest && channel != Channel::Manifest {
            self.refusal = Some(Refusal::Foreign);
            return Ok(());
        }
        let next = &mut self.sequences[channel as usize];
        let expected = next.unwrap_or(sequence);
        let is_bookkeeping = matches!(channel, Channel::Manifest | Channel::Rewrite);
        let may_repeat = self.segment.is_rewrite || is_bookkeeping || self.allows_gaps;
        let is_repeated = sequence < expected && may_repeat;
        if is_repeated && !is_bookkeeping {
            // Already read and verified in the former segment.
            return Ok(());
        }
        if sequence > expected && self.allows_gaps {
            let is_entry = matches!(channel, Channel::Input | Channel::Decision | Channel::Fit);
            let missing = u64::from(sequence - expected);
            self.missing_entries += missing * u64::from(is_entry);
            self.missing_decisions += missing * u64::from(channel == Channel::Decision);
            if matches!(channel, Channel::Daq | Channel::Derived) {
                self.has_raw &= channel == Channel::Derived;
            }
        } else if sequence != expected && !is_repeated {
            return Err(format!("message {expected} of channel {} is missing", channel.name()));
        }
        if !is_repeated {
            *next = Some(sequence.wrapping_add(1));
        }
        if self.end.is_some() && !is_bookkeeping {
            return Err("a message follows the end record".into());
        }
        let data = fields.0;
        match channel {
            Channel::Manifest => self.take_manifest(sequence, data),
            Channel::Rewrite => {
                self.segment.is_rewrite = true;
                Ok(())
            }
            // A thinned copy of the samples for other programs.
            Channel::View => Ok(()),
            Channel::Daq => self.take_raw(data),
            Channel::Derived => self.take_derived(data),
            Channel::Input => self.take_entry(EntryKind::Input, data),
            Channel::Decision => self.take_entry(EntryKind::Decision, data),
            Channel::Fit => self.take_entry(EntryKind::Fit, data),
            Channel::Raw => self.take_raw_bytes(data),
            Channel::Health => self.take_health(data),
            Channel::End => {
                let end = serde_json::from_slice(data)
                    .map_err(|err| format!("the end record is unreadable: {err}"))?;
                self.end = Some(end);
                Ok(())
            }
        }
    }

    fn take_manifest(&mut self, sequence: u32, data: &[u8]) -> Result<(), String> {
        let unreadable = |err: serde_json::Error| format!("the manifest is unreadable: {err}");
        if self.segment.has_manifest {
            return Err("the segment has a second manifest".into());
        }
        // The version comes first, because the rest of a newer manifest may not parse.
        let value: serde_json::Value = serde_json::from_slice(data).map_err(unreadable)?;
        let version = &value["record_version"];
        if version.is_number() && !version.is_u64() {
            return Err(format!("the manifest's record version is {version}, not a whole number"));
        }
        let Some(version) = version.as_u64() else {
            self.refusal = Some(Refusal::Foreign);
            return Ok(());
        };
        if version > u64::from(RECORD_VERSION) {
            let software = value["software_version"].as_str().unwrap_or("(unknown)");
            self.refusal = Some(Refusal::Newer(software.into(), version));
            return Ok(());
        }
        let manifest: Manifest = serde_json::from_value(value).map_err(unreadable)?;
        match &self.manifest {
            Some(first) if *first != manifest => {
                return Err("its manifest differs from that of the earlier segments".into());
            }
            Some(_) => {}
            None if sequence > 0 => {
                // A later segment: the other channels do not start at 0 either.
                self.is_later_part = true;
                self.sequences = [None; Channel::ALL.len()];
                self.sequences[Channel::Manifest as usize] = Some(sequence.wrapping_add(1));
                self.first_sample = None;
                self.first_raw_byte = None;
            }
            None => {}
        }
        self.manifest = Some(manifest);
        self.segment.has_manifest = true;
        Ok(())
    }

    fn take_raw(&mut self, data: &[u8]) -> Result<(), String> {
        if self.has_raw && !self.allows_gaps {
            return Err("a block of raw samples lacks its derived samples".into());
        }
        self.block.take_raw(data)?;
        let raw = self.block.first_sample();
        let first = *self.first_sample.get_or_insert(raw);
        let expected = first.saturating_add(self.samples);
        if raw > expected && self.allows_gaps {
            self.samples = raw - first;
        } else if raw != expected {
            return Err(format!(
                "sample {expected} is missing: the next block begins with sample {raw}"
            ));
        }
        self.has_raw = true;
        Ok(())
    }

    fn take_derived(&mut self, data: &[u8]) -> Result<(), String> {
        if !std::mem::take(&mut self.has_raw) {
            if self.allows_gaps {
                return Ok(());
            }
            return Err("a block of derived samples lacks its raw samples".into());
        }
        self.block.take_derived(data)?;
        self.samples += self.block.len() as u64;
        self.last_sample = self.block.last_time().unwrap_or(self.last_sample);
        (self.visit)(LogPart::Samples(&self.block));
        Ok(())
    }

    fn take_raw_bytes(&mut self, data: &[u8]) -> Result<(), String> {
        let block = RawBlock::read(data)?;
        let number = block.first_byte();
        let first = *self.first_raw_byte.get_or_insert(number);
        let expected = first.saturating_add(self.raw_bytes);
        if number > expected && self.allows_gaps {
            self.missing_raw_bytes += number - expected;
            self.raw_bytes = number - first;
        } else if number != expected {
            return Err(format!(
                "raw byte {expected} is missing: the next block begins with byte {number}"
            ));
        }
        self.raw_bytes = self.raw_bytes.saturating_add(block.len() as u64);
        (self.visit)(LogPart::Raw(&block));
        Ok(())
    }

    fn take_health(&mut self, data: &[u8]) -> Result<(), String> {
        let health: HealthMessage = serde_json::from_slice(data)
            .map_err(|err| format!("a health message is unreadable: {err}"))?;
        self.health.take(&health);
        (self.visit)(LogPart::Health(&health));
        Ok(())
    }

    fn take_entry(&mut self, kind: EntryKind, data: &[u8]) -> Result<(), String> {
        let message: EntryMessage<serde_json::Value> =
            serde_json::from_slice(data).map_err(|err| format!("an entry is unreadable: {err}"))?;
        if let Some(last) = self.entries.last()
            && message.order <= last.order
        {
            return Err(format!("entry {} comes after entry {}", message.order, last.order));
        }
        self.entries.push(LogEntry {
            kind,
            order: message.order,
            after_sample: message.after_sample,
            now: Nanos(message.now_ns),
            body: message.body,
        });
        Ok(())
    }

    /// Compares the content with the counts of the end record, if there is one.
    pub fn check_totals(&self) -> Result<(), String> {
        let Some(end) = &self.end else {
            return Ok(());
        };
        // A later segment that is read alone does not know the segments before.
        let first = self.first_sample.unwrap_or_else(|| end.samples.saturating_sub(self.samples));
        let samples = first.saturating_add(self.samples);
        let entries = self.entries.len() as u64;
        let has_entries = end.entries == entries || (self.is_later_part && end.entries >= entries);
        let before =
            self.first_raw_byte.unwrap_or_else(|| end.raw_bytes.saturating_sub(self.raw_bytes));
        let raw_bytes = before.saturating_add(self.raw_bytes);
        if end.raw_bytes != raw_bytes {
            let recorded = end.raw_bytes;
            return Err(format!("{recorded} raw bytes were recorded, but the log has {raw_bytes}"));
        }
        if !self.has_raw && end.samples == samples && has_entries {
            return Ok(());
        }
        Err(format!(
            "{} samples and {} entries were recorded, but the log has {samples} samples and {entries} entries",
            end.samples, end.entries
        ))
    }
}
