//! Young's modulus of a loading curve, with the position of contact as far as it is known.
//!
//! The force is the modulus times the law at the depth less the error of contact. Gauss's and Newton's steps find both; the
//! knowledge of the contact counts as one more sample. Uncertainties follow the law of propagation (JCGM 100:2008, 5.1.2).

use crate::document::{Indenter, Quantity, Specimen};
use crate::load_curve::LoadCurve;
use crate::validity::{ContactError, ContactLaw, Validity};
use std::collections::BTreeMap;
use thiserror::Error;

/// A sample of a loading curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadingSample {
    /// From the contact as it was found; below zero before it.
    pub depth_mm: f64,
    pub force_newtons: f64,
}

/// How well forces and the contact of a loading curve are known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadingKnowledge {
    /// Standard deviation of a force in N; `None` takes that of the residuals.
    pub noise_newtons: Option<f64>,
    /// Standard uncertainty of the contact in mm: zero for a contact that is certain, `None` for one that the curve alone
    /// shows.
    pub contact_error_mm: Option<f64>,
}

/// A source of uncertainty of a modulus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ModulusTerm {
    Noise,
    Contact,
    /// Of the indenter.
    Radius,
    HalfAngle,
    Thickness,
    Poisson,
}

impl ModulusTerm {
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Noise => "noise",
            Self::Contact => "contact",
            Self::Radius => "radius",
            Self::HalfAngle => "half angle",
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
    /// Root mean square of the residuals in N.
    pub residual_newtons: f64,
    /// What each source adds, in MPa.
    pub terms: BTreeMap<ModulusTerm, f64>,
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
}

/// Fewer give no residual to judge by.
const SAMPLES_MIN: usize = 5;
/// Steps until the modulus stays to 1e-10; the sum of squares is nearly a parabola, so ten are many.
const STEPS_MAX: usize = 60;
/// Of a standard uncertainty of the contact: beyond, one of the two is wrong.
const CONTACT_ERRORS_MAX: f64 = 5.0;

struct Found {
    modulus: f64,
    shift: f64,
    squares: f64,
    /// Of modulus and shift for forces of unit variance, the prior included.
    covariance: [[f64; 2]; 2],
}

struct LoadingProblem<'a> {
    samples: &'a [LoadingSample],
    curve: LoadCurve,
    /// Squared noise over the squared uncertainty of the contact: what a shift of 1 mm adds to the sum of squares.
    prior: f64,
    is_contact_free: bool,
}

impl LoadingProblem<'_> {
    fn sums(&self, modulus: f64, shift: f64) -> ([[f64; 2]; 2], [f64; 2], f64) {
        let (mut normal, mut gradient, mut squares) = ([[0.0; 2]; 2], [0.0; 2], 0.0);
        for sample in self.samples {
            let [force, slope] = self.curve.at(sample.depth_mm - shift);
            let row = [force, -modulus * slope];
            let residual = sample.force_newtons - modulus * force;
            for (i, own) in row.iter().enumerate() {
                gradient[i] += own * residual;
                normal[i][0] += own * row[0];
                normal[i][1] += own * row[1];
            }
            squares += residual * residual;
        }
        normal[1][1] += self.prior;
        gradient[1] -= self.prior * shift;
        (normal, gradient, squares + self.prior * shift * shift)
    }

    /// The modulus that fits best where the contact is, and its sum of squares.
    fn modulus_at(&self, shift: f64) -> (f64, f64) {
        let pairs = self.samples.iter().map(|one| (self.curve.at(one.depth_mm - shift)[0], one));
        let (over, under) = pairs.fold((0.0, 0.0), |(over, under), (force, one)| {
            (over + force * one.force_newtons, under + force * force)
        });
        let modulus = over / under;
        (modulus, self.sums(modulus, shift).2)
    }

    /// From the best of some contacts, in steps that lessen the sum of squares.
    fn solve(&self, starts: &[f64]) -> Option<Found> {
        let tried = starts.iter().map(|shift| (self.modulus_at(*shift), *shift));
        let known = tried.filter(|((_, squares), _)| squares.is_finite());
        let ((mut modulus, mut squares), mut shift) =
            known.min_by(|a, b| a.0.1.total_cmp(&b.0.1))?;
        let (mut normal, mut gradient, _) = self.sums(modulus, shift);
        for _ in 0..STEPS_MAX {
            let step = match self.is_contact_free {
                true => {
                    let inverse = inverse(normal)?;
                    inverse.map(|row| row[0] * gradient[0] + row[1] * gradient[1])
                }
                false => [gradient[0] / normal[0][0], 0.0],
            };
            let mut share = 1.0;
            let next = loop {
                let next = (modulus + share * step[0], shift + share * step[1]);
                let sums = self.sums(next.0, next.1);
                if sums.2 <= squares {
                    break Some((next, sums));
                }
                share *= 0.5;
                if share < 1e-6 {
                    break None;
                }
            };
            let Some((next, sums)) = next else { break };
            let change = (next.0 / modulus - 1.0).abs();
            ((modulus, shift), (normal, gradient, squares)) = (next, sums);
            if change < 1e-12 {
                break;
            }
        }
        let covariance = match self.is_contact_free {
            true => inverse(normal)?,
            false => [[1.0 / normal[0][0], 0.0], [0.0; 2]],
        };
        Some(Found { modulus, shift, squares, covariance })
    }

    /// By how much the modulus rises with each force.
    fn influence(&self, found: &Found) -> Vec<f64> {
        let [[of_modulus, with_shift], _] = found.covariance;
        let one = |sample: &LoadingSample| {
            let [force, slope] = self.curve.at(sample.depth_mm - found.shift);
            of_modulus * force - with_shift * found.modulus * slope
        };
        self.samples.iter().map(one).collect()
    }
}

fn inverse([[a, b], [c, d]]: [[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
    let determinant = a * d - b * c;
    // Two columns that are one to rounding tell nothing apart.
    (determinant > 1e-12 * a * d)
        .then(|| [[d / determinant, -b / determinant], [-c / determinant, a / determinant]])
}

/// The modulus by which the law meets the samples best. Samples are in order of time, and the indenter is pressed in.
pub fn fit_loading(
    law: ContactLaw,
    indenter: &Indenter,
    specimen: &Specimen,
    samples: &[LoadingSample],
    knowledge: LoadingKnowledge,
) -> Result<LoadingFit, LoadingFitError> {
    check(samples, knowledge)?;
    let depth_max = samples.iter().map(|one| one.depth_mm).fold(f64::NEG_INFINITY, f64::max);
    let count = samples.iter().filter(|one| one.depth_mm > 0.0).count();
    let is_certain = knowledge.contact_error_mm == Some(0.0);
    let count = if knowledge.contact_error_mm.is_some() { count } else { samples.len() };
    if count < SAMPLES_MIN {
        return Err(LoadingFitError::Samples { count });
    }
    let lowest = samples.iter().map(|one| one.depth_mm).fold(f64::INFINITY, f64::min);
    // A contact that the curve alone shows may be anywhere along it.
    let starts: Vec<f64> = match knowledge.contact_error_mm {
        Some(_) => vec![0.0],
        None => (0..24).map(|i| lowest + (depth_max - lowest) * f64::from(i) / 25.0).collect(),
    };
    let noise = knowledge.noise_newtons;
    let solve = |curve: LoadCurve, variance: f64, starts: &[f64]| {
        let prior = match knowledge.contact_error_mm {
            Some(error) if error > 0.0 => variance / (error * error),
            _ => 0.0,
        };
        let problem = LoadingProblem { samples, curve, prior, is_contact_free: !is_certain };
        let found = problem.solve(starts).ok_or(LoadingFitError::NoContact)?;
        Ok::<_, LoadingFitError>((problem, found))
    };
    let freedom = (samples.len() - 1 - usize::from(!is_certain)) as f64;
    let mut deepest = depth_max;
    let mut variance = noise.map_or(0.0, |noise| noise * noise);
    // The first round gives the depth behind the contact as fitted and, where the noise is not known, its size.
    let mut starts = starts;
    for _ in 0..2 {
        let (_, found) = solve(curve_of_any(law, indenter, specimen, deepest)?, variance, &starts)?;
        if noise.is_none() {
            variance = found.squares / freedom;
        }
        deepest = depth_max - found.shift;
        starts = vec![found.shift];
        if !(deepest > 0.0 && found.modulus > 0.0) {
            return Err(LoadingFitError::NoContact);
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
    let (problem, found) = solve(curve, variance, &starts)?;
    if let Some(error) = knowledge.contact_error_mm.filter(|error| *error > 0.0) {
        let errors = found.shift.abs() / error;
        if errors > CONTACT_ERRORS_MAX {
            return Err(LoadingFitError::ContactMoved { shift_mm: found.shift, errors });
        }
    }
    let influence = problem.influence(&found);
    let residuals = samples.iter().map(|one| {
        (one.force_newtons - found.modulus * problem.curve.at(one.depth_mm - found.shift)[0])
            .powi(2)
    });
    let residual_newtons = (residuals.sum::<f64>() / samples.len() as f64).sqrt();
    let mut terms = BTreeMap::new();
    let of_noise = variance.sqrt() * influence.iter().map(|one| one * one).sum::<f64>().sqrt();
    terms.insert(ModulusTerm::Noise, of_noise);
    if let Some(error) = knowledge.contact_error_mm {
        let moved =
            if error > 0.0 { problem.prior * found.covariance[0][1].abs() * error } else { 0.0 };
        terms.insert(ModulusTerm::Contact, moved);
    }
    for (term, [low, high]) in varied(indenter, specimen) {
        let modulus = |(indenter, specimen): (Indenter, Specimen)| {
            let curve = curve_of_any(law, &indenter, &specimen, deepest)?;
            Ok::<_, LoadingFitError>(solve(curve, variance, &[found.shift])?.1.modulus)
        };
        let half = 0.5 * (modulus(high)? - modulus(low)?);
        terms.insert(term, half.abs());
    }
    Ok(LoadingFit {
        modulus_mpa: found.modulus,
        contact_shift_mm: found.shift,
        residual_newtons,
        terms,
        validity: law.validity(indenter, specimen, deepest)?,
        influence,
    })
}

/// The curve up to a depth, or up to the part of it that the law describes: what is refused is refused at the end.
fn curve_of_any(
    law: ContactLaw,
    indenter: &Indenter,
    specimen: &Specimen,
    depth_max: f64,
) -> Result<LoadCurve, LoadingFitError> {
    let mut depth = depth_max;
    for _ in 0..8 {
        match LoadCurve::new(law, indenter, specimen, depth) {
            Err(ContactError::Outside { .. }) => depth *= 0.75,
            other => return other.map_err(LoadingFitError::from),
        }
    }
    LoadCurve::new(law, indenter, specimen, depth_max).map_err(LoadingFitError::from)
}

type Varied = (ModulusTerm, [(Indenter, Specimen); 2]);

/// Indenter and specimen with each uncertain number one standard uncertainty lower and higher.
fn varied(indenter: &Indenter, specimen: &Specimen) -> Vec<Varied> {
    let ends = |quantity: Quantity, range: [f64; 2]| {
        let error = quantity.standard_uncertainty;
        // A number at its physical end, as a Poisson's ratio of 0.5, is moved to the other side only, and twice as far.
        let low = (quantity.value - error).max(range[0]);
        let high = (quantity.value + error).min(range[1]);
        let (low, high) = match (high - quantity.value < error, quantity.value - low < error) {
            (true, _) => ((high - 2.0 * error).max(range[0]), high),
            (_, true) => (low, (low + 2.0 * error).min(range[1])),
            _ => (low, high),
        };
        [low, high].map(|value| Quantity { value, ..quantity })
    };
    let mut found: Vec<Varied> = Vec::new();
    let (term, size) = match *indenter {
        Indenter::FlatPunch { radius_mm } | Indenter::Sphere { radius_mm } => {
            (ModulusTerm::Radius, radius_mm)
        }
        Indenter::Cone { half_angle_degrees } | Indenter::Pyramid { half_angle_degrees, .. } => {
            (ModulusTerm::HalfAngle, half_angle_degrees)
        }
    };
    let with_size = |size: Quantity| match *indenter {
        Indenter::FlatPunch { .. } => Indenter::FlatPunch { radius_mm: size },
        Indenter::Sphere { .. } => Indenter::Sphere { radius_mm: size },
        Indenter::Cone { .. } => Indenter::Cone { half_angle_degrees: size },
        Indenter::Pyramid { faces, .. } => Indenter::Pyramid { faces, half_angle_degrees: size },
    };
    let all = [0.0, f64::INFINITY];
    if size.standard_uncertainty > 0.0 {
        found.push((term, ends(size, all).map(|size| (with_size(size), *specimen))));
    }
    if specimen.thickness_mm.standard_uncertainty > 0.0 {
        let ends = ends(specimen.thickness_mm, all);
        let with = |thickness_mm| (*indenter, Specimen { thickness_mm, ..*specimen });
        found.push((ModulusTerm::Thickness, ends.map(with)));
    }
    if specimen.poisson_ratio.standard_uncertainty > 0.0 {
        let ends = ends(specimen.poisson_ratio, [0.0, 0.5]);
        let with = |poisson_ratio| (*indenter, Specimen { poisson_ratio, ..*specimen });
        found.push((ModulusTerm::Poisson, ends.map(with)));
    }
    found
}

fn check(samples: &[LoadingSample], knowledge: LoadingKnowledge) -> Result<(), LoadingFitError> {
    let is_known = |one: &LoadingSample| one.depth_mm.is_finite() && one.force_newtons.is_finite();
    if let Some(index) = samples.iter().position(|one| !is_known(one)) {
        let LoadingSample { depth_mm, force_newtons } = samples[index];
        return Err(LoadingFitError::Sample { index, depth_mm, force_newtons });
    }
    let refused = |name, value, wanted| Err(LoadingFitError::Knowledge { name, value, wanted });
    match (knowledge.noise_newtons, knowledge.contact_error_mm) {
        (Some(value), _) if !(value > 0.0 && value.is_finite()) => {
            refused("the noise of the force", value, "newtons above 0")
        }
        (_, Some(value)) if !(value >= 0.0 && value.is_finite()) => {
            refused("the standard uncertainty of the contact", value, "mm, not below 0")
        }
        _ => Ok(()),
    }
}

impl LoadingFit {
    /// Combined standard uncertainty in MPa of all terms.
    #[must_use]
    pub fn standard_uncertainty(&self) -> f64 {
        self.terms.values().map(|one| one * one).sum::<f64>().sqrt()
    }

    /// By how much errors of the forces in N, one for each sample, move the modulus in MPa.
    #[must_use]
    pub fn shift_by(&self, errors_newtons: impl IntoIterator<Item = f64>) -> f64 {
        self.influence.iter().zip(errors_newtons).map(|(own, error)| own * error).sum()
    }
}
