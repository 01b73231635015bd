//! What the records of a session log say, taken in their order and checked as they come.

use super::frames::{Fields, frame_at};
use super::segment::PROFILE;
use crate::block::Block;
use crate::health::{Health, HealthSummary};
use crate::manifest::{Manifest, RECORD_VERSION};
use crate::raw::RawBlock;
use crate::record::{EndRecord, Entry, EntryKind, EntryMessage};
use crate::schema::Channel;
use mcap::records::op;
use palpate_model::Nanos;
use std::collections::BTreeMap;

/// A verified part of a session, as it passes by.
#[derive(Clone, Copy, Debug)]
pub enum Part<'a> {
    /// Samples.
    Samples(&'a Block),
    /// Bytes as exchanged with a device.
    Raw(&'a RawBlock<'a>),
    /// How the computer kept up.
    Health(&'a Health),
}

/// Why a log is not for this program, however whole it is.
pub(crate) enum Refusal {
    /// Another program's.
    Foreign,
    /// A newer version's: program and record version.
    Newer(String, u64),
}

/// What is particular to a segment that was left.
pub(crate) struct Left {
    topics: BTreeMap<u16, Option<Channel>>,
    has_manifest: bool,
    is_rewrite: bool,
}

/// What has been read so far, over all segments.
pub(crate) struct Content<'v> {
    /// Gets every part once it is verified.
    visit: &'v mut dyn FnMut(Part<'_>),
    block: Block,
    /// Whether a raw half waits for its derived one.
    has_raw: bool,
    /// Samples visited.
    pub samples: u64,
    /// Session time of the newest of them.
    pub last_sample: Nanos,
    topics: BTreeMap<u16, Option<Channel>>,
    /// The next message of each channel; `None` where a lone later segment may begin anywhere.
    sequences: [Option<u32>; Channel::ALL.len()],
    /// Number of the first sample; `None` until a lone later segment says.
    first_sample: Option<u64>,
    /// Raw bytes visited, and missing ones before the newest.
    pub raw_bytes: u64,
    /// Number of the first of them, as of the first sample.
    first_raw_byte: Option<u64>,
    /// What is told of the computer.
    pub health: HealthSummary,
    /// Whether the segment being read has shown its manifest.
    pub has_manifest: bool,
    /// Whether what came before the first segment read is missing.
    pub is_later_part: bool,
    /// Whether the segment being read writes again what may be lost of the ones before.
    pub is_rewrite: bool,
    pub manifest: Option<Manifest>,
    pub refusal: Option<Refusal>,
    pub entries: Vec<Entry>,
    pub end: Option<EndRecord>,
    /// Whether what is missing is counted instead of refused.
    allows_gaps: bool,
    /// Messages with entries that are missing.
    pub lost_entries: u64,
    /// Those of them that were decisions.
    pub lost_decisions: u64,
    /// Raw bytes that are missing between those that are there.
    pub lost_raw_bytes: u64,
}

impl<'v> Content<'v> {
    /// Nothing read yet. A file that is read alone may be a later segment.
    pub fn new(is_alone: bool, visit: &'v mut dyn FnMut(Part<'_>)) -> Self {
        let mut sequences = [Some(0); Channel::ALL.len()];
        if is_alone {
            sequences[Channel::Manifest as usize] = None;
        }
        Self {
            visit,
            block: Block::default(),
            has_raw: false,
            samples: 0,
            last_sample: Nanos::ZERO,
            topics: BTreeMap::new(),
            sequences,
            first_sample: Some(0),
            raw_bytes: 0,
            first_raw_byte: Some(0),
            health: HealthSummary::default(),
            has_manifest: false,
            is_later_part: false,
            is_rewrite: false,
            manifest: None,
            refusal: None,
            entries: Vec::new(),
            end: None,
            allows_gaps: false,
            lost_entries: 0,
            lost_decisions: 0,
            lost_raw_bytes: 0,
        }
    }

    /// Counts what is missing instead of refusing it. Blocks still come in order, each once.
    pub fn allow_gaps(&mut self) {
        self.allows_gaps = true;
    }

    /// Goes on with another file: everything counted goes on, its channels are named anew.
    pub fn begin_segment(&mut self) {
        self.topics.clear();
        self.has_manifest = false;
        self.is_rewrite = false;
        // A raw block that was cut off from its other half is written again, if at all.
        self.has_raw = false;
    }

    /// Leaves a segment to read another one first.
    pub fn leave_segment(&mut self) -> Left {
        Left {
            topics: std::mem::take(&mut self.topics),
            has_manifest: self.has_manifest,
            is_rewrite: self.is_rewrite,
        }
    }

    /// Goes on with a segment that was left.
    pub fn return_to_segment(&mut self, left: Left) {
        self.topics = left.topics;
        self.has_manifest = left.has_manifest;
        self.is_rewrite = left.is_rewrite;
        self.has_raw = false;
    }

    /// Goes on at any later chunk of the same segment: what lies between is not missed.
    pub fn begin_anywhere(&mut self) {
        self.sequences = [None; Channel::ALL.len()];
        self.first_sample = None;
        self.samples = 0;
        self.first_raw_byte = None;
        self.raw_bytes = 0;
        self.has_raw = false;
    }

    /// Reads the file's header: `profile` tells whose file it is.
    pub fn take_header(&mut self, body: &[u8]) {
        if Fields(body).text() != Some(PROFILE) {
            self.refusal = Some(Refusal::Foreign);
        }
    }

    /// Reads the records of a verified chunk.
    pub fn take_chunk(&mut self, records: &[u8]) -> Result<(), String> {
        let mut offset = 0;
        while offset < records.len() && self.refusal.is_none() {
            let frame = frame_at(records, offset)
                .map_err(|_| "a record runs past the end of its chunk".to_owned())?;
            match frame.opcode {
                op::SCHEMA => {}
                op::CHANNEL => self.take_channel(frame.body)?,
                op::MESSAGE => self.take_message(frame.body)?,
                _ => return Err("a chunk holds a record of an unexpected kind".into()),
            }
            offset = frame.next;
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
        self.topics.insert(id, Channel::from_topic(topic));
        Ok(())
    }

    fn take_message(&mut self, body: &[u8]) -> Result<(), String> {
        let mut fields = Fields(body);
        let (id, sequence) = (fields.u16(), fields.u32());
        let times = (fields.u64(), fields.u64());
        let (Some(id), Some(sequence), (Some(_), Some(_))) = (id, sequence, times) else {
            return Err("a message is cut short".into());
        };
        let channel = match self.topics.get(&id) {
            Some(Some(channel)) => *channel,
            // A channel of another program, or of a later version that adds one.
            Some(None) if self.has_manifest => return Ok(()),
            Some(None) => {
                self.refusal = Some(Refusal::Foreign);
                return Ok(());
            }
            None => return Err("a message is on a channel that was never named".into()),
        };
        if !self.has_manifest && channel != Channel::Manifest {
            self.refusal = Some(Refusal::Foreign);
            return Ok(());
        }
        let next = &mut self.sequences[channel as usize];
        let expected = next.unwrap_or(sequence);
        let is_bookkeeping = matches!(channel, Channel::Manifest | Channel::Rewrite);
        let may_repeat = self.is_rewrite || is_bookkeeping || self.allows_gaps;
        let is_again = sequence < expected && may_repeat;
        if is_again && !is_bookkeeping {
            // It was read, and verified, where it was first written.
            return Ok(());
        }
        if sequence > expected && self.allows_gaps {
            let is_entry = matches!(channel, Channel::Input | Channel::Decision | Channel::Fit);
            let lost = u64::from(sequence - expected);
            self.lost_entries += lost * u64::from(is_entry);
            self.lost_decisions += lost * u64::from(channel == Channel::Decision);
            if matches!(channel, Channel::Daq | Channel::Derived) {
                self.has_raw &= channel == Channel::Derived;
            }
        } else if sequence != expected && !is_again {
            return Err(format!("message {expected} of {} is missing", channel.name()));
        }
        if !is_again {
            *next = Some(sequence.wrapping_add(1));
        }
        if self.end.is_some() && !is_bookkeeping {
            return Err("something was recorded after the end".into());
        }
        let data = fields.0;
        match channel {
            Channel::Manifest => self.take_manifest(sequence, data),
            Channel::Rewrite => {
                self.is_rewrite = true;
                Ok(())
            }
            // A thinned copy of the samples, for other programs.
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
        if self.has_manifest {
            return Err("there is a second manifest".into());
        }
        // The version is read first: the rest of a newer manifest may not fit this program.
        let value: serde_json::Value = serde_json::from_slice(data).map_err(unreadable)?;
        let version = &value["record_version"];
        if version.is_number() && !version.is_u64() {
            return Err(format!("the manifest's record version is {version}, and none is"));
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
                return Err("its manifest is not that of the segments before".into());
            }
            Some(_) => {}
            None if sequence > 0 => {
                // The manifest's place tells a later segment: the other channels go on there too.
                self.is_later_part = true;
                self.sequences = [None; Channel::ALL.len()];
                self.sequences[Channel::Manifest as usize] = Some(sequence.wrapping_add(1));
                self.first_sample = None;
                self.first_raw_byte = None;
            }
            None => {}
        }
        self.manifest = Some(manifest);
        self.has_manifest = true;
        Ok(())
    }

    fn take_raw(&mut self, data: &[u8]) -> Result<(), String> {
        if self.has_raw && !self.allows_gaps {
            return Err("a block of raw samples has no derived ones".into());
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
            return Err("a block of derived samples has no raw ones".into());
        }
        self.block.take_derived(data)?;
        self.samples += self.block.len() as u64;
        self.last_sample = self.block.last_time().unwrap_or(self.last_sample);
        (self.visit)(Part::Samples(&self.block));
        Ok(())
    }

    fn take_raw_bytes(&mut self, data: &[u8]) -> Result<(), String> {
        let block = RawBlock::read(data)?;
        let number = block.first_byte();
        let first = *self.first_raw_byte.get_or_insert(number);
        let expected = first.saturating_add(self.raw_bytes);
        if number > expected && self.allows_gaps {
            self.lost_raw_bytes += number - expected;
            self.raw_bytes = number - first;
        } else if number != expected {
            return Err(format!(
                "raw byte {expected} is missing: the next block begins with byte {number}"
            ));
        }
        self.raw_bytes = self.raw_bytes.saturating_add(block.len() as u64);
        (self.visit)(Part::Raw(&block));
        Ok(())
    }

    fn take_health(&mut self, data: &[u8]) -> Result<(), String> {
        let health: Health = serde_json::from_slice(data)
            .map_err(|err| format!("a message of health is unreadable: {err}"))?;
        self.health.take(&health);
        (self.visit)(Part::Health(&health));
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
        self.entries.push(Entry {
            kind,
            order: message.order,
            after_sample: message.after_sample,
            now: Nanos(message.now_ns),
            body: message.body,
        });
        Ok(())
    }

    /// Compares what is there with what the end record counted, if there is one.
    pub fn check_totals(&self) -> Result<(), String> {
        let Some(end) = &self.end else {
            return Ok(());
        };
        // What a lone later segment does not know of the ones before is not compared.
        let first = self.first_sample.unwrap_or_else(|| end.samples.saturating_sub(self.samples));
        let samples = first.saturating_add(self.samples);
        let entries = self.entries.len() as u64;
        let has_entries = end.entries == entries || (self.is_later_part && end.entries >= entries);
        let before =
            self.first_raw_byte.unwrap_or_else(|| end.raw_bytes.saturating_sub(self.raw_bytes));
        let raw_bytes = before.saturating_add(self.raw_bytes);
        if end.raw_bytes != raw_bytes {
            let recorded = end.raw_bytes;
            return Err(format!("{recorded} raw bytes were recorded but {raw_bytes} are there"));
        }
        if !self.has_raw && end.samples == samples && has_entries {
            return Ok(());
        }
        Err(format!(
            "{} samples and {} entries were recorded but {samples} and {entries} are there",
            end.samples, end.entries
        ))
    }
}
