//! The relaxation modulus of a record of depth and force, whatever the ramp that leads to its hold.
//!
//! By Lee and Radok the force is linear in the moduli, and each relaxation time has a column that the recursion gives exactly for
//! the depth as it was. The times are found by variable projection (Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413-432,
//! with the step of Ruhe and Wedin, SIAM Rev. 22 (1980) 318-337), from the best set of a grid. A fractional relaxation is a mixture
//! of exponentials, whose columns add up to its own.

mod loading;
mod residuals;
mod search;
mod unloading;

#[cfg(test)]
mod fractional_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod unloading_tests;

pub use unloading::{UnloadingFit, UnloadingFitError, fit_unloading};

pub use loading::{
    LoadingFit, LoadingFitError, LoadingKnowledge, LoadingSample, ModulusTerm, fit_loading,
};

use crate::document::{Indenter, Specimen};
use crate::viscoelastic::{
    DepthHistory, HistoryError, PowerLaw, RelaxationMode, RelaxationModulus,
};
use search::{Fitted, Record};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A relaxation modulus and how well it is known.
#[derive(Clone, Debug, PartialEq)]
pub struct RelaxationFit {
    pub family: RelaxationFamily,
    /// Terms from the shortest relaxation time to the longest.
    pub modulus: RelaxationModulus,
    /// The standard error of each number of `modulus`, from the covariance of residuals that are independent of each other.
    pub standard_errors: RelaxationModulus,
    /// Standard deviation of the residuals in N.
    pub residual_newtons: f64,
    /// Force less fitted force of each sample, in N.
    pub residuals_newtons: Vec<f64>,
    /// By how much the force of each sample rises with each modulus in MPa, the equilibrium behind the terms, with the logarithm of
    /// each time, and with that of the exponent of a fractional relaxation.
    pub tangents: Vec<Vec<f64>>,
    /// In the order of `tangents`, for forces with a variance of one.
    unit_covariance: Vec<Vec<f64>>,
}

/// A record that gives no relaxation modulus.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum RelaxationFitError {
    #[error(transparent)]
    History(#[from] HistoryError),
    #[error("the number of terms is {count}; give 1 to {TERMS_MAX}")]
    TermCount { count: usize },
    #[error("there are {forces} forces for {depths} depths; give one for each")]
    Lengths { forces: usize, depths: usize },
    #[error("the force of sample {index} is {value}; give a number of newtons")]
    Force { index: usize, value: f64 },
    #[error(
        "the record has {samples} samples at different times; give at least {needed} for these terms"
    )]
    Samples { samples: usize, needed: usize },
    #[error(
        "the relaxation time of {time_secs:.3e} s is not identifiable behind a ramp of {ramp_secs:.3e} s; give a ramp of less than {RAMP_OVER_TIME_MAX} times the shortest time, or take {instead}"
    )]
    RampTooLong { time_secs: f64, ramp_secs: f64, instead: &'static str },
    #[error(
        "the relaxation time of {time_secs:.3e} s is not identifiable in this record; take {instead}, a faster ramp, a longer hold or less noise"
    )]
    NotIdentifiable { time_secs: f64, instead: &'static str },
    #[error(
        "the exponent of {exponent:.3} is not identifiable in this record; take a Prony series, a faster ramp, a longer hold or less noise"
    )]
    Exponent { exponent: f64 },
    #[error(
        "the record relaxes no slower than an exponential: the exponent reaches 1, where a fractional model is a Prony series of one term; take a Prony series"
    )]
    ExponentOne,
    #[error(
        "no set of {count} relaxation times describes the record with moduli above 0; take {instead}"
    )]
    NoSet { count: usize, instead: &'static str },
}

/// What a relaxation modulus is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum RelaxationFamily {
    /// So many exponentials.
    Prony { terms: usize },
    /// The fractional Zener model: one Mittag-Leffler function.
    Fractional,
}

impl RelaxationFamily {
    fn term_count(self) -> usize {
        match self {
            Self::Prony { terms } => terms,
            Self::Fractional => 1,
        }
    }

    /// Moduli, times and exponent.
    fn unknowns(self) -> usize {
        2 * self.term_count() + 1 + usize::from(self == Self::Fractional)
    }

    /// What to take where a record holds less.
    fn instead(self) -> &'static str {
        match self {
            Self::Prony { .. } => "fewer terms",
            Self::Fractional => "a Prony series",
        }
    }
}

/// Records identify no more.
pub const TERMS_MAX: usize = 5;
/// At the end of a ramp a term has relaxed but for its time over that of the ramp: a tenth here, and what else bends the ramp,
/// such as its first contact, weighs more.
const RAMP_OVER_TIME_MAX: f64 = 10.0;
/// Standard errors of a modulus and of a time, over the value, beyond which the linear covariance no longer describes them.
pub const RELATIVE_ERROR_MAX: f64 = 0.1;

/// Indenter and specimen with each uncertain number one standard uncertainty lower and higher, for the law of propagation.
#[must_use]
pub fn vary_uncertain_numbers(
    indenter: &Indenter,
    specimen: &Specimen,
) -> Vec<(ModulusTerm, [(Indenter, Specimen); 2])> {
    loading::varied(indenter, specimen)
}

/// The relaxation modulus of a family that fits the forces in N at the samples of the history best. The contact must not shrink
/// but by noise.
pub fn fit_relaxation(
    law: PowerLaw,
    history: &DepthHistory,
    forces_newtons: &[f64],
    family: RelaxationFamily,
) -> Result<RelaxationFit, RelaxationFitError> {
    let count = family.term_count();
    if !(1..=TERMS_MAX).contains(&count) {
        return Err(RelaxationFitError::TermCount { count });
    }
    let (forces, depths) = (forces_newtons.len(), history.knots().len() - 1);
    if forces != depths {
        return Err(RelaxationFitError::Lengths { forces, depths });
    }
    if let Some(index) = forces_newtons.iter().position(|force| !force.is_finite()) {
        return Err(RelaxationFitError::Force { index, value: forces_newtons[index] });
    }
    let needed = family.unknowns() + 1;
    let samples = 1 + history.knots()[1..].windows(2).filter(|w| w[1].time > w[0].time).count();
    if samples < needed {
        return Err(RelaxationFitError::Samples { samples, needed });
    }
    let record = Record { law, knots: history.knots(), forces: forces_newtons };
    let fitted = record.fit(family);
    let fitted = fitted.ok_or(RelaxationFitError::NoSet { count, instead: family.instead() })?;
    report(family, fitted, ramp_secs(history))
}

/// The time from 1 % to 99 % of the greatest depth.
fn ramp_secs(history: &DepthHistory) -> f64 {
    let knots = history.knots();
    let deepest = knots.iter().map(|knot| knot.depth).fold(0.0, f64::max);
    let first = |share: f64| knots.iter().find(|knot| knot.depth >= share * deepest);
    let time = |share: f64| first(share).map_or(knots[0].time, |knot| knot.time);
    time(0.99) - time(0.01)
}

fn report(
    family: RelaxationFamily,
    fitted: Fitted,
    ramp_secs: f64,
) -> Result<RelaxationFit, RelaxationFitError> {
    let Fitted { logs, moduli, left_over, residuals, tangents, covariance } = fitted;
    let (count, instead) = (family.term_count(), family.instead());
    let is_exponential = |log: &f64| *log >= 0.0;
    if logs.get(count).is_some_and(is_exponential) {
        return Err(RelaxationFitError::ExponentOne);
    }
    let times: Vec<f64> = logs[..count].iter().map(|log| log.exp()).collect();
    if let Some(&time_secs) = times.iter().find(|time| ramp_secs > RAMP_OVER_TIME_MAX * **time) {
        return Err(RelaxationFitError::RampTooLong { time_secs, ramp_secs, instead });
    }
    let variance = left_over / (residuals.len() - family.unknowns()) as f64;
    let not_identifiable = |time_secs| RelaxationFitError::NotIdentifiable { time_secs, instead };
    let unit_covariance = covariance.ok_or(not_identifiable(times[0]))?;
    let error = |index: usize| (variance * unit_covariance[index][index]).sqrt();
    let term = |index: usize| {
        let (modulus_mpa, time_secs) = (moduli[index], times[index]);
        let of_time = error(count + 1 + index);
        // A NaN is no answer either.
        let is_known =
            error(index) <= RELATIVE_ERROR_MAX * modulus_mpa && of_time <= RELATIVE_ERROR_MAX;
        let errors = RelaxationMode { modulus_mpa: error(index), time_secs: of_time * time_secs };
        match is_known {
            true => Ok((RelaxationMode { modulus_mpa, time_secs }, errors)),
            false => Err(not_identifiable(time_secs)),
        }
    };
    let [exponent, exponent_error] = match logs.get(count) {
        Some(log) => [log.exp(), log.exp() * error(2 * count + 1)],
        None => [1.0, 0.0],
    };
    let both: Result<Vec<_>, _> = (0..count).map(term).collect();
    let (terms, errors) = both?.into_iter().unzip();
    let is_known = exponent_error <= RELATIVE_ERROR_MAX * exponent;
    if !is_known {
        return Err(RelaxationFitError::Exponent { exponent });
    }
    let standard_errors = RelaxationModulus {
        equilibrium_mpa: error(count),
        terms: errors,
        exponent: exponent_error,
    };
    Ok(RelaxationFit {
        family,
        modulus: RelaxationModulus { equilibrium_mpa: moduli[count], terms, exponent },
        standard_errors,
        residual_newtons: variance.sqrt(),
        residuals_newtons: residuals,
        tangents,
        unit_covariance,
    })
}

impl RelaxationFit {
    /// By how much errors of the forces in N, one for each sample, move the numbers of `tangents`.
    #[must_use]
    pub fn shift_by(&self, errors_newtons: &[f64]) -> Vec<f64> {
        let along = |tangent: &Vec<f64>| -> f64 {
            tangent.iter().zip(errors_newtons).map(|(slope, error)| slope * error).sum()
        };
        let along: Vec<f64> = self.tangents.iter().map(along).collect();
        let shift = |row: &Vec<f64>| row.iter().zip(&along).map(|(entry, own)| entry * own).sum();
        self.unit_covariance.iter().map(shift).collect()
    }

    /// The standard error of what rises by this gradient with the numbers of `tangents`.
    #[must_use]
    pub fn standard_error_along(&self, gradient: &[f64]) -> f64 {
        let along = |row: &Vec<f64>| row.iter().zip(gradient).map(|(a, b)| a * b).sum::<f64>();
        let variance: f64 =
            self.unit_covariance.iter().map(along).zip(gradient).map(|(a, b)| a * b).sum();
        self.residual_newtons * variance.max(0.0).sqrt()
    }
}
