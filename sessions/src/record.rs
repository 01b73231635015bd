//! What a session holds, row by row and entry by entry. Samples are stored in [`Block`](crate::block::Block)s.

use palpate_model::Nanos;
use palpate_model::rig::{Age, Phase};
use serde::{Deserialize, Serialize};

/// One sample: raw as reported, and derived as shown to the operator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Controller clock, in its own counts; picoseconds since the first sample of an imported session.
    pub tick: u64,
    /// Arrival on the host's clock.
    pub host: Nanos,
    /// How long before it arrived it was taken; `None` where the link does not tell.
    pub age: Option<Age>,
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
    /// What the run was doing.
    pub phase: Phase,
    /// Indentation cycle, from 1; 0 outside cycles.
    pub cycle: u32,
}

impl Row {
    /// The first value of this row that is not a number, named; `None` when all are.
    pub fn non_finite(&self) -> Option<&'static str> {
        if self.volts.is_some_and(|volts| !volts.is_finite()) {
            Some("signal")
        } else if self.force.is_some_and(|force| !force.is_finite()) {
            Some("force")
        } else if self.depth.is_some_and(|depth| !depth.is_finite()) {
            Some("depth")
        } else {
            None
        }
    }
}

/// Which stream an entry belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum EntryKind {
    /// Something the engine was given, other than a sample.
    Input,
    /// Something the engine decided.
    Decision,
    /// A fit made during or after the run.
    Fit,
}

/// One event of a session.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Which stream.
    pub kind: EntryKind,
    /// Place among all entries; strictly increasing.
    pub order: u64,
    /// How many samples the engine had seen.
    pub after_sample: u64,
    /// Session time of the event.
    pub now: Nanos,
    /// The event; its shape belongs to the crate that made it.
    pub body: serde_json::Value,
}

/// How a session ended. A session without it was interrupted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EndRecord {
    /// The way out, such as `finished` or `aborted`.
    pub outcome: String,
    /// Why, in one sentence.
    pub reason: String,
    /// Samples in the session; set by the writer.
    pub samples: u64,
    /// Entries in the session; set by the writer.
    pub entries: u64,
    /// Raw bytes in the session; set by the writer.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub raw_bytes: u64,
    /// Session time of the end.
    pub ended_at: Nanos,
    /// Seconds spent per activity, in the order they are shown.
    pub time_use: Vec<(String, f64)>,
}

/// Whether a count says nothing, so that it is left out.
pub(crate) fn is_zero(count: &u64) -> bool {
    *count == 0
}

/// An [`Entry`] as JSON; its kind is the channel it is on.
#[derive(Serialize, Deserialize)]
pub(crate) struct EntryMessage<B> {
    pub order: u64,
    pub after_sample: u64,
    pub now_ns: u64,
    /// A JSON value, or one that is borrowed to be written.
    pub body: B,
}

/// One of the thinned samples; what is not known is left out.
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
