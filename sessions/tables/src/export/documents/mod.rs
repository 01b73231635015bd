//! Export of a session as the documents of one Bluesky run, for programs such as Databroker and Tiled: a JSON Lines file
//! with a name and a document in each line, as the package suitcase-jsonl writes it. The documents are those of the
//! package event-model (<https://github.com/bluesky/event-model>).
//!
//! Start at [`TableExport::write_documents`]. The file is not a session.

mod configuration;
mod heads;
mod keys;
mod stream;
mod unique_id;

use super::select::Picker;
use super::{ExportError, RowFeed, TableExport, atomic};
use crate::lake::kind_name;
use heads::Heads;
use keys::Survey;
use palpate_sessions::record::{EndRecord, LogEntry, SampleRow};
use std::io::{self, Write};
use std::path::Path;
use stream::EventStream;

/// Name of the stream with an event per sample.
const PRIMARY: &str = "primary";
/// Name of the stream with an event per entry of the log.
const ENTRIES: &str = "entries";
const ENTRY_KEYS: [&str; 4] = ["order", "after_sample", "kind", "body"];

/// A session apart from its manifest and its samples.
#[derive(Clone, Copy, Debug, Default)]
pub struct LogFacts<'a> {
    pub entries: &'a [LogEntry],
    /// `None` if the recording was interrupted or is in progress.
    pub end: Option<&'a EndRecord>,
}

impl TableExport<'_> {
    /// Writes the selected samples as events into a new file; returns their number. `feed` is called twice, for the same
    /// samples: the documents before the events state which values are known. At most one page of events is in memory. The
    /// selection of columns and the extra columns are ignored.
    pub fn write_documents(
        &self,
        path: &Path,
        log: LogFacts,
        feed: RowFeed,
    ) -> Result<u64, ExportError> {
        atomic::check_new(path)?;
        let survey = Survey::of(self, feed)?;
        let heads = Heads::new(self, log, &survey);
        let failed = |err| atomic::io_error(path)(err);
        atomic::write(path, |file| {
            put(file, "start", &heads.start()).map_err(failed)?;
            let events = write_samples(self, &heads, &survey, file, feed, path)?;
            let entries = write_entries(&heads, log.entries, file).map_err(failed)?;
            put(file, "stop", &heads.stop(events, entries)).map_err(failed)?;
            Ok(events)
        })
    }
}

/// Writes the line of a document.
fn put(file: &mut dyn Write, name: &str, document: &serde_json::Value) -> io::Result<()> {
    writeln!(file, "{}", serde_json::json!([name, document]))
}

fn write_samples(
    table: &TableExport,
    heads: &Heads,
    survey: &Survey,
    file: &mut dyn Write,
    feed: RowFeed,
    path: &Path,
) -> Result<u64, ExportError> {
    let keys = survey.keys();
    let (id, descriptor) = heads.sample_descriptor(&keys);
    put(file, "descriptor", &descriptor).map_err(atomic::io_error(path))?;
    let mut events =
        EventStream::new(id, keys.iter().map(|(key, _)| key.name().to_owned()).collect());
    let mut picker = Picker::new(table.manifest, table.selection);
    let mut written = Ok(());
    feed(&mut |rows: &[SampleRow]| {
        for row in rows {
            let picked = picker.pick(row).filter(|_| written.is_ok());
            if let Some((number, t_s)) = picked {
                for (cell, (key, _)) in events.cells().zip(&keys) {
                    key.write(cell, number, t_s, row);
                }
                let taken = row.host.0 - row.age.map_or(0, |age| age.by.0.min(row.host.0));
                written = events.end(heads.time_at(row.host.0), heads.time_at(taken), file);
            }
        }
    })?;
    written.and_then(|()| events.finish(file)).map_err(atomic::io_error(path))
}

fn write_entries(heads: &Heads, entries: &[LogEntry], file: &mut dyn Write) -> io::Result<u64> {
    if entries.is_empty() {
        return Ok(0);
    }
    let (id, descriptor) = heads.entry_descriptor();
    put(file, "descriptor", &descriptor)?;
    let mut events = EventStream::new(id, ENTRY_KEYS.map(str::to_owned).into());
    for entry in entries {
        // The body is text: bodies of one kind have different fields.
        let values: [serde_json::Value; ENTRY_KEYS.len()] = [
            entry.order.into(),
            entry.after_sample.into(),
            kind_name(entry.kind).into(),
            entry.body.to_string().into(),
        ];
        for (cell, value) in events.cells().zip(values) {
            cell.push_str(&value.to_string());
        }
        let time = heads.time_at(entry.now.0);
        events.end(time, time, file)?;
    }
    events.finish(file)
}
