//! Export of a session's samples as an MCAP file with one message each, for programs such as Foxglove and PlotJuggler. The
//! file is not a session, because it has no entries.

use super::select::Picker;
use super::{ExportError, RowFeed, TableExport, atomic};
use mcap::records::{MessageHeader, Metadata};
use palpate_sessions::record::SampleRow;
use palpate_sessions::schema::{SAMPLE_TOPIC, sample_metadata, sample_schema};
use prost::Message;
use std::io::{self, Seek, Write};
use std::path::Path;

/// Size of a chunk, which a viewer decompresses at once: about 50 000 samples.
const CHUNK_BYTES: u64 = 4 << 20;

/// One sample; unknown values are left out.
#[derive(Clone, PartialEq, prost::Message)]
struct Sample {
    #[prost(double, tag = "1")]
    t_s: f64,
    #[prost(double, optional, tag = "2")]
    depth_mm: Option<f64>,
    #[prost(double, optional, tag = "3")]
    force_n: Option<f64>,
    #[prost(double, optional, tag = "4")]
    signal_v: Option<f64>,
    #[prost(sint32, optional, tag = "5")]
    counts: Option<i32>,
    #[prost(sint64, optional, tag = "6")]
    pulses: Option<i64>,
    #[prost(string, tag = "7")]
    phase: String,
    #[prost(uint32, tag = "8")]
    cycle: u32,
    #[prost(uint64, tag = "9")]
    sample: u64,
}

impl TableExport<'_> {
    /// Writes the selected samples as messages into a new file; returns their number. At most one chunk is in memory. The
    /// selection of columns and the extra columns are ignored.
    pub fn write_messages(&self, path: &Path, feed: RowFeed) -> Result<u64, ExportError> {
        atomic::write(path, |file| {
            let mut writing = MessageWriter::begin(self, file).map_err(failed(path))?;
            feed(&mut |rows| rows.iter().for_each(|row| writing.take(row)))?;
            writing.finish().map_err(failed(path))
        })
    }
}

fn failed(path: &Path) -> impl Fn(mcap::McapError) -> ExportError {
    move |err| {
        let source = match err {
            mcap::McapError::Io(source) => source,
            other => io::Error::other(other),
        };
        atomic::io_error(path)(source)
    }
}

struct MessageWriter<'a, W: Write + Seek> {
    container: mcap::Writer<W>,
    channel_id: u16,
    started_ns: u64,
    picker: Picker<'a>,
    written: u64,
    /// The first failure; nothing is written after it.
    failure: Option<mcap::McapError>,
}

impl<'a, W: Write + Seek> MessageWriter<'a, W> {
    fn begin(table: &'a TableExport<'a>, file: W) -> mcap::McapResult<Self> {
        let manifest = table.manifest;
        let mut container = mcap::WriteOptions::new()
            .library(format!("palpate {}", manifest.software_version))
            .compression(Some(mcap::Compression::Zstd))
            .compression_level(1)
            .compression_threads(0)
            .chunk_size(Some(CHUNK_BYTES))
            .disable_seeking(true)
            .create(file)?;
        let schema_id = container.add_schema("palpate.Sample", "protobuf", &sample_schema())?;
        let channel_id =
            container.add_channel(schema_id, SAMPLE_TOPIC, "protobuf", &sample_metadata())?;
        let metadata = [
            ("session", manifest.session_id.clone()),
            ("specimen", manifest.specimen.clone()),
            ("selection", table.selection.to_json()),
            ("notes", serde_json::json!(table.notes).to_string()),
            ("manifest", serde_json::json!(manifest).to_string()),
        ];
        container.write_metadata(&Metadata {
            name: "palpate".into(),
            metadata: metadata.map(|(key, text)| (key.to_owned(), text)).into(),
        })?;
        let started_ns = manifest.started_at.timestamp_nanos_opt().unwrap_or(0);
        Ok(Self {
            container,
            channel_id,
            started_ns: u64::try_from(started_ns).unwrap_or(0),
            picker: Picker::new(manifest, table.selection),
            written: 0,
            failure: None,
        })
    }

    fn take(&mut self, row: &SampleRow) {
        let picked = self.picker.pick(row).filter(|_| self.failure.is_none());
        if let Some((number, t_s)) = picked {
            self.failure = self.put(number, t_s, row).err();
        }
    }

    fn put(&mut self, sample: u64, t_s: f64, row: &SampleRow) -> mcap::McapResult<()> {
        let message = Sample {
            t_s,
            depth_mm: row.depth,
            force_n: row.force,
            signal_v: row.volts,
            counts: row.counts,
            pulses: row.pulses,
            phase: row.phase.name().into(),
            cycle: row.cycle,
            sample,
        };
        let time = self.started_ns.saturating_add(row.host.0);
        let header = MessageHeader {
            channel_id: self.channel_id,
            // Wraps after 2^32 messages.
            sequence: self.written as u32,
            log_time: time,
            publish_time: time,
        };
        self.written += 1;
        self.container.write_to_known_channel(&header, &message.encode_to_vec())
    }

    fn finish(mut self) -> mcap::McapResult<u64> {
        match self.failure.take() {
            Some(failure) => Err(failure),
            None => {
                self.container.finish()?;
                Ok(self.written)
            }
        }
    }
}
