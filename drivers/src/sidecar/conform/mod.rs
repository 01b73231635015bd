//! Conformance of a sidecar with the protocol, and what it may be trusted with.
//!
//! [`run`] talks to the sidecar over a link of its own and measures: answers, samples, clock, nonsense, motion, stop,
//! silence, lost link, restart. Each [`Check`] has what was measured, its limit, and a verdict. `checks.rs` has the
//! checks at rest, `motions.rs` those that move the axis, `talk.rs` the link.

mod checks;
mod motions;
mod talk;
mod trust;

pub use trust::{SpeedTrust, speed_for_overtravel};

use super::description::SidecarDescription;
use crate::text::DeviceError;
use crate::wire::{HostClock, Link, WireError};
use palpate_model::Nanos;
use serde::Serialize;
use talk::Talk;
use thiserror::Error;

/// What the suite needs of its surroundings.
pub struct ConformBench<'a> {
    /// Opens the link to the sidecar; a program is started again each time.
    pub open: &'a mut dyn FnMut() -> Result<Box<dyn Link>, WireError>,
    pub clock: HostClock,
    /// Lets time pass while there is no link.
    pub wait: &'a dyn Fn(Nanos),
    /// Called with the name of each check before it begins.
    pub progress: &'a mut dyn FnMut(&str),
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConformOptions {
    /// The axis may move so far from where it stands, in mm: positive into the specimen, negative away from it. `None`
    /// where it must not move.
    pub range_mm: Option<f64>,
    /// Samples are watched for so long.
    pub watch: Nanos,
    /// Way that the axis may go beyond an interlock, in mm: the largest speed follows from it.
    pub overtravel_mm: f64,
}

impl Default for ConformOptions {
    fn default() -> Self {
        Self { range_mm: None, watch: Nanos::from_millis(10_000), overtravel_mm: 0.5 }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    Pass,
    Fail,
    /// It was not measured.
    Skipped,
}

/// One check of the suite.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Check {
    pub name: &'static str,
    /// What was measured, in words.
    pub what: String,
    /// In `unit`; `None` where it was not measured.
    pub measured: Option<f64>,
    /// Largest value that passes, if there is one.
    pub limit: Option<f64>,
    pub unit: &'static str,
    pub verdict: Verdict,
    /// Whether the axis is unsafe when it fails.
    pub is_safety: bool,
}

impl Check {
    /// Passes where it is at most the limit.
    fn at_most(
        name: &'static str,
        what: impl Into<String>,
        measured: f64,
        limit: f64,
        unit: &'static str,
    ) -> Self {
        // A measurement that is no number fails.
        let verdict = if measured <= limit { Verdict::Pass } else { Verdict::Fail };
        let (measured, limit) = (Some(measured).filter(|m| m.is_finite()), Some(limit));
        Self { name, what: what.into(), measured, limit, unit, verdict, is_safety: false }
    }

    fn of(name: &'static str, what: impl Into<String>, is_right: bool) -> Self {
        let verdict = if is_right { Verdict::Pass } else { Verdict::Fail };
        Self {
            name,
            what: what.into(),
            measured: None,
            limit: None,
            unit: "",
            verdict,
            is_safety: false,
        }
    }

    fn skipped(name: &'static str, why: impl Into<String>) -> Self {
        Self { verdict: Verdict::Skipped, ..Self::of(name, why, true) }
    }

    fn safety(self) -> Self {
        Self { is_safety: true, ..self }
    }
}

/// The result of the suite.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConformReport {
    pub device: String,
    pub checks: Vec<Check>,
    /// What follows for the speed; `None` without an axis that was moved.
    pub trust: Option<SpeedTrust>,
}

impl ConformReport {
    /// Whether nothing failed.
    #[must_use]
    pub fn is_conform(&self) -> bool {
        self.checks.iter().all(|check| check.verdict != Verdict::Fail)
    }

    /// Whether a check failed on which the safety of the axis depends.
    #[must_use]
    pub fn is_unsafe(&self) -> bool {
        self.checks.iter().any(|check| check.verdict == Verdict::Fail && check.is_safety)
    }
}

#[derive(Clone, Debug, PartialEq, Error)]
pub enum ConformError {
    #[error(transparent)]
    Wire(#[from] WireError),
    #[error(transparent)]
    Device(#[from] DeviceError),
    #[error(
        "the link to the sidecar was lost during the check '{check}' ({detail}); correct the sidecar and run the suite again"
    )]
    Lost { check: &'static str, detail: String },
}

/// What was measured that the largest speed depends on.
#[derive(Clone, Copy, Debug, Default)]
struct Measured {
    /// Longest time from a line to its answer.
    answer_max: Nanos,
    /// Longest time from a sample to its arrival, beyond the shortest.
    late_max: Nanos,
    /// Half of the shortest time there and back.
    way_min: Nanos,
}

/// Runs the whole suite.
pub fn run(
    bench: &mut ConformBench<'_>,
    options: &ConformOptions,
) -> Result<ConformReport, ConformError> {
    let mut checks = Vec::new();
    let mut measured = Measured::default();
    (bench.progress)("introduction");
    let link = (bench.open)()?;
    let mut talk = Talk::begin(link, &bench.clock);
    checks.push(checks::hello_first(&mut talk)?);
    let about = talk.introduce()?;
    checks.push(Check::of("introduction", about.identity(), true));
    (bench.progress)("answers");
    checks.extend(checks::answers(&mut talk, &mut measured)?);
    (bench.progress)("samples and clock");
    checks.extend(checks::samples(&mut talk, &about, options.watch, &mut measured)?);
    (bench.progress)("nonsense");
    checks.extend(checks::nonsense(&mut talk, &about)?);
    let trust = move_axis(bench, talk, &about, options, (&mut checks, &mut measured))?;
    let mut report = ConformReport { device: about.identity(), checks, trust: None };
    report.trust = trust.map(|trust| trust.unless(report.is_unsafe()));
    Ok(report)
}

/// The checks that move the axis, where that is allowed, and those that end the link.
fn move_axis(
    bench: &mut ConformBench<'_>,
    mut talk: Talk,
    about: &SidecarDescription,
    options: &ConformOptions,
    (checks, measured): (&mut Vec<Check>, &mut Measured),
) -> Result<Option<SpeedTrust>, ConformError> {
    let (Some(axis), Some(range)) = (about.axis, options.range_mm) else {
        let why = if about.axis.is_none() { "it has no axis" } else { "the axis must not move" };
        for name in motions::NAMES {
            checks.push(Check::skipped(name, why));
        }
        (bench.progress)("restart");
        drop(talk);
        checks.push(restart(bench, about)?);
        return Ok(None);
    };
    (bench.progress)("motion");
    let plan = motions::MotionPlan::new(about, axis, range);
    checks.extend(motions::refusals(&mut talk, &plan)?);
    checks.extend(motions::follow(&mut talk, &plan, about)?);
    (bench.progress)("stop");
    checks.extend(motions::stops(&mut talk, &plan, measured)?);
    (bench.progress)("nonsense in motion");
    checks.push(motions::nonsense(&mut talk, &plan)?);
    (bench.progress)("silence");
    checks.push(motions::silence(&mut talk, &plan)?);
    (bench.progress)("lost link");
    checks.extend(motions::lost_link(bench, talk, &plan)?);
    (bench.progress)("restart");
    checks.push(restart(bench, about)?);
    Ok(Some(trust::of(about, axis, measured, options.overtravel_mm)))
}

/// After its link was closed a program is another process; a board may go on. Both introduce themselves again.
fn restart(
    bench: &mut ConformBench<'_>,
    about: &SidecarDescription,
) -> Result<Check, ConformError> {
    let link = (bench.open)()?;
    let is_program = link.is_program();
    let mut talk = Talk::begin(link, &bench.clock);
    let again = talk.introduce()?;
    let has_new_boot = again.boot != about.boot;
    let what = match (has_new_boot, is_program) {
        (true, _) => "it introduces itself again, with another boot number",
        (false, false) => "it introduces itself again; it was not restarted",
        (false, true) => "the program was started again, but its boot number is the same",
    };
    let is_same = (&again.name, &again.serial) == (&about.name, &about.serial);
    Ok(Check::of("restart", what, is_same && (has_new_boot || !is_program)).safety())
}
