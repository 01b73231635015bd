//! Files of other programs: what layout, encoding, delimiter, decimal sign, header and units they have is
//! detected, said, and can be told instead. What has two readings is refused with the question.
//!
//! Start at [`open_foreign`]; [`keep`] makes a session of a part.

mod columns;
pub(super) mod decimal;
mod encoding;
mod formats;
mod keep;
mod layout;
mod rows;
mod said;
mod samples;
mod told;

pub use decimal::Decimal;
pub use encoding::TextEncoding;
pub use formats::Format;
pub use keep::{KeepError, Kept, folder_name, keep};
pub use rows::Delimiter;
pub use samples::Sample;
pub use told::{ColumnChoice, Fault, Told, UnitChoice, ZeroChoice};

use super::torn;
use columns::Unknown;
use formats::{Content, Head, Layout};
use palpate_sessions::imported::Imported;
use rows::Rows;
use said::Said;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Largest text read, in bytes: with what is made of it, about four times as much memory.
const TEXT_BYTES_MAX: u64 = 256 << 20;

/// A foreign file could not be read.
#[derive(Debug, Error)]
pub enum ForeignError {
    /// The disk refused.
    #[error("cannot read {} ({source}); check the path", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// It is not understood.
    #[error("{}: {reason}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong, where, and what to do.
        reason: String,
    },
}

/// A foreign file in memory.
#[derive(Clone, Debug)]
pub struct Foreign {
    /// Its bytes, untouched.
    pub bytes: Vec<u8>,
    /// Its measurements, in order.
    pub parts: Vec<ForeignPart>,
    /// What in it is no measurement, one sentence each.
    pub left_out: Vec<String>,
}

/// One measurement of a foreign file.
#[derive(Clone, Debug)]
pub struct ForeignPart {
    /// What the session will say of it.
    pub imported: Imported,
    /// Its samples, at least two, in order of time.
    pub samples: Vec<Sample>,
}

/// Reads a foreign file.
pub fn open_foreign(path: &Path, told: &Told) -> Result<Foreign, ForeignError> {
    let failed = |source| ForeignError::Io { path: path.into(), source };
    let refused = |reason| ForeignError::Content { path: path.into(), reason };
    let size = std::fs::metadata(path).map_err(failed)?;
    if !size.is_file() {
        return Err(refused("it is not a file; name a file of a tester".into()));
    }
    if size.len() > TEXT_BYTES_MAX {
        return Err(refused(format!(
            "it has {} bytes, and {TEXT_BYTES_MAX} are the most; export it in parts",
            size.len()
        )));
    }
    let bytes = std::fs::read(path).map_err(failed)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    parse_foreign(&name, bytes, told).map_err(refused)
}

/// As [`open_foreign`], from bytes; the error is one sentence.
pub fn parse_foreign(file: &str, bytes: Vec<u8>, told: &Told) -> Result<Foreign, String> {
    if bytes.is_empty() {
        return Err("it is empty".into());
    }
    let format = told.format.or_else(|| Format::of_bytes(&bytes));
    let (parts, left_out) = match format.map(|format| (format, &format.0.content)) {
        Some((format, Content::Sheets { read, .. })) => {
            let sheets = read(&bytes)?.into_iter().map(|(name, rows)| RawPart {
                name,
                facts: Vec::new(),
                layout: format.0,
                head: None,
                rows: Rows::Cells(rows),
            });
            let mut said = Said::default();
            said.layout(format, told);
            understand(sheets.collect(), &origin(file, &bytes, format, said), told)?
        }
        _ => parse_text(file, &bytes, told)?,
    };
    Ok(Foreign { bytes, parts, left_out })
}

/// What every part of a file says of where it comes from.
fn origin(file: &str, bytes: &[u8], format: Format, said: Said) -> Imported {
    Imported {
        file: file.into(),
        bytes: bytes.len() as u64,
        checksum: format!("{:08x}", crc32fast::hash(bytes)),
        format: format.name().into(),
        part: String::new(),
        first_time_s: 0.0,
        readings: said.0,
        facts: Vec::new(),
        remarks: Vec::new(),
    }
}

/// The parts of a file, and what in it is none.
type Understood = (Vec<ForeignPart>, Vec<String>);

fn parse_text(file: &str, bytes: &[u8], told: &Told) -> Result<Understood, String> {
    let (text, how) = encoding::decode(bytes, told.encoding)?;
    let lines = formats::lines_of(&text);
    let delimiter = told.delimiter.or_else(|| Delimiter::detect(&lines));
    let delimiter = delimiter.ok_or("no line holds two numbers, so it is no table; if its columns are separated by something unusual, say by what")?;
    let detect = || Format::of_text(&lines, delimiter);
    let format = told.format.unwrap_or_else(detect);
    let Content::Text { cut, .. } = format.0.content else {
        return Err(format!("it is text, and no {}", format.name()));
    };
    let mut said = Said::default();
    said.layout(format, told);
    said.say("encoding", how, told.encoding.is_some(), "--encoding NAME");
    let option = "--delimiter NAME";
    said.say("delimiter", delimiter.name(), told.delimiter.is_some(), option);
    let parts = cut(lines, delimiter)?.into_iter().map(|part| RawPart {
        name: part.name,
        facts: part.facts,
        layout: format.0,
        head: part.head,
        rows: Rows::Lines { lines: part.lines, delimiter },
    });
    let origin = origin(file, bytes, format, said);
    let (mut parts, left_out) = understand(parts.collect(), &origin, told)?;
    let last_cell = |line: &str| Some(delimiter.cells(line, 0).ok()?.pop()?.text());
    if let Some(last) = parts.last_mut() {
        let remark = torn::remark(&text, last_cell);
        last.imported.remarks.extend(remark);
    }
    Ok((parts, left_out))
}

/// A part before its columns are known.
struct RawPart<'a> {
    name: String,
    facts: Vec<(String, String)>,
    layout: &'static Layout,
    head: Option<Head>,
    rows: Rows<'a>,
}

/// Reads the parts that are wanted; one without a time is left out.
fn understand(cut: Vec<RawPart<'_>>, origin: &Imported, told: &Told) -> Result<Understood, String> {
    let is_whole = cut.len() == 1 && cut[0].name.is_empty();
    let is_wanted = |index: usize, name: &str| {
        let is_it = |wanted: &String| {
            wanted.to_lowercase() == name.to_lowercase() || *wanted == (index + 1).to_string()
        };
        told.parts.is_empty() || told.parts.iter().any(is_it)
    };
    for wanted in &told.parts {
        let is_it = |(index, part): (usize, &RawPart<'_>)| {
            wanted.to_lowercase() == part.name.to_lowercase() || *wanted == (index + 1).to_string()
        };
        if !cut.iter().enumerate().any(is_it) {
            let names: Vec<String> = cut.iter().map(|part| format!("'{}'", part.name)).collect();
            return Err(format!("no part is called '{wanted}'; there are {}", names.join(", ")));
        }
    }
    let (mut parts, mut left_out) = (Vec::new(), Vec::new());
    for (index, part) in cut.iter().enumerate() {
        if !is_wanted(index, &part.name) {
            continue;
        }
        let named = |reason: String| match is_whole {
            true => reason,
            false => format!("part '{}': {reason}", part.name),
        };
        match understand_one(part, origin, told) {
            Ok(found) => parts.push(found),
            Err(Unknown::NoMeasurement(reason)) => left_out.push(named(reason)),
            Err(Unknown::Other(reason)) if is_whole => return Err(reason),
            Err(Unknown::Other(reason)) => {
                return Err(format!("{}; other parts can be chosen", named(reason)));
            }
        }
    }
    if parts.is_empty() {
        let reason = left_out.into_iter().next();
        return Err(reason.unwrap_or_else(|| "it holds no measurement".into()));
    }
    Ok((parts, left_out))
}

fn understand_one(
    part: &RawPart<'_>,
    origin: &Imported,
    told: &Told,
) -> Result<ForeignPart, Unknown> {
    let mut said = Said(origin.readings.clone());
    let header = layout::find(&part.rows, told, part.head, &mut said)
        .map_err(Unknown::NoMeasurement)?
        .ok_or_else(|| Unknown::NoMeasurement("it has no rows of numbers".into()))?;
    if part.rows.len() - header.first < 2 {
        let reason = "it has fewer than two rows of numbers".into();
        return Err(Unknown::NoMeasurement(reason));
    }
    let columns = columns::find(&header, part.layout.words, told, &mut said)?;
    let mut read = vec![columns.time.index, columns.depth.index, columns.force.index];
    read.extend(columns.signal.as_ref().map(|column| column.index));
    let decimal = layout::decimal(&part.rows, &header, &read, told.decimal, &mut said)
        .map_err(Unknown::Other)?;
    let (samples, remarks) = samples::read(&part.rows, &header, &columns, decimal, &told.skip)
        .map_err(Unknown::Other)?;
    Ok(ForeignPart {
        imported: Imported {
            part: part.name.clone(),
            first_time_s: samples.first().map_or(0.0, |first| first.t),
            readings: said.0,
            facts: part.facts.clone(),
            remarks,
            ..origin.clone()
        },
        samples,
    })
}
