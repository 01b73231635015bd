//! The numbers of a part, checked row by row. Nothing is repaired: a row that is not as it should be is
//! refused, or left out where that was told, and counted.

use super::super::header::Quantity;
use super::columns::{Column, Columns, Zero};
use super::decimal::{Decimal, parse};
use super::layout::Header;
use super::rows::{Cell, Rows};
use super::told::Fault;
use palpate_model::rig::Phase;

/// One row in s, mm, N and V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Time in s, as the file counts it.
    pub t: f64,
    /// Depth in mm; `None` only outside an indentation.
    pub depth: Option<f64>,
    /// Force in N; `None` only outside an indentation.
    pub force: Option<f64>,
    /// Signal in V, where the file has one.
    pub signal: Option<f64>,
    /// The phase that a file of ours names.
    pub phase: Phase,
}

/// What a cell is worth.
enum Value {
    Number(f64),
    Missing,
}

struct Reader<'a> {
    rows: &'a Rows<'a>,
    decimal: Decimal,
    skip: &'a [Fault],
    /// Rows left out by fault: how many, and the number of the first.
    skipped: [(usize, usize); Fault::ALL.len()],
}

impl Reader<'_> {
    fn value(
        &self,
        cells: &[Cell],
        column: &Column,
        what: Quantity,
        number: usize,
    ) -> Result<Value, String> {
        let raw = match cells.get(column.index) {
            None | Some(Cell::Empty) => return Ok(Value::Missing),
            Some(Cell::Number(number)) => *number,
            Some(Cell::Text(text)) if text.eq_ignore_ascii_case("nan") => return Ok(Value::Missing),
            Some(Cell::Text(text)) => parse(text, self.decimal).ok_or_else(|| {
                format!(
                    "{} {number}: the {} '{}' is not a number with a decimal {}; mend or remove the {0}, or say the decimal sign",
                    self.rows.word(),
                    what.name(),
                    text.chars().take(40).collect::<String>(),
                    self.decimal.name()
                )
            })?,
        };
        let sign = if column.is_turned { -1.0 } else { 1.0 };
        let value = sign * column.scale.apply(raw);
        if value.is_finite() { Ok(Value::Number(value)) } else { Ok(Value::Missing) }
    }

    fn check_width(&self, cells: &[Cell], width: usize, number: usize) -> Result<(), String> {
        let mut beyond = cells.iter().skip(width);
        match beyond.position(|cell| !cell.is_empty()) {
            None => Ok(()),
            Some(place) => Err(format!(
                "{} {number} has a cell in column {} where the header has {width}; mend the {0}, or say the delimiter or decimal sign if these were taken wrongly",
                self.rows.word(),
                width + place + 1,
            )),
        }
    }

    /// The sample in a row; none where the row is left out, as told. `last` is the time of the sample before in s.
    fn sample(
        &mut self,
        cells: &[Cell],
        columns: &Columns,
        number: usize,
        last: Option<f64>,
    ) -> Result<Option<Sample>, String> {
        let one = |column: &Column, what| match self.value(cells, column, what, number) {
            Ok(Value::Number(number)) => Ok(Some(number)),
            Ok(Value::Missing) => Ok(None),
            Err(reason) => Err(reason),
        };
        let t = one(&columns.time, Quantity::Time)?;
        let depth = one(&columns.depth, Quantity::Depth)?;
        let force = one(&columns.force, Quantity::Force)?;
        let signal = columns.signal.as_ref().map(|column| one(column, Quantity::Signal));
        let signal = signal.transpose()?.flatten();
        let phase = columns.phase.and_then(|place| cells.get(place));
        let phase = phase.map_or(Phase::Imported, |cell| phase_of(&cell.text()));
        let is_needed =
            matches!(phase, Phase::Imported | Phase::Ramp | Phase::Hold | Phase::Unload);
        let missing = |what: &str| (Fault::Missing, format!("there is no {what}"));
        let (fault, what) = match (t, depth, force, last) {
            (None, ..) => missing("time"),
            (_, None, ..) if is_needed => missing("depth"),
            (_, _, None, _) if is_needed => missing("force"),
            (Some(t), .., Some(last)) if t == last => {
                (Fault::Repeated, format!("the time {t} s is that of the row before"))
            }
            (Some(t), .., Some(last)) if t < last => {
                (Fault::Backward, format!("the time goes back from {last} to {t} s"))
            }
            (Some(t), ..) => {
                return Ok(Some(Sample { t, depth, force, signal, phase }));
            }
        };
        self.fault(fault, number, &what).map(|()| None)
    }

    /// Refuses a row, or counts it among those left out.
    fn fault(&mut self, fault: Fault, number: usize, what: &str) -> Result<(), String> {
        if !self.skip.contains(&fault) {
            return Err(format!(
                "{} {number}: {what}; mend the file, or have such rows skipped: {}",
                self.rows.word(),
                fault.name()
            ));
        }
        let (count, first) = &mut self.skipped[fault as usize];
        if *count == 0 {
            *first = number;
        }
        *count += 1;
        Ok(())
    }
}

/// Every sample of a part, and what a user of them must know.
pub(super) fn read(
    rows: &Rows<'_>,
    header: &Header,
    columns: &Columns,
    decimal: Decimal,
    skip: &[Fault],
) -> Result<(Vec<Sample>, Vec<String>), String> {
    let mut reader = Reader { rows, decimal, skip, skipped: [(0, 0); Fault::ALL.len()] };
    let mut samples: Vec<Sample> = Vec::new();
    let mut numbers: Vec<usize> = Vec::new();
    for index in header.first..rows.len() {
        let number = rows.number(index);
        let cells = rows.cells(index)?;
        if cells.iter().all(Cell::is_empty) {
            continue;
        }
        reader.check_width(&cells, header.width, number)?;
        let last = samples.last().map(|last| last.t);
        if let Some(sample) = reader.sample(&cells, columns, number, last)? {
            samples.push(sample);
            numbers.push(number);
        }
    }
    if samples.len() < 2 {
        return Err("it has fewer than two rows of numbers".into());
    }
    let from_zero = |column: &Column, first: Option<f64>| match column.zero {
        Zero::AsItIs => 0.0,
        Zero::First => first.unwrap_or(0.0),
        Zero::At(value) => value,
    };
    let depth_zero = from_zero(&columns.depth, samples.iter().find_map(|one| one.depth));
    let force_zero = from_zero(&columns.force, samples.iter().find_map(|one| one.force));
    for sample in &mut samples {
        sample.depth = sample.depth.map(|depth| depth - depth_zero);
        sample.force = sample.force.map(|force| force - force_zero);
    }
    let mut remarks = left_out(&reader);
    remarks.extend(gaps(rows, &samples, &numbers));
    remarks.extend(turned(&samples));
    Ok((samples, remarks))
}

fn phase_of(name: &str) -> Phase {
    let known = Phase::ALL.iter().copied().find(|phase| phase.name() == name);
    known.unwrap_or(Phase::Imported)
}

fn left_out(reader: &Reader<'_>) -> Vec<String> {
    let why = |fault| match fault {
        Fault::Missing => "without a value",
        Fault::Repeated => "with the time of the row before",
        Fault::Backward => "whose time goes back",
    };
    Fault::ALL
        .into_iter()
        .map(|fault| (fault, reader.skipped[fault as usize]))
        .filter(|(_, (count, _))| *count > 0)
        .map(|(fault, (count, first))| {
            format!(
                "{count} rows {} are left out, as told; the first is {} {first}",
                why(fault),
                reader.rows.word()
            )
        })
        .collect()
}

/// A step counts as even if it is within this share of the median: more than any file's rounding of times.
const EVEN: f64 = 0.05;
/// A step this many times the median is a gap: between a row that is missing and one that is late.
const GAP: f64 = 1.5;

/// Where rows seem to be missing, or how unevenly they are spaced.
fn gaps(rows: &Rows<'_>, samples: &[Sample], numbers: &[usize]) -> Option<String> {
    let steps: Vec<f64> = samples.windows(2).map(|pair| pair[1].t - pair[0].t).collect();
    let mut sorted = steps.clone();
    let middle = sorted.len() / 2;
    let median = *sorted.select_nth_unstable_by(middle, f64::total_cmp).1;
    let even = steps.iter().filter(|step| (*step - median).abs() <= EVEN * median).count();
    let shortest = steps.iter().copied().fold(f64::INFINITY, f64::min);
    let longest = steps.iter().copied().fold(0.0, f64::max);
    // Where a tenth of the steps differ, that is how the instrument takes its samples.
    if 10 * even < 9 * steps.len() {
        return Some(format!(
            "the rows are not evenly spaced: {shortest:.6} to {longest:.6} s apart"
        ));
    }
    let is_gap = |step: &f64| *step > GAP * median;
    let count = steps.iter().filter(|step| is_gap(step)).count();
    let first = steps.iter().position(is_gap)?;
    Some(format!(
        "{count} gaps: after {} {} nothing for {:.6} s where rows are {median:.6} s apart; nothing is filled in",
        rows.word(),
        numbers[first],
        steps[first]
    ))
}

/// Whether the force falls where the depth grows, which compression does not do here.
fn turned(samples: &[Sample]) -> Option<String> {
    let both: Vec<(f64, f64)> =
        samples.iter().filter_map(|one| Some((one.depth?, one.force?))).collect();
    let count = both.len() as f64;
    let mean = |pick: fn(&(f64, f64)) -> f64| both.iter().map(pick).sum::<f64>() / count;
    let (depth, force) = (mean(|one| one.0), mean(|one| one.1));
    let together: f64 = both.iter().map(|(x, f)| (x - depth) * (f - force)).sum();
    (together < 0.0).then(|| {
        "the force falls where the depth grows; if the file counts one of them the other way round, turn its sign, as in force=-NAME or depth=-NAME".into()
    })
}
