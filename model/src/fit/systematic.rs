//! What errors of the calibration and of the rig's compliance do to fitted parameters. They are the same in every
//! sample, so residuals do not show them and no repeat takes them away: they are told beside the statistical error,
//! not in it.
//!
//! Every independent error is moved by one standard uncertainty, all forces or depths read with it are read again,
//! and the fit is made again; the root of the sum of squared changes is the systematic standard uncertainty
//! (JCGM 100:2008, section 5.1, with the derivatives as differences). Records read with one calibration move together.

use super::family::{FamilyFit, FamilyOptions, refit_family};
use super::options::{FitOptions, PARAMETER_NAMES};
use super::report::{FitReport, JointReport};
use super::sample::{FitError, FitSample, Named};
use super::solve::Fitted;
use crate::calibration::{ForceUncertainty, Term};
use crate::families::Family;
use crate::units::{Depth, Newtons};
use serde::Serialize;
use std::collections::BTreeMap;

/// More samples of a record than this tell the change no better: it is no matter of noise, for the same samples
/// are fitted before and after. Longer records are taken at every second, third, ... sample.
const SAMPLES_MAX: usize = 4000;

/// A record and what its forces and depths were read with.
#[derive(Clone, Copy, Debug)]
pub struct Traced<'a> {
    /// Its name.
    pub name: &'a str,
    /// What is fitted.
    pub samples: &'a [FitSample],
    /// The calibration by name, and its uncertainty; `None` where it is not known, as of a table.
    pub calibration: Option<(&'a str, &'a ForceUncertainty)>,
    /// The compliance taken from the depths, by name, and its standard uncertainty in mm/N.
    pub compliance: Option<(&'a str, f64)>,
}

/// What calibration and compliance add to the uncertainty of a fit.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Systematic {
    /// Names of the calibrations.
    pub calibrations: Vec<String>,
    /// Names of the compliances that were taken from the depths.
    pub compliances: Vec<String>,
    /// Every parameter; empty where nothing is stated of any error.
    pub parameters: Vec<SystematicError>,
    /// Terms that a calibration does not state.
    pub not_stated: Vec<Term>,
    /// What each calibration states by itself, in the order of their names above.
    pub stated_by: Vec<Stated>,
    /// Whether forces beyond the heaviest weight were fitted, so that the true error is larger.
    pub is_extrapolated: bool,
}

/// What one calibration states of its errors.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Stated {
    /// Its name.
    pub calibration: String,
    /// Terms whose errors were moved.
    pub terms: Vec<Term>,
    /// Terms it does not state.
    pub not_stated: Vec<Term>,
}

impl Stated {
    fn of((name, own): (&str, &ForceUncertainty)) -> Self {
        Self {
            calibration: name.to_owned(),
            terms: distinct(own.errors()),
            not_stated: own.not_stated().to_vec(),
        }
    }

    /// Its own part of a sentence.
    fn words(&self) -> String {
        let name = &self.calibration;
        match (self.terms.as_slice(), self.not_stated.as_slice()) {
            ([], _) => format!("\"{name}\" states nothing"),
            (terms, []) => format!("\"{name}\" states {}", words(terms)),
            (terms, others) => {
                format!(
                    "\"{name}\" states {}, but not {}",
                    words(terms),
                    words(others)
                )
            }
        }
    }
}

/// Terms in words.
fn words(terms: &[Term]) -> String {
    let words: Vec<&str> = terms.iter().map(|term| term.word()).collect();
    words.join(", ")
}

/// The systematic standard uncertainty of one parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SystematicError {
    /// The parameter.
    pub name: String,
    /// Everything together, in its unit.
    pub error: f64,
    /// Each term of the calibration, in its unit.
    pub terms: Vec<TermError>,
    /// The part of the rig's compliance, in its unit; `None` where depths are raw.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub compliance: Option<f64>,
}

/// The part of one term.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TermError {
    /// Where it comes from.
    pub term: Term,
    /// Its standard uncertainty.
    pub error: f64,
}

/// The systematic uncertainties of a fit of `record` with `options`.
///
/// Costs a fit of at most 4000 samples for each independent error, of which there are as many as twice
/// the weights or more.
pub fn systematic(record: Traced<'_>, options: &FitOptions) -> Result<Systematic, FitError> {
    let refit = |records: &[Named<'_>]| {
        let fitted = Fitted::of(records[0].1, options)?;
        Ok(fitted.system.physical(&fitted.refined.points[0]).to_vec())
    };
    let spread = Spread::of(&[record], refit)?;
    Ok(spread.told(&[record], &PARAMETER_NAMES, 0))
}

/// The same of a fit of several records together, one for each; [`super::fit_joint`] says what `shared` is.
pub fn systematic_joint(
    records: &[Traced<'_>],
    options: &FitOptions,
    shared: &[&str],
) -> Result<Vec<Systematic>, FitError> {
    let refit = |records: &[Named<'_>]| {
        let fitted = Fitted::joint(records, options, shared)?;
        let points = fitted.refined.points.iter();
        Ok(points
            .flat_map(|point| fitted.system.physical(point))
            .collect())
    };
    let spread = Spread::of(records, refit)?;
    let each = (0..records.len()).map(|k| k * PARAMETER_NAMES.len());
    Ok(each
        .map(|first| spread.told(records, &PARAMETER_NAMES, first))
        .collect())
}

/// The same of a fit of any family, one body for all records.
pub fn systematic_family(
    fit: &FamilyFit,
    family: &dyn Family,
    records: &[Traced<'_>],
    options: FamilyOptions,
) -> Result<Systematic, FitError> {
    let names: Vec<&str> = fit.parameters.iter().map(|one| one.name.as_str()).collect();
    let spread = Spread::of(records, refit_family(family, options))?;
    Ok(spread.told(records, &names, 0))
}

/// Squared changes of everything a fit finds.
struct Spread {
    terms: BTreeMap<Term, Vec<f64>>,
    compliance: Option<Vec<f64>>,
}

impl Spread {
    /// Of what `refit` finds in records, in an order of its own.
    fn of(
        records: &[Traced<'_>],
        mut refit: impl FnMut(&[Named<'_>]) -> Result<Vec<f64>, FitError>,
    ) -> Result<Self, FitError> {
        let taken: Vec<Vec<FitSample>> = records.iter().map(|one| thinned(one.samples)).collect();
        let names = records.iter().map(|one| one.name);
        let mut values = |sets: &[Vec<FitSample>]| {
            let borrowed: Vec<_> = names.clone().zip(sets.iter().map(Vec::as_slice)).collect();
            refit(&borrowed)
        };
        let mut spread = Self {
            terms: BTreeMap::new(),
            compliance: None,
        };
        let calibrations = distinct(records.iter().filter_map(|one| one.calibration));
        let compliances = distinct(records.iter().filter_map(|one| one.compliance));
        if calibrations.iter().all(|(_, one)| !one.is_stated()) && compliances.is_empty() {
            return Ok(spread);
        }
        let before = values(&taken)?;
        let mut add = |sums: &mut Vec<f64>, moved: &[Vec<FitSample>]| {
            sums.resize(before.len(), 0.0);
            if moved != taken {
                let after = values(moved)?;
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
                    if one.is_measured() {
                        FitSample { force, ..*one }
                    } else {
                        *one
                    }
                };
                let moved = moved(
                    records,
                    &taken,
                    |one| one.calibration == Some(*own),
                    |samples| samples.iter().map(move_one).collect(),
                );
                add(spread.terms.entry(term).or_default(), &moved)?;
            }
        }
        for own in &compliances {
            let moved = moved(
                records,
                &taken,
                |one| one.compliance == Some(*own),
                |samples| bent(samples, own.1),
            );
            add(spread.compliance.get_or_insert_default(), &moved)?;
        }
        Ok(spread)
    }

    /// The values from `first` on, by name.
    fn told(&self, records: &[Traced<'_>], names: &[&str], first: usize) -> Systematic {
        let calibrations = distinct(records.iter().filter_map(|one| one.calibration));
        let compliances = distinct(records.iter().filter_map(|one| one.compliance));
        let mut not_stated: Vec<Term> = calibrations
            .iter()
            .flat_map(|(_, one)| one.not_stated().to_vec())
            .collect();
        not_stated.sort_unstable();
        not_stated.dedup();
        let is_told = self.compliance.is_some() || !self.terms.is_empty();
        let parameters = names.iter().zip(first..).filter(|_| is_told);
        Systematic {
            calibrations: calibrations
                .iter()
                .map(|(name, _)| (*name).to_owned())
                .collect(),
            compliances: compliances
                .iter()
                .map(|(name, _)| (*name).to_owned())
                .collect(),
            not_stated,
            stated_by: calibrations.iter().copied().map(Stated::of).collect(),
            is_extrapolated: records.iter().any(|one| {
                one.calibration.is_some_and(|(_, uncertainty)| {
                    let known = one.samples.iter().filter(|sample| sample.is_measured());
                    known
                        .map(|sample| sample.force)
                        .any(|force| force > uncertainty.force_max())
                })
            }),
            parameters: parameters
                .map(|(name, k)| {
                    let compliance = self.compliance.as_ref().map(|sums| sums[k]);
                    let all = self.terms.values().map(|sums| sums[k]).chain(compliance);
                    SystematicError {
                        name: (*name).to_owned(),
                        error: all.sum::<f64>().sqrt(),
                        terms: self
                            .terms
                            .iter()
                            .map(|(term, sums)| TermError {
                                term: *term,
                                error: sums[k].sqrt(),
                            })
                            .collect(),
                        compliance: compliance.map(f64::sqrt),
                    }
                })
                .collect(),
        }
    }
}

fn thinned(samples: &[FitSample]) -> Vec<FitSample> {
    let stride = samples.len().div_ceil(SAMPLES_MAX).max(1);
    samples.iter().step_by(stride).copied().collect()
}

/// Each once, in the order of their coming.
fn distinct<T: PartialEq>(all: impl Iterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for one in all {
        if !found.contains(&one) {
            found.push(one);
        }
    }
    found
}

/// The samples taken, those of the chosen records as another calibration or compliance would have read them.
fn moved(
    records: &[Traced<'_>],
    taken: &[Vec<FitSample>],
    is_chosen: impl Fn(&Traced<'_>) -> bool,
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
fn bent(samples: &[FitSample], mm_per_newton: f64) -> Vec<FitSample> {
    let mut force = 0.0;
    let each = samples.iter().map(|one| {
        if one.is_measured() {
            force = one.force.0;
        }
        FitSample {
            depth: Depth(one.depth.0 - mm_per_newton * force),
            ..*one
        }
    });
    each.collect()
}

impl Systematic {
    /// One sentence on what was added and what could not be.
    #[must_use]
    pub fn sentence(&self) -> String {
        let calibrations = self.calibrations.iter();
        let calibrations = calibrations.map(|name| format!("the calibration \"{name}\""));
        let compliances = self.compliances.iter();
        let names: Vec<String> = calibrations
            .chain(compliances.map(|name| format!("the rig's compliance {name}")))
            .collect();
        let is_one = names.len() == 1;
        let names = names.join(" and ");
        let Some(first) = self.parameters.first() else {
            let states = match is_one {
                true => "states nothing of its",
                false => "state nothing of their",
            };
            return format!("{names} {states} own errors, so a systematic part is not told");
        };
        let bends = first
            .compliance
            .map(|_| "what the rig gives way".to_owned());
        let is_alike = |pair: &[Stated]| {
            (&pair[0].terms, &pair[0].not_stated) == (&pair[1].terms, &pair[1].not_stated)
        };
        let parts = if self.stated_by.windows(2).all(is_alike) {
            let terms: Vec<Term> = first.terms.iter().map(|one| one.term).collect();
            let stated = Some(words(&terms)).filter(|words| !words.is_empty());
            let stated: Vec<String> = stated.into_iter().chain(bends).collect();
            match self.not_stated.as_slice() {
                [] => stated.join(", "),
                terms => format!("{}; not stated: {}", stated.join(", "), words(terms)),
            }
        } else {
            // What one states and another does not would read as a contradiction.
            let each = self.stated_by.iter().map(Stated::words);
            each.chain(bends).collect::<Vec<_>>().join("; ")
        };
        let beyond = match self.is_extrapolated {
            true => {
                "; forces beyond its heaviest weight are extrapolated, so the true error is larger"
            }
            false => "",
        };
        format!(
            "{names} {} the systematic error, one standard uncertainty that repeats do not take away ({parts}){beyond}",
            if is_one { "adds" } else { "add" },
        )
    }

    /// The error of a parameter, where there is one.
    fn error(&self, name: &str) -> Option<f64> {
        let own = self.parameters.iter().find(|one| one.name == name);
        own.map(|own| own.error)
    }
}

impl FitReport {
    /// This report with the systematic errors beside the statistical ones, and the sentence on them.
    #[must_use]
    pub fn with_systematic(mut self, systematic: &Systematic) -> Self {
        self.add_systematic(systematic);
        self.findings.push(systematic.sentence());
        self
    }

    fn add_systematic(&mut self, systematic: &Systematic) {
        let known = self.parameters.iter_mut();
        for parameter in known.filter(|one| one.std_error.is_some()) {
            parameter.systematic_error = systematic.error(&parameter.name);
        }
    }
}

impl JointReport {
    /// This report with the systematic errors of every record beside the statistical ones.
    #[must_use]
    pub fn with_systematic(mut self, systematic: &[Systematic]) -> Self {
        for (record, own) in self.records.iter_mut().zip(systematic) {
            record.report.add_systematic(own);
        }
        self
    }
}

impl FamilyFit {
    /// This fit with the systematic errors beside the statistical ones.
    #[must_use]
    pub fn with_systematic(mut self, systematic: &Systematic) -> Self {
        let known = self.parameters.iter_mut();
        for parameter in known.filter(|one| one.std_error.is_some()) {
            parameter.systematic_error = systematic.error(&parameter.name);
        }
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibration::Calibration;
    use crate::random::SplitMix;
    use crate::units::{Depth, Seconds, Volts};
    use crate::viscoelastic::{KelvinState, ModifiedKelvin};

    /// The thesis's ramp and hold, so many samples a second.
    fn record(rate: f64) -> Vec<FitSample> {
        let mut state = KelvinState::at_rest();
        (0..(90.0 * rate) as usize)
            .map(|i| {
                let t = i as f64 / rate;
                let depth = Depth((0.75 * t).min(30.0));
                let dt = Seconds(if i == 0 { 0.0 } else { 1.0 / rate });
                FitSample {
                    t: Seconds(t),
                    depth,
                    force: state.step(&ModifiedKelvin::THESIS, depth, dt),
                    sigma: Newtons(0.02),
                }
            })
            .collect()
    }

    fn traced<'a>(
        samples: &'a [FitSample],
        name: &'a str,
        uncertainty: &'a ForceUncertainty,
    ) -> Traced<'a> {
        Traced {
            name,
            samples,
            calibration: Some((name, uncertainty)),
            compliance: None,
        }
    }

    /// The thesis's table as if it were printed with a digit more: small errors, so that the draws do not
    /// bend the curve.
    fn calibration() -> Calibration {
        Calibration {
            resolution: Some(Volts(0.001)),
            ..Calibration::thesis()
        }
    }

    #[test]
    fn it_is_what_draws_of_whole_calibrations_scatter() {
        let (samples, options) = (record(5.0), FitOptions::default());
        let calibration = calibration();
        let uncertainty = ForceUncertainty::of(&calibration).unwrap();
        let found = systematic(traced(&samples, "thesis", &uncertainty), &options).unwrap();
        let curve = calibration.curve().unwrap();
        let tare = curve.volts_from_newtons(Newtons(0.0));
        let mut random = SplitMix::seeded(5);
        let values = |samples: &[FitSample]| {
            let fitted = Fitted::of(samples, &options).unwrap();
            fitted.system.physical(&fitted.refined.points[0])
        };
        let before = values(&samples);
        let mut squares = [0.0; 8];
        let draws = 600;
        for _ in 0..draws {
            let mut drawn = calibration.clone();
            for step in &mut drawn.steps {
                step.volts.0 += 1e-3 / 12f64.sqrt() * random.normal();
            }
            let drawn = drawn.curve().unwrap();
            let zero = drawn.volts_from_newtons(Newtons(0.0));
            let read = |one: &FitSample| FitSample {
                force: drawn.newtons_from_volts(curve.volts_from_newtons(one.force) - tare + zero),
                ..*one
            };
            let again: Vec<FitSample> = samples.iter().map(read).collect();
            let after = values(&again);
            for k in 0..8 {
                squares[k] += (after[k] - before[k]).powi(2) / f64::from(draws);
            }
        }
        for (k, own) in found.parameters.iter().enumerate().take(5) {
            let digits = own
                .terms
                .iter()
                .find(|one| one.term == Term::Resolution)
                .unwrap();
            let drawn = squares[k].sqrt();
            // 600 draws know a standard deviation to 3 %, three times that and a little bend.
            assert!(
                (digits.error / drawn - 1.0).abs() < 0.12,
                "{}: {} against {drawn}",
                own.name,
                digits.error
            );
            let sum: f64 = own.terms.iter().map(|one| one.error.powi(2)).sum();
            assert!((own.error - sum.sqrt()).abs() <= 1e-12 * own.error);
        }
    }

    #[test]
    fn fewer_samples_tell_the_same() {
        let options = FitOptions::default();
        let uncertainty = ForceUncertainty::of(&calibration()).unwrap();
        let of = |samples: &[FitSample]| {
            systematic(traced(samples, "thesis", &uncertainty), &options).unwrap()
        };
        // Of 18 000 samples every fifth is taken; 1800 are taken whole.
        let (long, short) = (of(&record(200.0)), of(&record(20.0)));
        for (a, b) in long.parameters.iter().zip(&short.parameters).take(5) {
            assert!(
                (a.error / b.error - 1.0).abs() < 0.01,
                "{}: {} {}",
                a.name,
                a.error,
                b.error
            );
        }
    }

    #[test]
    fn a_calibration_that_states_nothing_adds_nothing_and_says_so() {
        let line = Calibration::linear("line", Volts(1.0), 0.1, Newtons(10.0));
        let uncertainty = ForceUncertainty::of(&line).unwrap();
        let (samples, options) = (record(5.0), FitOptions::default());
        let found = systematic(traced(&samples, "line", &uncertainty), &options).unwrap();
        let report = super::super::fit(&samples, &options)
            .unwrap()
            .with_systematic(&found);
        assert!(
            report
                .parameters
                .iter()
                .all(|one| one.systematic_error.is_none())
        );
        let sentence = report.findings.last().unwrap();
        assert!(sentence.contains("\"line\" states nothing"), "{sentence}");
        let uncertainty = ForceUncertainty::of(&Calibration::thesis()).unwrap();
        let found = systematic(traced(&samples, "thesis", &uncertainty), &options).unwrap();
        let report = super::super::fit(&samples, &options)
            .unwrap()
            .with_systematic(&found);
        let sentence = report.findings.last().unwrap();
        assert!(
            sentence.contains("digits of the readings, interpolation; not stated: tolerance"),
            "{sentence}"
        );
        assert!(!found.is_extrapolated);
        for parameter in &report.parameters {
            assert_eq!(
                parameter.systematic_error.is_some(),
                parameter.std_error.is_some()
            );
        }
    }

    #[test]
    fn records_of_one_calibration_move_together_and_of_two_apart() {
        let (one, options) = (record(5.0), FitOptions::default());
        let uncertainty = ForceUncertainty::of(&calibration()).unwrap();
        let joint = |names: [&str; 2]| {
            let both = names.map(|name| traced(&one, name, &uncertainty));
            systematic_joint(&both, &options, &PARAMETER_NAMES[..5]).unwrap()
        };
        let alone = systematic(traced(&one, "a", &uncertainty), &options).unwrap();
        let (same, apart) = (joint(["a", "a"]), joint(["a", "b"]));
        for (k, own) in alone.parameters.iter().enumerate().take(5) {
            // Twice the same record with the same error: the same as once.
            let ratio = same[0].parameters[k].error / own.error;
            assert!((ratio - 1.0).abs() < 1e-6, "{}: {ratio}", own.name);
            // Each moves half of the body, and both are independent: 1 / sqrt(2). Differences of a fit that bends
            // are a few percent off.
            let ratio = apart[1].parameters[k].error / own.error;
            assert!(
                (ratio - 0.5f64.sqrt()).abs() < 0.05,
                "{}: {ratio}",
                own.name
            );
        }
        let sentence = apart[0].sentence();
        assert!(
            sentence.starts_with("the calibration \"a\" and the calibration \"b\" add"),
            "{sentence}"
        );
        assert!(
            sentence.contains("(digits of the readings, interpolation; not stated: tolerance"),
            "{sentence}"
        );
    }

    #[test]
    fn of_two_calibrations_it_is_told_which_states_what() {
        let (one, options) = (record(5.0), FitOptions::default());
        let drifting = Calibration {
            zero_before: Some(Volts(1.28)),
            zero_after: Some(Volts(1.29)),
            ..calibration()
        };
        let straight = Calibration::linear("line", Volts(1.28), 0.15, Newtons(50.0));
        let told = |second: &Calibration| {
            let both = [&calibration(), second].map(|one| ForceUncertainty::of(one).unwrap());
            let records = [traced(&one, "a", &both[0]), traced(&one, "b", &both[1])];
            systematic_joint(&records, &options, &PARAMETER_NAMES[..5]).unwrap()[0].clone()
        };
        let found = told(&drifting);
        let sentence = found.sentence();
        assert!(
            sentence.contains(
                "(\"a\" states digits of the readings, interpolation, but not tolerance of the weights, repeatability, \
                 hysteresis, zero drift; \"b\" states digits of the readings, zero drift, interpolation, but not \
                 tolerance of the weights, repeatability, hysteresis)"
            ),
            "{sentence}"
        );
        assert!(found.stated_by[1].terms.contains(&Term::ZeroDrift));
        assert!(found.stated_by[0].not_stated.contains(&Term::ZeroDrift));
        let sentence = told(&straight).sentence();
        assert!(sentence.contains("; \"b\" states nothing)"), "{sentence}");
    }

    #[test]
    fn any_family_tells_the_same_of_the_same_body() {
        let (samples, options) = (record(5.0), FitOptions::default());
        let uncertainty = ForceUncertainty::of(&calibration()).unwrap();
        let traced = traced(&samples, "thesis", &uncertainty);
        let family = crate::families::by_key("series-3").unwrap();
        let options_of = FamilyOptions::default();
        let fit = super::super::fit_family(&*family, &[("it", &samples)], options_of).unwrap();
        let found = systematic_family(&fit, &*family, &[traced], options_of).unwrap();
        let known = systematic(traced, &options).unwrap();
        for own in &found.parameters {
            let Some(other) = known.parameters.iter().find(|one| one.name == own.name) else {
                continue;
            };
            // Two searches for the same minimum; that of a family ends where a step gains less than 1e-9 of the sum.
            assert!(
                (own.error / other.error - 1.0).abs() < 2e-3,
                "{own:?} {other:?}"
            );
        }
        assert!(
            found
                .parameters
                .iter()
                .filter(|one| one.error > 0.0)
                .count()
                >= 5
        );
        let told = fit.with_systematic(&found);
        assert!(
            told.parameters
                .iter()
                .all(|one| one.std_error.is_none() || one.systematic_error.is_some())
        );
    }

    #[test]
    fn a_compliance_known_badly_makes_stiffness_known_badly() {
        let (samples, options) = (record(5.0), FitOptions::default());
        let line = Calibration::linear("line", Volts(1.0), 0.1, Newtons(10.0));
        let uncertainty = ForceUncertainty::of(&line).unwrap();
        let with = |std_error| {
            let traced = Traced {
                compliance: Some(("stand", std_error)),
                ..traced(&samples, "line", &uncertainty)
            };
            systematic(traced, &options).unwrap()
        };
        // 1 um/N moves a depth of 30 mm by some micrometres; twice of it, twice as far.
        let (one, two) = (with(1e-3), with(2e-3));
        for (one, two) in one.parameters.iter().zip(&two.parameters).take(5) {
            assert!(
                one.error > 0.0 && one.compliance == Some(one.error),
                "{one:?}"
            );
            assert!(
                (two.error / one.error - 2.0).abs() < 0.02,
                "{one:?} {two:?}"
            );
        }
        let sentence = one.sentence();
        assert!(
            sentence.contains("the rig's compliance stand add"),
            "{sentence}"
        );
        assert!(
            sentence.contains("(what the rig gives way; not stated"),
            "{sentence}"
        );
    }
}
