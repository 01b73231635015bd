//! Systematic errors in a sentence, and in a report next to the statistical ones.

use super::super::report::{BudgetEntry, FitReport, JointReport};
use super::{JointChange, StatedTerms, SystematicError, SystematicUncertainty};
use palpate_model::calibration::UncertaintyTerm;
use palpate_model::estimate::FittedParameter;

/// Half of the 95 % interval of a standard normal error.
const NORMAL975: f64 = 1.959_963_985;

/// Half of a total 95 % interval: two standard normal errors add in quadrature, and so do the halves of their intervals.
pub(super) fn total_half(statistical: f64, error: f64) -> f64 {
    statistical.hypot(NORMAL975 * error)
}

impl StatedTerms {
    /// Its own part of a sentence.
    fn words(&self) -> String {
        let name = &self.name;
        match (self.terms.as_slice(), self.not_stated.as_slice()) {
            ([], _) => format!("\"{name}\" states nothing"),
            (terms, []) => format!("\"{name}\" states {}", words(terms)),
            (terms, others) => {
                format!("\"{name}\" states {}, but not {}", words(terms), words(others))
            }
        }
    }
}

fn words(terms: &[UncertaintyTerm]) -> String {
    let words: Vec<&str> = terms.iter().map(|term| term.name()).collect();
    words.join(", ")
}

impl SystematicUncertainty {
    /// One sentence on what was added and what could not be.
    pub fn sentence(&self) -> String {
        let calibrations = self.calibrations.iter();
        let calibrations = calibrations.map(|one| format!("the calibration \"{}\"", one.name));
        let compliances = self.compliances.iter();
        let names: Vec<String> = calibrations
            .chain(compliances.map(|name| format!("the machine compliance {name}")))
            .collect();
        let is_one = names.len() == 1;
        let names = names.join(" and ");
        let Some(first) = self.parameters.first() else {
            let states = match is_one {
                true => "states nothing about its",
                false => "state nothing about their",
            };
            return format!(
                "{names} {states} own uncertainty, so the systematic uncertainty is not known"
            );
        };
        let bends = first.compliance.map(|_| "machine compliance".to_owned());
        let is_alike = |pair: &[StatedTerms]| {
            (&pair[0].terms, &pair[0].not_stated) == (&pair[1].terms, &pair[1].not_stated)
        };
        let parts = if self.calibrations.windows(2).all(is_alike) {
            let terms: Vec<UncertaintyTerm> = first.terms.iter().map(|one| one.term).collect();
            let stated = Some(words(&terms)).filter(|words| !words.is_empty());
            let stated: Vec<String> = stated.into_iter().chain(bends).collect();
            match self.calibrations.first().map(|one| one.not_stated.as_slice()) {
                None | Some([]) => stated.join(", "),
                Some(terms) => format!("{}; not stated: {}", stated.join(", "), words(terms)),
            }
        } else {
            // What one states and another does not would read as a contradiction.
            let each = self.calibrations.iter().map(StatedTerms::words);
            each.chain(bends).collect::<Vec<_>>().join("; ")
        };
        let beyond = match self.is_extrapolated {
            true => {
                "; forces beyond the heaviest weight of the calibration are extrapolated, so the true error is larger"
            }
            false => "",
        };
        let doubt = match self.is_contradicted {
            true => {
                "; the record differs from model and calibration by more than the stated errors explain, so the record is not used to reduce these errors; check the load cell with known weights, and compare model families"
            }
            false => "",
        };
        format!(
            "{names} {} a systematic standard uncertainty, which repeats do not reduce ({parts}){beyond}{doubt}",
            if is_one { "adds" } else { "add" },
        )
    }
}

impl SystematicError {
    /// What contributes to it.
    fn budget(&self) -> Vec<BudgetEntry> {
        let entry = |source: &str, error: f64| BudgetEntry { source: source.to_owned(), error };
        let terms = self.terms.iter().map(|one| entry(one.term.name(), one.error));
        let compliance = self.compliance.map(|error| entry("machine compliance", error));
        terms.chain(compliance).filter(|one| one.error > 0.0).collect()
    }
}

impl FitReport {
    /// This report with the systematic errors next to the statistical ones, and the sentence on them.
    #[must_use]
    pub fn with_systematic(mut self, systematic: &SystematicUncertainty) -> Self {
        self.add_systematic(systematic);
        self.findings.push(systematic.sentence());
        self.findings.extend(self.displaced_sentence());
        self
    }

    /// Which estimates lie outside of their own total interval, because it uses what the record tells of the calibration.
    #[must_use]
    pub fn displaced_sentence(&self) -> Option<String> {
        let is_outside = |one: &&FittedParameter| one.is_displaced();
        let names = self.parameters.iter().filter(is_outside).map(|one| one.name.as_str());
        let names: Vec<&str> = names.collect();
        (!names.is_empty()).then(|| {
            format!(
                "the values of {} take the calibration as exact and lie outside of their total 95 % intervals, which use what this record shows of the calibration's error; quote the middle of the total interval, or calibrate the load cell again",
                names.join(", ")
            )
        })
    }

    fn add_systematic(&mut self, systematic: &SystematicUncertainty) {
        let known = self.parameters.iter_mut();
        for parameter in known.filter(|one| one.std_error.is_some()) {
            let own = systematic.parameters.iter().find(|one| one.name == parameter.name);
            let (Some(own), Some([low, high]), Some(std_error)) =
                (own, parameter.ci95, parameter.std_error)
            else {
                continue;
            };
            let joint = own.joint.unwrap_or_else(|| JointChange {
                change: 0.0,
                statistical: std_error,
                half: total_half(0.5 * (high - low), own.error),
            });
            parameter.systematic_error = Some(own.error);
            if !parameter.budget.is_empty() {
                let scale = joint.statistical / std_error;
                parameter.budget.iter_mut().for_each(|one| one.error *= scale);
                parameter.budget.extend(own.budget());
            }
            let middle = parameter.value + joint.change;
            parameter.total95 = Some([middle - joint.half, middle + joint.half]);
        }
    }
}

impl JointReport {
    /// This report with the systematic errors of every record next to the statistical ones.
    #[must_use]
    pub fn with_systematic(mut self, systematic: &[SystematicUncertainty]) -> Self {
        for (record, own) in self.records.iter_mut().zip(systematic) {
            record.report.add_systematic(own);
            let displaced = record.report.displaced_sentence();
            record.report.findings.extend(displaced);
        }
        self
    }
}
