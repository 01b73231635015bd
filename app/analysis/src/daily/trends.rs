//! Daily checks over time: what their sessions measured, control limits, and a warning before a check fails.

use super::{DailyCheckDeviation, records_of, weight_of, zero_of};
use crate::catalog_search::session_folders;
use crate::progress::Progress;
use crate::source::{calibration_of, decisions};
use palpate_model::control_chart::{ControlLimits, ControlSignal, READINGS_MIN};
use palpate_sessions::Session;
use palpate_sessions::checks::{DailyCheck, read_checks};
use std::path::Path;

/// A daily check with the deviations its session measured.
#[derive(Clone, Debug, PartialEq)]
pub struct PastCheck {
    pub check: DailyCheck,
    /// The empty cell, and the known weight; none where the session is not in the library or lacks the reading.
    pub zero: Option<DailyCheckDeviation>,
    pub weight: Option<DailyCheckDeviation>,
}

/// The newest checks of a rig, oldest first, so many at most, each with what its session in the library measured.
pub fn past_checks(
    library: &Path,
    rig: &str,
    most: usize,
    progress: &dyn Progress,
) -> Result<Vec<PastCheck>, String> {
    let mut checks = read_checks(library, rig).map_err(|err| err.to_string())?;
    if checks.is_empty() {
        return Ok(Vec::new());
    }
    let folders = session_folders(library, progress)?;
    let checks = checks.split_off(checks.len().saturating_sub(most));
    let count = checks.len();
    let mut past = Vec::with_capacity(count);
    for (done, check) in checks.into_iter().enumerate() {
        if progress.report(done, count, "reading the sessions of the daily checks").is_break() {
            // The newest come last: a part of them would be taken for all.
            return Err("cancelled".into());
        }
        let folder = folders.get(&check.session_id);
        let [zero, weight] = folder.map_or([None; 2], |folder| deviations(&library.join(folder)));
        past.push(PastCheck { check, zero, weight });
    }
    Ok(past)
}

/// Deviations of zero and weight in a session, as far as it can be read.
fn deviations(session: &Path) -> [Option<DailyCheckDeviation>; 2] {
    let read = || -> Option<_> {
        let session = Session::open(session).ok()?;
        Some((calibration_of(&session).ok()?, decisions(&session).ok()?))
    };
    let Some((calibration, decisions)) = read() else { return [None; 2] };
    let records = records_of(&decisions);
    let weight = weight_of(&calibration, &records).ok();
    [
        zero_of(&calibration, &records).ok().map(|(_, zero)| zero),
        weight.map(|weight| DailyCheckDeviation { newtons: weight.error_n, limit: weight.limit_n }),
    ]
}

/// Checks from which control limits are found: two months of working days.
pub const CONTROL_CHECKS: usize = 40;

/// Control limits of the deviations before the last, and what the last ones show; `None` of too few.
#[must_use]
pub fn control_limits(
    known: &[DailyCheckDeviation],
) -> Option<(ControlLimits, Option<ControlSignal>)> {
    let known = &known[known.len().saturating_sub(CONTROL_CHECKS)..];
    let readings: Vec<f64> = known.iter().map(|one| one.newtons).collect();
    let (_, before) = readings.split_last()?;
    let limits = ControlLimits::of(before)?;
    Some((limits, limits.signal(&readings)))
}

/// What a control chart shows, in one sentence, and whether it is to be looked at.
#[must_use]
pub fn control_sentence(found: Option<(ControlLimits, Option<ControlSignal>)>) -> (String, bool) {
    let Some((limits, signal)) = found else {
        let words = format!("control limits need {} checks or more", READINGS_MIN + 1);
        return (words, false);
    };
    let between = format!("the control limits of {:+.4} to {:+.4} N", limits.low, limits.high);
    let advice = "find out what changed, and calibrate the load cell again before it fails";
    let words = match signal {
        None => return (format!("steady within {between}"), false),
        Some(ControlSignal::Beyond) => format!("the last check is beyond {between}; {advice}"),
        Some(ControlSignal::NearLimit) => {
            format!("two of the last three checks are near one of {between}; {advice}")
        }
        Some(ControlSignal::Shift(count)) => {
            format!("the last {count} checks lie on one side of the mean of {between}; {advice}")
        }
        Some(ControlSignal::Trend(count)) => {
            format!("the last {count} checks move in one direction within {between}; {advice}")
        }
    };
    (words, true)
}

/// What the control charts of weight and zero show: a sentence each, and whether it is to be looked at.
#[must_use]
pub fn trends(past: &[PastCheck]) -> [(String, bool); 2] {
    let chart = |name: &str, measured: fn(&PastCheck) -> Option<DailyCheckDeviation>| {
        let readings: Vec<_> = past.iter().filter_map(measured).collect();
        let (words, is_warning) = control_sentence(control_limits(&readings));
        (format!("{name}: {words}"), is_warning)
    };
    [chart("weight", |one| one.weight), chart("zero", |one| one.zero)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drift_is_told_before_a_check_fails() {
        let of = |newtons: &[f64]| {
            let one = |newtons: &f64| DailyCheckDeviation { newtons: *newtons, limit: 0.1 };
            control_sentence(control_limits(&newtons.iter().map(one).collect::<Vec<_>>()))
        };
        let steady = [0.01, -0.01, 0.0, 0.01, -0.01, 0.01, 0.0, -0.01, 0.01, 0.0, -0.01];
        let (words, is_warning) = of(&steady);
        assert!(words.starts_with("steady within") && !is_warning, "{words}");
        assert!(of(&steady[..10]).0.contains("need 11 checks"));
        let last = [&steady[..], &[0.06]].concat();
        let (words, is_warning) = of(&last);
        // Far from the limit of 0.1 N at which the check fails.
        assert!(words.contains("beyond the control limits") && is_warning, "{words}");
        let rising = [&steady[..], &[-0.005, 0.0, 0.004, 0.008, 0.012]].concat();
        assert!(
            of(&rising).0.contains("the last 6 checks move in one direction"),
            "{:?}",
            of(&rising)
        );
    }
}
