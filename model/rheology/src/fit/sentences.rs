//! Warnings and findings of a fit; window, command line and files use the same sentences.

use super::report::{FitReport, FittedParameter, NoiseEstimate};
use super::solve::FitSolution;
use super::uncertainty::RangeEnd;
use crate::families::OuterRange;
use palpate_model::viscoelastic::admissibility;

/// Correlation times this many relaxation times long blur the model itself.
const MEMORY_LONG: f64 = 1.0;
/// Fewer effective samples than this for every unknown make any interval rough.
const EFFECTIVE_MIN: f64 = 10.0;
/// Initial forces and offsets beyond this many ranges of the force are not what they are called.
const LEVEL_LARGE: f64 = 3.0;
/// A correlation time of this share of the record is the longest that is looked for.
const LONGEST_SHARE: f64 = 0.45;
/// A relaxation time less certain than this share of its value is hardly known.
const UNCERTAIN_SHARE: f64 = 0.5;

/// Warnings without which the numbers would be misread.
pub(super) fn warnings(fitted: &FitSolution<'_>, record: usize, report: &FitReport) -> Vec<String> {
    let mut warnings = Vec::new();
    let layout = fitted.system.layout();
    for outer in 0..layout.outers {
        warnings.extend(
            fitted
                .range_end(record, outer)
                .map(|end| edge_warning(fitted, record, outer, end, &report.parameters[outer])),
        );
    }
    if fitted.is_contact_at_start(record) {
        warnings.push(
            "the contact point lies at or before the shallowest recorded depth and is not separable from \
             the elastic coefficients; record the approach as well"
                .to_owned(),
        );
    }
    if !fitted.refined.is_converged {
        warnings.push(
            "the iteration did not converge; the parameters depend on each other too strongly"
                .to_owned(),
        );
    }
    if !fitted.inseparable.is_empty() {
        warnings.push(format!(
            "these records hardly separate {}; record a second speed or depth, or a longer hold",
            fitted.inseparable.join(", ")
        ));
    }
    for time in relaxation_times(fitted, report) {
        let is_uncertain = |error: f64| error > UNCERTAIN_SHARE * time.value;
        if time.std_error.is_some_and(is_uncertain) {
            warnings.push(format!(
                "{} is uncertain by more than half its value; record a longer hold",
                time.name
            ));
        }
    }
    let (low, high) = fitted.system.records[record].forces();
    let own = layout.initial().into_iter().chain([layout.offset()]);
    for parameter in own.map(|k| &report.parameters[k]) {
        if parameter.value.abs() > LEVEL_LARGE * (high - low) {
            warnings.push(format!(
                "{} is far larger than the range of the force, so it describes something that the model \
                 does not contain; fix this parameter, or check the start of the record",
                parameter.name
            ));
        }
    }
    if let Some(noise) = &report.noise {
        let unknowns = fitted.system.unknowns.len() as f64;
        if noise.correlation_time_s.is_none() {
            if noise.effective_samples < EFFECTIVE_MIN * unknowns {
                warnings.push(format!(
                    "only {} samples for {unknowns} parameters; the intervals are rough",
                    report.samples
                ));
            }
        } else if lacks_fit(fitted, report, noise) {
            warnings.push(format!(
                "{LACK_OF_FIT}: the residuals are autocorrelated over a long time, so the model does not \
                 describe the record to within its noise, and intervals based on about {} are rough",
                independent_words(noise.effective_samples)
            ));
        }
    }
    warnings
}

fn relaxation_times<'a>(
    fitted: &FitSolution<'_>,
    report: &'a FitReport,
) -> impl Iterator<Item = &'a FittedParameter> {
    let is_time = |k: &usize| fitted.system.source.range_kind(*k) == OuterRange::Time;
    let times: Vec<usize> = (0..fitted.system.layout().outers).filter(is_time).collect();
    times.into_iter().map(|k| &report.parameters[k])
}

/// The warning that the model does not describe a record begins so.
pub(super) const LACK_OF_FIT: &str = "lack of fit";

/// Whether residuals are autocorrelated over so long that the model does not describe the record.
pub(super) fn lacks_fit(
    fitted: &FitSolution<'_>,
    report: &FitReport,
    noise: &NoiseEstimate,
) -> bool {
    let Some(time) = noise.correlation_time_s else { return false };
    let is_few = noise.effective_samples < EFFECTIVE_MIN * fitted.system.unknowns.len() as f64;
    let longest = relaxation_times(fitted, report).map(|one| one.value).reduce(f64::max);
    is_few || longest.is_some_and(|longest| time > MEMORY_LONG * longest)
}

/// Findings that are not numbers.
pub(super) fn findings(fitted: &FitSolution<'_>, record: usize, report: &FitReport) -> Vec<String> {
    let mut findings = Vec::new();
    if report.censored > 0 {
        findings.push(format!(
            "{} samples are censored: the fit uses their depths but not their forces",
            report.censored
        ));
    }
    let samples = fitted.system.records[record].samples;
    let length = samples[samples.len() - 1].t.0 - samples[0].t.0;
    if let Some(noise) = &report.noise
        && let Some(time) = noise.correlation_time_s
        && noise.effective_samples < 0.95 * report.samples as f64
    {
        let about = if time > LONGEST_SHARE * length { "at least" } else { "about" };
        findings.push(format!(
            "autocorrelated residuals: {} samples carry the information of {}, because {} % of the residual \
             variance has a correlation time of {about} {}; the intervals take this into account",
            report.samples,
            independent_words(noise.effective_samples),
            percent_words(noise.slow_share),
            time_words(time)
        ));
    }
    let (_, deepest) = fitted.system.records[record].depths;
    let contact = report.parameters[fitted.system.layout().contact()].value;
    let kelvin = report.kelvin().into_iter();
    findings.extend(kelvin.flat_map(|body| admissibility::sentences(&body, deepest - contact)));
    findings
}

/// That an outer parameter ended where its search does.
fn edge_warning(
    fitted: &FitSolution<'_>,
    record: usize,
    outer: usize,
    end: RangeEnd,
    found: &FittedParameter,
) -> String {
    let name = &found.name;
    if fitted.system.source.range_kind(outer) != OuterRange::Time {
        let (value, unit) = (found.value, &found.unit);
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        return format!(
            "{name} lies at an end of its range, {value:.3e}{unit}; the other parameters are conditional on this value"
        );
    }
    let end = match end {
        RangeEnd::Low => "short",
        RangeEnd::High => "long",
    };
    let (low, high) = fitted.system.ranges[record].outers[outer];
    format!(
        "{name} lies at the {end} end of the range that this record can resolve ({:.3e} s to {:.3e} s); \
         the other parameters are conditional on this value",
        low.exp(),
        high.exp()
    )
}

fn independent_words(samples: f64) -> String {
    if samples < 1.5 {
        "one independent sample".to_owned()
    } else {
        format!("{samples:.0} independent samples")
    }
}

/// A share in percent, two digits of it.
fn percent_words(share: f64) -> String {
    let percent = 100.0 * share;
    let decimals = match percent {
        10.0.. => 0,
        1.0.. => 1,
        0.1.. => 2,
        _ => 3,
    };
    format!("{percent:.decimals$}")
}

/// A time in words of its size.
fn time_words(seconds: f64) -> String {
    if seconds < 0.1 {
        format!("{:.0} ms", 1e3 * seconds)
    } else if seconds < 10.0 {
        format!("{seconds:.2} s")
    } else {
        format!("{seconds:.0} s")
    }
}
