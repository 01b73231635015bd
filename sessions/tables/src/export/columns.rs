//! The columns of tables of samples: names, meanings and values.

use palpate_model::rig::SensorReading;
use palpate_sessions::manifest::Manifest;
use palpate_sessions::record::{EntryKind, LogEntry, SampleRow};
use polars_arrow::array::{MutableBinaryViewArray, MutablePrimitiveArray, PrimitiveArray};
use polars_core::prelude::{ChunkFull, Column, DataFrame, IntoSeries, PlSmallStr, PolarsResult};
use polars_core::prelude::{Series, StringChunked};
use serde::Deserialize;
use std::borrow::Cow;

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
    /// A column of [`ExtraColumns`], by index.
    Extra(usize),
    /// A sensor of [`ExtraColumns`], by index.
    Sensor(usize),
    /// Number of the sample in a thinned table.
    EveryNth,
}

/// Description of a column for readers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ColumnInfo {
    field: Field,
    /// With the unit, if any.
    pub name: String,
    /// `1` for a count, empty for text.
    pub unit: Cow<'static, str>,
    pub kind: &'static str,
    pub meaning: String,
    pub how: &'static str,
}

pub(super) const TIME_COLUMN: &str = "t_s";

/// Default columns, in order.
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

/// Columns available by name.
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

/// Columns in addition to the session's own, such as corrected depths.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExtraColumns {
    /// Name, unit and one value per sample, `None` where unknown.
    pub columns: Vec<(&'static str, &'static str, Vec<Option<f64>>)>,
    /// Sensors of the rig beside load cell and axis.
    pub sensors: Vec<SensorColumn>,
    /// Entries of the file's metadata that explain them.
    pub metadata: Vec<(String, String)>,
}

/// The values of a sensor, which change now and then.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SensorColumn {
    pub name: String,
    pub unit: String,
    /// Numbers of the first samples with a value, in order, and the value.
    changes: Vec<(u64, f64)>,
}

impl SensorColumn {
    /// The newest value at a sample.
    fn value(&self, sample: u64) -> Option<f64> {
        let after = self.changes.partition_point(|(from, _)| *from <= sample);
        Some(self.changes[after.checked_sub(1)?].1)
    }
}

impl ExtraColumns {
    /// A column for each channel of the rig, from the inputs of the session.
    #[must_use]
    pub fn of_sensors(manifest: &Manifest, entries: &[LogEntry]) -> Self {
        let channels = manifest.rig.iter().flat_map(|rig| &rig.sensors.channels);
        let mut sensors: Vec<SensorColumn> = channels
            .map(|channel| SensorColumn {
                name: match channel.unit.as_str() {
                    "1" => channel.name.clone(),
                    unit => format!("{}_{unit}", channel.name),
                },
                unit: channel.unit.clone(),
                changes: Vec::new(),
            })
            .collect();
        if sensors.is_empty() {
            return Self::default();
        }
        for entry in entries.iter().filter(|entry| entry.kind == EntryKind::Input) {
            let Some(SensorReading::Channel { number, value, .. }) = sensor_reading(entry) else {
                continue;
            };
            let index = usize::from(number).checked_sub(1);
            if let Some(sensor) = index.and_then(|index| sensors.get_mut(index)) {
                sensor.changes.push((entry.after_sample, value));
            }
        }
        Self { sensors, ..Self::default() }
    }
}

fn sensor_reading(entry: &LogEntry) -> Option<SensorReading> {
    let body = entry.body.as_object()?;
    (body.get("input")? == "sensor").then_some(())?;
    SensorReading::deserialize(body.get("value")?).ok()
}

impl Field {
    fn describe(self) -> ColumnInfo {
        let (name, unit, meaning) = match self {
            Self::SessionId => ("session_id", "", "name of the session"),
            Self::Specimen => ("specimen", "", "what was indented"),
            Self::Sample => ("sample", "1", "number of the sample in the session, from 0"),
            Self::Time => (
                TIME_COLUMN,
                "s",
                "time since the session's first sample; negative after a restart of the controller",
            ),
            Self::Depth => (
                "depth_mm",
                "mm",
                "depth below contact, positive into the tissue; empty before contact is known",
            ),
            Self::Force => (
                "force_N",
                "N",
                "force on the probe above tare, positive in compression; empty before the tare and where masked",
            ),
            Self::Signal => {
                ("signal_V", "V", "load-cell signal; empty in an imported session without one")
            }
            Self::Counts => ("counts", "1", "converter counts; empty on a rig without a converter"),
            Self::Pulses => (
                "pulses",
                "1",
                "commanded position in motor pulses from home; empty in an imported session",
            ),
            Self::Phase => ("phase", "", "what the run was doing"),
            Self::Cycle => ("cycle", "1", "indentation cycle, from 1; 0 outside cycles"),
            Self::Tick => (
                "tick",
                "1",
                "the controller's clock in its own counts; picoseconds in an imported session",
            ),
            Self::Host => {
                ("host_ns", "ns", "time of arrival at the computer, from the start of the session")
            }
            Self::Status => ("status", "1", "status bits of the axis"),
            Self::Age => (
                "age_ns",
                "ns",
                "delay from acquisition to arrival; empty if the link does not measure it",
            ),
            Self::AgeWithin => (
                "age_within_ns",
                "ns",
                "largest error of age_ns in either direction; empty if the link does not measure it",
            ),
            // `Layout::new` describes these.
            Self::Extra(_) | Self::Sensor(_) | Self::EveryNth => ("", "", ""),
        };
        let (kind, how) = (self.kind(), self.origin());
        ColumnInfo {
            field: self,
            name: name.into(),
            unit: unit.into(),
            kind,
            meaning: meaning.into(),
            how,
        }
    }

    fn kind(self) -> &'static str {
        match self {
            Self::SessionId | Self::Specimen | Self::Phase => "text",
            Self::Time | Self::Depth | Self::Force | Self::Signal => "number",
            Self::Extra(_) | Self::Sensor(_) => "number",
            _ => "whole number",
        }
    }

    fn origin(self) -> &'static str {
        match self {
            Self::SessionId => {
                "set when the session starts; alphabetical order is chronological order"
            }
            Self::Specimen => "typed by the operator",
            Self::Sample | Self::EveryNth => "counted",
            Self::Time => "controller ticks times the true length of a tick",
            Self::Depth => {
                "commanded path, measured from the recorded or corrected contact point; agrees with the column pulses to within one pulse"
            }
            Self::Force => "signal converted by the load-cell calibration, minus the tare",
            Self::Signal | Self::Counts | Self::Pulses | Self::Tick | Self::Status => "as received",
            Self::Phase | Self::Cycle => "decided by the engine",
            Self::Host => "the computer's monotonic clock",
            Self::Age | Self::AgeWithin => "measured by the driver, sample by sample",
            Self::Sensor(_) => "measured by a sensor of the rig",
            Self::Extra(_) => "computed at export; the file's metadata describe the method",
        }
    }
}

/// The columns of one table, and values that are the same in every row.
pub(super) struct Layout<'a> {
    pub columns: Vec<ColumnInfo>,
    extra: &'a ExtraColumns,
    manifest: &'a Manifest,
}

/// Selected samples: their numbers in the session, and their rows.
#[derive(Clone, Copy)]
pub(super) struct Samples<'a> {
    pub numbers: &'a [u64],
    pub rows: &'a [SampleRow],
    /// Tick of the session's first sample.
    pub first_tick: u64,
}

/// Time of a sample in s. After a restart of the controller, which counts from zero again, the time is negative.
pub(super) fn time_of(manifest: &Manifest, row: &SampleRow, first_tick: u64) -> f64 {
    manifest.time_of(row.tick.wrapping_sub(first_tick) as i64).0
}

impl<'a> Layout<'a> {
    /// The default and extra columns or, if any are named, those in that order. A table of every `every`-th sample begins with
    /// the numbers of its samples.
    pub fn new(
        manifest: &'a Manifest,
        extra: &'a ExtraColumns,
        names: &[String],
        every: u64,
    ) -> Result<Self, String> {
        let mut known: Vec<ColumnInfo> = USUAL.map(Field::describe).into();
        known.extend(extra.columns.iter().enumerate().map(|(number, (name, unit, _))| {
            let (name, meaning) = ((*name).into(), "extra column; empty where unknown".into());
            ColumnInfo { name, unit: (*unit).into(), meaning, ..Field::Extra(number).describe() }
        }));
        known.extend(extra.sensors.iter().enumerate().map(|(number, sensor)| ColumnInfo {
            name: sensor.name.clone(),
            unit: sensor.unit.clone().into(),
            meaning:
                "newest value of the sensor when the sample came; empty before the first".into(),
            ..Field::Sensor(number).describe()
        }));
        let usual = known.len();
        known.extend(MORE.map(Field::describe));
        let mut columns = Vec::new();
        if every > 1 {
            columns.push(ColumnInfo {
                name: format!("sample_every_{every}"),
                meaning: format!(
                    "number of the sample in the session, from 0; the table has one of every {every} selected samples, without averaging"
                ),
                field: Field::EveryNth,
                ..Field::Sample.describe()
            });
        }
        if names.is_empty() {
            known.truncate(usual);
            columns.append(&mut known);
        }
        for name in names {
            let found = known.iter().find(|one| one.name == *name);
            let Some(found) = found else {
                let all: Vec<&str> = known.iter().map(|one| one.name.as_str()).collect();
                return Err(format!(
                    "the session has no column {name}; its columns are {}",
                    all.join(", ")
                ));
            };
            if columns.contains(found) {
                return Err(format!("column {name} is listed twice; list it once"));
            }
            columns.push(found.clone());
        }
        Ok(Self { columns, extra, manifest })
    }

    /// Empty cells with capacity for `room` samples.
    pub fn empty_cells(&self, room: usize) -> Vec<Cells> {
        let columns = self.columns.iter();
        columns.map(|column| Cells::new(column.field, self.manifest, room)).collect()
    }

    pub fn fill(&self, frame: &mut [Cells], samples: Samples) {
        for (cells, column) in frame.iter_mut().zip(&self.columns) {
            cells.extend(samples, column.field, self);
        }
    }

    /// Builds the frame of `rows` samples.
    pub fn frame(&self, cells: Vec<Cells>, rows: usize) -> PolarsResult<DataFrame> {
        let columns = self.columns.iter().zip(cells);
        let columns =
            columns.map(|(column, cells)| cells.series(column.name.as_str().into()).into());
        DataFrame::new(rows, columns.collect::<Vec<Column>>())
    }
}

/// Cells of a column while it is filled.
pub(super) enum Cells {
    /// The same text in every row, and the number of rows.
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
            Field::Depth | Field::Force | Field::Signal | Field::Extra(_) | Field::Sensor(_) => {
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
            Self::Words(cells) => {
                // A phase lasts for many samples, and its name is encoded once.
                for same in samples.rows.chunk_by(|a, b| a.phase == b.phase) {
                    cells.extend_constant(same.len(), Some(same[0].phase.name()));
                }
            }
            Self::MaybeNumbers(cells) => match field {
                Field::Depth => cells.extend(rows.map(|row| row.depth)),
                Field::Force => cells.extend(rows.map(|row| row.force)),
                Field::Extra(one) => {
                    let values = &layout.extra.columns[one].2;
                    let of = |number: &u64| *values.get(*number as usize)?;
                    cells.extend(samples.numbers.iter().map(of));
                }
                Field::Sensor(one) => {
                    let sensor = &layout.extra.sensors[one];
                    cells.extend(samples.numbers.iter().map(|number| sensor.value(*number)));
                }
                _ => cells.extend(rows.map(|row| row.volts)),
            },
            Self::MaybeWide(cells) => match field {
                // A delay never reaches i64::MAX ns, 292 years.
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

#[cfg(test)]
mod sensor_tests {
    use super::*;
    use palpate_model::Nanos;
    use palpate_model::rig::{RigDescription, RigSensors, SensorChannel};

    #[test]
    fn a_sensor_has_its_newest_value_at_each_sample() {
        let channel =
            |name: &str, unit: &str| SensorChannel { name: name.into(), unit: unit.into() };
        let channels = vec![channel("room.temperature", "°C"), channel("camera.frame", "1")];
        let rig: RigDescription = serde_json::from_value(serde_json::json!({
            "name": "a", "identity": "a", "settings": {}, "mm_per_pulse": 0.01, "travel": 1.0, "tick_nanos": 1,
            "speed_quantum": 0.01, "speed_max": 1.0, "acceleration": 1.0, "adc": null, "noise_expected": 0.0,
        }))
        .unwrap();
        let sensors = RigSensors { channels, ..RigSensors::default() };
        let manifest =
            Manifest { rig: Some(RigDescription { sensors, ..rig }), ..Manifest::default() };
        let entry = |after_sample, value: SensorReading| LogEntry {
            kind: EntryKind::Input,
            order: 0,
            after_sample,
            now: Nanos::ZERO,
            body: serde_json::json!({ "input": "sensor", "value": value }),
        };
        let channel = |number, value| SensorReading::Channel { number, value, age: Nanos(7) };
        let entries = [
            entry(2, channel(1, 21.5)),
            entry(2, SensorReading::Bath { celsius: 37.0 }),
            entry(4, channel(2, 1.0)),
            entry(5, channel(1, 21.6)),
            entry(5, channel(1, 21.7)),
        ];
        let columns = ExtraColumns::of_sensors(&manifest, &entries).sensors;
        assert_eq!([&*columns[0].name, &*columns[1].name], ["room.temperature_°C", "camera.frame"]);
        let values = |column: &SensorColumn| [0, 1, 2, 4, 5, 9].map(|sample| column.value(sample));
        let (a, b) = (Some(21.5), Some(21.7));
        assert_eq!(values(&columns[0]), [None, None, a, a, b, b]);
        assert_eq!(values(&columns[1]), [None, None, None, Some(1.0), Some(1.0), Some(1.0)]);
        assert!(ExtraColumns::of_sensors(&Manifest::default(), &entries).sensors.is_empty());
    }
}
