//! Young's modulus of an unloading by the method of Oliver and Pharr (J. Mater. Res. 7 (1992) 1564-1583; 19 (2004) 3-20).
//!
//! A surface that was pressed beyond its elastic range unloads elastically from the shape that it was left in. The first part
//! of the unloading is a power of the depth above what is left, `force = top (u - left)^m`; its slope at the top is the
//! stiffness `S`, the contact reaches down to `depth - epsilon force / S`, and `E / (1 - nu^2) = sqrt(pi) / (2 beta) S / sqrt(A)`
//! with the area `A` of the indenter there. `epsilon` follows from the exponent (Pharr and Bolshakov, J. Mater. Res. 17 (2002)
//! 2660-2671), and `beta` is one but for pyramids (King, Int. J. Solids Struct. 23 (1987) 1657-1664).

use super::loading::{LoadingKnowledge, LoadingSample, ModulusTerm, varied};
use super::residuals::{FittedSamples, ModulusNoise};
use crate::document::{Indenter, Specimen};
use crate::triangle::Triangle;
use crate::validity::{ContactError, ContactLaw, Validity};
use palpate_model::estimate::coverage_factor;
use std::collections::BTreeMap;
use std::f64::consts::PI;
use thiserror::Error;

/// A modulus of an unloading and what makes it uncertain.
#[derive(Clone, Debug, PartialEq)]
pub struct UnloadingFit {
    pub modulus_mpa: f64,
    /// Slope of the unloading where it begins, in N/mm.
    pub stiffness_n_per_mm: f64,
    pub exponent: f64,
    /// How deep the contact reaches, in mm.
    pub contact_depth_mm: f64,
    pub contact_area_mm2: f64,
    /// Samples of the part that was fitted.
    pub fitted: Vec<LoadingSample>,
    /// Forces of those samples less the power's, in N.
    pub residuals_newtons: Vec<f64>,
    /// Root mean square of the residuals in N.
    pub residual_newtons: f64,
    /// What each source adds, in MPa.
    pub terms: BTreeMap<ModulusTerm, f64>,
    /// Degrees of freedom of the noise, for Student's t.
    pub noise_freedom: f64,
    pub validity: Validity,
}

#[derive(Clone, Debug, PartialEq, Error)]
pub enum UnloadingFitError {
    #[error(transparent)]
    Contact(#[from] ContactError),
    #[error(
        "the unloading has {count} samples between {} and {} % of its greatest force; give at least {SAMPLES_MIN}: record the unloading too, and slower",
        100.0 * SHARES[0],
        100.0 * SHARES[1]
    )]
    Samples { count: usize },
    #[error(
        "the unloading is no power of the depth with an exponent between 1 and {EXPONENT_MAX}; check that the force falls with the depth, and take the law of the loading"
    )]
    NoPower,
    #[error(
        "the contact would reach {depth_mm:.4} mm deep, where this indenter has no area; check its size and where depth zero is"
    )]
    NoArea { depth_mm: f64 },
}

/// Shares of the greatest force between which the unloading is fitted, as ISO 14577-1 allows.
const SHARES: [f64; 2] = [0.4, 0.98];
const SAMPLES_MIN: usize = 10;
/// A surface that is left nearly as the indenter has the exponent 1.5 of two spheres; soft ones that stick have more.
const EXPONENT_MAX: f64 = 5.0;
const STEPS_MAX: usize = 100;

/// Force at the top in N, depth that is left in mm, exponent.
type Power = [f64; 3];

/// The modulus of samples in the order of time, from the deepest on; depths count from the contact.
pub fn fit_unloading(
    indenter: &Indenter,
    specimen: &Specimen,
    samples: &[LoadingSample],
    knowledge: LoadingKnowledge,
) -> Result<UnloadingFit, UnloadingFitError> {
    let unloading = Unloading::of(samples)?;
    let power = unloading.fit()?;
    let tip = Tip { indenter, specimen };
    let contact = tip.contact(unloading.top_mm, power)?;
    let validity = tip.validity(contact.area_mm2)?;
    let (noise, residual_newtons) = unloading.noise(power, knowledge.noise_newtons, |power| {
        Ok(tip.contact(unloading.top_mm, power)?.modulus_mpa)
    })?;
    let mut terms = BTreeMap::from([(ModulusTerm::Noise, noise.mpa)]);
    let modulus = contact.modulus_mpa;
    if let Some(error) = knowledge.contact_error_mm {
        // What is left moves with the depth, so the power stays.
        let moved = [power[0], power[1] + error, power[2]];
        let other = tip.contact(unloading.top_mm + error, moved)?.modulus_mpa;
        terms.insert(ModulusTerm::Contact, (other - modulus).abs());
    }
    if let Some(error) = knowledge.zero_error_newtons.filter(|error| *error > 0.0) {
        let raised = Unloading {
            forces: unloading.forces.iter().map(|one| one + error).collect(),
            ..unloading.clone()
        };
        let other = tip.contact(raised.top_mm, raised.fit()?)?.modulus_mpa;
        terms.insert(ModulusTerm::ForceZero, (other - modulus).abs());
    }
    for (term, ends) in varied(indenter, specimen) {
        let [low, high] = ends.map(|(indenter, specimen)| {
            let tip = Tip { indenter: &indenter, specimen: &specimen };
            Ok::<_, UnloadingFitError>(tip.contact(unloading.top_mm, power)?.modulus_mpa)
        });
        terms.insert(term, 0.5 * (high? - low?).abs());
    }
    // A half-space has no thickness.
    terms.remove(&ModulusTerm::Thickness);
    Ok(UnloadingFit {
        modulus_mpa: modulus,
        stiffness_n_per_mm: contact.stiffness,
        exponent: power[2],
        contact_depth_mm: contact.depth_mm,
        contact_area_mm2: contact.area_mm2,
        residuals_newtons: unloading.residuals(power),
        residual_newtons,
        terms,
        noise_freedom: noise.freedom,
        validity,
        fitted: unloading.fitted,
    })
}

impl UnloadingFit {
    /// As of a loading: [`super::LoadingFit::coverage_factor`].
    #[must_use]
    pub fn coverage_factor(&self, variance: f64) -> f64 {
        coverage_factor(self.terms[&ModulusTerm::Noise], self.noise_freedom, variance)
    }
}

/// The part of an unloading that is fitted.
#[derive(Clone)]
struct Unloading {
    fitted: Vec<LoadingSample>,
    depths: Vec<f64>,
    forces: Vec<f64>,
    /// Where it begins.
    top_mm: f64,
}

impl Unloading {
    fn of(samples: &[LoadingSample]) -> Result<Self, UnloadingFitError> {
        let few = |count| UnloadingFitError::Samples { count };
        let top = samples.first().ok_or(few(0))?;
        let [low, high] = SHARES.map(|share| share * top.force_newtons);
        let until = samples.iter().position(|one| one.force_newtons < low);
        let all = &samples[..until.unwrap_or(samples.len())];
        let fitted: Vec<LoadingSample> =
            all.iter().copied().filter(|one| one.force_newtons <= high).collect();
        if fitted.len() < SAMPLES_MIN || top.force_newtons <= 0.0 {
            return Err(few(fitted.len()));
        }
        Ok(Self {
            depths: fitted.iter().map(|one| one.depth_mm).collect(),
            forces: fitted.iter().map(|one| one.force_newtons).collect(),
            fitted,
            top_mm: top.depth_mm,
        })
    }

    /// Force and how it changes with each number of the power.
    fn row(&self, power: Power, depth: f64) -> (f64, [f64; 3]) {
        let [top, left, exponent] = power;
        let height = self.top_mm - left;
        let share = (depth - left) / height;
        let force = top * share.powf(exponent);
        let of_left = exponent * force / share * (depth - self.top_mm) / (height * height);
        (force, [force / top, of_left, force * share.ln()])
    }

    fn squares(&self, power: Power) -> f64 {
        let [top, left, exponent] = power;
        let lowest = self.depths.iter().copied().fold(f64::INFINITY, f64::min);
        if top.is_nan() || left >= lowest || !(1.0..=EXPONENT_MAX).contains(&exponent) {
            return f64::INFINITY;
        }
        let pairs = self.depths.iter().zip(&self.forces);
        pairs.map(|(depth, force)| (force - self.row(power, *depth).0).powi(2)).sum()
    }

    /// With an exponent, its root of the force is a line of the depth.
    fn start(&self, exponent: f64) -> Power {
        let roots: Vec<f64> = self.forces.iter().map(|force| force.powf(1.0 / exponent)).collect();
        let count = roots.len() as f64;
        let (mean_depth, mean_root) =
            (self.depths.iter().sum::<f64>() / count, roots.iter().sum::<f64>() / count);
        let pairs = || self.depths.iter().zip(&roots);
        let over: f64 = pairs().map(|(d, r)| (d - mean_depth) * (r - mean_root)).sum();
        let under: f64 = self.depths.iter().map(|d| (d - mean_depth).powi(2)).sum();
        let left = mean_depth - mean_root * under / over;
        [(over / under * (self.top_mm - left)).powf(exponent), left, exponent]
    }

    fn fit(&self) -> Result<Power, UnloadingFitError> {
        let starts = [1.2, 1.5, 2.0, 2.5, 3.0, 4.0].map(|exponent| self.start(exponent));
        let scored = starts.map(|start| (self.squares(start), start));
        let best = scored.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
        let (mut squares, mut at) = best.ok_or(UnloadingFitError::NoPower)?;
        if !squares.is_finite() {
            return Err(UnloadingFitError::NoPower);
        }
        for _ in 0..STEPS_MAX {
            let Some(step) = self.triangle(at).solve() else { break };
            let better = (0..20).find_map(|halving| {
                let share = 0.5f64.powi(halving);
                let next: Power = std::array::from_fn(|i| at[i] + share * step[i]);
                Some((self.squares(next), next)).filter(|(next, _)| *next < squares)
            });
            let Some(next) = better else { break };
            (squares, at) = next;
        }
        // An end of the range is no answer.
        match at[2] > 1.0 + 1e-6 && at[2] < EXPONENT_MAX - 1e-6 {
            true => Ok(at),
            false => Err(UnloadingFitError::NoPower),
        }
    }

    fn columns(&self, power: Power) -> Vec<Vec<f64>> {
        let rows: Vec<[f64; 3]> =
            self.depths.iter().map(|depth| self.row(power, *depth).1).collect();
        (0..3).map(|number| rows.iter().map(|row| row[number]).collect()).collect()
    }

    fn residuals(&self, power: Power) -> Vec<f64> {
        let pairs = self.depths.iter().zip(&self.forces);
        pairs.map(|(depth, force)| force - self.row(power, *depth).0).collect()
    }

    fn triangle(&self, power: Power) -> Triangle {
        Triangle::new(self.columns(power).into_iter().chain([self.residuals(power)]).collect())
    }

    /// The noise of a modulus that follows from the power, and the root mean square of the residuals.
    fn noise(
        &self,
        power: Power,
        known: Option<f64>,
        modulus: impl Fn(Power) -> Result<f64, UnloadingFitError>,
    ) -> Result<(ModulusNoise, f64), UnloadingFitError> {
        let covariance = self.triangle(power).covariance().ok_or(UnloadingFitError::NoPower)?;
        let scale = [power[0], self.top_mm - power[1], power[2]];
        let mut gradient = [0.0; 3];
        for (number, slope) in gradient.iter_mut().enumerate() {
            let step = 1e-6 * scale[number];
            let [up, down] = [step, -step].map(|step| {
                let mut moved = power;
                moved[number] += step;
                modulus(moved)
            });
            *slope = (up? - down?) / (2.0 * step);
        }
        let columns = self.columns(power);
        let shares: Vec<f64> = covariance
            .iter()
            .map(|row| row.iter().zip(&gradient).map(|(entry, slope)| entry * slope).sum())
            .collect();
        let influence: Vec<f64> = (0..self.forces.len())
            .map(|at| shares.iter().zip(&columns).map(|(share, column)| share * column[at]).sum())
            .collect();
        let residuals = self.residuals(power);
        let squares: f64 = residuals.iter().map(|one| one * one).sum();
        let spare = (residuals.len() - gradient.len()) as f64;
        let (variance, freedom) = match known {
            Some(noise) => (noise * noise, f64::INFINITY),
            None => (squares / spare, spare),
        };
        let fitted = FittedSamples {
            forces: &self.forces,
            residuals: &residuals,
            columns: &columns,
            influence: &influence,
        };
        let root_mean_square = (squares / residuals.len() as f64).sqrt();
        Ok((fitted.modulus_noise((variance, freedom)), root_mean_square))
    }
}

struct Tip<'a> {
    indenter: &'a Indenter,
    specimen: &'a Specimen,
}

struct UnloadedContact {
    modulus_mpa: f64,
    stiffness: f64,
    depth_mm: f64,
    area_mm2: f64,
}

impl Tip<'_> {
    fn contact(&self, top_mm: f64, power: Power) -> Result<UnloadedContact, UnloadingFitError> {
        let [force, left, exponent] = power;
        let stiffness = exponent * force / (top_mm - left);
        let depth_mm = top_mm - epsilon(exponent) * force / stiffness;
        let shape = self.indenter.shape().map_err(ContactError::from)?;
        let area = shape.area_at(depth_mm).filter(|area| *area > 0.0);
        let area_mm2 = area.ok_or(UnloadingFitError::NoArea { depth_mm })?;
        let poisson = self.specimen.layer().map_err(ContactError::from)?.poisson;
        let plane =
            PI.sqrt() / (2.0 * self.indenter.stiffness_factor()) * stiffness / area_mm2.sqrt();
        let modulus_mpa = plane * (1.0 - poisson * poisson);
        Ok(UnloadedContact { modulus_mpa, stiffness, depth_mm, area_mm2 })
    }

    /// As of an elastic contact on a half-space with this area.
    fn validity(&self, area_mm2: f64) -> Result<Validity, UnloadingFitError> {
        let shape = self.indenter.shape().map_err(ContactError::from)?;
        let depth = match shape.taken((area_mm2 / PI).sqrt()) {
            // A flat punch has its contact radius at any depth.
            0.0 => f64::MIN_POSITIVE,
            depth => depth,
        };
        let validity = ContactLaw::Sneddon.validity(self.indenter, self.specimen, depth)?;
        validity.check()?;
        Ok(validity)
    }
}

/// Force over stiffness by which the edge of the contact sinks in, as a share; 3/4 for an exponent of 1.5.
fn epsilon(exponent: f64) -> f64 {
    let argument = 1.0 / (2.0 * (exponent - 1.0));
    exponent * (1.0 - 2.0 * (exponent - 1.0) * gamma_ratio(argument) / PI.sqrt())
}

/// `gamma(x + 1/2) / gamma(x)`, from its series for large `x` (Abramowitz and Stegun 6.1.47) and the recurrence of both.
fn gamma_ratio(x: f64) -> f64 {
    if x < 20.0 {
        return gamma_ratio(x + 1.0) * x / (x + 0.5);
    }
    let over = 1.0 / x;
    let series = 1.0
        + over
            * (-1.0 / 8.0 + over * (1.0 / 128.0 + over * (5.0 / 1024.0 - over * 21.0 / 32768.0)));
    x.sqrt() * series
}
