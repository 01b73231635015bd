//! What fits make of a record, as answers.

use super::judge::Answer;
use crate::families::{Family, Model};
use crate::fit::{FamilyOptions, FitOptions, FitSample, PARAMETER_NAMES, fit, fit_family};
use crate::viscoelastic::ModifiedKelvin;

/// The fit of the thesis body, which has a method of its own.
pub(super) struct ThesisFit;

impl ThesisFit {
    /// Name among the subjects.
    pub const NAME: &'static str = "fit of the thesis body";

    /// Fits; the error is that of the worst parameter against `truth`.
    pub fn of(samples: &[FitSample], truth: Option<&ModifiedKelvin>) -> Answer {
        let report = match fit(samples, &FitOptions::default()) {
            Ok(report) => report,
            Err(err) => return Answer::Refused(err.to_string()),
        };
        let mut numbers = vec![report.r2, report.rmse_n];
        for parameter in &report.parameters {
            numbers.push(parameter.value);
            numbers.extend(parameter.std_error);
            numbers.extend(parameter.ci95.unwrap_or_default());
        }
        let error = truth.map_or(0.0, |truth| {
            let [mu1, mu2, mu3] = truth.mu;
            let exact = [truth.tau_eps, mu1, mu2, mu3, truth.tau_sig];
            let found = PARAMETER_NAMES.iter().filter_map(|name| report.value(name));
            worst(found, exact)
        });
        answer(numbers, error, report.warnings)
    }
}

/// Fits a family; the error is that of the worst parameter against `truth`.
pub(super) fn family_fit(
    family: &dyn Family,
    samples: &[FitSample],
    truth: Option<&Model>,
) -> Answer {
    let fit = match fit_family(family, &[("record", samples)], FamilyOptions::default()) {
        Ok(fit) => fit,
        Err(err) => return Answer::Refused(err.to_string()),
    };
    let mut numbers = vec![fit.sum, fit.rms, fit.effective_samples];
    for parameter in &fit.parameters {
        numbers.push(parameter.value);
        numbers.extend(parameter.std_error);
    }
    for record in &fit.records {
        numbers.extend([record.offset, record.initial, record.rms, record.worst]);
    }
    let error = truth.map_or(0.0, |truth| {
        let found = fit.model.outer.iter().chain(&fit.model.linear);
        worst(
            found.copied(),
            truth.outer.iter().chain(&truth.linear).copied(),
        )
    });
    answer(numbers, error, fit.warnings)
}

fn worst(found: impl IntoIterator<Item = f64>, exact: impl IntoIterator<Item = f64>) -> f64 {
    let both = found.into_iter().zip(exact);
    both.fold(0.0, |worst: f64, (found, exact)| {
        worst.max((found / exact - 1.0).abs())
    })
}

/// NaN or infinity anywhere in a report is an error without end.
fn answer(numbers: Vec<f64>, error: f64, warnings: Vec<String>) -> Answer {
    let is_finite = numbers.iter().all(|value| value.is_finite());
    Answer::Number {
        error: if is_finite { error } else { f64::INFINITY },
        warnings,
    }
}
