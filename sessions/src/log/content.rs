//! What the records of a session log say, taken in their order and checked as they come.

use super::frames::{Fields, frame_at};
use super::segment::PROFILE;
use crate::manifest::{Manifest, RECORD_VERSION};
use crate::record::{
    DaqBlock, DerivedBlock, EndRecord, Entry, EntryKind, EntryMessage, Row, rows_from_blocks,
};
use crate::schema::Channel;
use mcap::records::op;
use palpate_model::Nanos;
use prost::Message;
use std::collections::BTreeMap;

/// Why a log is not for this program, however whole it is.
pub(crate) enum Refusal {
    /// Another program's.
    Foreign,
    /// A newer version's: program and record version.
    Newer(String, u64),
}

/// What has been read so far, over all segments.
pub(crate) struct Content {
    topics: BTreeMap<u16, Option<Channel>>,
    /// The next message of each channel; `None` where a lone later segment may begin anywhere.
    sequences: [Option<u32>; Channel::ALL.len()],
    /// Number of the first sample; `None` until a lone later segment says.
    first_sample: Option<u64>,
    /// Whether the segment being read has shown its manifest.
    pub has_manifest: bool,
    /// Whether what came before the first segment read is missing.
    pub is_later_part: bool,
    /// Whether the segment being read holds anything but its manifest.
    pub has_data: bool,
    pub manifest: Option<Manifest>,
    pub refusal: Option<Refusal>,
    pub rows: Vec<Row>,
    /// Raw samples that wait for their derived ones.
    raw: Option<DaqBlock>,
    pub entries: Vec<Entry>,
    pub end: Option<EndRecord>,
}

impl Content {
    /// Nothing read yet. A file that is read alone may be a later segment.
    pub fn new(is_alone: bool) -> Self {
        let mut sequences = [Some(0); Channel::ALL.len()];
        if is_alone {
            sequences[Channel::Manifest as usize] = None;
        }
        Self {
            topics: BTreeMap::new(),
            sequences,
            first_sample: Some(0),
            has_manifest: false,
            is_later_part: false,
            has_data: false,
            manifest: None,
            refusal: None,
            rows: Vec::new(),
            raw: None,
            entries: Vec::new(),
            end: None,
        }
    }

    /// Goes on with another file: everything counted goes on, its channels are named anew.
    pub fn begin_segment(&mut self) {
        self.topics.clear();
        self.has_manifest = false;
        self.has_data = false;
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
        if sequence != expected {
            return Err(format!(
                "message {expected} of {} is missing",
                channel.topic()
            ));
        }
        *next = Some(expected.wrapping_add(1));
        self.has_data |= channel != Channel::Manifest;
        if self.end.is_some() {
            return Err("something was recorded after the end".into());
        }
        let data = fields.0;
        match channel {
            Channel::Manifest => self.take_manifest(sequence, data),
            Channel::Daq => self.take_raw(data),
            Channel::Derived => self.take_derived(data),
            Channel::Input => self.take_entry(EntryKind::Input, data),
            Channel::Decision => self.take_entry(EntryKind::Decision, data),
            Channel::Fit => self.take_entry(EntryKind::Fit, data),
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
        let Some(version) = value["record_version"].as_u64() else {
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
            }
            None => {}
        }
        self.manifest = Some(manifest);
        self.has_manifest = true;
        Ok(())
    }

    fn take_raw(&mut self, data: &[u8]) -> Result<(), String> {
        let raw = DaqBlock::decode(data)
            .map_err(|err| format!("a block of samples is unreadable: {err}"))?;
        if self.raw.is_some() {
            return Err("a block of raw samples has no derived ones".into());
        }
        let first = *self.first_sample.get_or_insert(raw.first_sample);
        let expected = first.saturating_add(self.rows.len() as u64);
        if raw.first_sample != expected {
            return Err(format!(
                "sample {expected} is missing: the next block begins with sample {}",
                raw.first_sample
            ));
        }
        self.raw = Some(raw);
        Ok(())
    }

    fn take_derived(&mut self, data: &[u8]) -> Result<(), String> {
        let derived = DerivedBlock::decode(data)
            .map_err(|err| format!("a block of derived samples is unreadable: {err}"))?;
        let raw = self
            .raw
            .take()
            .ok_or("a block of derived samples has no raw ones")?;
        let length = self.rows.len();
        rows_from_blocks(&raw, &derived, &mut self.rows).inspect_err(|_| {
            // Nothing of a bad block is kept, not even its good beginning.
            self.rows.truncate(length);
        })
    }

    fn take_entry(&mut self, kind: EntryKind, data: &[u8]) -> Result<(), String> {
        let message: EntryMessage =
            serde_json::from_slice(data).map_err(|err| format!("an entry is unreadable: {err}"))?;
        if let Some(last) = self.entries.last()
            && message.order <= last.order
        {
            return Err(format!(
                "entry {} comes after entry {}",
                message.order, last.order
            ));
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
        let first = self
            .first_sample
            .unwrap_or_else(|| end.samples.saturating_sub(self.rows.len() as u64));
        let samples = first.saturating_add(self.rows.len() as u64);
        let entries = self.entries.len() as u64;
        let has_entries = end.entries == entries || (self.is_later_part && end.entries >= entries);
        if self.raw.is_none() && end.samples == samples && has_entries {
            return Ok(());
        }
        Err(format!(
            "{} samples and {} entries were recorded but {samples} and {entries} are there",
            end.samples, end.entries
        ))
    }
}
