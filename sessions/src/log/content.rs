//! What the records of a session log say, taken in their order and checked as they come.

use super::frames::{Fields, frame_at};
use super::writer::PROFILE;
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

/// What has been read so far.
#[derive(Default)]
pub(crate) struct Content {
    topics: BTreeMap<u16, Option<Channel>>,
    sequences: [u32; Channel::ALL.len()],
    pub manifest: Option<Manifest>,
    pub refusal: Option<Refusal>,
    pub rows: Vec<Row>,
    /// Raw samples that wait for their derived ones.
    raw: Option<DaqBlock>,
    pub entries: Vec<Entry>,
    pub end: Option<EndRecord>,
}

impl Content {
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
            Some(None) if self.manifest.is_some() => return Ok(()),
            Some(None) => {
                self.refusal = Some(Refusal::Foreign);
                return Ok(());
            }
            None => return Err("a message is on a channel that was never named".into()),
        };
        if self.manifest.is_none() && channel != Channel::Manifest {
            self.refusal = Some(Refusal::Foreign);
            return Ok(());
        }
        let expected = &mut self.sequences[channel as usize];
        if sequence != *expected {
            return Err(format!(
                "message {expected} of {} is missing",
                channel.topic()
            ));
        }
        *expected = expected.wrapping_add(1);
        if self.end.is_some() {
            return Err("something was recorded after the end".into());
        }
        let data = fields.0;
        match channel {
            Channel::Manifest => self.take_manifest(data),
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

    fn take_manifest(&mut self, data: &[u8]) -> Result<(), String> {
        let unreadable = |err: serde_json::Error| format!("the manifest is unreadable: {err}");
        if self.manifest.is_some() {
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
        self.manifest = Some(serde_json::from_value(value).map_err(unreadable)?);
        Ok(())
    }

    fn take_raw(&mut self, data: &[u8]) -> Result<(), String> {
        let raw = DaqBlock::decode(data)
            .map_err(|err| format!("a block of samples is unreadable: {err}"))?;
        if self.raw.is_some() {
            return Err("a block of raw samples has no derived ones".into());
        }
        let expected = self.rows.len() as u64;
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
        let (samples, entries) = (self.rows.len() as u64, self.entries.len() as u64);
        if self.raw.is_none() && end.samples == samples && end.entries == entries {
            return Ok(());
        }
        Err(format!(
            "{} samples and {} entries were recorded but {samples} and {entries} are there",
            end.samples, end.entries
        ))
    }
}
