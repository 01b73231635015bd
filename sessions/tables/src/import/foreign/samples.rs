//! The numbers of a part, checked row by row. Nothing is repaired: a faulty row is refused or, if the options say so, left
//! out and counted.

use super::super::header::Quantity;
use super::columns::{Column, Columns, Zero};
use super::decimal::{DecimalSign, parse};
use super::formats::{Stage, StageKind};
use super::layout::Header;
use super::options::RowFault;
use super::rows::{Cell, Rows};
use palpate_model::rig::Phase;

/// One row in s, mm, N and V.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForeignSample {
    /// Time in s, from the file's origin.
    pub t: f64,
    /// Depth in mm; `None` only outside an indentation.
    pub depth: Option<f64>,
    /// Force in N; `None` only outside an indentation.
    pub force: Option<f64>,
    /// Signal in V; `None` in a file without one.
    pub signal: Option<f64>,
    /// From a table that palpate exported; otherwise [`Phase::Imported`].
    pub phase: Phase,
}

struct Reader<'a> {
    rows: &'a Rows<'a>,
    decimal: DecimalSign,
    skip: &'a [RowFault],
    stages: &'a [Stage],
    /// Rows left out by fault: how many, and the number of the first.
    skipped: [(usize, usize); RowFault::ALL.len()],
}

impl Reader<'_> {
    /// The value of a cell in the unit of its quantity; `None` if it is missing.
    fn value(
        &self,
        cells: &[Cell],
        column: &Column,
        what: Quantity,
        number: usize,
    ) -> Result<Option<f64>, String> {
        let raw = match cells.get(column.index) {
            None | Some(Cell::Empty) => return Ok(None),
            Some(Cell::Number(number)) => *number,
            Some(Cell::Text(text)) if text.eq_ignore_ascii_case("nan") => return Ok(None),
            Some(Cell::Text(text)) => parse(text, self.decimal).ok_or_else(|| {
                format!(
                    "{} {number}: the {} '{}' is not a number with a decimal {}; correct or remove the {0}, or give the decimal sign",
                    self.rows.word(),
                    what.name(),
                    text.chars().take(40).collect::<String>(),
                    self.decimal.name()
                )
            })?,
        };
        let sign = if column.is_inverted { -1.0 } else { 1.0 };
        let value = sign * column.scale.apply(raw);
        Ok(Some(value).filter(|value| value.is_finite()))
    }

    fn check_width(&self, cells: &[Cell], width: usize, number: usize) -> Result<(), String> {
        let mut beyond = cells.iter().skip(width);
        match beyond.position(|cell| !cell.is_empty()) {
            None => Ok(()),
            Some(place) => Err(format!(
                "{} {number} has a cell in column {}, but the header has {width} columns; correct the {0}, or give the delimiter or decimal sign if it was detected wrongly",
                self.rows.word(),
                width + place + 1,
            )),
        }
    }

    /// The sample in a row; `None` if the row is left out. `last` is the time of the sample before in s.
    fn sample(
        &mut self,
        cells: &[Cell],
        columns: &Columns,
        number: usize,
        last: Option<f64>,
    ) -> Result<Option<ForeignSample>, String> {
        let one = |column: &Column, what| self.value(cells, column, what, number);
        let stage = self.stages.iter().rfind(|stage| stage.first <= number);
        let t = one(&columns.time, Quantity::Time)?;
        let t = t.map(|t| t + stage.map_or(0.0, |stage| stage.start_s));
        let depth = one(&columns.depth, Quantity::Depth)?;
        let force = one(&columns.force, Quantity::Force)?;
        let signal = columns.signal.as_ref().map(|column| one(column, Quantity::Signal));
        let signal = signal.transpose()?.flatten();
        let phase = columns.phase.and_then(|place| cells.get(place));
        let phase = match stage {
            Some(stage) => stage.kind.first_phase(),
            None => phase.map_or(Phase::Imported, |cell| phase_of(&cell.text())),
        };
        let is_needed =
            matches!(phase, Phase::Imported | Phase::Ramp | Phase::Hold | Phase::Unload);
        let missing = |what: &str| (RowFault::Missing, format!("the {what} is missing"));
        let (fault, what) = match (t, depth, force, last) {
            (None, ..) => missing("time"),
            (_, None, ..) if is_needed => missing("depth"),
            (_, _, None, _) if is_needed => missing("force"),
            (Some(t), .., Some(last)) if t == last => {
                (RowFault::Repeated, format!("the time {t} s equals that of the previous row"))
            }
            (Some(t), .., Some(last)) if t < last => {
                (RowFault::Backward, format!("the time decreases from {last} to {t} s"))
            }
            (Some(t), ..) => {
                return Ok(Some(ForeignSample { t, depth, force, signal, phase }));
            }
        };
        self.fault(fault, number, &what).map(|()| None)
    }

    /// Refuses a row, or counts it as left out.
    fn fault(&mut self, fault: RowFault, number: usize, what: &str) -> Result<(), String> {
        if !self.skip.contains(&fault) {
            return Err(format!(
                "{} {number}: {what}; correct the file, or skip all rows with the fault '{}'",
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

/// All samples of a part, and remarks.
pub(super) fn read(
    rows: &Rows<'_>,
    header: &Header,
    columns: &Columns,
    stages: &[Stage],
    decimal: DecimalSign,
    skip: &[RowFault],
) -> Result<(Vec<ForeignSample>, Vec<String>), String> {
    let skipped = [(0, 0); RowFault::ALL.len()];
    let mut reader = Reader { rows, decimal, skip, stages, skipped };
    let mut samples: Vec<ForeignSample> = Vec::new();
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
    let zero = |column: &Column, value: fn(&ForeignSample) -> Option<f64>| match column.zero {
        Zero::Unchanged => 0.0,
        Zero::First => samples.iter().find_map(value).unwrap_or(0.0),
        Zero::Row(row) => {
            let count = numbers.partition_point(|number| *number <= row);
            samples[..count].iter().rev().find_map(value).unwrap_or(0.0)
        }
        Zero::At(value) => value,
    };
    let depth_zero = zero(&columns.depth, |one| one.depth);
    let force_zero = zero(&columns.force, |one| one.force);
    for sample in &mut samples {
        sample.depth = sample.depth.map(|depth| depth - depth_zero);
        sample.force = sample.force.map(|force| force - force_zero);
    }
    for (index, stage) in stages.iter().enumerate().filter(|(_, one)| one.kind == StageKind::Press)
    {
        let end = stages.get(index + 1).map_or(usize::MAX, |next| next.first);
        let place = |line: usize| numbers.partition_point(|number| *number < line);
        name_hold(&mut samples[place(stage.first)..place(end)]);
    }
    let mut remarks = left_out(&reader);
    remarks.extend(gaps(rows, &samples, &numbers));
    remarks.extend(inverted_sign(&samples));
    Ok((samples, remarks))
}

/// A ramp is over where this share of its travel is left: a stage at rest trembles by a step of its encoder.
const TRAVEL_LEFT: f64 = 0.002;

/// The hold of a ramp begins where the stage has arrived.
fn name_hold(samples: &mut [ForeignSample]) {
    let mut depths = samples.iter().filter_map(|one| one.depth);
    let Some(first) = depths.next() else { return };
    let last = depths.next_back().unwrap_or(first);
    let left = TRAVEL_LEFT * (last - first).abs();
    let is_there =
        |one: &ForeignSample| one.depth.is_some_and(|depth| (last - depth).abs() <= left);
    let arrived = samples.iter().position(is_there).unwrap_or(samples.len());
    for sample in samples.iter_mut().skip(arrived + 1) {
        sample.phase = Phase::Hold;
    }
}

fn phase_of(name: &str) -> Phase {
    let known = Phase::ALL.iter().copied().find(|phase| phase.name() == name);
    known.unwrap_or(Phase::Imported)
}

fn left_out(reader: &Reader<'_>) -> Vec<String> {
    let description = |fault| match fault {
        RowFault::Missing => "without a value",
        RowFault::Repeated => "with the time of the previous row",
        RowFault::Backward => "with decreasing time",
    };
    RowFault::ALL
        .into_iter()
        .map(|fault| (fault, reader.skipped[fault as usize]))
        .filter(|(_, (count, _))| *count > 0)
        .map(|(fault, (count, first))| {
            format!(
                "{count} rows {} are left out on request; the first is {} {first}",
                description(fault),
                reader.rows.word()
            )
        })
        .collect()
}

/// Relative deviation from the median up to which a step counts as even: more than the rounding of times in files.
const EVEN: f64 = 0.05;
/// A step above this multiple of the median is a gap: between a late row (1) and a missing one (2).
const GAP: f64 = 1.5;

/// A remark about gaps or uneven spacing.
fn gaps(rows: &Rows<'_>, samples: &[ForeignSample], numbers: &[usize]) -> Option<String> {
    let steps: Vec<f64> = samples.windows(2).map(|pair| pair[1].t - pair[0].t).collect();
    let mut sorted = steps.clone();
    let middle = sorted.len() / 2;
    let median = *sorted.select_nth_unstable_by(middle, f64::total_cmp).1;
    let even = steps.iter().filter(|step| (*step - median).abs() <= EVEN * median).count();
    let shortest = steps.iter().copied().fold(f64::INFINITY, f64::min);
    let longest = steps.iter().copied().fold(0.0, f64::max);
    // With more than a tenth of uneven steps, the instrument samples unevenly.
    if 10 * even < 9 * steps.len() {
        return Some(format!(
            "the rows are not evenly spaced in time: their intervals are {shortest:.6} to {longest:.6} s"
        ));
    }
    let is_gap = |step: &f64| *step > GAP * median;
    let count = steps.iter().filter(|step| is_gap(step)).count();
    let first = steps.iter().position(is_gap)?;
    Some(format!(
        "{count} time step(s) are longer than the usual {median:.6} s: the first, after {} {}, is {:.6} s; palpate does not fill the gaps",
        rows.word(),
        numbers[first],
        steps[first]
    ))
}

/// Steps that are compared with each other, so that the noise of neighbouring rows does not count.
const STEPS: usize = 200;

/// A remark if the force decreases with depth, which suggests an inverted sign. Steps of both are compared, because at rest
/// an inverted force rises as the specimen relaxes.
fn inverted_sign(samples: &[ForeignSample]) -> Option<String> {
    let both: Vec<(f64, f64)> =
        samples.iter().filter_map(|one| Some((one.depth?, one.force?))).collect();
    let apart = both.len().div_ceil(STEPS);
    let pairs = both.iter().zip(both.iter().skip(apart)).step_by(apart.max(1));
    let together: f64 = pairs.map(|(a, b)| (b.0 - a.0) * (b.1 - a.1)).sum();
    (together < 0.0).then(|| {
        "the force decreases as the depth increases; if the file counts one of them in the opposite direction, invert its sign, as in force=-NAME or depth=-NAME".into()
    })
}
