//! Files of other programs. Layout, encoding, delimiter, decimal sign, header and units are detected and reported, and options
//! override them. An ambiguous file is refused with a question.
//!
//! Start at [`open_foreign`]; [`store_import`] makes a session of a part.

mod columns;
pub(super) mod decimal;
mod encoding;
mod facts;
mod formats;
mod keep;
mod layout;
mod options;
mod readings;
mod rows;
mod samples;

pub use decimal::DecimalSign;
pub use encoding::TextEncoding;
pub use formats::ForeignFormat;
pub use keep::{ImportTarget, StoreImportError, folder_name, store_import};
pub use options::{ColumnChoice, ImportOptions, RowFault, UnitChoice, ZeroChoice};
pub use rows::Delimiter;
pub use samples::ForeignSample;

use super::truncated;
use columns::{ColumnError, Columns, Zero};
use formats::{Content, FACTS_MAX, Layout, StageKind, TextPart};
use palpate_sessions::import_origin::ImportOrigin;
use readings::ReadingList;
use rows::Rows;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Largest text file in bytes; reading takes about four times as much memory.
const TEXT_BYTES_MAX: u64 = 256 << 20;

/// A foreign file could not be read.
#[derive(Debug, Error)]
pub enum ForeignError {
    #[error("cannot read {} ({source}); check the path", path.display())]
    Io { path: PathBuf, source: io::Error },
    #[error("{}: {reason}", path.display())]
    Content { path: PathBuf, reason: String },
}

#[derive(Clone, Debug)]
pub struct ForeignFile {
    pub bytes: Vec<u8>,
    pub parts: Vec<ForeignPart>,
    /// Parts that are not measurements, one sentence each.
    pub left_out: Vec<String>,
}

/// One measurement of a foreign file.
#[derive(Clone, Debug)]
pub struct ForeignPart {
    pub imported: ImportOrigin,
    /// At least two, in order of time.
    pub samples: Vec<ForeignSample>,
}

pub fn open_foreign(path: &Path, options: &ImportOptions) -> Result<ForeignFile, ForeignError> {
    let failed = |source| ForeignError::Io { path: path.into(), source };
    let refused = |reason| ForeignError::Content { path: path.into(), reason };
    let size = std::fs::metadata(path).map_err(failed)?;
    if !size.is_file() {
        return Err(refused("it is not a file; choose a file".into()));
    }
    if size.len() > TEXT_BYTES_MAX {
        return Err(refused(format!(
            "it has {} bytes, more than {TEXT_BYTES_MAX}; export it in parts",
            size.len()
        )));
    }
    let bytes = std::fs::read(path).map_err(failed)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    parse_foreign(&name, bytes, options).map_err(refused)
}

/// Like [`open_foreign`], from bytes; the error is one sentence.
pub fn parse_foreign(
    file: &str,
    bytes: Vec<u8>,
    options: &ImportOptions,
) -> Result<ForeignFile, String> {
    if bytes.is_empty() {
        return Err("it is empty".into());
    }
    let format = options.format.or_else(|| ForeignFormat::of_bytes(&bytes));
    let (parts, left_out) = match format.map(|format| (format, &format.0.content)) {
        Some((format, Content::Sheets { read, .. })) => {
            let sheets = read(&bytes)?.into_iter().map(|sheet| RawPart {
                layout: format.0,
                rows: Rows::Cells(sheet.rows),
                outline: TextPart { name: sheet.name, facts: sheet.facts, ..TextPart::default() },
            });
            let mut readings = ReadingList::default();
            readings.add_layout(format, options);
            parse_parts(sheets.collect(), &origin(file, &bytes, format, readings), options)?
        }
        _ => parse_text(file, &bytes, options)?,
    };
    Ok(ForeignFile { bytes, parts, left_out })
}

/// The origin that all parts of a file share.
fn origin(file: &str, bytes: &[u8], format: ForeignFormat, readings: ReadingList) -> ImportOrigin {
    ImportOrigin {
        file: file.into(),
        bytes: bytes.len() as u64,
        checksum: format!("{:08x}", crc32fast::hash(bytes)),
        format: format.name().into(),
        readings: readings.0,
        ..ImportOrigin::default()
    }
}

/// The measurements of a file, and remarks about other parts.
type ParsedParts = (Vec<ForeignPart>, Vec<String>);

fn parse_text(file: &str, bytes: &[u8], options: &ImportOptions) -> Result<ParsedParts, String> {
    let (text, how) = encoding::decode(bytes, options.encoding)?;
    let lines = formats::lines_of(&text);
    let delimiter = options.delimiter.or_else(|| Delimiter::detect(&lines));
    let delimiter = delimiter.ok_or(
        "no line has two numbers, so the file is not a table; if its delimiter is unusual, give the delimiter",
    )?;
    let detect = || ForeignFormat::of_text(&lines, delimiter);
    let format = options.format.unwrap_or_else(detect);
    let Content::Text { cut, .. } = format.0.content else {
        return Err(format!("it is text, not a {}", format.name()));
    };
    let mut readings = ReadingList::default();
    readings.add_layout(format, options);
    readings.add("encoding", how, options.encoding.is_some(), "--encoding NAME");
    let option = "--delimiter NAME";
    readings.add("delimiter", delimiter.name(), options.delimiter.is_some(), option);
    let parts = cut(lines, delimiter)?.into_iter().map(|mut part| RawPart {
        layout: format.0,
        rows: Rows::Lines { lines: std::mem::take(&mut part.lines), delimiter },
        outline: part,
    });
    let origin = origin(file, bytes, format, readings);
    let (mut parts, left_out) = parse_parts(parts.collect(), &origin, options)?;
    let last_cell = |line: &str| Some(delimiter.cells(line, 0).ok()?.pop()?.text());
    if let Some(last) = parts.last_mut() {
        let remark = truncated::remark(&text, last_cell);
        last.imported.remarks.extend(remark);
    }
    Ok((parts, left_out))
}

/// A part before its columns are known.
struct RawPart<'a> {
    layout: &'static Layout,
    rows: Rows<'a>,
    /// Without its lines, which are the rows.
    outline: TextPart<'a>,
}

/// Reads the selected parts; one without a time is left out.
fn parse_parts(
    cut: Vec<RawPart<'_>>,
    origin: &ImportOrigin,
    options: &ImportOptions,
) -> Result<ParsedParts, String> {
    let is_whole = cut.len() == 1 && cut[0].outline.name.is_empty();
    let is_it = |selector: &String, index: usize, part: &RawPart<'_>| {
        selector.to_lowercase() == part.outline.name.to_lowercase()
            || *selector == (index + 1).to_string()
    };
    for selector in &options.parts {
        if !cut.iter().enumerate().any(|(index, part)| is_it(selector, index, part)) {
            let names: Vec<String> =
                cut.iter().map(|part| format!("'{}'", part.outline.name)).collect();
            return Err(format!(
                "the file has no part '{selector}'; its parts are {}",
                names.join(", ")
            ));
        }
    }
    let (mut parts, mut left_out) = (Vec::new(), Vec::new());
    let mut facts_of_sheets = Vec::new();
    for (index, part) in cut.iter().enumerate() {
        let is_selected = |selector: &String| is_it(selector, index, part);
        if !options.parts.is_empty() && !options.parts.iter().any(is_selected) {
            continue;
        }
        let named = |reason: String| match is_whole {
            true => reason,
            false => format!("part '{}': {reason}", part.outline.name),
        };
        if let (Some(whole), true) = (&part.outline.included_in, options.parts.is_empty()) {
            left_out
                .push(named(format!("it is in the part '{whole}'; select it to read it alone")));
            continue;
        }
        match parse_part(part, origin, options) {
            Ok(found) => parts.push(found),
            Err(ColumnError::NoMeasurement(reason)) => {
                left_out.push(named(reason));
                facts_of_sheets.extend(facts_of_sheet(part));
            }
            Err(ColumnError::Other(reason)) if is_whole => return Err(reason),
            Err(ColumnError::Other(reason)) => {
                return Err(format!("{}; or select other parts", named(reason)));
            }
        }
    }
    if parts.is_empty() {
        let reason = left_out.into_iter().next();
        return Err(reason.unwrap_or_else(|| "it holds no measurement".into()));
    }
    for part in &mut parts {
        let room = FACTS_MAX.saturating_sub(part.imported.facts.len());
        part.imported.facts.extend(facts_of_sheets.iter().take(room).cloned());
    }
    Ok((parts, left_out))
}

/// Facts of a sheet without a measurement, such as the parameters of a test.
fn facts_of_sheet(part: &RawPart<'_>) -> Vec<(String, String)> {
    let Rows::Cells(_) = part.rows else { return Vec::new() };
    let facts = facts::in_first_rows(&part.rows, part.rows.len()).into_iter();
    facts.map(|(key, value)| (format!("{}: {key}", part.outline.name), value)).collect()
}

fn parse_part(
    part: &RawPart<'_>,
    origin: &ImportOrigin,
    options: &ImportOptions,
) -> Result<ForeignPart, ColumnError> {
    let mut readings = ReadingList(origin.readings.clone());
    let header = layout::find(&part.rows, options, part.outline.head, &mut readings)
        .map_err(ColumnError::NoMeasurement)?
        .ok_or_else(|| ColumnError::NoMeasurement("it has no rows of numbers".into()))?;
    if part.rows.len() - header.first < 2 {
        let reason = "it has fewer than two rows of numbers".into();
        return Err(ColumnError::NoMeasurement(reason));
    }
    let mut columns = columns::find(&header, part.layout.words, options, &mut readings)?;
    count_depth_from_contact(part, &mut columns, &mut readings);
    let mut read = vec![columns.time.index, columns.depth.index, columns.force.index];
    read.extend(columns.signal.as_ref().map(|column| column.index));
    let decimal = layout::decimal(&part.rows, &header, &read, options.decimal, &mut readings)
        .map_err(ColumnError::Other)?;
    let (samples, remarks) =
        samples::read(&part.rows, &header, &columns, &part.outline.stages, decimal, &options.skip)
            .map_err(ColumnError::Other)?;
    Ok(ForeignPart {
        imported: ImportOrigin {
            part: part.outline.name.clone(),
            first_time_s: samples.first().map_or(0.0, |first| first.t),
            readings: readings.0,
            facts: match part.outline.facts.is_empty() {
                true => facts::in_first_rows(&part.rows, header.top),
                false => part.outline.facts.clone(),
            },
            remarks: part.outline.remarks.iter().cloned().chain(remarks).collect(),
            ..origin.clone()
        },
        samples,
    })
}

/// Counts the depth of a joined part from the last row of the block that found the contact, unless a zero is given.
fn count_depth_from_contact(part: &RawPart<'_>, columns: &mut Columns, readings: &mut ReadingList) {
    let stages = &part.outline.stages;
    let is_contact = |stage: &&formats::Stage| stage.kind == StageKind::Contact;
    let after = stages.iter().find(|stage| !is_contact(stage));
    let (Some(after), Zero::Unchanged) = (after, columns.depth.zero) else { return };
    let rows = &part.rows;
    let contact = (0..rows.len()).map(|index| rows.number(index)).rfind(|row| *row < after.first);
    if let Some(contact) = contact {
        columns.depth.zero = Zero::Row(contact);
        let place = format!("{} {contact}, where the contact was found", rows.word());
        readings.add("depth zero", place, false, "--zero depth=first or NUMBER");
    }
}
