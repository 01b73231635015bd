//! Tables for a fit: delimited text with a header that names time, depth and force. Anything unclear is refused with a
//! reason; nothing is guessed or repaired.

use super::cells::{delimiter_of, split};
use super::header::{HeaderCell, Quantity, Scale, parse_header_cell};
use super::truncated;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Largest table in bytes: ten million rows of three columns.
const BYTES_MAX: u64 = 1 << 30;

/// Time, depth and force of a table, one element per row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeasurementTable {
    /// Time in s.
    pub t: Vec<f64>,
    /// Depth in mm.
    pub depth: Vec<f64>,
    /// Force in N.
    pub force: Vec<f64>,
    /// Whether a row's phase is `unload`; all false where the table has no phases.
    pub is_unload: Vec<bool>,
    pub notes: Vec<String>,
}

#[derive(Debug, Error)]
pub enum TableError {
    #[error("cannot read the table {} ({source}); check the path", path.display())]
    Io { path: PathBuf, source: io::Error },
    #[error("{} is not a text table ({reason}); give a delimited text file with a header", path.display())]
    NotText { path: PathBuf, reason: String },
    #[error("{}: {reason}", path.display())]
    Content { path: PathBuf, reason: String },
}

/// Column names of a table without a header, in order, such as `t_s`, `x_mm`, `F_N`; a column of another name is ignored.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ColumnNames(Vec<String>);

impl std::str::FromStr for ColumnNames {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let names: Vec<String> = text.split(',').map(|name| name.trim().to_owned()).collect();
        // Reports a mistake before any file is read.
        Layout::of(&names, ',')?;
        Ok(Self(names))
    }
}

/// `columns` names the columns of a table without a header.
pub fn read_table(
    path: &Path,
    columns: Option<&ColumnNames>,
) -> Result<MeasurementTable, TableError> {
    let io_error = |source: io::Error| TableError::Io { path: path.to_owned(), source };
    let not_text =
        |reason: &str| TableError::NotText { path: path.to_owned(), reason: reason.into() };
    let size = std::fs::metadata(path).map_err(io_error)?.len();
    if size > BYTES_MAX {
        return Err(not_text("it is larger than 1 GiB"));
    }
    let bytes = std::fs::read(path).map_err(io_error)?;
    let text = String::from_utf8(bytes).map_err(|_| not_text("it is not UTF-8"))?;
    if text.contains('\0') {
        return Err(not_text("it holds binary data"));
    }
    parse_table(&text, columns)
        .map_err(|reason| TableError::Content { path: path.to_owned(), reason })
}

/// Like [`read_table`], from text; the error is one sentence.
pub fn parse_table(text: &str, columns: Option<&ColumnNames>) -> Result<MeasurementTable, String> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut lines = text
        .lines()
        .enumerate()
        .map(|(i, line)| (i + 1, line))
        .filter(|(_, line)| !line.trim().is_empty())
        .peekable();
    let &(number, first) = lines.peek().ok_or("the table is empty")?;
    let delimiter = delimiter_of(first)?;
    let cells = split(first, delimiter, number)?;
    let has_decimal_comma = delimiter != ',';
    let has_header = !cells.iter().all(|cell| is_number(cell, has_decimal_comma));
    let layout = match (has_header, columns) {
        (true, None) => {
            lines.next();
            Layout::of(&cells, delimiter)?
        }
        (false, Some(ColumnNames(names))) if names.len() == cells.len() => {
            Layout::of(names, delimiter)?
        }
        (false, Some(ColumnNames(names))) => {
            return Err(format!(
                "the table has {} columns, but {} names are given; name every column",
                cells.len(),
                names.len()
            ));
        }
        (true, Some(_)) => {
            return Err("the table already names its columns in its first line; leave out the separate names".into());
        }
        (false, None) => {
            return Err("the table has no header; name its columns in the first line, as in t_s,depth_mm,force_N, or give the names separately".into());
        }
    };
    let mut table = MeasurementTable::default();
    table.notes.extend(layout.note.clone());
    let mut left_out = 0usize;
    for (number, line) in lines {
        let cells = split(line, delimiter, number)?;
        if cells.len() != layout.width {
            return Err(format!(
                "line {number} has {} cells, but the header has {}; correct the line",
                cells.len(),
                layout.width
            ));
        }
        let phase = layout.phase.map(|phase| cells[phase].as_str());
        if phase.is_some_and(|phase| !matches!(phase, "ramp" | "hold" | "unload")) {
            left_out += 1;
            continue;
        }
        let [t, depth, force] = layout.values(&cells, number)?;
        if table.t.last().is_some_and(|&last| t <= last) {
            return Err(format!(
                "line {number}: the time does not increase; sort the rows by time and keep one measurement per table"
            ));
        }
        table.t.push(t);
        table.depth.push(depth);
        table.force.push(force);
        table.is_unload.push(phase == Some("unload"));
    }
    if table.t.is_empty() {
        return Err("the table has no rows to fit".into());
    }
    let last_cell = |line: &str| split(line, delimiter, 0).ok()?.pop();
    table.notes.extend(truncated::remark(text, last_cell));
    if left_out > 0 {
        table.notes.push(format!(
            "{left_out} rows with phases other than ramp, hold and unload are left out"
        ));
    }
    Ok(table)
}

/// Parses a number with the decimal sign of the table.
fn parse_number(cell: &str, has_decimal_comma: bool) -> Option<f64> {
    if has_decimal_comma { cell.replace(',', ".").parse().ok() } else { cell.parse().ok() }
}

fn is_number(cell: &str, has_decimal_comma: bool) -> bool {
    parse_number(cell, has_decimal_comma).is_some()
}

/// Positions of the columns.
struct Layout {
    width: usize,
    /// Column and scale of time, depth and force.
    places: [(usize, Scale); 3],
    phase: Option<usize>,
    has_decimal_comma: bool,
    note: Option<String>,
}

impl Layout {
    fn of(cells: &[String], delimiter: char) -> Result<Self, String> {
        let place = |quantity: Quantity| -> Result<(usize, Scale), String> {
            let found: Vec<(usize, Option<Scale>)> = cells
                .iter()
                .enumerate()
                .filter_map(|(i, cell)| match parse_header_cell(cell) {
                    HeaderCell::Known(q, scale) if q == quantity => Some((i, Some(scale))),
                    // All known instruments write times without a unit in seconds; depths and forces have too many
                    // common units to assume one.
                    HeaderCell::Bare(Quantity::Time) if quantity == Quantity::Time => {
                        Some((i, Some(Scale::ONE)))
                    }
                    HeaderCell::Bare(q) | HeaderCell::Unitless(q) if q == quantity => {
                        Some((i, None))
                    }
                    _ => None,
                })
                .collect();
            let (name, example) = (quantity.name(), quantity.example());
            match found[..] {
                [(i, Some(scale))] => Ok((i, scale)),
                [(i, None)] => {
                    Err(format!("column '{}' has no known unit; name it like {example}", cells[i]))
                }
                [] => Err(format!(
                    "no column is recognised as the {name}; name the column like {example}"
                )),
                [(i, _), (j, _), ..] => Err(format!(
                    "columns '{}' and '{}' could both be the {name}; rename one of them",
                    cells[i], cells[j]
                )),
            }
        };
        let time = place(Quantity::Time)?;
        let name = &cells[time.0];
        let is_bare = parse_header_cell(name) == HeaderCell::Bare(Quantity::Time);
        Ok(Self {
            width: cells.len(),
            places: [time, place(Quantity::Depth)?, place(Quantity::Force)?],
            note: is_bare.then(|| format!("column '{name}' has no unit; seconds are assumed")),
            phase: cells.iter().position(|cell| cell == "phase"),
            has_decimal_comma: delimiter != ',',
        })
    }

    fn values(&self, cells: &[String], number: usize) -> Result<[f64; 3], String> {
        let mut values = [0.0; 3];
        for (value, ((column, scale), quantity)) in
            values.iter_mut().zip(self.places.iter().zip(Quantity::FITTED))
        {
            let cell = &cells[*column];
            let read = parse_number(cell, self.has_decimal_comma).map(|read| scale.apply(read));
            *value = read.filter(|read| read.is_finite()).ok_or_else(|| {
                format!(
                    "line {number}: the {} '{cell}' is not a number; correct or remove the line",
                    quantity.name()
                )
            })?;
        }
        Ok(values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_order_and_foreign_columns_are_read() {
        let table =
            parse_table("\u{feff}Force [mN];Time (ms);note;x mm\n1,5;0;a;0\n-2;100;b;0,25\n", None)
                .unwrap();
        assert_eq!(table.t, [0.0, 0.1]);
        assert_eq!(table.depth, [0.0, 0.25]);
        assert_eq!(table.force, [0.0015, -0.002]);
    }

    #[test]
    fn exported_table_is_read_without_rows_outside_indentation() {
        let text = "t_s,depth_mm,force_N,phase\n0,,,tare\n1,0,0,ramp\n2,1,0.1,hold\n3,0.5,0,unload\n4,-1,0,retract\n";
        let table = parse_table(text, None).unwrap();
        assert_eq!(table.t, [1.0, 2.0, 3.0]);
        assert_eq!(table.is_unload, [false, false, true]);
        assert!(table.notes[0].contains("2 rows"));
    }

    #[test]
    fn time_without_unit_is_seconds_with_a_remark() {
        let table = parse_table("Time,x_mm,F_N\n0,0,0\n0.5,1,2\n", None).unwrap();
        assert_eq!(table.t, [0.0, 0.5]);
        assert!(table.notes[0].contains("'Time'") && table.notes.len() == 1);
        let reason = parse_table("time_furlong,x_mm,F_N\n0,0,0\n", None).unwrap_err();
        assert!(reason.contains("'time_furlong'"), "{reason}");
    }

    #[test]
    fn table_without_header_takes_separate_names() {
        let names: ColumnNames = "t_s, x_mm, F_N".parse().unwrap();
        let table = parse_table("0;0,5;1\n1;1,5;2\n", Some(&names)).unwrap();
        assert_eq!(
            (table.t, table.depth, table.force),
            (vec![0.0, 1.0], vec![0.5, 1.5], vec![1.0, 2.0])
        );
        let check = |text: &str, expected: &str| {
            let reason = parse_table(text, Some(&names)).unwrap_err();
            assert!(reason.contains(expected), "{reason}");
        };
        check("0,0,0,0\n", "4 columns");
        check("t_s,x_mm,F_N\n0,0,0\n", "already");
        let reason = "t_s,x_mm".parse::<ColumnNames>().unwrap_err();
        assert!(reason.contains("force"), "{reason}");
    }

    #[test]
    fn possibly_truncated_last_number_is_reported() {
        let notes = |text: &str| parse_table(text, None).unwrap().notes;
        let cut = notes("t_s,x_mm,F_N\n0,0,0.1034\n1,1,2.3310\n2,2,3.4");
        assert!(cut[0].contains("'3.4'") && cut[0].contains("cut off"), "{cut:?}");
        let whole = "t_s,x_mm,F_N\n0,0,0.1034\n1,1,2.3310\n2,2,3.4810";
        assert!(notes(whole).is_empty());
    }

    #[test]
    fn quoted_cells_may_contain_the_delimiter() {
        let text = "\"note, free\",t_s,x_mm,F_N\n\"a, b\",0,0,0\n\"say \"\"c\"\"\",1,1,\"2.5\"\n";
        let table = parse_table(text, None).unwrap();
        assert_eq!(table.force, [0.0, 2.5]);
        let reason = parse_table("t_s,x_mm,F_N\n0,0,\"0\n", None).unwrap_err();
        assert!(reason.contains("line 2: a quote"), "{reason}");
    }

    #[test]
    fn unclear_tables_are_refused() {
        let check = |text: &str, expected: &str| {
            let reason = parse_table(text, None).unwrap_err();
            assert!(reason.contains(expected), "{text:?}: {reason}");
        };
        check("", "empty");
        check("0,0,0\n1,1,1\n", "no header");
        check("t_s depth_mm force_N\n", "no delimiter");
        check("t_s,depth_mm\n0,0\n", "recognised as the force");
        check("t_s,depth_mm,force\n0,0,0\n", "'force'");
        check("t_s,depth_mm,x_mm,force_N\n0,0,0,0\n", "'depth_mm' and 'x_mm'");
        check("t_s,depth_mm,force_N\n0,0,0\n1,one,1\n", "line 3: the depth 'one'");
        check("t_s,depth_mm,force_N\n0,0,nan\n", "line 2: the force 'nan'");
        check("t_s,depth_mm,force_kN\n0,0,1e306\n", "line 2: the force");
        check("t_s,x_mm,F_N\n0,0,0\n1,0,0\n1,0,0\n", "line 4: the time");
        check("t_s,depth_mm,force_N\n0,0\n", "line 2 has 2 cells");
        check("t_s,depth_mm,force_N\n", "no rows");
    }
}
