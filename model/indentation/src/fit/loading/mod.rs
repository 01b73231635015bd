//! Young's modulus of a loading curve, with the position of contact as far as it is known.
//!
//! The force is the modulus times the law at the depth less the error of contact, and the force out of contact. Gauss's and
//! Newton's steps find all three; what is known of contact and zero counts as one more sample each. Uncertainties follow the law
//! of propagation (JCGM 100:2008, 5.1.2).

mod problem;
mod variations;

#[cfg(test)]
mod tests;

use super::residuals::{FittedSamples, ModulusNoise};
use crate::document::{Indenter, Specimen};
use crate::load_curve::LoadCurve;
use crate::validity::{ContactError, ContactLaw, Validity};
use palpate_model::estimate::coverage_factor;
use problem::{Found, LoadingProblem, MODULUS, SHIFT, ZERO};
use std::collections::BTreeMap;
use thiserror::Error;
pub(super) use variations::varied;

/// A sample of a loading curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadingSample {
    /// From the contact as it was found; below zero before it.
    pub depth_mm: f64,
    pub force_newtons: f64,
}

/// How well forces, contact and zero of a loading curve are known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadingKnowledge {
    /// Standard deviation of a force in N; `None` takes that of the residuals.
    pub noise_newtons: Option<f64>,
    /// Standard uncertainty of the contact in mm: zero for a contact that is certain, `None` for one that the curve alone
    /// shows.
    pub contact_error_mm: Option<f64>,
    /// Standard uncertainty in N of the force out of contact, which is read as zero: zero for one that is certain, `None` for
    /// one that the curve alone shows.
    pub zero_error_newtons: Option<f64>,
}

/// A source of uncertainty of a modulus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ModulusTerm {
    Noise,
    Contact,
    /// The force out of contact.
    ForceZero,
    /// Of the indenter.
    Radius,
    HalfAngle,
    TipRadius,
    Chamfer,
    Thickness,
    Poisson,
}

impl ModulusTerm {
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Noise => "noise",
            Self::Contact => "contact",
            Self::ForceZero => "force zero",
            Self::Radius => "radius",
            Self::HalfAngle => "half angle",
            Self::TipRadius => "tip radius",
            Self::Chamfer => "chamfer",
            Self::Thickness => "thickness",
            Self::Poisson => "Poisson's ratio",
        }
    }
}

/// A modulus and what makes it uncertain.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadingFit {
    pub modulus_mpa: f64,
    /// By how much deeper than found the contact is, in mm.
    pub contact_shift_mm: f64,
    /// The force out of contact, in N.
    pub force_zero_newtons: f64,
    /// Root mean square of the residuals in N.
    pub residual_newtons: f64,
    /// Force less that of the law, sample by sample, in N.
    pub residuals_newtons: Vec<f64>,
    /// What each source adds, in MPa.
    pub terms: BTreeMap<ModulusTerm, f64>,
    /// Degrees of freedom of the noise, for Student's t; infinite where the noise was known and describes the residuals.
    pub noise_freedom: f64,
    /// How the deepest contact stands in the range of the law.
    pub validity: Validity,
    /// By how much the modulus rises for a force of one newton more, sample by sample, in MPa/N.
    influence: Vec<f64>,
}

#[derive(Clone, Debug, PartialEq, Error)]
pub enum LoadingFitError {
    #[error(transparent)]
    Contact(#[from] ContactError),
    #[error("the loading reaches {depth_mm:.4} mm behind the contact, and {reason}")]
    TooDeep { depth_mm: f64, contact_shift_mm: f64, reason: ContactError },
    #[error(
        "the loading has {count} samples from the contact to its greatest force; give at least {SAMPLES_MIN}: press deeper or slower, and check the signs of force and depth"
    )]
    Samples { count: usize },
    #[error(
        "sample {index} has the depth {depth_mm} mm and the force {force_newtons} N; give finite numbers"
    )]
    Sample { index: usize, depth_mm: f64, force_newtons: f64 },
    #[error("{name} is {value}; give {wanted}")]
    Knowledge { name: &'static str, value: f64, wanted: &'static str },
    #[error(
        "the force does not grow with the depth as that of a contact does; check the signs of force and depth"
    )]
    NoContact,
    #[error(
        "the contact would be {shift_mm:.4} mm deeper than found, {errors:.1} times its standard uncertainty; find the contact again, or leave it to the curve"
    )]
    ContactMoved { shift_mm: f64, errors: f64 },
    #[error(
        "the force out of contact would be {zero_newtons:.4e} N, {errors:.1} times its standard uncertainty; tare again, or leave it to the curve"
    )]
    ZeroMoved { zero_newtons: f64, errors: f64 },
    #[error(
        "the loading begins in contact and does not show the force out of contact; record the approach too, or state how well the force zero is known"
    )]
    NoApproach,
}

/// A record that begins far above the specimen is a hundred thousand times as long as the part that the law describes.
const SHORTER_MAX: usize = 40;
/// Rounds until the weight of the samples stays to a hundredth, which is little beside how well it is known.
const ROUNDS_MAX: usize = 10;
const WEIGHT_CHANGE: f64 = 0.01;
/// Fewer in contact give no residual to judge by, and fewer before it no force out of contact.
const SAMPLES_MIN: usize = 5;
/// Of a standard uncertainty of contact or zero: beyond, it or the law is wrong.
const ERRORS_MAX: f64 = 5.0;

/// The modulus by which the law meets the samples best. Samples are in order of time, and the indenter is pressed in.
pub fn fit_loading(
    law: ContactLaw,
    indenter: &Indenter,
    specimen: &Specimen,
    samples: &[LoadingSample],
    knowledge: LoadingKnowledge,
) -> Result<LoadingFit, LoadingFitError> {
    check(samples, knowledge)?;
    let search = Search { samples, knowledge };
    let depth_max = samples.iter().map(|one| one.depth_mm).fold(f64::NEG_INFINITY, f64::max);
    let lowest = samples.iter().map(|one| one.depth_mm).fold(f64::INFINITY, f64::min);
    // A contact that the curve alone shows may be anywhere along it.
    let mut starts: Vec<f64> = match knowledge.contact_error_mm {
        Some(_) => vec![0.0],
        None => (0..24).map(|i| lowest + (depth_max - lowest) * f64::from(i) / 25.0).collect(),
    };
    let mut deepest = match knowledge.contact_error_mm {
        Some(_) => depth_max,
        None => depth_max - lowest,
    };
    let mut variance = knowledge.noise_newtons.map_or(0.0, |noise| noise * noise);
    let mut weight = variance;
    // Every round gives the depth behind the contact as fitted, the noise where it is not known, and what residuals that last
    // count for beside what was known before.
    for round in 0..ROUNDS_MAX {
        let curve = curve_of_any(law, indenter, specimen, deepest)?;
        let (problem, found) = search.solve(curve, weight, &starts)?;
        deepest = depth_max - found.at[SHIFT];
        starts = vec![found.at[SHIFT]];
        if !(deepest > 0.0 && found.at[MODULUS] > 0.0) {
            return Err(LoadingFitError::NoContact);
        }
        if knowledge.noise_newtons.is_none() {
            variance = found.squares / search.freedom();
        }
        let last = weight;
        weight = search.weight(&problem, &found, variance);
        if round > 0 && (weight - last).abs() <= WEIGHT_CHANGE * weight {
            break;
        }
    }
    let curve =
        LoadCurve::new(law, indenter, specimen, deepest).map_err(|reason| match reason {
            ContactError::Outside { .. } => {
                let contact_shift_mm = depth_max - deepest;
                LoadingFitError::TooDeep { depth_mm: deepest, contact_shift_mm, reason }
            }
            reason => reason.into(),
        })?;
    let (problem, found) = search.solve(curve, weight, &starts)?;
    search.check(&found)?;
    let mut terms = search.terms_of_the_known(&problem, &found);
    let noise = search.noise(&problem, &found, variance);
    terms.insert(ModulusTerm::Noise, noise.mpa);
    for (term, [low, high]) in varied(indenter, specimen) {
        let modulus = |(indenter, specimen): (Indenter, Specimen)| {
            let curve = curve_of_any(law, &indenter, &specimen, deepest)?;
            Ok::<_, LoadingFitError>(search.solve(curve, weight, &starts)?.1.at[MODULUS])
        };
        let half = 0.5 * (modulus(high)? - modulus(low)?);
        terms.insert(term, half.abs());
    }
    let residuals = problem.residuals(&found);
    let squares = residuals.iter().map(|one| one * one).sum::<f64>();
    Ok(LoadingFit {
        modulus_mpa: found.at[MODULUS],
        contact_shift_mm: found.at[SHIFT],
        force_zero_newtons: found.at[ZERO],
        residual_newtons: (squares / samples.len() as f64).sqrt(),
        residuals_newtons: residuals,
        terms,
        noise_freedom: noise.freedom,
        validity: law.validity(indenter, specimen, deepest)?,
        influence: problem.influence(&found),
    })
}

/// A loading and what is known of it.
struct Search<'a> {
    samples: &'a [LoadingSample],
    knowledge: LoadingKnowledge,
}

impl<'a> Search<'a> {
    fn is_free(&self) -> [bool; 3] {
        let LoadingKnowledge { contact_error_mm, zero_error_newtons, .. } = self.knowledge;
        [true, contact_error_mm != Some(0.0), zero_error_newtons != Some(0.0)]
    }

    /// Whether contact or zero is known, but not exactly.
    fn is_any_known(&self) -> bool {
        let LoadingKnowledge { contact_error_mm, zero_error_newtons, .. } = self.knowledge;
        [contact_error_mm, zero_error_newtons].iter().flatten().any(|error| *error > 0.0)
    }

    fn freedom(&self) -> f64 {
        let unknowns = self.is_free().into_iter().filter(|is_free| *is_free).count();
        (self.samples.len() - unknowns) as f64
    }

    /// What samples count for beside what was known before: the variance of independent noise that would make the modulus as
    /// uncertain as the residuals do. Without it thousands of samples of a law that is wrong would overrule a measured contact.
    fn weight(&self, problem: &LoadingProblem<'_>, found: &Found, variance: f64) -> f64 {
        if !self.is_any_known() {
            return variance;
        }
        let influence: f64 = problem.influence(found).iter().map(|one| one * one).sum();
        self.noise(problem, found, variance).mpa.powi(2) / influence
    }

    fn noise(&self, problem: &LoadingProblem<'_>, found: &Found, variance: f64) -> ModulusNoise {
        let forces: Vec<f64> = self.samples.iter().map(|one| one.force_newtons).collect();
        let fitted = FittedSamples {
            forces: &forces,
            residuals: &problem.residuals(found),
            columns: &problem.columns(found),
            influence: &problem.influence(found),
        };
        let freedom = self.knowledge.noise_newtons.map_or(self.freedom(), |_| f64::INFINITY);
        fitted.modulus_noise((variance, freedom))
    }

    fn solve(
        &self,
        curve: LoadCurve,
        variance: f64,
        starts: &[f64],
    ) -> Result<(LoadingProblem<'a>, Found), LoadingFitError> {
        let prior = |error: Option<f64>| match error {
            Some(error) if error > 0.0 => variance / (error * error),
            _ => 0.0,
        };
        let LoadingKnowledge { contact_error_mm, zero_error_newtons, .. } = self.knowledge;
        let prior = [0.0, prior(contact_error_mm), prior(zero_error_newtons)];
        let problem =
            LoadingProblem { samples: self.samples, curve, prior, is_free: self.is_free() };
        let found = problem.solve(starts)?;
        Ok((problem, found))
    }

    fn check(&self, found: &Found) -> Result<(), LoadingFitError> {
        let is_before = |one: &&LoadingSample| one.depth_mm <= found.at[SHIFT];
        let before = self.samples.iter().filter(is_before).count();
        if self.knowledge.zero_error_newtons.is_none() && before < SAMPLES_MIN {
            return Err(LoadingFitError::NoApproach);
        }
        let errors = |moved: f64, error: Option<f64>| {
            error.filter(|error| *error > 0.0).map_or(0.0, |error| moved.abs() / error)
        };
        let of_contact = errors(found.at[SHIFT], self.knowledge.contact_error_mm);
        if of_contact > ERRORS_MAX {
            let shift_mm = found.at[SHIFT];
            return Err(LoadingFitError::ContactMoved { shift_mm, errors: of_contact });
        }
        let of_zero = errors(found.at[ZERO], self.knowledge.zero_error_newtons);
        if of_zero > ERRORS_MAX {
            let zero_newtons = found.at[ZERO];
            return Err(LoadingFitError::ZeroMoved { zero_newtons, errors: of_zero });
        }
        Ok(())
    }

    /// What errors of contact and zero do to the modulus, as far as the samples leave them.
    fn terms_of_the_known(
        &self,
        problem: &LoadingProblem<'_>,
        found: &Found,
    ) -> BTreeMap<ModulusTerm, f64> {
        let LoadingKnowledge { contact_error_mm, zero_error_newtons, .. } = self.knowledge;
        let known = [
            (ModulusTerm::Contact, SHIFT, contact_error_mm),
            (ModulusTerm::ForceZero, ZERO, zero_error_newtons),
        ];
        let moved = |(term, unknown, error): (ModulusTerm, usize, Option<f64>)| {
            let share = problem.prior[unknown] * found.covariance[MODULUS][unknown].abs();
            Some((term, share * error?))
        };
        known.into_iter().filter_map(moved).collect()
    }
}

/// The curve up to a depth, or up to the part of it that the law describes: what is refused is refused at the end.
fn curve_of_any(
    law: ContactLaw,
    indenter: &Indenter,
    specimen: &Specimen,
    depth_max: f64,
) -> Result<LoadCurve, LoadingFitError> {
    let mut depth = depth_max;
    for _ in 0..SHORTER_MAX {
        match LoadCurve::new(law, indenter, specimen, depth) {
            Ok(curve) => return Ok(curve),
            // Outside of the range, or beyond the end of the shape or of what is solved.
            Err(_) => depth *= 0.75,
        }
    }
    LoadCurve::new(law, indenter, specimen, depth_max).map_err(LoadingFitError::from)
}

fn check(samples: &[LoadingSample], knowledge: LoadingKnowledge) -> Result<(), LoadingFitError> {
    let is_known = |one: &LoadingSample| one.depth_mm.is_finite() && one.force_newtons.is_finite();
    if let Some(index) = samples.iter().position(|one| !is_known(one)) {
        let LoadingSample { depth_mm, force_newtons } = samples[index];
        return Err(LoadingFitError::Sample { index, depth_mm, force_newtons });
    }
    let refused = |name, value, wanted| Err(LoadingFitError::Knowledge { name, value, wanted });
    if let Some(value) = knowledge.noise_newtons.filter(|value| *value <= 0.0 || !value.is_finite())
    {
        return refused("the noise of the force", value, "newtons above 0");
    }
    let is_impossible = |value: &f64| *value < 0.0 || !value.is_finite();
    if let Some(value) = knowledge.contact_error_mm.filter(is_impossible) {
        return refused("the standard uncertainty of the contact", value, "mm, not below 0");
    }
    if let Some(value) = knowledge.zero_error_newtons.filter(is_impossible) {
        return refused(
            "the standard uncertainty of the force zero",
            value,
            "newtons, not below 0",
        );
    }
    let is_known = knowledge.contact_error_mm.is_some();
    let count = samples.iter().filter(|one| !is_known || one.depth_mm > 0.0).count();
    if count < SAMPLES_MIN {
        return Err(LoadingFitError::Samples { count });
    }
    Ok(())
}

impl LoadingFit {
    /// Combined standard uncertainty in MPa of all terms.
    #[must_use]
    pub fn standard_uncertainty(&self) -> f64 {
        self.terms.values().map(|one| one * one).sum::<f64>().sqrt()
    }

    /// The standard uncertainties in half of a 95 % interval of a modulus of this variance in MPa²: Student's t for as many
    /// degrees of freedom as Welch's and Satterthwaite's formula gives (JCGM 100:2008, G.4.1).
    #[must_use]
    pub fn coverage_factor(&self, variance: f64) -> f64 {
        coverage_factor(self.terms[&ModulusTerm::Noise], self.noise_freedom, variance)
    }

    /// 95 % interval in MPa of all terms.
    #[must_use]
    pub fn interval95(&self) -> [f64; 2] {
        let error = self.standard_uncertainty();
        let half = self.coverage_factor(error * error) * error;
        [self.modulus_mpa - half, self.modulus_mpa + half]
    }

    /// By how much errors of the forces in N, one for each sample, move the modulus in MPa.
    #[must_use]
    pub fn shift_by(&self, errors_newtons: impl IntoIterator<Item = f64>) -> f64 {
        self.influence.iter().zip(errors_newtons).map(|(own, error)| own * error).sum()
    }
}
