//! Results of fits, as answers.

use super::judge::SubjectAnswer;
use crate::families::{Family, Model};
use crate::fit::{FitOptions, FitSample, fit};
use std::sync::Arc;

/// Name among the subjects of the fit that needs no family named.
pub(super) const DEFAULT_FIT: &str = "fit of the modified Kelvin model";

/// Fits a family; the error is that of the worst parameter of the body against `truth`.
pub(super) fn fit_answer(
    family: Arc<dyn Family>,
    samples: &[FitSample],
    truth: Option<&Model>,
) -> SubjectAnswer {
    let report = match fit(samples, &FitOptions::of(family)) {
        Ok(report) => report,
        Err(err) => return SubjectAnswer::Refused(err.to_string()),
    };
    let mut numbers = vec![report.r2, report.rmse_n];
    numbers.extend(report.noise.map(|noise| noise.effective_samples));
    for parameter in &report.parameters {
        numbers.push(parameter.value);
        numbers.extend(parameter.std_error);
        numbers.extend(parameter.ci95.unwrap_or_default());
    }
    let error = truth.map_or(0.0, |truth| {
        let found = report.body.outer.iter().chain(&report.body.linear);
        let exact = truth.outer.iter().chain(&truth.linear);
        let relative = found.zip(exact).map(|(found, exact)| (found / exact - 1.0).abs());
        relative.fold(0.0, f64::max)
    });
    // NaN or infinity anywhere in a report is an error without end.
    let is_finite = numbers.iter().all(|value| value.is_finite());
    SubjectAnswer::Number {
        error: if is_finite { error } else { f64::INFINITY },
        warnings: report.warnings,
    }
}
