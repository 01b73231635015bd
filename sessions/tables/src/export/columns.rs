//! The columns of every table of samples: what they are called and mean, and how they are filled.

use palpate_sessions::manifest::Manifest;
use palpate_sessions::record::Row;
use polars_arrow::array::{MutableBinaryViewArray, MutablePrimitiveArray, PrimitiveArray};
use polars_core::prelude::{ChunkFull, Column, DataFrame, IntoSeries, PlSmallStr, PolarsResult};
use polars_core::prelude::{Series, StringChunked};

/// What stands in a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Field {
    SessionId,
    Specimen,
    Sample,
    Time,
    Depth,
    Force,
    Signal,
    Counts,
    Pulses,
    Phase,
    Cycle,
    Tick,
    Host,
    Status,
    Age,
    AgeWithin,
    /// One of [`Beside`], by number.
    Beside(usize),
    /// The number of the sample, in a table that holds every so many only.
    EveryNth,
}

/// A column, as a reader is told of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ColumnInfo {
    field: Field,
    /// Its name, with the unit where it has one.
    pub name: String,
    /// Its unit; `1` is a plain count, empty is text.
    pub unit: &'static str,
    /// Its type.
    pub kind: &'static str,
    /// What it means.
    pub meaning: String,
    /// Where it comes from.
    pub how: &'static str,
}

/// The column of times.
pub(super) const TIME_COLUMN: &str = "t_s";

/// Columns of every table, in order.
const USUAL: [Field; 8] = [
    Field::Time,
    Field::Depth,
    Field::Force,
    Field::Signal,
    Field::Counts,
    Field::Pulses,
    Field::Phase,
    Field::Cycle,
];

/// Columns that can be asked for by name.
const MORE: [Field; 8] = [
    Field::SessionId,
    Field::Specimen,
    Field::Sample,
    Field::Tick,
    Field::Host,
    Field::Status,
    Field::Age,
    Field::AgeWithin,
];

/// Columns that stand beside the session's own, such as corrected depths.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Beside {
    /// Name, unit and values, one for each sample and none where it is not known.
    pub columns: Vec<(&'static str, &'static str, Vec<Option<f64>>)>,
    /// What a reader must know of them: keys and texts of the file's metadata.
    pub metadata: Vec<(String, String)>,
}

impl Field {
    #[expect(clippy::too_many_lines, reason = "a table of columns")]
    fn told(self) -> ColumnInfo {
        let (name, unit, kind, meaning, how) = match self {
            Self::SessionId => (
                "session_id",
                "",
                "text",
                "name of the session",
                "given at the start, sorts by time",
            ),
            Self::Specimen => {
                ("specimen", "", "text", "what was indented", "typed by the operator")
            }
            Self::Sample => (
                "sample",
                "1",
                "whole number",
                "number of the sample in the session, from 0",
                "counted",
            ),
            Self::Time => (
                TIME_COLUMN,
                "s",
                "number",
                "time since the session's first sample; negative after a restart of the controller",
                "controller ticks times the true length of a tick",
            ),
            Self::Depth => (
                "depth_mm",
                "mm",
                "number",
                "depth below contact, positive into the tissue; empty before contact is known",
                "the commanded path, within one pulse of the pulses, from the contact found or corrected",
            ),
            Self::Force => (
                "force_N",
                "N",
                "number",
                "force on the probe above tare, positive in compression; empty before the tare and where left out",
                "signal through the load-cell calibration, less the tare",
            ),
            Self::Signal => (
                "signal_V",
                "V",
                "number",
                "load-cell signal; empty in an imported session without one",
                "as received",
            ),
            Self::Counts => (
                "counts",
                "1",
                "whole number",
                "converter counts; empty on a rig without a converter",
                "as received",
            ),
            Self::Pulses => (
                "pulses",
                "1",
                "whole number",
                "commanded position in motor pulses from home; empty in an imported session",
                "as received",
            ),
            Self::Phase => ("phase", "", "text", "what the run was doing", "decided by the engine"),
            Self::Cycle => (
                "cycle",
                "1",
                "whole number",
                "indentation cycle, from 1; 0 outside cycles",
                "decided by the engine",
            ),
            Self::Tick => (
                "tick",
                "1",
                "whole number",
                "the controller's clock in its own counts; picoseconds in an imported session",
                "as received",
            ),
            Self::Host => (
                "host_ns",
                "ns",
                "whole number",
                "arrival on the computer, since the start of the session",
                "the computer's monotonic clock",
            ),
            Self::Status => {
                ("status", "1", "whole number", "bits of the axis' status", "as received")
            }
            Self::Age => (
                "age_ns",
                "ns",
                "whole number",
                "the sample was taken so long before it arrived; empty where the link does not tell",
                "measured by the driver, sample by sample",
            ),
            Self::AgeWithin => (
                "age_within_ns",
                "ns",
                "whole number",
                "how far age_ns may be wrong either way; empty where the link does not tell",
                "measured by the driver, sample by sample",
            ),
            // Named by those who make them.
            Self::Beside(_) | Self::EveryNth => ("", "", "", "", ""),
        };
        ColumnInfo { field: self, name: name.into(), unit, kind, meaning: meaning.into(), how }
    }
}

/// The columns of one table and what is the same in every row.
pub(super) struct Layout<'a> {
    pub columns: Vec<ColumnInfo>,
    beside: &'a Beside,
    manifest: &'a Manifest,
}

/// Samples of the table, which are as many numbers in the session as rows.
#[derive(Clone, Copy)]
pub(super) struct Samples<'a> {
    pub numbers: &'a [u64],
    pub rows: &'a [Row],
    /// Tick of the session's first sample.
    pub first_tick: u64,
}

/// Time in s of a sample. A controller that restarted counts from zero again: its time is negative, not a failure.
pub(super) fn time_of(manifest: &Manifest, row: &Row, first_tick: u64) -> f64 {
    manifest.time_of(row.tick.wrapping_sub(first_tick) as i64).0
}

impl<'a> Layout<'a> {
    /// The usual columns and those beside, or those that are named, in that order; or the name there is no
    /// column of. A table of every `every`-th sample begins with the numbers of its samples.
    pub fn new(
        manifest: &'a Manifest,
        beside: &'a Beside,
        wanted: &[String],
        every: u64,
    ) -> Result<Self, String> {
        let mut known: Vec<ColumnInfo> = USUAL.map(Field::told).into();
        known.extend(beside.columns.iter().enumerate().map(|(number, (name, unit, _))| {
            ColumnInfo {
                field: Field::Beside(number),
                name: (*name).into(),
                unit,
                kind: "number",
                meaning: "beside the session's own columns; empty where it is not known".into(),
                how: "computed at export; how is in the file's metadata",
            }
        }));
        let usual = known.len();
        known.extend(MORE.map(Field::told));
        let mut columns = Vec::new();
        if every > 1 {
            columns.push(ColumnInfo {
                name: format!("sample_every_{every}"),
                meaning: format!(
                    "number of the sample in the session, from 0; only every {every}th of those selected is here, none is averaged"
                ),
                field: Field::EveryNth,
                ..Field::Sample.told()
            });
        }
        if wanted.is_empty() {
            known.truncate(usual);
            columns.append(&mut known);
        }
        for name in wanted {
            let found = known.iter().find(|one| one.name == *name);
            let Some(found) = found else {
                let all: Vec<&str> = known.iter().map(|one| one.name.as_str()).collect();
                return Err(format!(
                    "there is no column {name}; the columns are {}",
                    all.join(", ")
                ));
            };
            if columns.contains(found) {
                return Err(format!("column {name} is named twice; name it once"));
            }
            columns.push(found.clone());
        }
        Ok(Self { columns, beside, manifest })
    }

    /// A frame of these columns to fill, with room for so many samples.
    pub fn filling(&self, room: usize) -> Vec<Cells> {
        let columns = self.columns.iter();
        columns.map(|column| Cells::new(column.field, self.manifest, room)).collect()
    }

    /// Adds samples to a frame.
    pub fn fill(&self, frame: &mut [Cells], samples: Samples) {
        for (cells, column) in frame.iter_mut().zip(&self.columns) {
            cells.extend(samples, column.field, self);
        }
    }

    /// The frame of so many samples.
    pub fn frame(&self, cells: Vec<Cells>, rows: usize) -> PolarsResult<DataFrame> {
        let columns = self.columns.iter().zip(cells);
        let columns =
            columns.map(|(column, cells)| cells.series(column.name.as_str().into()).into());
        DataFrame::new(rows, columns.collect::<Vec<Column>>())
    }
}

/// What a column of a frame holds so far.
pub(super) enum Cells {
    /// A text that is the same in every row, and their number.
    Same(String, usize),
    Numbers(Vec<f64>),
    Wide(Vec<u64>),
    Whole(Vec<u32>),
    Words(MutableBinaryViewArray<str>),
    MaybeNumbers(MutablePrimitiveArray<f64>),
    MaybeWide(MutablePrimitiveArray<i64>),
    MaybeWhole(MutablePrimitiveArray<i32>),
}

impl Cells {
    fn new(field: Field, manifest: &Manifest, room: usize) -> Self {
        match field {
            Field::SessionId => Self::Same(manifest.session_id.clone(), 0),
            Field::Specimen => Self::Same(manifest.specimen.clone(), 0),
            Field::Time => Self::Numbers(Vec::with_capacity(room)),
            Field::Sample | Field::EveryNth | Field::Tick | Field::Host => {
                Self::Wide(Vec::with_capacity(room))
            }
            Field::Cycle | Field::Status => Self::Whole(Vec::with_capacity(room)),
            Field::Phase => Self::Words(MutableBinaryViewArray::with_capacity(room)),
            Field::Depth | Field::Force | Field::Signal | Field::Beside(_) => {
                Self::MaybeNumbers(MutablePrimitiveArray::with_capacity(room))
            }
            Field::Pulses | Field::Age | Field::AgeWithin => {
                Self::MaybeWide(MutablePrimitiveArray::with_capacity(room))
            }
            Field::Counts => Self::MaybeWhole(MutablePrimitiveArray::with_capacity(room)),
        }
    }

    fn extend(&mut self, samples: Samples, field: Field, layout: &Layout) {
        let rows = samples.rows.iter();
        match self {
            Self::Same(_, count) => *count += rows.len(),
            Self::Numbers(cells) => {
                cells.extend(rows.map(|row| time_of(layout.manifest, row, samples.first_tick)));
            }
            Self::Wide(cells) => match field {
                Field::Tick => cells.extend(rows.map(|row| row.tick)),
                Field::Host => cells.extend(rows.map(|row| row.host.0)),
                _ => cells.extend(samples.numbers),
            },
            Self::Whole(cells) => match field {
                Field::Cycle => cells.extend(rows.map(|row| row.cycle)),
                _ => cells.extend(rows.map(|row| row.status)),
            },
            Self::Words(cells) => cells.extend_values(rows.map(|row| row.phase.name())),
            Self::MaybeNumbers(cells) => match field {
                Field::Depth => cells.extend(rows.map(|row| row.depth)),
                Field::Force => cells.extend(rows.map(|row| row.force)),
                Field::Beside(one) => {
                    let values = &layout.beside.columns[one].2;
                    let of = |number: &u64| *values.get(*number as usize)?;
                    cells.extend(samples.numbers.iter().map(of));
                }
                _ => cells.extend(rows.map(|row| row.volts)),
            },
            Self::MaybeWide(cells) => match field {
                // No link is as slow as i64::MAX nanoseconds.
                Field::Age => cells.extend(rows.map(|row| row.age.map(|age| age.by.0 as i64))),
                Field::AgeWithin => {
                    cells.extend(rows.map(|row| row.age.map(|age| age.within.0 as i64)))
                }
                _ => cells.extend(rows.map(|row| row.pulses)),
            },
            Self::MaybeWhole(cells) => cells.extend(rows.map(|row| row.counts)),
        }
    }

    fn series(self, name: PlSmallStr) -> Series {
        match self {
            Self::Same(text, count) => StringChunked::full(name, &text, count).into_series(),
            Self::Numbers(cells) => Series::from_array(name, PrimitiveArray::from_vec(cells)),
            Self::Wide(cells) => Series::from_array(name, PrimitiveArray::from_vec(cells)),
            Self::Whole(cells) => Series::from_array(name, PrimitiveArray::from_vec(cells)),
            Self::Words(cells) => Series::from_array(name, cells.freeze()),
            Self::MaybeNumbers(cells) => Series::from_array(name, cells.freeze()),
            Self::MaybeWide(cells) => Series::from_array(name, cells.freeze()),
            Self::MaybeWhole(cells) => Series::from_array(name, cells.freeze()),
        }
    }
}
