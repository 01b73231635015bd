//! Tables of weights and voltages for a calibration, as written by hand.

use super::cells::{delimiter_of, split};
use super::foreign::decimal::{self, DecimalSign, Evidence};
use palpate_model::calibration::{
    CALIBRATION_FORMAT, Calibration, CalibrationSeries, Direction, SeriesStep,
};
use palpate_model::units::Volts;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Names of each column, the preferred one first.
const MASS: &[&str] = &["mass_g", "weight_g", "weight", "mass", "g", "grams"];
const VOLTS: &[&str] = &["volts", "signal_v", "v", "voltage", "volts_v"];
const DIRECTION: &[&str] = &["direction"];
const REPEAT: &[&str] = &["repeat"];
const NOISE: &[&str] = &["noise_v", "noise"];
const SAMPLES: &[&str] = &["samples"];
const WAITED: &[&str] = &["waited_s"];

#[derive(Debug, Error)]
pub enum WeightsError {
    #[error("cannot read {} ({source}); check the path", path.display())]
    Io { path: PathBuf, source: io::Error },
    #[error(
        "the table has no column {expected} in its first line; name its columns mass_g,volts and, if known, direction,repeat,noise_v,samples,waited_s"
    )]
    NoColumn { expected: &'static str },
    #[error("line {line} has \"{cell}\" for {column}, which is not {expected}; correct the line")]
    Cell {
        /// Line, counted from 1.
        line: usize,
        column: &'static str,
        cell: String,
        expected: &'static str,
    },
    #[error("{0}")]
    Row(String),
    #[error(
        "line {line} has \"{cell}\", whose comma may be a decimal comma or a thousands separator; write every number of the table with a decimal point"
    )]
    Comma {
        /// Line, counted from 1.
        line: usize,
        cell: String,
    },
    #[error(
        "line {line} has {mass_g} g after {before_g} g; for decreasing weights, add a column named 'direction' that contains loading or unloading"
    )]
    Falling {
        /// Line, counted from 1.
        line: usize,
        mass_g: f64,
        before_g: f64,
    },
}

struct Row {
    line: usize,
    direction: Option<Direction>,
    repeat: Option<u32>,
    step: SeriesStep,
}

/// Reads a table of weights as a calibration without a name.
pub fn read_weights(path: &Path) -> Result<Calibration, WeightsError> {
    let text = std::fs::read_to_string(path)
        .map_err(|source| WeightsError::Io { path: path.into(), source })?;
    parse_weights(&text)
}

/// Like [`read_weights`], from text. Commas, semicolons or tabs separate cells, which may be quoted; the decimal sign is a
/// point or, in the whole table, a comma; empty lines and lines that begin with `#` are ignored.
pub fn parse_weights(text: &str) -> Result<Calibration, WeightsError> {
    let lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    let mut lines = lines
        .map(|(index, line)| (index + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let (number, head) = lines.next().unwrap_or((1, ""));
    // Without a delimiter there is only one column, which is reported below.
    let mark = delimiter_of(head).unwrap_or(',');
    let names: Vec<String> = split(head, mark, number)
        .map_err(WeightsError::Row)?
        .iter()
        .map(|name| name.to_ascii_lowercase())
        .collect();
    let place = |known: &[&str]| names.iter().position(|name| known.contains(&name.as_str()));
    let (Some(mass), Some(volts)) = (place(MASS), place(VOLTS)) else {
        let expected = if place(MASS).is_none() { MASS[0] } else { VOLTS[0] };
        return Err(WeightsError::NoColumn { expected });
    };
    let optional = [DIRECTION, REPEAT, NOISE, SAMPLES, WAITED].map(place);
    let mut table = Vec::new();
    for (line, text) in lines {
        let cells = split(text, mark, line).map_err(WeightsError::Row)?;
        if cells.len() > names.len() {
            return Err(WeightsError::Row(format!(
                "line {line} has {} cells, but the first line names {} columns; quote a number with a decimal comma, or write it with a point",
                cells.len(),
                names.len()
            )));
        }
        table.push((line, cells));
    }
    let reals = [Some(mass), Some(volts), optional[2], optional[4]];
    let decimal = detect_decimal(&table, &reals)?;
    let rows = table.iter().map(|(line, cells)| {
        let line = *line;
        let cell = |place: usize| cells.get(place).map_or("", String::as_str);
        let filled = |k: usize| optional[k].map(cell).filter(|cell| !cell.is_empty());
        let real = |column, cell| {
            decimal::parse(cell, decimal).ok_or_else(|| wrong(line, column, cell, "a number"))
        };
        let direction = match filled(0).map(str::to_ascii_lowercase).as_deref() {
            None => None,
            Some("loading" | "up") => Some(Direction::Loading),
            Some("unloading" | "down") => Some(Direction::Unloading),
            Some(other) => return Err(wrong(line, DIRECTION[0], other, "loading or unloading")),
        };
        let count = |k: usize, column| {
            let parse = |cell: &str| {
                let read = cell.parse::<u32>();
                read.map_err(|_| wrong(line, column, cell, "a whole number"))
            };
            filled(k).map(parse).transpose()
        };
        let optional_real = |k: usize, column| filled(k).map(|cell| real(column, cell)).transpose();
        Ok(Row {
            line,
            direction,
            repeat: count(1, REPEAT[0])?,
            step: SeriesStep {
                mass_g: real(MASS[0], cell(mass))?,
                volts: Volts(real(VOLTS[0], cell(volts))?),
                noise: optional_real(2, NOISE[0])?.map(Volts),
                samples: count(3, SAMPLES[0])?.map(u64::from),
                waited_s: optional_real(4, WAITED[0])?,
                ..SeriesStep::default()
            },
        })
    });
    Ok(Calibration {
        format: CALIBRATION_FORMAT,
        series: group_series(rows.collect::<Result<_, _>>()?)?,
        ..Calibration::default()
    })
}

/// The decimal sign of the columns `reals`: a point if no number has a comma, else the only sign that fits every number.
fn detect_decimal(
    table: &[(usize, Vec<String>)],
    reals: &[Option<usize>],
) -> Result<DecimalSign, WeightsError> {
    let cells = table.iter().flat_map(|(line, cells)| {
        let own = reals.iter().filter_map(|place| cells.get((*place)?));
        own.map(|cell| (*line, cell))
    });
    let with_comma = |(_, cell): &(usize, &String)| {
        cell.contains(',') && decimal::evidence(cell) != Evidence::None
    };
    let Some((line, cell)) = cells.clone().find(with_comma) else {
        return Ok(DecimalSign::Point);
    };
    let has = |sign| {
        let only = Evidence::Only(sign);
        cells.clone().any(|(_, cell)| decimal::evidence(cell) == only)
    };
    match (has(DecimalSign::Point), has(DecimalSign::Comma)) {
        (true, false) => Ok(DecimalSign::Point),
        (false, true) => Ok(DecimalSign::Comma),
        _ => Err(WeightsError::Comma { line, cell: cell.clone() }),
    }
}

fn wrong(line: usize, column: &'static str, cell: &str, expected: &'static str) -> WeightsError {
    WeightsError::Cell { line, column, cell: cell.to_owned(), expected }
}

/// Groups rows into series: a new one begins where direction or repeat changes, or where the masses restart.
fn group_series(rows: Vec<Row>) -> Result<Vec<CalibrationSeries>, WeightsError> {
    let mut series: Vec<CalibrationSeries> = Vec::new();
    for row in rows {
        let direction = row.direction.unwrap_or(Direction::Loading);
        let mass = row.step.mass_g;
        let goes_on = match series.last() {
            Some(last) if last.direction == direction => {
                let before = last.steps.last().map_or(mass, |step| step.mass_g);
                let first = last.steps.first().map_or(mass, |step| step.mass_g);
                let is_same_repeat = row.repeat.is_none_or(|repeat| repeat == last.repeat);
                let is_onward = match direction {
                    Direction::Loading => mass > before,
                    Direction::Unloading => mass < before,
                };
                if row.direction.is_none() && !is_onward && mass > first {
                    return Err(WeightsError::Falling {
                        line: row.line,
                        mass_g: mass,
                        before_g: before,
                    });
                }
                is_same_repeat && is_onward
            }
            _ => false,
        };
        if !goes_on {
            let before = series.iter().filter(|one| one.direction == direction).count();
            let number = u32::try_from(before + 1).unwrap_or(u32::MAX);
            series.push(CalibrationSeries {
                direction,
                repeat: row.repeat.unwrap_or(number),
                steps: Vec::new(),
            });
        }
        if let Some(last) = series.last_mut() {
            last.steps.push(row.step);
        }
    }
    Ok(series)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shape(calibration: &Calibration) -> Vec<(Direction, u32, usize)> {
        let one =
            |series: &CalibrationSeries| (series.direction, series.repeat, series.steps.len());
        calibration.series.iter().map(one).collect()
    }

    #[test]
    fn minimal_and_complete_tables_become_series() {
        let plain =
            parse_weights("mass_g,volts\n0,1.28\n140,1.60\n240,1.73\n0,1.29\n140,1.61\n").unwrap();
        use Direction::{Loading, Unloading};
        assert_eq!(shape(&plain), [(Loading, 1, 3), (Loading, 2, 2)]);
        assert_eq!(plain.series[1].steps[0].volts, Volts(1.29));
        let whole = "# bench\nDirection;Mass_g;Signal_V;samples;noise_v\n\
            loading;0;1.0;2000;0.001\nloading;100;1.2;2000;0.001\n\n\
            unloading;100;1.21;2000;0.001\nunloading;0;1.01;;\nup;0;1;1;0.1\n";
        let whole = parse_weights(whole).unwrap();
        assert_eq!(shape(&whole), [(Loading, 1, 2), (Unloading, 1, 2), (Loading, 2, 1)]);
        assert_eq!(whole.series[0].steps[1].samples, Some(2000));
        assert_eq!(whole.series[1].steps[1].noise, None);
        let repeats = "mass_g\tvolts\trepeat\n0\t1\t1\n50\t2\t1\n100\t3\t2\n";
        assert_eq!(shape(&parse_weights(repeats).unwrap()), [(Loading, 1, 2), (Loading, 2, 1)]);
    }

    #[test]
    fn quoted_cells_and_decimal_commas_are_read() {
        let volts = |text: &str| -> Vec<f64> {
            let read = parse_weights(text).unwrap();
            read.series_steps().map(|(_, step)| step.volts.0).collect()
        };
        let quoted = "mass_g,volts\n0,\"1,280\"\n140,\"1,600\"\n240,\"2,730\"\n340,\"3,78\"\n";
        assert_eq!(volts(quoted), [1.28, 1.6, 2.73, 3.78]);
        assert_eq!(volts("mass_g;volts\n0;1,28\n1.040;2,5\n"), [1.28, 2.5]);
        // A comma separates thousands if every other number has a point.
        let thousands = parse_weights("mass_g,volts\n0,1.28\n\"1,040\",2.84\n").unwrap();
        assert_eq!(thousands.series[0].steps[1].mass_g, 1040.0);
        assert_eq!(volts("mass_g,volts\n0,1.280\n140,1.600\n"), [1.28, 1.6]);
    }

    #[test]
    fn errors_name_line_and_cell() {
        for (text, line_expected, cell_expected, column_expected) in [
            ("mass_g,volts\n0,1\n100,one", 3, "one", "volts"),
            ("mass_g,volts\n0", 2, "", "volts"),
            ("mass_g,volts,direction\n0,1,sideways", 2, "sideways", "direction"),
            ("mass_g,volts,repeat\n0,1,-1", 2, "-1", "repeat"),
            ("mass_g,volts\n0,nan", 2, "nan", "volts"),
        ] {
            match parse_weights(text) {
                Err(WeightsError::Cell { line, column, cell, .. }) => assert_eq!(
                    (line, cell.as_str(), column),
                    (line_expected, cell_expected, column_expected)
                ),
                other => panic!("{text}: {other:?}"),
            }
        }
        for (text, column) in [("", "mass_g"), ("mass_g,force\n1,2", "volts")] {
            assert!(matches!(
                parse_weights(text),
                Err(WeightsError::NoColumn { expected }) if expected == column
            ));
        }
        for (text, line_expected, cell_expected) in [
            ("mass_g,volts\n0,\"1,280\"\n140,\"1,600\"", 2, "1,280"),
            ("mass_g;volts\n0;1.28\n140;1,6", 3, "1,6"),
        ] {
            assert!(matches!(
                parse_weights(text),
                Err(WeightsError::Comma { line, cell }) if (line, cell.as_str()) == (line_expected, cell_expected)
            ));
        }
        assert!(matches!(
            parse_weights("mass_g,volts\n0,1\n100,2\n50,1.5"),
            Err(WeightsError::Falling { line: 4, mass_g: 50.0, before_g: 100.0 })
        ));
        for (text, fact) in [
            ("mass_g,volts\n0,1.2\n140,1,600", "line 3 has 3 cells"),
            ("mass_g,volts\n0,\"1.2", "line 2: a quote"),
        ] {
            assert!(matches!(
                parse_weights(text),
                Err(WeightsError::Row(reason)) if reason.starts_with(fact)
            ));
        }
    }
}
