//! What a session holds, row by row and entry by entry, and its on-disk form.
//!
//! Samples are stored in pairs of Protocol Buffers messages: a [`DaqBlock`] with what the rig
//! reported and a [`DerivedBlock`] with what was made of it. Every array of a pair has one
//! element per sample, except that `counts` is empty on a rig without a converter, and `volts` and
//! `pulses_delta` are where an imported file has no such thing.

use palpate_model::Nanos;
use palpate_model::rig::Phase;
use serde::{Deserialize, Serialize};

/// Most samples in one block, so that a block and its decoded form stay small.
pub const BLOCK_ROWS_MAX: usize = 1 << 16;

const FORCE_VALID: u32 = 1;
const DEPTH_VALID: u32 = 1 << 1;

/// One sample: raw as reported, and derived as shown to the operator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Controller clock, in its own counts; picoseconds since the first sample of an imported session.
    pub tick: u64,
    /// Arrival on the host's clock.
    pub host: Nanos,
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
    #[must_use]
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
    /// Session time of the end.
    pub ended_at: Nanos,
    /// Seconds spent per activity, in the order they are shown.
    pub time_use: Vec<(String, f64)>,
}

/// An [`Entry`] to be written as JSON; its kind is the channel it is on.
#[derive(Serialize)]
pub(crate) struct EntryMessageRef<'a> {
    pub order: u64,
    pub after_sample: u64,
    pub now_ns: u64,
    pub body: &'a serde_json::Value,
}

/// An [`Entry`] as it is read back.
#[derive(Deserialize)]
pub(crate) struct EntryMessage {
    pub order: u64,
    pub after_sample: u64,
    pub now_ns: u64,
    pub body: serde_json::Value,
}

/// Raw samples. A delta is the difference to the previous sample, the first one to zero,
/// modulo 2^64.
#[derive(Clone, PartialEq, prost::Message)]
pub(crate) struct DaqBlock {
    #[prost(uint64, tag = "1")]
    pub first_sample: u64,
    #[prost(sint64, repeated, tag = "2")]
    pub tick_delta: Vec<i64>,
    #[prost(sint64, repeated, tag = "3")]
    pub host_delta_ns: Vec<i64>,
    #[prost(sint32, repeated, tag = "4")]
    pub counts: Vec<i32>,
    #[prost(double, repeated, tag = "5")]
    pub volts: Vec<f64>,
    #[prost(sint64, repeated, tag = "6")]
    pub pulses_delta: Vec<i64>,
    #[prost(uint32, repeated, tag = "7")]
    pub status: Vec<u32>,
}

/// Derived values of the same samples; where `validity` lacks a value's bit, it is 0.
#[derive(Clone, PartialEq, prost::Message)]
pub(crate) struct DerivedBlock {
    #[prost(uint64, tag = "1")]
    pub first_sample: u64,
    #[prost(double, repeated, tag = "2")]
    pub force_newtons: Vec<f64>,
    #[prost(double, repeated, tag = "3")]
    pub depth_mm: Vec<f64>,
    #[prost(uint32, repeated, tag = "4")]
    pub validity: Vec<u32>,
    #[prost(uint32, repeated, tag = "5")]
    pub phase: Vec<u32>,
    #[prost(uint32, repeated, tag = "6")]
    pub cycle: Vec<u32>,
}

/// Which of its optional values a row has: counts, volts and pulses.
fn held(row: &Row) -> [bool; 3] {
    [
        row.counts.is_some(),
        row.volts.is_some(),
        row.pulses.is_some(),
    ]
}

/// Cuts rows where a block must end: at its size limit, and where counts, volts or pulses appear or vanish.
pub(crate) fn block_slices(rows: &[Row]) -> impl Iterator<Item = &[Row]> {
    rows.chunk_by(|a, b| held(a) == held(b))
        .flat_map(|rows| rows.chunks(BLOCK_ROWS_MAX))
}

/// The pair of blocks of some rows that all have the same of their optional values.
pub(crate) fn blocks_from_rows(first_sample: u64, rows: &[Row]) -> (DaqBlock, DerivedBlock) {
    let mut daq = DaqBlock {
        first_sample,
        ..DaqBlock::default()
    };
    let mut derived = DerivedBlock {
        first_sample,
        ..DerivedBlock::default()
    };
    let (mut tick, mut host, mut pulses) = (0u64, 0u64, 0i64);
    for row in rows {
        daq.tick_delta.push(row.tick.wrapping_sub(tick) as i64);
        daq.host_delta_ns.push(row.host.0.wrapping_sub(host) as i64);
        if let Some(to) = row.pulses {
            daq.pulses_delta.push(to.wrapping_sub(pulses));
            pulses = to;
        }
        (tick, host) = (row.tick, row.host.0);
        daq.counts.extend(row.counts);
        daq.volts.extend(row.volts);
        daq.status.push(row.status);
        derived.force_newtons.push(row.force.unwrap_or(0.0));
        derived.depth_mm.push(row.depth.unwrap_or(0.0));
        let force_bit = row.force.map_or(0, |_| FORCE_VALID);
        let depth_bit = row.depth.map_or(0, |_| DEPTH_VALID);
        derived.validity.push(force_bit | depth_bit);
        derived.phase.push(row.phase.code());
        derived.cycle.push(row.cycle);
    }
    (daq, derived)
}

/// Appends the rows of a pair of blocks, or says what is wrong with the pair.
pub(crate) fn rows_from_blocks(
    daq: &DaqBlock,
    derived: &DerivedBlock,
    rows: &mut Vec<Row>,
) -> Result<(), String> {
    let count = daq.tick_delta.len();
    let lengths = [
        daq.host_delta_ns.len(),
        daq.status.len(),
        derived.force_newtons.len(),
        derived.depth_mm.len(),
        derived.validity.len(),
        derived.phase.len(),
        derived.cycle.len(),
    ];
    let optional = [daq.counts.len(), daq.volts.len(), daq.pulses_delta.len()];
    let [has_counts, has_volts, has_pulses] = optional.map(|length| length > 0);
    if lengths.iter().any(|&length| length != count)
        || optional.iter().any(|&length| length > 0 && length != count)
    {
        return Err("the columns of a sample block differ in length".into());
    }
    if count > BLOCK_ROWS_MAX {
        return Err(format!("a sample block holds {count} samples"));
    }
    if derived.first_sample != daq.first_sample {
        return Err("raw and derived samples are numbered differently".into());
    }
    let (mut tick, mut host, mut pulses) = (0u64, 0u64, 0i64);
    for i in 0..count {
        tick = tick.wrapping_add(daq.tick_delta[i] as u64);
        host = host.wrapping_add(daq.host_delta_ns[i] as u64);
        if has_pulses {
            pulses = pulses.wrapping_add(daq.pulses_delta[i]);
        }
        let validity = derived.validity[i];
        if validity & !(FORCE_VALID | DEPTH_VALID) != 0 {
            return Err(format!("validity bits {validity:#x} are unknown"));
        }
        let code = derived.phase[i];
        let row = Row {
            tick,
            host: Nanos(host),
            counts: has_counts.then(|| daq.counts[i]),
            volts: has_volts.then(|| daq.volts[i]),
            pulses: has_pulses.then_some(pulses),
            status: daq.status[i],
            force: (validity & FORCE_VALID != 0).then_some(derived.force_newtons[i]),
            depth: (validity & DEPTH_VALID != 0).then_some(derived.depth_mm[i]),
            phase: Phase::from_code(code).ok_or_else(|| format!("phase code {code} is unknown"))?,
            cycle: derived.cycle[i],
        };
        if let Some(name) = row.non_finite() {
            return Err(format!("the {name} of a sample is not a number"));
        }
        rows.push(row);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(tick: u64, counts: Option<i32>) -> Row {
        Row {
            tick,
            host: Nanos(u64::MAX - tick),
            counts,
            volts: (tick != 12).then_some(0.1 + tick as f64 * 1e-17),
            pulses: (tick != 13).then_some(i64::MIN.wrapping_add(tick as i64)),
            status: u32::MAX,
            force: tick.is_multiple_of(2).then_some(-0.0),
            depth: tick.is_multiple_of(3).then_some(f64::MIN_POSITIVE),
            phase: Phase::Hold,
            cycle: 3,
        }
    }

    #[test]
    fn blocks_keep_every_bit_at_the_edges_of_every_type() {
        let rows = [
            row(u64::MAX, None),
            row(0, None),
            row(7, Some(i32::MIN)),
            row(12, Some(0)),
            row(13, Some(1)),
            row(14, Some(2)),
        ];
        let mut back = Vec::new();
        let mut first = 0;
        for slice in block_slices(&rows) {
            let (daq, derived) = blocks_from_rows(first, slice);
            rows_from_blocks(&daq, &derived, &mut back).unwrap();
            first += slice.len() as u64;
        }
        assert_eq!(back, rows);
        let sign = back[1].force.unwrap().is_sign_negative();
        assert!(sign, "minus zero lost its sign");
    }

    #[test]
    fn inconsistent_blocks_are_refused() {
        let rows = [row(1, Some(2)), row(2, Some(3))];
        let (daq, derived) = blocks_from_rows(0, &rows);
        type Edit = fn(&mut DaqBlock, &mut DerivedBlock);
        let edits: [(Edit, &str); 8] = [
            (|_, derived| derived.phase[1] = 99, "phase code 99"),
            (|_, derived| derived.cycle.clear(), "length"),
            (|daq, _| daq.counts.truncate(1), "length"),
            (|daq, _| daq.volts.truncate(1), "length"),
            (|daq, _| daq.pulses_delta.truncate(1), "length"),
            (|daq, _| daq.volts[0] = f64::NAN, "signal"),
            (|_, derived| derived.validity[0] = 4, "validity"),
            (|_, derived| derived.first_sample = 1, "numbered"),
        ];
        for (edit, expected) in edits {
            let (mut daq, mut derived) = (daq.clone(), derived.clone());
            edit(&mut daq, &mut derived);
            let refusal = rows_from_blocks(&daq, &derived, &mut Vec::new()).unwrap_err();
            assert!(refusal.contains(expected), "{refusal}");
        }
    }
}
