//! Samples of a lake: their columns, and conversion back to rows.

use palpate_model::Nanos;
use palpate_model::rig::Phase;
use palpate_sessions::record::SampleRow;
use polars_core::prelude::{DataFrame, PolarsError, PolarsResult};

/// Columns of the samples: everything in a [`SampleRow`] except the age.
pub(super) const SAMPLE_COLUMNS: [&str; 12] = [
    "session_id",
    "t_s",
    "depth_mm",
    "force_N",
    "signal_V",
    "counts",
    "pulses",
    "phase",
    "cycle",
    "tick",
    "host_ns",
    "status",
];

fn missing(what: &str) -> PolarsError {
    PolarsError::ComputeError(format!("a row has no {what}").into())
}

pub(super) fn rows(frame: &DataFrame) -> PolarsResult<Vec<SampleRow>> {
    let column = |name: &str| frame.column(name);
    let (tick, host) = (column("tick")?.u64()?, column("host_ns")?.u64()?);
    let (counts, volts) = (column("counts")?.i32()?, column("signal_V")?.f64()?);
    let (pulses, status) = (column("pulses")?.i64()?, column("status")?.u32()?);
    let (force, depth) = (column("force_N")?.f64()?, column("depth_mm")?.f64()?);
    let (phase, cycle) = (column("phase")?.str()?, column("cycle")?.u32()?);
    let mut rows = Vec::with_capacity(frame.height());
    let known = tick.iter().zip(host.iter()).zip(status.iter());
    let known = known.zip(phase.iter()).zip(cycle.iter());
    let optional = counts.iter().zip(volts.iter()).zip(pulses.iter());
    let optional = optional.zip(force.iter()).zip(depth.iter());
    for (known, optional) in known.zip(optional) {
        let ((((tick, host), status), phase), cycle) = known;
        let ((((counts, volts), pulses), force), depth) = optional;
        let phase = phase.ok_or_else(|| missing("phase"))?;
        let found = Phase::ALL.iter().find(|known| known.name() == phase);
        rows.push(SampleRow {
            tick: tick.ok_or_else(|| missing("tick"))?,
            host: Nanos(host.ok_or_else(|| missing("host_ns"))?),
            age: None,
            counts,
            volts,
            pulses,
            status: status.ok_or_else(|| missing("status"))?,
            force,
            depth,
            phase: *found.ok_or_else(|| {
                PolarsError::ComputeError(format!("phase {phase:?} is unknown").into())
            })?,
            cycle: cycle.ok_or_else(|| missing("cycle"))?,
        });
    }
    match rows.iter().find_map(SampleRow::non_finite) {
        Some(what) => {
            Err(PolarsError::ComputeError(format!("the {what} of a sample is not a number").into()))
        }
        None => Ok(rows),
    }
}
