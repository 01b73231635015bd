//! The relaxation modulus of a record of depth and force, whatever the ramp that leads to its hold.
//!
//! By Lee and Radok the force is linear in the moduli, and each relaxation time has a column that the recursion gives exactly for
//! the depth as it was. The times are found by variable projection (Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413-432,
//! with the step of Ruhe and Wedin, SIAM Rev. 22 (1980) 318-337), from the best set of a grid.

mod loading;
mod residuals;
mod search;
mod unloading;

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
use thiserror::Error;

/// A relaxation modulus and how well it is known.
#[derive(Clone, Debug, PartialEq)]
pub struct RelaxationFit {
    /// Terms from the shortest relaxation time to the longest.
    pub modulus: RelaxationModulus,
    /// The standard error of each number of `modulus`, from the covariance of residuals that are independent of each other.
    pub standard_errors: RelaxationModulus,
    /// Standard deviation of the residuals in N.
    pub residual_newtons: f64,
    /// Force less fitted force of each sample, in N.
    pub residuals_newtons: Vec<f64>,
    /// By how much the force of each sample rises with each modulus in MPa, the equilibrium behind the terms, and with the
    /// logarithm of each time.
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
        "the relaxation time of {time_secs:.3e} s is not identifiable behind a ramp of {ramp_secs:.3e} s; give a ramp of less than {RAMP_OVER_TIME_MAX} times the shortest time, or take fewer terms"
    )]
    RampTooLong { time_secs: f64, ramp_secs: f64 },
    #[error(
        "the relaxation time of {time_secs:.3e} s is not identifiable in this record; take fewer terms, a faster ramp, a longer hold or less noise"
    )]
    NotIdentifiable { time_secs: f64 },
    #[error(
        "no set of {count} relaxation times describes the record with moduli above 0; take fewer terms"
    )]
    NoSet { count: usize },
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

/// The relaxation modulus of so many terms that fits the forces in N at the samples of the history best. The contact must not
/// shrink but by noise.
pub fn fit_relaxation(
    law: PowerLaw,
    history: &DepthHistory,
    forces_newtons: &[f64],
    term_count: usize,
) -> Result<RelaxationFit, RelaxationFitError> {
    if !(1..=TERMS_MAX).contains(&term_count) {
        return Err(RelaxationFitError::TermCount { count: term_count });
    }
    let (forces, depths) = (forces_newtons.len(), history.knots().len() - 1);
    if forces != depths {
        return Err(RelaxationFitError::Lengths { forces, depths });
    }
    if let Some(index) = forces_newtons.iter().position(|force| !force.is_finite()) {
        return Err(RelaxationFitError::Force { index, value: forces_newtons[index] });
    }
    let needed = 2 * term_count + 2;
    let samples = 1 + history.knots()[1..].windows(2).filter(|w| w[1].time > w[0].time).count();
    if samples < needed {
        return Err(RelaxationFitError::Samples { samples, needed });
    }
    let record = Record { law, knots: history.knots(), forces: forces_newtons };
    let fitted = record.fit(term_count).ok_or(RelaxationFitError::NoSet { count: term_count })?;
    report(fitted, ramp_secs(history), depths)
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
    fitted: Fitted,
    ramp_secs: f64,
    samples: usize,
) -> Result<RelaxationFit, RelaxationFitError> {
    let Fitted { times, moduli, left_over, residuals, tangents, covariance } = fitted;
    let count = times.len();
    if let Some(&time_secs) = times.iter().find(|time| ramp_secs > RAMP_OVER_TIME_MAX * **time) {
        return Err(RelaxationFitError::RampTooLong { time_secs, ramp_secs });
    }
    let variance = left_over / (samples - 2 * count - 1) as f64;
    let unit_covariance =
        covariance.ok_or(RelaxationFitError::NotIdentifiable { time_secs: times[0] })?;
    let error = |index: usize| (variance * unit_covariance[index][index]).sqrt();
    let term = |index: usize| {
        let (modulus_mpa, time_secs) = (moduli[index], times[index]);
        let of_time = error(count + 1 + index);
        // A NaN is no answer either.
        let is_known =
            error(index) <= RELATIVE_ERROR_MAX * modulus_mpa && of_time <= RELATIVE_ERROR_MAX;
        let errors = RelaxationMode { modulus_mpa: error(index), time_secs: of_time * time_secs };
        if is_known {
            Ok((RelaxationMode { modulus_mpa, time_secs }, errors))
        } else {
            Err(RelaxationFitError::NotIdentifiable { time_secs })
        }
    };
    let both: Result<Vec<_>, _> = (0..count).map(term).collect();
    let (terms, errors) = both?.into_iter().unzip();
    Ok(RelaxationFit {
        modulus: RelaxationModulus { equilibrium_mpa: moduli[count], terms },
        standard_errors: RelaxationModulus { equilibrium_mpa: error(count), terms: errors },
        residual_newtons: variance.sqrt(),
        residuals_newtons: residuals,
        tangents,
        unit_covariance,
    })
}

impl RelaxationFit {
    /// By how much errors of the forces in N, one for each sample, move the moduli, the equilibrium behind the terms, and the
    /// logarithms of the times.
    #[must_use]
    pub fn shift_by(&self, errors_newtons: &[f64]) -> Vec<f64> {
        let along = |tangent: &Vec<f64>| -> f64 {
            tangent.iter().zip(errors_newtons).map(|(slope, error)| slope * error).sum()
        };
        let along: Vec<f64> = self.tangents.iter().map(along).collect();
        let shift = |row: &Vec<f64>| row.iter().zip(&along).map(|(entry, own)| entry * own).sum();
        self.unit_covariance.iter().map(shift).collect()
    }

    /// The standard error in MPa of the modulus at a time in s after a step.
    #[must_use]
    pub fn modulus_standard_error(&self, time_secs: f64) -> f64 {
        let terms = &self.modulus.terms;
        let age = |term: &RelaxationMode| time_secs / term.time_secs;
        let of_moduli = terms.iter().map(|term| (-age(term)).exp());
        let of_times = terms.iter().map(|term| term.modulus_mpa * age(term) * (-age(term)).exp());
        let gradient: Vec<f64> = of_moduli.chain([1.0]).chain(of_times).collect();
        self.standard_error_along(&gradient)
    }

    /// The standard error of what rises by this gradient with the numbers of `shift_by`.
    #[must_use]
    pub fn standard_error_along(&self, gradient: &[f64]) -> f64 {
        let along = |row: &Vec<f64>| row.iter().zip(gradient).map(|(a, b)| a * b).sum::<f64>();
        let variance: f64 =
            self.unit_covariance.iter().map(along).zip(gradient).map(|(a, b)| a * b).sum();
        self.residual_newtons * variance.max(0.0).sqrt()
    }
}
