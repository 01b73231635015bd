//! Detection of header, units, first row of numbers, and decimal sign.

use super::columns::{is_known_unit_cell, is_quantity_name, is_unit_cell};
use super::decimal::{DecimalSign, Evidence, evidence};
use super::formats::Head;
use super::options::ImportOptions;
use super::readings::ReadingList;
use super::rows::{Cell, Rows};

/// Names and units of the columns.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Header {
    pub names: Vec<String>,
    /// From a row of units; empty without one.
    pub units: Vec<String>,
    pub width: usize,
    /// Source of the names, in words.
    pub place: String,
    /// Index of the row of names, or else of the first row of numbers.
    pub top: usize,
    /// Index of the first row of numbers.
    pub first: usize,
}

/// Consecutive rows of numbers that make a table; fewer may be a remark with numbers.
const ROWS_OF_A_TABLE: usize = 3;

fn width_of(cells: &[Cell]) -> usize {
    cells.iter().rposition(|cell| !cell.is_empty()).map_or(0, |last| last + 1)
}

/// The first row of the first table, or of the longest run of rows with numbers.
fn first_numbers(rows: &Rows<'_>, from: usize) -> Option<usize> {
    let mut best: Option<(usize, usize)> = None;
    let mut run: Option<(usize, usize)> = None;
    for index in from..rows.len() {
        let cells = rows.words(index);
        let numbers = cells.iter().filter(|cell| cell.is_number()).count();
        if width_of(&cells) == 0 {
            continue;
        }
        run = (numbers >= 2).then(|| run.map_or((index, 1), |(start, count)| (start, count + 1)));
        if let Some((start, count)) = run {
            if best.is_none_or(|(_, most)| count > most) {
                best = Some((start, count));
            }
            if count == ROWS_OF_A_TABLE {
                return Some(start);
            }
        }
    }
    best.map(|(start, _)| start)
}

fn texts(cells: &[Cell]) -> Vec<String> {
    cells.iter().map(Cell::text).collect()
}

/// The nearest row above that is not blank.
fn row_above(rows: &Rows<'_>, index: usize) -> Option<usize> {
    (0..index).rev().find(|&i| width_of(&rows.words(i)) > 0)
}

fn is_units(cells: &[Cell]) -> bool {
    let filled: Vec<String> = texts(cells).into_iter().filter(|text| !text.is_empty()).collect();
    filled.iter().all(|text| is_unit_cell(text))
        && filled.iter().any(|text| is_known_unit_cell(text))
}

fn is_names(cells: &[Cell]) -> bool {
    cells.iter().any(|cell| matches!(cell, Cell::Text(text) if is_quantity_name(text)))
}

/// Finds header, units and the first row of numbers; `None` without numbers.
pub(super) fn find(
    rows: &Rows<'_>,
    options: &ImportOptions,
    known: Option<Head>,
    readings: &mut ReadingList,
) -> Result<Option<Header>, String> {
    let find_row = |what: &str, number: usize| {
        rows.index_of(number).ok_or_else(|| {
            format!(
                "{0} {number}, given for the {what}, is missing or blank; give another {0}",
                rows.word()
            )
        })
    };
    let names = options.header_row.or(known.map(|head| head.names));
    let header = names.map(|number| find_row("header", number)).transpose()?;
    let units = match options.units_row.or(known.and_then(|head| head.units)) {
        None | Some(0) => None,
        Some(number) => Some(find_row("units", number)?),
    };
    let from = header.max(units).map_or(0, |index| index + 1);
    let Some(first) = first_numbers(rows, from) else {
        return Ok(None);
    };
    let (header, units) = header_and_units(rows, options, first, header, units);
    let is_header =
        |index: &usize| rows.words(*index).iter().any(|cell| matches!(cell, Cell::Text(_)));
    let header = header.filter(is_header);
    let word = rows.word();
    let (names, place) = match header {
        _ if !options.names.is_empty() => (options.names.clone(), "the given names".to_owned()),
        Some(index) => (texts(&rows.words(index)), format!("{word} {}", rows.number(index))),
        None => {
            return Err(format!(
                "the numbers from {word} {} on have no column names above them; name every column, as in t_s,depth_mm,force_N, or give the {word} that contains the names",
                rows.number(first)
            ));
        }
    };
    readings.add(
        "header",
        place.clone(),
        !options.names.is_empty() || options.header_row.is_some(),
        "--header-row N or --columns NAME,...",
    );
    let in_words = match units {
        Some(index) => format!("{word} {}", rows.number(index)),
        None => "no row of their own".into(),
    };
    readings.add("units", in_words, options.units_row.is_some(), "--units-row N");
    let width = names.iter().rposition(|name| !name.is_empty()).map_or(0, |last| last + 1);
    let named = options.names.len();
    if named > 0 {
        let found = width_of(&rows.words(first));
        if found != named {
            return Err(format!(
                "{word} {} has {found} columns, but {named} names are given; name every column",
                rows.number(first)
            ));
        }
    }
    Ok(Some(Header {
        names,
        units: units.map_or_else(Vec::new, |index| texts(&rows.words(index))),
        width,
        place,
        top: header.unwrap_or(first),
        first,
    }))
}

/// Detects the rows of names and units above the first row of numbers, unless the options give them.
fn header_and_units(
    rows: &Rows<'_>,
    options: &ImportOptions,
    first: usize,
    header: Option<usize>,
    units: Option<usize>,
) -> (Option<usize>, Option<usize>) {
    let may_have_units = options.units_row.is_none();
    match header {
        None if options.names.is_empty() => {
            let nearest = row_above(rows, units.unwrap_or(first));
            if let (Some(index), true) = (nearest, may_have_units) {
                let next = row_above(rows, index).filter(|&next| is_names(&rows.words(next)));
                let cells = rows.words(index);
                if is_units(&cells) && (next.is_some() || !is_names(&cells)) {
                    return (next, Some(index));
                }
            }
            (nearest, units)
        }
        Some(index) if units.is_none() && may_have_units => {
            let between = (index + 1..first).find(|&i| is_units(&rows.words(i)));
            (header, between)
        }
        _ => (header, units),
    }
}

/// Rows that are checked for contradicting decimal signs; a later number that does not fit is refused when it is read.
const ROWS_FOR_DECIMAL: usize = 2000;

/// The decimal sign of the columns that are read.
pub(super) fn decimal(
    rows: &Rows<'_>,
    header: &Header,
    columns: &[usize],
    chosen: Option<DecimalSign>,
    readings: &mut ReadingList,
) -> Result<DecimalSign, String> {
    let option = "--decimal point or comma";
    if let Some(decimal) = chosen {
        readings.add("decimal sign", decimal.name(), true, option);
        return Ok(decimal);
    }
    let word = rows.word();
    let mut found: Option<(DecimalSign, String)> = None;
    let mut either: Option<String> = None;
    for index in header.first..rows.len() {
        if found.is_some() && index > header.first + ROWS_FOR_DECIMAL {
            break;
        }
        let cells = rows.words(index);
        for cell in columns.iter().filter_map(|&column| cells.get(column)) {
            let Cell::Text(text) = cell else { continue };
            let here = || format!("'{text}' in {word} {}", rows.number(index));
            match (evidence(text), &found) {
                (Evidence::Only(decimal), None) => found = Some((decimal, here())),
                (Evidence::Only(decimal), Some((before, place))) if decimal != *before => {
                    return Err(format!(
                        "{place} has a decimal {}, but {} has a decimal {}; give the decimal sign, or correct the file",
                        before.name(),
                        here(),
                        decimal.name()
                    ));
                }
                (Evidence::Either, _) => {
                    either.get_or_insert_with(here);
                }
                _ => {}
            }
        }
    }
    match (found, either) {
        (Some((decimal, place)), _) => {
            readings.add(
                "decimal sign",
                format!("{}, from {place}", decimal.name()),
                false,
                option,
            );
            Ok(decimal)
        }
        (None, Some(place)) => Err(format!(
            "{place} may have a thousands separator or a decimal sign, and no other number shows which; give the decimal sign (point or comma)"
        )),
        (None, None) => {
            readings.add("decimal sign", "none needed", false, option);
            Ok(DecimalSign::Point)
        }
    }
}
