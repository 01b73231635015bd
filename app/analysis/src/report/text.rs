//! The strings of a fit. Window, command line and picture print these and no others, so that a
//! number never reads differently in two places.

use super::budget::budget_lines;
use super::fit_json::{FitDetails, FitOverlay};
use crate::fit::{FitIntervals, JointFit};
use palpate_figures::uncertain::{interval, plain, with_error, with_interval};
use palpate_rheology::families::find_family;
use palpate_rheology::fit::{FitReport, FittedParameter, NamedReport};

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ParameterText {
    pub name: String,
    /// `value ± standard error`, or the value and why it has no error.
    pub value: String,
    /// Unit of value and interval, typeset.
    pub unit: String,
    /// Statistical 95 % interval, empty where there is none.
    pub interval: String,
    /// 95 % interval with everything that is known to be uncertain, empty where there is none.
    pub total: String,
}

impl ParameterText {
    #[must_use]
    pub fn of(parameter: &FittedParameter) -> Self {
        let value = match parameter.std_error {
            Some(error) => with_error(parameter.value, error),
            None if parameter.is_fixed => format!("{} fixed", plain(parameter.value)),
            None => format!("{} not identified", plain(parameter.value)),
        };
        let words = |ends: Option<[f64; 2]>| {
            let known = ends.zip(parameter.std_error);
            known.map(|(ends, error)| interval(ends, parameter.value, error)).unwrap_or_default()
        };
        Self {
            name: parameter.name.clone(),
            value,
            unit: typeset(&parameter.unit),
            interval: words(parameter.ci95),
            total: words(parameter.total95),
        }
    }

    /// Both intervals in one line.
    #[must_use]
    pub fn intervals(&self) -> String {
        with_total(self.interval.clone(), &self.total)
    }
}

/// An interval, or a value with its interval, and the total interval after it, where there is one.
fn with_total(words: String, total: &str) -> String {
    if total.is_empty() { words } else { format!("{words}, total {total}") }
}

/// Name and unit of a parameter at the head of a column.
#[must_use]
pub fn parameter_head(parameter: &FittedParameter) -> String {
    match parameter.unit.as_str() {
        "" => parameter.name.clone(),
        unit => format!("{} ({})", parameter.name, typeset(unit)),
    }
}

/// A parameter in one cell of a table: `value [low, high], total [low, high]`, or the value and why
/// it has no interval.
#[must_use]
pub fn cell(parameter: &FittedParameter) -> String {
    let text = ParameterText::of(parameter);
    match (parameter.std_error, parameter.ci95) {
        (Some(error), Some(ends)) => {
            with_total(with_interval(parameter.value, error, ends), &text.total)
        }
        _ => text.value,
    }
}

/// A unit as it is printed rather than typed.
#[must_use]
pub fn typeset(unit: &str) -> String {
    unit.replace("^2", "²").replace("^3", "³").replace('*', "·")
}

/// Goodness of fit.
#[must_use]
pub fn quality(report: &FitReport) -> String {
    format!("R² {:.6}, rmse {:.3} mN, {} samples", report.r2, report.rmse_n * 1e3, report.samples)
}

/// Work along the path and the largest residual.
#[must_use]
pub fn energy(overlay: &FitOverlay) -> String {
    format!(
        "energy {:.3} N·mm measured, {:.3} fitted; largest residual {:.1} mN",
        overlay.work_measured_n_mm,
        overlay.work_fitted_n_mm,
        overlay.worst_n * 1e3
    )
}

/// Equation of the model family; `None` of an unknown one.
pub(super) fn equation(report: &FitReport) -> Option<&'static str> {
    Some(find_family(&report.body.family).ok()?.equation())
}

pub(super) fn limit(report: &FitReport) -> Option<String> {
    let family = find_family(&report.body.family).ok()?;
    Some(format!("the model cannot represent {}", family.cannot_represent()))
}

/// A whole fit, of every family the same: model, equation, parameters, how good it is, every sentence, further intervals.
#[must_use]
pub fn fit_text(report: &FitReport, details: FitDetails<'_>) -> String {
    let mut lines = vec![report.model.clone()];
    lines.extend(equation(report).map(|text| format!("  {text}")));
    lines.extend(parameter_lines(&report.parameters));
    lines.extend([quality(report), energy(details.overlay)]);
    lines.extend(budget_lines(&report.parameters));
    let sentences = report.sentences().map(str::to_owned).chain(limit(report));
    lines.extend(sentences.map(|sentence| format!("- {sentence}")));
    lines.extend(interval_lines(details.intervals, report));
    lines.join("\n")
}

/// A fit of several recordings: what is shared once, then every recording with what is its own.
#[must_use]
pub fn joint_fit_text(fitted: &JointFit, details: &[FitDetails<'_>]) -> String {
    let (shared, records) = (&fitted.report.shared, &fitted.report.records);
    let part = |named: &NamedReport, is_shared: bool| {
        let mut chosen = named.report.parameters.clone();
        chosen.retain(|parameter| shared.contains(&parameter.name) == is_shared);
        parameter_lines(&chosen)
    };
    let mut lines = Vec::new();
    let first = records.first();
    if let Some(first) = first {
        lines.push(format!("{}, {} records together", first.report.model, records.len()));
        lines.extend(equation(&first.report).map(|text| format!("  {text}")));
        lines.extend(part(first, true));
    }
    for (named, details) in records.iter().zip(details) {
        lines.push(named.record.clone());
        lines.extend(part(named, false));
        let own = [quality(&named.report), energy(details.overlay)].into_iter();
        let own = own.chain(budget_lines(&named.report.parameters));
        let own = own.chain(interval_lines(details.intervals, &named.report));
        let own = own.chain(named.report.sentences().map(|sentence| format!("- {sentence}")));
        lines.extend(own.map(|line| format!("  {line}")));
    }
    let limit = first.and_then(|first| limit(&first.report));
    let systematic = fitted.systematic.iter().flatten().next().map(|one| one.sentence());
    lines.extend(limit.into_iter().chain(systematic).map(|sentence| format!("- {sentence}")));
    lines.join("\n")
}

/// Intervals that take more than one pass, in the digits of the report.
fn interval_lines(found: &FitIntervals, report: &FitReport) -> Vec<String> {
    let line = |name: &str, ends: [Option<f64>; 2]| {
        let known = report.parameter(name).and_then(|known| Some((known.value, known.std_error?)));
        let text = match (ends, known) {
            ([Some(low), Some(high)], Some((value, error))) => interval([low, high], value, error),
            _ => {
                let [low, high] = ends.map(|end| end.map_or("open".to_owned(), plain));
                format!("[{low}, {high}]")
            }
        };
        format!("  {name:<10} {text}")
    };
    let mut lines = Vec::new();
    if !found.profile.is_empty() {
        lines.push("95 % from the profile likelihood".to_owned());
    }
    lines.extend(found.profile.iter().map(|one| line(&one.name, [one.low, one.high])));
    let seed = found.bootstrap_seed;
    lines.extend(seed.map(|seed| format!("95 % from the bootstrap, seed {seed}")));
    lines.extend(found.bootstrap.iter().map(|one| line(&one.name, one.ci95.map(Some))));
    lines
}

/// One line per parameter, in columns.
#[must_use]
pub fn parameter_lines(parameters: &[FittedParameter]) -> Vec<String> {
    let texts: Vec<ParameterText> = parameters.iter().map(ParameterText::of).collect();
    let width = texts.iter().map(|text| text.value.chars().count()).max().unwrap_or(0);
    let line = |text: &ParameterText| {
        let interval = match text.intervals() {
            ends if ends.is_empty() => ends,
            ends => format!("95 % {ends}"),
        };
        let line =
            format!("  {:<10} {:<width$}  {:<8} {interval}", text.name, text.value, text.unit);
        line.trim_end().to_owned()
    };
    texts.iter().map(line).collect()
}

#[must_use]
pub fn capital(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next().map(|letter| letter.to_uppercase().to_string());
    first.unwrap_or_default() + letters.as_str()
}

/// The cells of a table's head, given in one text with `|` between them.
pub(super) fn head(names: &str) -> Vec<String> {
    names.split('|').map(|name| name.trim().to_owned()).collect()
}

/// A count and its noun.
#[must_use]
pub fn counted(count: usize, noun: &str) -> String {
    match count {
        1 => format!("1 {noun}"),
        _ => format!("{count} {noun}s"),
    }
}

/// A number of bytes in MB.
#[must_use]
pub fn megabytes(bytes: u64) -> String {
    format!("{:.1} MB", bytes as f64 * 1e-6)
}

/// A table in columns under its head.
pub(crate) fn table(names: &str, rows: impl IntoIterator<Item = Vec<String>>) -> String {
    in_columns(&std::iter::once(head(names)).chain(rows).collect::<Vec<_>>())
}

/// Cells in columns as wide as their widest; a sentence at the end of a short line widens none.
#[must_use]
pub fn in_columns(lines: &[Vec<String>]) -> String {
    let columns = lines.first().map_or(0, Vec::len);
    let letters = |text: &String| text.chars().count();
    let width = |column: usize| {
        let whole = lines.iter().filter(|line| column == 0 || line.len() == columns);
        whole.filter_map(|line| line.get(column)).map(letters).max()
    };
    let widths: Vec<usize> = (0..columns).filter_map(width).collect();
    let line = |cells: &Vec<String>| {
        let padded = cells.iter().zip(&widths).map(|(cell, &width)| {
            // Counted by letters: `±` is two bytes and one letter.
            format!("{cell:<width$}")
        });
        padded.collect::<Vec<_>>().join("  ").trim_end().to_owned()
    };
    lines.iter().map(line).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameter(std_error: Option<f64>, is_fixed: bool) -> FittedParameter {
        FittedParameter {
            name: "tau_sig".into(),
            value: 1.5,
            unit: "N*s/mm^2".into(),
            std_error,
            ci95: std_error.map(|error| [1.5 - 2.0 * error, 1.5 + 2.0 * error]),
            is_fixed,
            systematic_error: None,
            total95: None,
            budget: Vec::new(),
        }
    }

    #[test]
    fn a_value_without_an_error_says_why() {
        for (parameter, value, interval) in [
            (parameter(Some(0.1), false), "1.50 ± 0.10", "[1.30, 1.70]"),
            (parameter(None, true), "1.500 fixed", ""),
            (parameter(None, false), "1.500 not identified", ""),
        ] {
            let text = ParameterText::of(&parameter);
            assert_eq!((text.value.as_str(), text.interval.as_str()), (value, interval));
            assert_eq!(text.unit, "N·s/mm²");
        }
    }

    #[test]
    fn the_total_interval_stands_after_the_statistical_one() {
        let mut known = parameter(Some(0.1), false);
        // It need not lie evenly around the value.
        known.total95 = Some([0.9, 2.5]);
        let text = ParameterText::of(&known);
        assert_eq!((text.interval.as_str(), text.total.as_str()), ("[1.30, 1.70]", "[0.90, 2.50]"));
        let both = "[1.30, 1.70], total [0.90, 2.50]";
        assert_eq!(cell(&known), format!("1.50 {both}"));
        assert!(parameter_lines(&[known])[0].ends_with(&format!("95 % {both}")));
    }

    #[test]
    fn every_unit_is_typeset() {
        for unit in palpate_rheology::fit::PARAMETER_UNITS {
            assert!(!typeset(unit).contains(['^', '*']), "{unit}");
        }
    }

    #[test]
    fn a_whole_report_says_every_sentence() {
        let mut report = FitReport {
            model: "a model".into(),
            parameters: vec![parameter(Some(0.1), false), parameter(None, true)],
            r2: 0.999_123_4,
            rmse_n: 0.003_45,
            samples: 900,
            warnings: vec!["beware".into()],
            findings: vec!["found".into()],
            ..FitReport::default()
        };
        report.body.family = "maxwell".into();
        let (overlay, intervals) =
            (FitOverlay::of(&FitReport::default(), &[]), FitIntervals::default());
        let details = FitDetails {
            overlay: &overlay,
            intervals: &intervals,
            systematic: None,
            compliance: None,
        };
        let lines = [
            "a model",
            "  F + tau F' = k tau x'",
            "  tau_sig    1.50 ± 0.10  N·s/mm²  95 % [1.30, 1.70]",
            "  tau_sig    1.500 fixed  N·s/mm²",
            "R² 0.999123, rmse 3.450 mN, 900 samples",
            "energy 0.000 N·mm measured, 0.000 fitted; largest residual 0.0 mN",
            "- beware",
            "- found",
            "- the model cannot represent an equilibrium force other than zero; stiffness that grows with depth; unloading that differs from loading",
        ];
        assert_eq!(fit_text(&report, details), lines.join("\n"));
    }

    #[test]
    fn a_sentence_does_not_widen_the_columns() {
        let lines = [
            vec!["source".into(), "mu1".into(), "R²".into()],
            vec!["a-long-name".into(), "1 [0, 2]".into(), "1".into()],
            vec!["b".into(), "failed: a long sentence".into()],
        ];
        let expected = [
            "source       mu1       R²",
            "a-long-name  1 [0, 2]  1",
            "b            failed: a long sentence",
        ];
        assert_eq!(in_columns(&lines), expected.join("\n"));
    }
}
