//! Samples and entries of a session. Samples are stored in [`Block`](crate::block::Block)s.

use palpate_model::Nanos;
use palpate_model::rig::{Phase, SampleAge};
use serde::{Deserialize, Serialize};

/// One sample: raw values as reported, and values derived from them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SampleRow {
    /// Controller clock in its own counts; in an imported session, picoseconds since the first sample.
    pub tick: u64,
    /// Session time of arrival at the host.
    pub host: Nanos,
    /// Delay from acquisition to arrival; `None` if the link does not measure it.
    pub age: Option<SampleAge>,
    /// Converter counts; `None` on a rig without a converter.
    pub counts: Option<i32>,
    /// Load-cell signal in V, as received; `None` in an imported session whose file had none.
    pub volts: Option<f64>,
    /// Commanded position in pulses; `None` in an imported session.
    pub pulses: Option<i64>,
    /// Bits of [`palpate_model::rig::AxisStatus`]; none in an imported session.
    pub status: u32,
    /// Force above tare in N; `None` before tare.
    pub force: Option<f64>,
    /// Depth below contact in mm; `None` before contact.
    pub depth: Option<f64>,
    pub phase: Phase,
    /// Indentation cycle, from 1; 0 outside cycles.
    pub cycle: u32,
}

impl SampleRow {
    /// Name of the first value that is not finite.
    pub fn non_finite(&self) -> Option<&'static str> {
        let values = [("signal", self.volts), ("force", self.force), ("depth", self.depth)];
        let is_bad = |(_, value): &(_, Option<f64>)| value.is_some_and(|value| !value.is_finite());
        values.into_iter().find(is_bad).map(|(name, _)| name)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EntryKind {
    /// Input of the engine other than a sample.
    Input,
    /// Decision of the engine.
    Decision,
    /// A fit made during or after the run.
    Fit,
}

#[derive(Clone, Debug, PartialEq)]
pub struct LogEntry {
    pub kind: EntryKind,
    /// Position among all entries; strictly increasing.
    pub order: u64,
    /// Number of samples before the event.
    pub after_sample: u64,
    pub now: Nanos,
    /// The event, in the format of the crate that made it.
    pub body: serde_json::Value,
}

/// End of a session. A session without it was interrupted.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EndRecord {
    /// Such as `finished` or `aborted`.
    pub outcome: String,
    pub reason: String,
    /// Set by the writer, like `entries` and `raw_bytes`.
    pub samples: u64,
    pub entries: u64,
    #[serde(default, skip_serializing_if = "is_zero")]
    pub raw_bytes: u64,
    pub ended_at: Nanos,
    /// Time per activity in s, in the order of display.
    pub time_use: Vec<(String, f64)>,
}

/// Condition for omitting a count from JSON.
pub(crate) fn is_zero(count: &u64) -> bool {
    *count == 0
}

/// An [`Entry`] as JSON; its kind is the channel it is on.
#[derive(Serialize, Deserialize)]
pub(crate) struct EntryMessage<B> {
    pub order: u64,
    pub after_sample: u64,
    pub now_ns: u64,
    /// A JSON value, owned or borrowed.
    pub body: B,
}

/// A sample of the thinned channel; unknown values are left out.
#[derive(Clone, PartialEq, prost::Message)]
pub(crate) struct View {
    #[prost(double, tag = "1")]
    pub t_s: f64,
    #[prost(double, optional, tag = "2")]
    pub signal_v: Option<f64>,
    #[prost(double, optional, tag = "3")]
    pub force_n: Option<f64>,
    #[prost(double, optional, tag = "4")]
    pub depth_mm: Option<f64>,
    #[prost(uint32, tag = "5")]
    pub cycle: u32,
}
