//! The measured trade: error against time on this machine, one table to a file.
//!
//! Errors are computed, the same on every machine up to the last digits; times are measured. What
//! follows from both is in [`palpate_rheology::trade`].

mod families;
mod fit;
mod integrators;
mod live;
mod paths;
mod picture;
#[cfg(feature = "haptics")]
mod scene;
pub mod stored;
pub mod text;
mod timing;

pub use picture::svg;
#[cfg(feature = "haptics")]
pub use scene::{SCENE_PEAK, SCENE_SIDE_MM, SCENE_SLOPE, measure_scene};
pub use text::text;

use crate::progress::Progress;
use chrono::{DateTime, SecondsFormat, Utc};
use palpate_rheology::trade::{Machine, MeasuredCost, TRADE_FORMAT, TradeCurves};
use palpate_runner::wall_now;
use std::ops::ControlFlow;
use timing::Job;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TradeExtent {
    /// Every row, long enough for times that can be repeated.
    Full,
    /// A few rows, briefly.
    Quick,
}

impl TradeExtent {
    fn choose<T>(self, full: T, quick: T) -> T {
        if self == Self::Full { full } else { quick }
    }
}

/// Tables whose errors [`errors`] computes.
const TABLES: usize = 4;
/// Placeholder for a time that is not measured yet.
const UNMEASURED: MeasuredCost = MeasuredCost { ns: 0.0, spread: 0.0, halves: 0.0 };

/// All rows, computed, timed and marked; none if `progress` ended it.
pub fn measure(
    extent: TradeExtent,
    progress: &dyn Progress,
) -> Result<Option<TradeCurves>, String> {
    let total = TABLES + timing::rounds(extent);
    let of_errors = |done: usize, _: usize, what: &str| progress.report(done, total, what);
    let Some(curves) = errors(extent, &of_errors)? else { return Ok(None) };
    let mut done = TABLES;
    times(curves, extent, &mut || {
        done += 1;
        progress.report(done, total, "times")
    })
}

/// All rows with their errors and without times: what [`TradeCurves::agrees_with`] compares. None if
/// `progress` ended it.
pub fn errors(extent: TradeExtent, progress: &dyn Progress) -> Result<Option<TradeCurves>, String> {
    let paths = paths::ReferencePaths::new()?;
    // Seeds of the noise in the fits: the first, and how many.
    let seeds = extent.choose([1, 8], [1, 2]);
    let next = |done: usize, what: &str| progress.report(done, TABLES, what).continue_value();
    let Some(()) = next(0, "errors of the integrators") else { return Ok(None) };
    let integrators = integrators::rows(extent, &paths)?;
    let Some(()) = next(1, "errors of the families") else { return Ok(None) };
    let families = families::rows(extent, &paths)?;
    let Some(()) = next(2, "errors of the fit") else { return Ok(None) };
    let fit = fit::rows(extent, seeds, &paths)?;
    let Some(()) = next(3, "errors of the live fit") else { return Ok(None) };
    let live = live::rows(&paths)?;
    let now: DateTime<Utc> = wall_now().into();
    Ok(Some(TradeCurves {
        format: TRADE_FORMAT,
        version: version().into(),
        machine: this_machine(),
        measured_at: now.to_rfc3339_opts(SecondsFormat::Secs, true),
        quick: extent == TradeExtent::Quick,
        peak: paths.peak(),
        seeds,
        integrators,
        families,
        fit,
        live,
    }))
}

/// Measures the times of all rows; `step` hears of each round done and may end the whole.
fn times(
    mut curves: TradeCurves,
    extent: TradeExtent,
    step: &mut dyn FnMut() -> ControlFlow<()>,
) -> Result<Option<TradeCurves>, String> {
    let paths = paths::ReferencePaths::new()?;
    let mut jobs: Vec<Job> = Vec::new();
    jobs.extend(integrators::jobs());
    jobs.extend(families::jobs(&curves.families)?);
    jobs.extend(fit::jobs(&curves.fit, curves.seeds[0], &paths)?);
    jobs.extend(live::jobs(&curves.live, &paths)?);
    let Some(costs) = timing::measure(&mut jobs, extent, step) else { return Ok(None) };
    let mut costs = costs.into_iter();
    let by_scheme: Vec<MeasuredCost> = costs.by_ref().take(integrators::JOBS).collect();
    for row in &mut curves.integrators {
        row.cost = by_scheme[integrators::job_of(row)];
        row.second_ns = row.cost.ns / row.step_s;
    }
    let rest = curves.families.iter_mut().map(|row| &mut row.cost);
    let rest = rest.chain(curves.fit.iter_mut().map(|row| &mut row.cost));
    let rest = rest.chain(curves.live.iter_mut().map(|row| &mut row.cost));
    rest.zip(costs).for_each(|(slot, cost)| *slot = cost);
    curves.mark_fronts();
    Ok(Some(curves))
}

/// Version of this program.
#[must_use]
pub fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}

/// Description of the machine this program runs on.
#[must_use]
pub fn this_machine() -> Machine {
    let described = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    Machine {
        cpu: cpu_name(&described).unwrap_or(std::env::consts::ARCH).into(),
        os: std::env::consts::OS.into(),
        cores: std::thread::available_parallelism().map_or(1, usize::from),
        profile: if cfg!(debug_assertions) { "debug".into() } else { "release".into() },
    }
}

/// The processor's name as Linux tells it; elsewhere there is no such text.
fn cpu_name(described: &str) -> Option<&str> {
    let line = described.lines().find(|line| line.starts_with("model name"))?;
    let name = line.split_once(':')?.1.trim();
    (!name.is_empty()).then_some(name)
}

/// Days since curves were measured; endless if their date cannot be read.
#[must_use]
pub fn age_days(curves: &TradeCurves) -> f64 {
    let now: DateTime<Utc> = wall_now().into();
    DateTime::parse_from_rfc3339(&curves.measured_at).map_or(f64::INFINITY, |then| {
        (now - then.with_timezone(&Utc)).num_seconds() as f64 / 86_400.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_the_processor_is_found_where_there_is_one() {
        let text = "processor\t: 0\nmodel name\t: Example(R) CPU\nflags\t: fpu\n";
        assert_eq!(cpu_name(text), Some("Example(R) CPU"));
        assert_eq!(cpu_name("processor\t: 0\n"), None);
        assert_eq!(cpu_name(""), None);
        assert!(this_machine().cores >= 1);
    }
}
