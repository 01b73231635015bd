//! Systematic uncertainty of fitted parameters from the calibration and the machine compliance. These errors are the
//! same in every sample, so residuals do not show them and repeats do not reduce them: they are reported next to the
//! statistical error, not in it.
//!
//! Every independent error is moved by one standard uncertainty, all forces or depths read with it are read again,
//! and the fit is made again; the root of the sum of squared changes is the systematic standard uncertainty
//! (JCGM 100:2008, section 5.1, with the derivatives as differences). Records read with one calibration move together.

use super::options::FitOptions;
use super::sample::{FitError, FitSample, NamedSamples};
use super::solve::FitSolution;
use crate::distinct;
use palpate_model::calibration::{ForceUncertainty, UncertaintyTerm};
use palpate_model::units::{Depth, Newtons};
use serde::Serialize;
use std::collections::BTreeMap;

mod in_volts;
mod sentence;
#[cfg(test)]
mod tests;

/// More samples of a record than this do not make the change more exact: noise cancels, since the same samples are
/// fitted before and after. Longer records are taken at every second, third, ... sample.
const SAMPLES_MAX: usize = 4000;

/// A record and what its forces and depths were read with.
#[derive(Clone, Copy, Debug)]
pub struct TracedRecord<'a> {
    pub name: &'a str,
    pub samples: &'a [FitSample],
    /// The calibration by name, and its uncertainty; `None` where it is not known, as of a table.
    pub calibration: Option<(&'a str, &'a ForceUncertainty)>,
    /// The compliance taken from the depths, by name, and its standard uncertainty in mm/N.
    pub compliance: Option<(&'a str, f64)>,
}

/// Uncertainty of a fit from calibration and machine compliance.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SystematicUncertainty {
    pub calibrations: Vec<StatedTerms>,
    /// Names of the compliances that were taken from the depths.
    pub compliances: Vec<String>,
    /// Every parameter; empty where nothing is stated of any error.
    pub parameters: Vec<SystematicError>,
    /// Whether forces beyond the heaviest weight were fitted, so that the true error is larger.
    pub is_extrapolated: bool,
    /// Whether the records depart from model and calibration by more than is stated of these errors, which are then propagated
    /// and not found with the parameters.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub is_contradicted: bool,
}

/// Error terms that one calibration states and does not state.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StatedTerms {
    pub name: String,
    /// Terms whose errors were moved.
    pub terms: Vec<UncertaintyTerm>,
    pub not_stated: Vec<UncertaintyTerm>,
}

impl StatedTerms {
    fn of((name, own): (&str, &ForceUncertainty)) -> Self {
        Self {
            name: name.to_owned(),
            terms: distinct(own.errors()),
            not_stated: own.not_stated().to_vec(),
        }
    }
}

/// The systematic standard uncertainty of one parameter.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct SystematicError {
    pub name: String,
    /// Everything together, in its unit.
    pub error: f64,
    /// Each term of the calibration, in its unit.
    pub terms: Vec<TermError>,
    /// The part of the rig's compliance, in its unit; `None` where depths are raw.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub compliance: Option<f64>,
    /// What becomes of the parameter where these errors are found with it; `None` where they were moved one by one.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub joint: Option<JointChange>,
}

/// A parameter that is found together with the errors of its calibration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct JointChange {
    /// How far its value moves, in its unit.
    pub change: f64,
    /// The standard uncertainty that it would have if these errors were known.
    pub statistical: f64,
    /// Half of its total 95 % interval.
    #[serde(skip)]
    pub half: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TermError {
    pub term: UncertaintyTerm,
    /// Its standard uncertainty.
    pub error: f64,
}

/// The systematic uncertainties of a fit of `record` with `options`.
///
/// Costs a fit of at most 4000 samples for each independent error, of which there are as many as twice
/// the weights or more.
pub fn estimate_systematic(
    record: TracedRecord<'_>,
    options: &FitOptions,
) -> Result<SystematicUncertainty, FitError> {
    let mut found = estimate_systematic_jointly(&[record], options, &[])?;
    Ok(found.pop().unwrap_or_default())
}

/// The same of a fit of several records together, one for each; [`super::fit_joint`] says what `shared` is.
pub fn estimate_systematic_jointly(
    records: &[TracedRecord<'_>],
    options: &FitOptions,
    shared: &[&str],
) -> Result<Vec<SystematicUncertainty>, FitError> {
    let taken: Vec<Vec<FitSample>> = records.iter().map(|one| thinned(one.samples)).collect();
    let mut spread = Spread::default();
    let mut names = Vec::new();
    let calibrations = records.iter().filter_map(|one| one.calibration);
    let is_stated = calibrations.into_iter().any(|(_, one)| one.is_stated());
    if is_stated || records.iter().any(|one| one.compliance.is_some()) {
        let fitted = FitSolution::fit_jointly(&name_samples(records, &taken), options, shared)?;
        names = fitted.value_names();
        spread = Spread::of(records, &taken, &fitted)?;
    }
    let each = 0..records.len();
    Ok(each.map(|record| spread.summarise(records, &names, record * names.len())).collect())
}

/// Samples under the names of their records.
fn name_samples<'a>(
    records: &[TracedRecord<'a>],
    samples: &'a [Vec<FitSample>],
) -> Vec<NamedSamples<'a>> {
    let names = records.iter().map(|one| one.name);
    names.zip(samples.iter().map(Vec::as_slice)).collect()
}

/// Squared changes of everything a fit finds.
#[derive(Default)]
struct Spread {
    terms: BTreeMap<UncertaintyTerm, Vec<f64>>,
    compliance: Option<Vec<f64>>,
}

impl Spread {
    /// Of what is found in records, of which these samples were `taken` and `fitted`.
    fn of(
        records: &[TracedRecord<'_>],
        taken: &[Vec<FitSample>],
        fitted: &FitSolution<'_>,
    ) -> Result<Self, FitError> {
        let mut spread = Self::default();
        let calibrations = distinct(records.iter().filter_map(|one| one.calibration));
        let compliances = distinct(records.iter().filter_map(|one| one.compliance));
        let before = fitted.values();
        let add = |sums: &mut Vec<f64>, moved: &[Vec<FitSample>]| {
            sums.resize(before.len(), 0.0);
            if moved != taken {
                let after = fitted.refit(&name_samples(records, moved))?.values();
                for (sum, (after, before)) in sums.iter_mut().zip(after.iter().zip(&before)) {
                    *sum += (after - before).powi(2);
                }
            }
            Ok(())
        };
        for own in &calibrations {
            for (index, term) in own.1.errors().enumerate() {
                let move_one = |one: &FitSample| {
                    let shift = own.1.shift(index, one.force);
                    let force = Newtons(one.force.0 + shift.0);
                    if one.is_measured() { FitSample { force, ..*one } } else { *one }
                };
                let moved = reread_records(
                    records,
                    taken,
                    |one| one.calibration == Some(*own),
                    |samples| samples.iter().map(move_one).collect(),
                );
                add(spread.terms.entry(term).or_default(), &moved)?;
            }
        }
        for own in &compliances {
            let moved = reread_records(
                records,
                taken,
                |one| one.compliance == Some(*own),
                |samples| add_compliance(samples, own.1),
            );
            add(spread.compliance.get_or_insert_default(), &moved)?;
        }
        Ok(spread)
    }

    /// The values from `first` on, by name.
    fn summarise(
        &self,
        records: &[TracedRecord<'_>],
        names: &[String],
        first: usize,
    ) -> SystematicUncertainty {
        let is_stated = self.compliance.is_some() || !self.terms.is_empty();
        let parameters = names.iter().zip(first..).filter(|_| is_stated);
        SystematicUncertainty {
            parameters: parameters
                .map(|(name, k)| {
                    let compliance = self.compliance.as_ref().map(|sums| sums[k]);
                    let all = self.terms.values().map(|sums| sums[k]).chain(compliance);
                    SystematicError {
                        name: name.clone(),
                        error: all.sum::<f64>().sqrt(),
                        terms: self
                            .terms
                            .iter()
                            .map(|(term, sums)| TermError { term: *term, error: sums[k].sqrt() })
                            .collect(),
                        compliance: compliance.map(f64::sqrt),
                        joint: None,
                    }
                })
                .collect(),
            ..SystematicUncertainty::stated(records)
        }
    }
}

impl SystematicUncertainty {
    /// What calibrations and compliances of records state, without any parameter.
    fn stated(records: &[TracedRecord<'_>]) -> Self {
        let calibrations = distinct(records.iter().filter_map(|one| one.calibration));
        let compliances = distinct(records.iter().filter_map(|one| one.compliance));
        Self {
            calibrations: calibrations.iter().copied().map(StatedTerms::of).collect(),
            compliances: compliances.iter().map(|(name, _)| (*name).to_owned()).collect(),
            is_extrapolated: records.iter().any(|one| {
                one.calibration.is_some_and(|(_, uncertainty)| {
                    let known = one.samples.iter().filter(|sample| sample.is_measured());
                    known.map(|sample| sample.force).any(|force| force > uncertainty.force_max())
                })
            }),
            parameters: Vec::new(),
            is_contradicted: false,
        }
    }
}

fn thinned(samples: &[FitSample]) -> Vec<FitSample> {
    let stride = samples.len().div_ceil(SAMPLES_MAX).max(1);
    samples.iter().step_by(stride).copied().collect()
}

/// The samples taken, those of the chosen records as another calibration or compliance would have read them.
fn reread_records(
    records: &[TracedRecord<'_>],
    taken: &[Vec<FitSample>],
    is_chosen: impl Fn(&TracedRecord<'_>) -> bool,
    read: impl Fn(&[FitSample]) -> Vec<FitSample>,
) -> Vec<Vec<FitSample>> {
    let pairs = records.iter().zip(taken);
    pairs
        .map(|(record, samples)| match is_chosen(record) {
            true => read(samples),
            false => samples.clone(),
        })
        .collect()
}

/// Depths with so much more of the force, in mm/N, taken from them. Where no force is known, the last one bends.
fn add_compliance(samples: &[FitSample], mm_per_newton: f64) -> Vec<FitSample> {
    let mut force = 0.0;
    let each = samples.iter().map(|one| {
        if one.is_measured() {
            force = one.force.0;
        }
        FitSample { depth: Depth(one.depth.0 - mm_per_newton * force), ..*one }
    });
    each.collect()
}
