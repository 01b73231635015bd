//! The canonical columns of every export.

use crate::log::Session;
use polars::prelude::{Column, DataFrame, NamedFrom, PolarsResult, Series};

/// Name and unit of every column, in order. `1` is a plain count.
pub const COLUMNS: [(&str, &str); 8] = [
    ("t_s", "s"),
    ("depth_mm", "mm"),
    ("force_N", "N"),
    ("signal_V", "V"),
    ("counts", "1"),
    ("pulses", "1"),
    ("phase", ""),
    ("cycle", "1"),
];

/// Columns that stand beside the session's own, such as corrected depths.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Beside {
    /// Name, unit and values, one for each sample and none where it is not known.
    pub columns: Vec<(&'static str, &'static str, Vec<Option<f64>>)>,
    /// What a reader must know of them: keys and texts of a Parquet file's metadata.
    pub metadata: Vec<(String, String)>,
}

/// The samples as a frame: `t_s` is controller time since the first sample in true seconds, depth
/// is null before contact is known, force before tare, counts on a rig without a converter,
/// signal and pulses in an imported session.
pub(super) fn frame(session: &Session, beside: &Beside) -> PolarsResult<DataFrame> {
    let rows = &session.rows;
    let first_tick = rows.first().map_or(0, |row| row.tick);
    // A controller that restarted counts from zero again: its time is negative, not a failure.
    let t: Vec<f64> = rows
        .iter()
        .map(|row| {
            let ticks = row.tick.wrapping_sub(first_tick) as i64;
            session.manifest.time_of(ticks).0
        })
        .collect();
    let depth: Vec<Option<f64>> = rows.iter().map(|row| row.depth).collect();
    let force: Vec<Option<f64>> = rows.iter().map(|row| row.force).collect();
    let signal: Vec<Option<f64>> = rows.iter().map(|row| row.volts).collect();
    let counts: Vec<Option<i32>> = rows.iter().map(|row| row.counts).collect();
    let pulses: Vec<Option<i64>> = rows.iter().map(|row| row.pulses).collect();
    let phase: Vec<&str> = rows.iter().map(|row| row.phase.name()).collect();
    let cycle: Vec<u32> = rows.iter().map(|row| row.cycle).collect();
    let [
        n_t,
        n_depth,
        n_force,
        n_signal,
        n_counts,
        n_pulses,
        n_phase,
        n_cycle,
    ] = COLUMNS.map(|(name, _)| name.into());
    let own = [
        Series::new(n_t, t),
        Series::new(n_depth, depth),
        Series::new(n_force, force),
        Series::new(n_signal, signal),
        Series::new(n_counts, counts),
        Series::new(n_pulses, pulses),
        Series::new(n_phase, phase),
        Series::new(n_cycle, cycle),
    ];
    let more = beside.columns.iter();
    let more = more.map(|(name, _, values)| Series::new((*name).into(), values));
    let columns: Vec<Column> = own.into_iter().chain(more).map(Column::from).collect();
    DataFrame::new(rows.len(), columns)
}
