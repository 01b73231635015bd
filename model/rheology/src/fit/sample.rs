//! Samples of a fit, and its errors.

use palpate_model::units::{Depth, Newtons, Seconds};
use thiserror::Error;

/// A record's name and its samples.
pub(super) type NamedSamples<'a> = (&'a str, &'a [FitSample]);

/// One sample of an indentation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitSample {
    /// When, in s on any clock; must increase from sample to sample.
    pub t: Seconds,
    /// Depth of the probe. Between samples it is taken to move straight.
    pub depth: Depth,
    pub force: Newtons,
    /// Standard deviation of this force; the sample weighs `1 / sigma^2`. Infinite for a censored
    /// sample, one whose force is not known (a saturated load cell, a reading distrusted by an
    /// interlock): its depth counts, its force does not and may be anything.
    pub sigma: Newtons,
}

impl FitSample {
    /// Whether its force counts.
    pub fn is_measured(&self) -> bool {
        self.sigma.0 < f64::INFINITY
    }
}

/// A fit could not be made; the text says what to change.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum FitError {
    #[error(
        "the record has {samples} sample(s) with a force and the fit has {parameters} free parameter(s); record more samples or fix parameters"
    )]
    TooFewSamples { samples: usize, parameters: usize },
    #[error("sample {index} has a {what} of {value}; remove samples whose numbers are not finite")]
    NotFinite { index: usize, what: &'static str, value: f64 },
    #[error(
        "the record has a {what} of {value:e} {unit}, but a fit needs numbers between 1e-50 and 1e50; check the unit"
    )]
    Scale { what: &'static str, value: f64, unit: &'static str },
    #[error(
        "sample {index} has a force uncertainty of {sigma} N; the uncertainty must be greater than zero"
    )]
    SigmaNotPositive { index: usize, sigma: f64 },
    #[error(
        "sample {index} is at {t} s, but the sample before is at {before} s; times must increase, so remove repeated samples and sort the record"
    )]
    TimeNotIncreasing { index: usize, t: f64, before: f64 },
    #[error(
        "the depth never exceeds {deepest} mm and contact is at {contact} mm, so the probe never enters the tissue; check the contact position"
    )]
    NeverInTissue { deepest: f64, contact: f64 },
    #[error("this record cannot separate {}: {advice}", list(.names))]
    Inseparable { names: Vec<String>, advice: String },
    #[error("{record}: {reason}")]
    InRecord { record: String, reason: Box<FitError> },
    #[error("{name} belongs to one recording and cannot be shared; share any of {known}")]
    NotShareable { name: String, known: String },
    #[error(
        "the residuals are autocorrelated for so long that the record has only {blocks} independent block(s), but a bootstrap needs {needed}; use the intervals of the fit or of the profile"
    )]
    TooFewBlocks { blocks: usize, needed: usize },
    #[error(
        "the force stays at {force} N, so the force does not depend on the tissue; check the load cell and the columns"
    )]
    ConstantForce { force: f64 },
    #[error(
        "the depth stays at {depth} mm, so the probe does not indent the tissue; move deeper, or check the columns"
    )]
    ConstantDepth { depth: f64 },
    #[error("the model has no parameter '{name}'; it has {known}")]
    UnknownParameter { name: String, known: String },
    #[error("{name} cannot be fixed at {value}; {reason}")]
    BadValue { name: String, value: f64, reason: &'static str },
    #[error(
        "{name} is {value:.4}, which has no logarithm; leave it out of the parameters, or take another family"
    )]
    NoLogarithm { name: String, value: f64 },
    #[error("{name} is fixed, so the record says nothing of it; leave it out of the parameters")]
    NotFitted { name: String },
    #[error(
        "the best {name} lies at an end of its searched range, so the record does not determine it; leave it out of the parameters"
    )]
    AtRangeEnd { name: String },
    #[error("{family}: {reason}")]
    Unsupported { family: String, reason: String },
    #[error(
        "the fit produced numbers that are not finite; check the units of depth (mm) and force (N)"
    )]
    Overflow,
}

/// Largest and least size of depths, forces and their uncertainties: a fit forms fifth powers of depths
/// and squares of forces, and their quotients, which doubles hold up to 1.8e308.
const SIZES: std::ops::RangeInclusive<f64> = 1e-50..=1e50;

/// Refuses samples whose sizes leave no room for a fit.
pub(super) fn check_scale(samples: &[FitSample]) -> Result<(), FitError> {
    let measured = || samples.iter().filter(|sample| sample.is_measured());
    let largest = |values: &mut dyn Iterator<Item = f64>| {
        values.fold(0.0f64, |largest, value| largest.max(value.abs()))
    };
    let depth = largest(&mut samples.iter().map(|one| one.depth.0));
    let force = largest(&mut measured().map(|one| one.force.0));
    let sizes = [("largest depth", "mm", depth), ("largest force", "N", force)];
    let sigmas = measured().map(|one| ("force uncertainty", "N", one.sigma.0));
    match sizes.into_iter().chain(sigmas).find(|(.., value)| !SIZES.contains(value)) {
        Some((what, unit, value)) => Err(FitError::Scale { what, value, unit }),
        None => Ok(()),
    }
}

fn list(names: &[String]) -> String {
    match names {
        [] => String::new(),
        [only] => format!("{only} from the others"),
        [one, other] => format!("{one} from {other}"),
        [rest @ .., last] => format!("{} and {last}", rest.join(", ")),
    }
}

/// Checks every number and the order of times.
pub(super) fn check_samples(samples: &[FitSample]) -> Result<(), FitError> {
    let mut before = f64::NEG_INFINITY;
    for (index, sample) in samples.iter().enumerate() {
        let named = [("time", sample.t.0), ("depth", sample.depth.0), ("force", sample.force.0)];
        // The force of a censored sample means nothing.
        let counted = if sample.is_measured() { 3 } else { 2 };
        let bad = named[..counted].iter().find(|(_, value)| !value.is_finite());
        if let Some(&(what, value)) = bad {
            return Err(FitError::NotFinite { index, what, value });
        }
        if sample.sigma.0.is_nan() || sample.sigma.0 <= 0.0 {
            return Err(FitError::SigmaNotPositive { index, sigma: sample.sigma.0 });
        }
        if sample.t.0 <= before {
            return Err(FitError::TimeNotIncreasing { index, t: sample.t.0, before });
        }
        before = sample.t.0;
    }
    Ok(())
}
