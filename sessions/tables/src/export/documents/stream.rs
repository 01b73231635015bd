//! Events of one stream, written a page at a time.

use super::unique_id::UniqueId;
use std::fmt::Write as _;
use std::io::{self, Write};

/// Events in a page: a line of about 400 kB.
const PAGE_EVENTS: u64 = 1 << 10;

pub(super) struct EventStream {
    descriptor: UniqueId,
    columns: Vec<Column>,
    /// Times of the present page's events, and those at which their values were taken.
    times: String,
    taken: String,
    /// Events so far, and those of them in earlier pages.
    events: u64,
    written: u64,
}

/// A data key with the text of its values in the present page.
struct Column {
    key: String,
    values: String,
}

impl EventStream {
    pub fn new(descriptor: UniqueId, keys: Vec<String>) -> Self {
        let columns = keys.into_iter().map(|key| Column { key, values: String::new() }).collect();
        let (times, taken) = (String::new(), String::new());
        Self { descriptor, columns, times, taken, events: 0, written: 0 }
    }

    /// For each key the text to append the next event's value to.
    pub fn cells(&mut self) -> impl Iterator<Item = &mut String> {
        self.columns.iter_mut().map(|column| {
            separate(&mut column.values);
            &mut column.values
        })
    }

    /// Completes an event at `time` whose values were taken at `taken`, both in POSIX seconds.
    pub fn end(&mut self, time: f64, taken: f64, file: &mut dyn Write) -> io::Result<()> {
        for (text, value) in [(&mut self.times, time), (&mut self.taken, taken)] {
            separate(text);
            write_number(text, value);
        }
        self.events += 1;
        match self.events - self.written {
            PAGE_EVENTS => self.flush(file),
            _ => Ok(()),
        }
    }

    /// Writes the last page; returns the number of events.
    pub fn finish(mut self, file: &mut dyn Write) -> io::Result<u64> {
        if self.events > self.written {
            self.flush(file)?;
        }
        Ok(self.events)
    }

    fn flush(&mut self, file: &mut dyn Write) -> io::Result<()> {
        let descriptor = self.descriptor;
        let (mut numbers, mut ids) = (String::new(), String::new());
        for number in self.written + 1..=self.events {
            separate(&mut numbers);
            separate(&mut ids);
            append(&mut numbers, format_args!("{number}"));
            append(&mut ids, format_args!("\"{descriptor}/{number}\""));
        }
        write!(file, r#"["event_page", {{"descriptor": "{descriptor}", "seq_num": [{numbers}], "#)?;
        write!(file, r#""uid": [{ids}], "time": [{}], "data": {{"#, self.times)?;
        for (index, Column { key, values }) in self.columns.iter().enumerate() {
            write!(file, r#"{}"{key}": [{values}]"#, comma(index))?;
        }
        write!(file, r#"}}, "timestamps": {{"#)?;
        for (index, Column { key, .. }) in self.columns.iter().enumerate() {
            write!(file, r#"{}"{key}": [{}]"#, comma(index), self.taken)?;
        }
        writeln!(file, "}}}}]")?;
        self.written = self.events;
        let values = self.columns.iter_mut().map(|column| &mut column.values);
        values.chain([&mut self.times, &mut self.taken]).for_each(String::clear);
        Ok(())
    }
}

const fn comma(index: usize) -> &'static str {
    if index == 0 { "" } else { ", " }
}

fn separate(text: &mut String) {
    if !text.is_empty() {
        text.push_str(", ");
    }
}

/// The shortest text that reads back as the same double; `NaN` as Python's package json writes and reads it.
pub(super) fn write_number(text: &mut String, value: f64) {
    append(text, format_args!("{value:?}"));
}

pub(super) fn append(text: &mut String, value: std::fmt::Arguments) {
    // Writing into a text does not fail.
    let _ = text.write_fmt(value);
}
