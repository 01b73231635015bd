//! What errors of the calibration do to fitted parameters. They are the same in every sample, so residuals do not
//! show them and no repeat takes them away: they are told beside the statistical error, not in it.
//!
//! Every independent error of the calibration is moved by one standard uncertainty, all forces are read again,
//! and the fit is made again; the root of the sum of squared changes is the systematic standard uncertainty
//! (JCGM 100:2008, section 5.1, with the derivatives as differences).

use super::options::{FitOptions, PARAMETER_NAMES};
use super::report::FitReport;
use super::sample::{FitError, FitSample};
use super::solve::Fitted;
use crate::calibration::{ForceUncertainty, Term};
use crate::units::Newtons;
use serde::Serialize;

/// More samples than this tell the change no better: it is no matter of noise, for the same samples are
/// fitted before and after. Longer records are taken at every second, third, ... sample.
const SAMPLES_MAX: usize = 4000;

/// What the calibration adds to the uncertainty of a fit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Systematic {
    /// Name of the calibration.
    pub calibration: String,
    /// Every parameter; empty where the calibration states nothing of its errors.
    pub parameters: Vec<SystematicError>,
    /// Terms that the calibration does not state.
    pub not_stated: Vec<Term>,
    /// Whether forces beyond the heaviest weight were fitted, so that the true error is larger.
    pub is_extrapolated: bool,
}

/// The systematic standard uncertainty of one parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SystematicError {
    /// The parameter.
    pub name: String,
    /// All terms together, in its unit.
    pub error: f64,
    /// Each term, in its unit.
    pub terms: Vec<TermError>,
}

/// The part of one term.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TermError {
    /// Where it comes from.
    pub term: Term,
    /// Its standard uncertainty.
    pub error: f64,
}

/// The systematic uncertainties of a fit of `samples` with `options`, whose forces were read with a
/// calibration of this name and uncertainty.
///
/// Costs a fit of at most 4000 samples for each independent error, of which there are as many as twice
/// the weights or more.
pub fn systematic(
    samples: &[FitSample],
    options: &FitOptions,
    name: &str,
    uncertainty: &ForceUncertainty,
) -> Result<Systematic, FitError> {
    let stride = samples.len().div_ceil(SAMPLES_MAX).max(1);
    let taken: Vec<FitSample> = samples.iter().step_by(stride).copied().collect();
    let mut found = Systematic {
        calibration: name.to_owned(),
        parameters: Vec::new(),
        not_stated: uncertainty.not_stated().to_vec(),
        is_extrapolated: samples
            .iter()
            .any(|one| one.is_measured() && one.force > uncertainty.force_max()),
    };
    if !uncertainty.is_stated() {
        return Ok(found);
    }
    let before = values(&taken, options)?;
    let mut squares: Vec<(Term, [f64; PARAMETER_NAMES.len()])> = Vec::new();
    for (index, term) in uncertainty.errors().enumerate() {
        let moved: Vec<FitSample> = taken
            .iter()
            .map(|one| moved(one, uncertainty, index))
            .collect();
        if moved == taken {
            continue;
        }
        let after = values(&moved, options)?;
        if squares.last().is_none_or(|(last, _)| *last != term) {
            squares.push((term, [0.0; PARAMETER_NAMES.len()]));
        }
        if let Some((_, sums)) = squares.last_mut() {
            for (sum, (after, before)) in sums.iter_mut().zip(after.iter().zip(&before)) {
                *sum += (after - before).powi(2);
            }
        }
    }
    found.parameters = PARAMETER_NAMES
        .iter()
        .enumerate()
        .map(|(k, name)| SystematicError {
            name: (*name).to_owned(),
            error: squares.iter().map(|(_, sums)| sums[k]).sum::<f64>().sqrt(),
            terms: squares
                .iter()
                .map(|(term, sums)| TermError {
                    term: *term,
                    error: sums[k].sqrt(),
                })
                .collect(),
        })
        .collect();
    Ok(found)
}

/// A sample as another calibration would have read it. Its weight in the fit stays.
fn moved(sample: &FitSample, uncertainty: &ForceUncertainty, error: usize) -> FitSample {
    if !sample.is_measured() {
        return *sample;
    }
    FitSample {
        force: Newtons(sample.force.0 + uncertainty.shift(error, sample.force).0),
        ..*sample
    }
}

fn values(
    samples: &[FitSample],
    options: &FitOptions,
) -> Result<[f64; PARAMETER_NAMES.len()], FitError> {
    let fitted = Fitted::of(samples, options)?;
    Ok(fitted.system.physical(&fitted.refined.points[0]))
}

impl Systematic {
    /// One sentence on what was added and what could not be.
    #[must_use]
    pub fn sentence(&self) -> String {
        let name = &self.calibration;
        let words = |terms: &mut dyn Iterator<Item = Term>| {
            let words: Vec<&str> = terms.map(Term::word).collect();
            words.join(", ")
        };
        let Some(first) = self.parameters.first() else {
            return format!(
                "the calibration \"{name}\" states nothing of its own errors, so a systematic part is not told"
            );
        };
        let stated = words(&mut first.terms.iter().map(|one| one.term));
        let missing = match self.not_stated.as_slice() {
            [] => String::new(),
            terms => format!("; not stated: {}", words(&mut terms.iter().copied())),
        };
        let beyond = match self.is_extrapolated {
            true => {
                "; forces beyond its heaviest weight are extrapolated, so the true error is larger"
            }
            false => "",
        };
        format!(
            "the calibration \"{name}\" adds the error marked so, one standard uncertainty that repeats do not take away ({stated}{missing}){beyond}"
        )
    }
}

impl FitReport {
    /// This report with the systematic errors beside the statistical ones, and the sentence on them.
    #[must_use]
    pub fn with_systematic(mut self, systematic: &Systematic) -> Self {
        for own in &systematic.parameters {
            let parameter = self.parameters.iter_mut().find(|one| one.name == own.name);
            if let Some(parameter) = parameter.filter(|one| one.std_error.is_some()) {
                parameter.systematic_error = Some(own.error);
            }
        }
        self.findings.push(systematic.sentence());
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
        let found = systematic(&samples, &options, "thesis", &uncertainty).unwrap();
        let curve = calibration.curve().unwrap();
        let tare = curve.volts_from_newtons(Newtons(0.0));
        let mut random = SplitMix::seeded(5);
        let before = values(&samples, &options).unwrap();
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
            let after = values(&again, &options).unwrap();
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
        let of =
            |samples: &[FitSample]| systematic(samples, &options, "thesis", &uncertainty).unwrap();
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
        let found = systematic(&samples, &options, "line", &uncertainty).unwrap();
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
        let found = systematic(&samples, &options, "thesis", &uncertainty).unwrap();
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
}
