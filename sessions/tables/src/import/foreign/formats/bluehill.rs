//! Instron Bluehill: raw data as CSV, with one or several specimens in sequence.
//!
//! The numbers follow optional facts (`Test : Rate 1,"15.00",mm/min`), optional tables of results, and the column names. The
//! units are in brackets, in a line of their own (Bluehill 2 and 3) or after each name below a line `Raw Data` (Bluehill
//! Universal). Separators, decimal signs and names depend on the computer's language.

use super::super::rows::{Cell, Delimiter};
use super::{Content, FACT_LENGTH_MAX, FACTS_MAX, Head, Layout, Line, Quantity, TextPart};

pub(super) const LAYOUT: Layout = Layout {
    name: "bluehill",
    source: "Bluehill's raw data",
    content: Content::Text { is_it, cut },
    words: &[
        (Quantity::Time, "time measurement, godzina"),
        (Quantity::Depth, "compressive extension, compressive displacement, przemieszczenie"),
        (
            Quantity::Force,
            "compressive load, compressive force, primary load measurement, obciążenie, last",
        ),
    ],
};

/// Lines that are searched for column names; a header has some dozens.
const HEADER_LINES_MAX: usize = 1000;
/// First cell of the line above a table of results, and above names with units.
const RESULTS: &str = "results table";
const RAW_DATA: &str = "raw data";
/// Separator between group and name of a fact.
const BETWEEN: &str = " : ";
/// Lines of a head: names and units, or `Raw Data` and names with units.
const LINES_OF_HEAD: usize = 2;
/// Name of the fact that names a specimen.
const LABEL: &str = "specimen label";

/// Recognises a head with a time unit, if only Bluehill writes a line above it, or if every line above parses.
fn is_it(lines: &[Line<'_>], delimiter: Delimiter) -> bool {
    let lines = &lines[..lines.len().min(HEADER_LINES_MAX)];
    let find = |index: usize| Some((index, head(&lines[index..], delimiter).ok()??));
    let has_time = |columns: &Columns| {
        let is_time =
            |cell: &String| unit(cell).is_some_and(|unit| Quantity::Time.scale(unit).is_some());
        columns.units.iter().any(is_time)
    };
    let mut found = (0..lines.len()).filter_map(find);
    let Some((index, _)) = found.find(|(_, columns)| has_time(columns)) else {
        return false;
    };
    let is_own = |line: &Line<'_>| {
        let cells = cells(*line, delimiter).unwrap_or_default();
        begins(&cells, RAW_DATA)
            || begins(&cells, RESULTS)
            || cells.first().is_some_and(|cell| cell.contains(BETWEEN))
    };
    lines[..=index].iter().any(is_own)
        || cut(lines[..index + LINES_OF_HEAD].to_vec(), delimiter).is_ok()
}

#[derive(Default)]
struct Specimen {
    facts: Vec<(String, String)>,
    name: String,
    line: Option<usize>,
}

fn cut<'a>(lines: Vec<Line<'a>>, delimiter: Delimiter) -> Result<Vec<TextPart<'a>>, String> {
    let mut parts: Vec<TextPart<'a>> = Vec::new();
    let mut next = Specimen::default();
    let mut rest = &lines[..];
    while let Some((&line, after)) = rest.split_first() {
        let (number, text) = line;
        let texts = cells(line, delimiter)?;
        if is_row(&texts) {
            match (parts.last_mut(), next.line) {
                (Some(part), None) => part.lines.push(line),
                (Some(_), Some(strange)) => return Err(strange_line(&lines, strange)),
                (None, _) => {
                    return Err(format!(
                        "line {number}: the numbers have no column names and units above them; restore the missing beginning of the file"
                    ));
                }
            }
            rest = after;
        } else if let Some(columns) = head(rest, delimiter)? {
            parts.push(TextPart {
                name: std::mem::take(&mut next.name),
                facts: std::mem::take(&mut next.facts),
                head: Some(columns.head),
                lines: rest[..LINES_OF_HEAD].to_vec(),
                ..TextPart::default()
            });
            next.line = None;
            rest = &rest[LINES_OF_HEAD..];
        } else {
            next.line.get_or_insert(number);
            rest = match begins(&texts, RESULTS) {
                true => next.results(rest, delimiter)?,
                false => {
                    next.fact(&texts, number, text)?;
                    after
                }
            };
        }
    }
    match next.line {
        _ if parts.is_empty() => Err("it has no column names above a line of units, such as Time,Extension,Load above (s),(mm),(N)".into()),
        Some(strange) => Err(strange_line(&lines, strange)),
        None => {
            name(&mut parts);
            Ok(parts)
        }
    }
}

impl Specimen {
    fn fact(&mut self, texts: &[String], number: usize, line: &str) -> Result<(), String> {
        let (key, values) =
            texts.split_first().map_or(("", texts), |(key, values)| (key.as_str(), values));
        let values: Vec<&str> =
            values.iter().map(String::as_str).filter(|value| !value.is_empty()).collect();
        let word = key.to_lowercase();
        let after = word.strip_prefix("specimen").map(str::trim);
        let is_number = |after: &str| after.bytes().all(|byte| byte.is_ascii_digit());
        if values.is_empty() && after.is_some_and(is_number) {
            self.name = key.to_owned();
        } else if key.is_empty() || texts.len() < 2 && !begins(texts, RAW_DATA) {
            return Err(format!(
                "line {number}: '{}' is neither a metadata entry, nor column names, nor numbers; correct or remove the line, or read the file as a table",
                short(line)
            ));
        }
        let (_, last) = key.rsplit_once(BETWEEN).unwrap_or(("", key));
        if last.to_lowercase() == LABEL {
            self.name = values.join(" ");
        }
        self.keep(key, &values.join(" "));
        Ok(())
    }

    fn keep(&mut self, key: &str, value: &str) {
        if !value.is_empty() && self.facts.len() < FACTS_MAX {
            self.facts.push((short(key), short(value)));
        }
    }

    /// Reads a table of results, up to a blank line or column names; returns the lines after it.
    fn results<'l, 'a>(
        &mut self,
        lines: &'l [Line<'a>],
        delimiter: Delimiter,
    ) -> Result<&'l [Line<'a>], String> {
        let (mut names, mut units): (Vec<String>, Vec<String>) = (Vec::new(), Vec::new());
        let title = cells(lines[0], delimiter)?.swap_remove(0);
        for (index, pair) in lines.windows(2).enumerate() {
            let texts = cells(pair[1], delimiter)?;
            let is_over = pair[1].0 > pair[0].0 + 1
                || begins(&texts, RESULTS)
                || begins(&texts, RAW_DATA)
                || !names.is_empty() && head(&lines[index + 1..], delimiter)?.is_some();
            if is_over {
                return Ok(&lines[index + 1..]);
            }
            if names.is_empty() {
                names = texts;
            } else if texts.iter().all(|cell| cell.is_empty() || is_unit(cell)) {
                units = texts;
            } else {
                for (place, value) in
                    texts.iter().enumerate().skip(1).filter(|(_, value)| !value.is_empty())
                {
                    let of = |row: &[String]| row.get(place).cloned().unwrap_or_default();
                    let key = format!("{title}, {}: {}", texts[0], of(&names));
                    let unit = of(&units);
                    let unit = unit.trim_matches(['(', ')']);
                    self.keep(&key, format!("{value} {unit}").trim_end());
                }
            }
        }
        Ok(&[])
    }
}

struct Columns {
    head: Head,
    units: Vec<String>,
}

/// The columns, if the first two lines name them.
fn head(lines: &[Line<'_>], delimiter: Delimiter) -> Result<Option<Columns>, String> {
    let [first, second, ..] = lines else {
        return Ok(None);
    };
    let (above, units) = (cells(*first, delimiter)?, cells(*second, delimiter)?);
    let (names, has_units) = if begins(&above, RAW_DATA) {
        let has_units = units.len() > 1 && units.iter().all(|cell| unit(cell).is_some());
        (second.0, has_units)
    } else {
        (first.0, is_units(&units) && !is_row(&above) && !is_units(&above))
    };
    if !has_units {
        return Ok(None);
    }
    let own_line = Some(second.0).filter(|units| *units > names);
    if own_line.is_some() && above.len() != units.len() {
        return Err(format!(
            "line {} has {} units for the {} columns of line {names}; correct the line",
            second.0,
            units.len(),
            above.len(),
        ));
    }
    let head = Head { names, units: own_line };
    Ok(Some(Columns { head, units }))
}

/// Numbers specimens without a name, and those with the same name.
fn name(parts: &mut [TextPart<'_>]) {
    let count = parts.len();
    for index in 0..count {
        if parts[index].name.is_empty() && count > 1 {
            parts[index].name = format!("specimen {}", index + 1);
        }
        let name = parts[index].name.clone();
        let before = parts[..index].iter().filter(|one| one.name == name).count();
        if before > 0 {
            parts[index].name = format!("{name} {}", before + 1);
        }
    }
}

fn strange_line(lines: &[Line<'_>], number: usize) -> String {
    let text = lines.iter().find(|(one, _)| *one == number);
    format!(
        "line {number}: '{}' is no row of numbers, and no column names of another table follow it; correct or remove the line, or copy the file again if its end is missing",
        short(text.map_or("", |(_, text)| text))
    )
}

fn cells((number, line): Line<'_>, delimiter: Delimiter) -> Result<Vec<String>, String> {
    let cells = delimiter.cells(line, number)?;
    Ok(cells.iter().map(Cell::text).collect())
}

fn short(text: &str) -> String {
    text.trim().chars().take(FACT_LENGTH_MAX).collect()
}

fn begins(cells: &[String], word: &str) -> bool {
    cells.first().is_some_and(|cell| cell.to_lowercase().starts_with(word))
}

/// The unit in brackets at the end of a cell.
fn unit(cell: &str) -> Option<&str> {
    let (_, unit) = cell.strip_suffix(')')?.rsplit_once('(')?;
    Some(unit.trim())
}

/// Whether a cell is only a unit in brackets.
fn is_unit(cell: &str) -> bool {
    cell.starts_with('(') && cell.ends_with(')')
}

/// Whether a line has at least two units and nothing else.
fn is_units(cells: &[String]) -> bool {
    let mut filled = cells.iter().filter(|cell| !cell.is_empty());
    filled.clone().count() > 1 && filled.all(|cell| is_unit(cell))
}

/// Whether a line has numbers; the first may be missing.
fn is_row(cells: &[String]) -> bool {
    let is_number = |cell: &String| Cell::Text(cell.clone()).is_number();
    match cells.first() {
        Some(first) if first.is_empty() => cells.iter().any(is_number),
        first => first.is_some_and(is_number),
    }
}
