//! The data keys of samples.

use super::super::columns::{ColumnInfo, Layout};
use super::super::select::Picker;
use super::super::{ExportError, ExtraColumns, RowFeed, TableExport};
use super::stream::{append, write_number};
use palpate_model::rig::Phase;
use palpate_sessions::manifest::Manifest;
use palpate_sessions::record::SampleRow;
use serde_json::{Value, json};

/// The devices of a run, in Bluesky's sense: objects that readings come from.
pub(super) const STAGE: &str = "stage";
pub(super) const CELL: &str = "cell";
pub(super) const PROBE: &str = "probe";
const RUN: &str = "run";

palpate_model::named! {
    /// A column of the samples' table that is a data key.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub(super) enum SampleKey {
        Time = "t_s",
        Depth = "depth_mm",
        Pulses = "pulses",
        Force = "force_N",
        Signal = "signal_V",
        Counts = "counts",
        Phase = "phase",
        Cycle = "cycle",
        Sample = "sample",
    }
}

impl SampleKey {
    /// The device that it belongs to.
    pub const fn device(self) -> &'static str {
        match self {
            Self::Depth | Self::Pulses => STAGE,
            Self::Force | Self::Signal | Self::Counts => CELL,
            Self::Time | Self::Phase | Self::Cycle | Self::Sample => RUN,
        }
    }

    const fn is_known(self, row: &SampleRow) -> bool {
        match self {
            Self::Depth => row.depth.is_some(),
            Self::Pulses => row.pulses.is_some(),
            Self::Force => row.force.is_some(),
            Self::Signal => row.volts.is_some(),
            Self::Counts => row.counts.is_some(),
            Self::Time | Self::Phase | Self::Cycle | Self::Sample => true,
        }
    }

    /// Appends the value of a sample. An unknown one is `NaN`.
    pub fn write(self, text: &mut String, number: u64, t_s: f64, row: &SampleRow) {
        let double = |text, value: Option<f64>| write_number(text, value.unwrap_or(f64::NAN));
        let whole = |text, value: Option<i64>| match value {
            Some(value) => append(text, format_args!("{value}")),
            None => write_number(text, f64::NAN),
        };
        match self {
            Self::Time => write_number(text, t_s),
            Self::Depth => double(text, row.depth),
            Self::Pulses => whole(text, row.pulses),
            Self::Force => double(text, row.force),
            Self::Signal => double(text, row.volts),
            Self::Counts => whole(text, row.counts.map(i64::from)),
            Self::Phase => append(text, format_args!("\"{}\"", row.phase.name())),
            Self::Cycle => append(text, format_args!("{}", row.cycle)),
            Self::Sample => append(text, format_args!("{number}")),
        }
    }

    /// Its description for readers, of the type that its values have.
    pub fn describe(self, manifest: &Manifest, knowledge: Knowledge) -> Value {
        let one = self.column(manifest);
        let (dtype, numpy) = match one.as_ref().map_or("", |one| one.kind) {
            "text" => ("string", format!("<U{}", longest_phase())),
            // NaN is no whole number.
            "whole number" if knowledge == Knowledge::Whole => ("integer", "<i8".into()),
            _ => ("number", "<f8".into()),
        };
        let origin = manifest.rig.as_ref().map_or("import", |rig| rig.name.as_str());
        let mut key = json!({ "dtype": dtype, "dtype_numpy": numpy, "shape": [], "object_name": self.device(),
            "source": format!("{origin}:{}:{}", self.device(), self.name()),
        });
        if let Some(one) = one {
            key["meaning"] = one.meaning.into();
            key["origin"] = one.how.into();
            if !one.unit.is_empty() {
                key["units"] = one.unit.as_ref().into();
            }
        }
        if let Some(digits) = self.precision(manifest) {
            key["precision"] = digits.into();
        }
        if self == Self::Phase {
            key["choices"] = Phase::ALL.map(Phase::name).to_vec().into();
        }
        key
    }

    fn column(self, manifest: &Manifest) -> Option<ColumnInfo> {
        let (extra, names) = (ExtraColumns::default(), [self.name().to_owned()]);
        Layout::new(manifest, &extra, &names, 1).ok()?.columns.pop()
    }

    /// Digits behind the point that show a step of the value.
    fn precision(self, manifest: &Manifest) -> Option<u32> {
        let step = match self {
            Self::Depth => manifest.rig.as_ref()?.mm_per_pulse,
            Self::Signal => manifest.signal.as_ref()?.resolution_v?,
            _ => return None,
        };
        let is_step = step.is_finite() && step > 0.0;
        is_step.then(|| (-step.log10()).ceil().max(0.0) as u32)
    }
}

fn longest_phase() -> usize {
    Phase::ALL.iter().map(|phase| phase.name().len()).max().unwrap_or(0)
}

/// For how many of the samples a value is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Knowledge {
    /// All.
    Whole,
    /// Some.
    Part,
}

/// What a first reading of the samples finds.
#[derive(Clone, Debug, Default)]
pub(super) struct Survey {
    /// Samples of the session, and those of them that are selected.
    pub seen: u64,
    pub selected: u64,
    /// For how many of the selected samples each key is known, as [`SampleKey::ALL`].
    known: [u64; SampleKey::ALL.len()],
    /// Session time of the last sample, in ns.
    pub last_ns: u64,
}

impl Survey {
    pub fn of(table: &TableExport, feed: RowFeed) -> Result<Self, ExportError> {
        let mut survey = Self::default();
        let mut picker = Picker::new(table.manifest, table.selection);
        feed(&mut |rows| {
            for row in rows {
                survey.last_ns = row.host.0;
                if picker.pick(row).is_some() {
                    survey.selected += 1;
                    for (count, key) in survey.known.iter_mut().zip(SampleKey::ALL) {
                        *count += u64::from(key.is_known(row));
                    }
                }
            }
        })?;
        survey.seen = picker.seen();
        Ok(survey)
    }

    /// The keys without those of which nothing is known.
    pub fn keys(&self) -> Vec<(SampleKey, Knowledge)> {
        let all = SampleKey::ALL.into_iter().zip(self.known);
        all.filter_map(|(key, known)| match known {
            all if all == self.selected => Some((key, Knowledge::Whole)),
            0 => None,
            _ => Some((key, Knowledge::Part)),
        })
        .collect()
    }
}
