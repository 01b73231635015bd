//! Samples on disk, in pairs of Protocol Buffers messages: a [`DaqBlock`] of raw values and a [`DerivedBlock`] of values
//! computed from them. Every array has one element per sample; `counts`, `volts`, `pulses_delta` and the ages are empty
//! where the rig or the imported file has no such value.

use crate::packed::{Field, extend_doubles, extend_numbers, read_fields, zigzag};
use crate::record::SampleRow;
use palpate_model::Nanos;
use palpate_model::rig::{Phase, SampleAge};

/// Most samples in one block, so that a block and its decoded form stay small.
pub const BLOCK_ROWS_MAX: usize = 1 << 16;

const FORCE_VALID: u32 = 1;
const DEPTH_VALID: u32 = 1 << 1;

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
    #[prost(uint64, repeated, tag = "8")]
    pub age_ns: Vec<u64>,
    #[prost(uint64, repeated, tag = "9")]
    pub age_within_ns: Vec<u64>,
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

/// Presence of age, counts, volts and pulses.
fn present_values(row: &SampleRow) -> [bool; 4] {
    [row.age.is_some(), row.counts.is_some(), row.volts.is_some(), row.pulses.is_some()]
}

/// Splits rows where a block must end: at its size limit, and where optional values appear or vanish.
pub(crate) fn block_slices(rows: &[SampleRow]) -> impl Iterator<Item = &[SampleRow]> {
    rows.chunk_by(|a, b| present_values(a) == present_values(b))
        .flat_map(|rows| rows.chunks(BLOCK_ROWS_MAX))
}

/// The rows must all have the same optional values, as [`block_slices`] gives them.
pub(crate) fn blocks_from_rows(first_sample: u64, rows: &[SampleRow]) -> (DaqBlock, DerivedBlock) {
    let mut daq = DaqBlock { first_sample, ..DaqBlock::default() };
    let mut derived = DerivedBlock { first_sample, ..DerivedBlock::default() };
    let (mut tick, mut host, mut pulses) = (0u64, 0u64, 0i64);
    for row in rows {
        daq.tick_delta.push(row.tick.wrapping_sub(tick) as i64);
        daq.host_delta_ns.push(row.host.0.wrapping_sub(host) as i64);
        if let Some(to) = row.pulses {
            daq.pulses_delta.push(to.wrapping_sub(pulses));
            pulses = to;
        }
        (tick, host) = (row.tick, row.host.0);
        daq.age_ns.extend(row.age.map(|age| age.by.0));
        daq.age_within_ns.extend(row.age.map(|age| age.within.0));
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

fn age(daq: &DaqBlock, index: usize) -> Option<SampleAge> {
    Some(SampleAge {
        by: Nanos(*daq.age_ns.get(index)?),
        within: Nanos(*daq.age_within_ns.get(index)?),
    })
}

/// Size of the largest block: 68 bytes hold every value of a sample in its longest form.
const BLOCK_BYTES_MAX: usize = BLOCK_ROWS_MAX * 68;

/// A verified block of samples, column by column. Its memory is reused for the next block.
#[derive(Debug, Default)]
pub struct SampleBlock {
    // After `check`, the deltas are summed to absolute values.
    daq: DaqBlock,
    derived: DerivedBlock,
}

impl SampleBlock {
    /// Session-wide number of the first sample.
    pub fn first_sample(&self) -> u64 {
        self.daq.first_sample
    }

    pub fn len(&self) -> usize {
        self.daq.tick_delta.len()
    }

    pub fn is_empty(&self) -> bool {
        self.daq.tick_delta.is_empty()
    }

    /// Force above tare in N; 0 where [`SampleRow::force`] is `None`.
    pub fn force(&self) -> &[f64] {
        &self.derived.force_newtons
    }

    /// Session time of the last sample.
    pub fn last_time(&self) -> Option<Nanos> {
        self.daq.host_delta_ns.last().map(|ns| Nanos(*ns as u64))
    }

    /// Panics if `index` is out of range.
    pub fn row(&self, index: usize) -> SampleRow {
        let (daq, derived) = (&self.daq, &self.derived);
        let validity = derived.validity[index];
        SampleRow {
            tick: daq.tick_delta[index] as u64,
            host: Nanos(daq.host_delta_ns[index] as u64),
            age: age(daq, index),
            counts: daq.counts.get(index).copied(),
            volts: daq.volts.get(index).copied(),
            pulses: daq.pulses_delta.get(index).copied(),
            status: daq.status[index],
            force: (validity & FORCE_VALID != 0).then_some(derived.force_newtons[index]),
            depth: (validity & DEPTH_VALID != 0).then_some(derived.depth_mm[index]),
            // Checked when the block was read.
            phase: Phase::from_code(derived.phase[index]).unwrap_or(Phase::Idle),
            cycle: derived.cycle[index],
        }
    }

    pub fn rows(&self) -> impl Iterator<Item = SampleRow> {
        (0..self.len()).map(|index| self.row(index))
    }

    pub(crate) fn take_raw(&mut self, data: &[u8]) -> Result<(), String> {
        let daq = &mut self.daq;
        prost::Message::clear(daq);
        read_block(data, "samples", |number, field| match (number, field) {
            (1, Field::Number(value)) => {
                daq.first_sample = value;
                Ok(())
            }
            (2, Field::Bytes(bytes)) => extend_numbers(&mut daq.tick_delta, bytes, zigzag),
            (3, Field::Bytes(bytes)) => extend_numbers(&mut daq.host_delta_ns, bytes, zigzag),
            (4, Field::Bytes(bytes)) => {
                extend_numbers(&mut daq.counts, bytes, |value| zigzag(value) as i32)
            }
            (5, Field::Bytes(bytes)) => extend_doubles(&mut daq.volts, bytes),
            (6, Field::Bytes(bytes)) => extend_numbers(&mut daq.pulses_delta, bytes, zigzag),
            (7, Field::Bytes(bytes)) => extend_numbers(&mut daq.status, bytes, |it| it as u32),
            (8, Field::Bytes(bytes)) => extend_numbers(&mut daq.age_ns, bytes, |it| it),
            (9, Field::Bytes(bytes)) => extend_numbers(&mut daq.age_within_ns, bytes, |it| it),
            _ => Ok(()),
        })
    }

    /// Reads the derived half and checks the pair.
    pub(crate) fn take_derived(&mut self, data: &[u8]) -> Result<(), String> {
        let derived = &mut self.derived;
        prost::Message::clear(derived);
        read_block(data, "derived samples", |number, field| match (number, field) {
            (1, Field::Number(value)) => {
                derived.first_sample = value;
                Ok(())
            }
            (2, Field::Bytes(bytes)) => extend_doubles(&mut derived.force_newtons, bytes),
            (3, Field::Bytes(bytes)) => extend_doubles(&mut derived.depth_mm, bytes),
            (4, Field::Bytes(bytes)) => {
                extend_numbers(&mut derived.validity, bytes, |it| it as u32)
            }
            (5, Field::Bytes(bytes)) => extend_numbers(&mut derived.phase, bytes, |it| it as u32),
            (6, Field::Bytes(bytes)) => extend_numbers(&mut derived.cycle, bytes, |it| it as u32),
            _ => Ok(()),
        })?;
        self.check()
    }

    fn check(&mut self) -> Result<(), String> {
        let (daq, derived) = (&mut self.daq, &self.derived);
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
        let optional = [
            daq.counts.len(),
            daq.volts.len(),
            daq.pulses_delta.len(),
            daq.age_ns.len(),
            daq.age_within_ns.len(),
        ];
        let is_odd = |length: &usize| *length > 0 && *length != count;
        if lengths.iter().any(|&length| length != count) || optional.iter().any(is_odd) {
            return Err("the columns of a sample block differ in length".into());
        }
        if count > BLOCK_ROWS_MAX {
            return Err(format!(
                "a sample block holds {count} samples, more than {BLOCK_ROWS_MAX}"
            ));
        }
        if derived.first_sample != daq.first_sample {
            return Err("raw and derived samples are numbered differently".into());
        }
        let known = FORCE_VALID | DEPTH_VALID;
        if let Some(bits) = derived.validity.iter().find(|bits| **bits & !known != 0) {
            return Err(format!("validity bits {bits:#x} are unknown"));
        }
        let is_unknown = |code: &&u32| Phase::from_code(**code).is_none();
        if let Some(code) = derived.phase.iter().find(is_unknown) {
            return Err(format!("phase code {code} is unknown"));
        }
        let columns = [
            ("signal", &daq.volts),
            ("force", &derived.force_newtons),
            ("depth", &derived.depth_mm),
        ];
        for (name, column) in columns {
            // Without an early exit the compiler vectorises the loop.
            if !column.iter().fold(true, |all, x| all & x.is_finite()) {
                return Err(format!("the {name} of a sample is not a number"));
            }
        }
        for column in [&mut daq.tick_delta, &mut daq.host_delta_ns, &mut daq.pulses_delta] {
            let mut sum = 0i64;
            for value in column {
                sum = sum.wrapping_add(*value);
                *value = sum;
            }
        }
        Ok(())
    }
}

fn read_block<'a>(
    data: &'a [u8],
    what: &str,
    take: impl FnMut(u32, Field<'a>) -> Result<(), String>,
) -> Result<(), String> {
    if data.len() > BLOCK_BYTES_MAX {
        let count = data.len();
        return Err(format!("a block of {what} has {count} bytes, more than {BLOCK_BYTES_MAX}"));
    }
    read_fields(data, what, take)
}

#[cfg(test)]
mod tests {
    use super::*;
    use prost::Message;

    fn row(tick: u64, counts: Option<i32>) -> SampleRow {
        SampleRow {
            tick,
            host: Nanos(u64::MAX - tick),
            age: None,
            counts,
            volts: Some(0.1 + tick as f64 * 1e-17),
            pulses: Some(i64::MIN.wrapping_add(tick as i64)),
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
            SampleRow { volts: None, ..row(12, Some(0)) },
            SampleRow { pulses: None, ..row(13, Some(1)) },
            SampleRow {
                age: Some(SampleAge { by: Nanos(u64::MAX), within: Nanos(1) }),
                ..row(14, Some(2))
            },
            SampleRow {
                age: Some(SampleAge { by: Nanos(0), within: Nanos(u64::MAX) }),
                ..row(15, Some(2))
            },
        ];
        let mut back = Vec::new();
        let mut first = 0;
        for slice in block_slices(&rows) {
            let (daq, derived) = blocks_from_rows(first, slice);
            let mut block = SampleBlock::default();
            (block.daq, block.derived) = (daq, derived);
            block.check().unwrap();
            back.extend(block.rows());
            first += slice.len() as u64;
        }
        assert_eq!(back, rows);
        let sign = back[1].force.unwrap().is_sign_negative();
        assert!(sign, "minus zero lost its sign");
    }

    #[test]
    fn blocks_are_read_as_the_general_decoder_reads_them() {
        let rows: Vec<SampleRow> = (0..1000u64)
            .map(|i| row(i.wrapping_pow(9) >> (i % 60), Some((i * i) as i32 - 7)))
            .collect();
        let (daq, derived) = blocks_from_rows(3, &rows);
        let mut ours = SampleBlock::default();
        ours.take_raw(&daq.encode_to_vec()).unwrap();
        assert_eq!(ours.daq, DaqBlock::decode(&*daq.encode_to_vec()).unwrap());
        ours.take_derived(&derived.encode_to_vec()).unwrap();
        assert_eq!(ours.derived, derived);
        // Cut anywhere, both refuse or both read the same.
        let bytes = daq.encode_to_vec();
        for length in 0..bytes.len() {
            let theirs = DaqBlock::decode(&bytes[..length]);
            let outcome = ours.take_raw(&bytes[..length]);
            assert_eq!(outcome.is_ok(), theirs.is_ok(), "{length}");
            if let Ok(theirs) = theirs {
                assert_eq!(ours.daq, theirs);
            }
        }
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
            let refusal = SampleBlock { daq, derived }.check().unwrap_err();
            assert!(refusal.contains(expected), "{refusal}");
        }
    }
}
