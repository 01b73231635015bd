//! How many terms a record is worth.

use super::RelaxationError;
use super::record::{Press, Record};
use palpate_indentation::{RelaxationFit, TERMS_MAX};
use palpate_rheology::fit::ResidualAutocorrelation;
use palpate_rheology::select::criteria;
use serde::Serialize;

/// The numbers of terms that were tried.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TermChoice {
    pub candidates: Vec<TermCandidate>,
    /// Why more terms than those are no candidates; `None` where all were tried.
    pub refused: Option<String>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TermCandidate {
    pub terms: usize,
    /// Standard deviation of the residuals in N.
    pub residual_n: f64,
    /// Bayesian criterion above the lowest.
    pub bic_above: f64,
}

/// The fit with the lowest Bayesian criterion, on the effective number of samples of the residuals that come closest to noise, as
/// the selection of a model family takes it.
pub(super) fn choose(
    record: &Record,
    press: Press,
) -> Result<(RelaxationFit, TermChoice), RelaxationError> {
    let (mut fits, mut refused) = (Vec::new(), None);
    for count in 1..=TERMS_MAX {
        match record.fit(press, count) {
            Ok(fit) => fits.push(fit),
            // What is refused with so many terms is so with more.
            Err(RelaxationError::Fit(reason)) => {
                refused = Some(reason);
                break;
            }
            Err(err) => return Err(err),
        }
    }
    let squares =
        |fit: &RelaxationFit| -> f64 { fit.residuals_newtons.iter().map(|one| one * one).sum() };
    let closest = fits.iter().min_by(|a, b| squares(a).total_cmp(&squares(b)));
    let Some(closest) = closest else {
        return Err(match refused {
            Some(reason) => reason.into(),
            None => RelaxationError::NoPress,
        });
    };
    let samples = record.forces.len();
    let effective = ResidualAutocorrelation::of(&closest.residuals_newtons, &closest.tangents)
        .ok_or(RelaxationError::NoResiduals { samples })?
        .effective_samples();
    let bayesian = |fit: &RelaxationFit| {
        criteria(squares(fit) / samples as f64, effective, fit.tangents.len()).1
    };
    let lowest = fits.iter().map(bayesian).fold(f64::INFINITY, f64::min);
    let candidate = |fit: &RelaxationFit| TermCandidate {
        terms: fit.modulus.terms.len(),
        residual_n: fit.residual_newtons,
        bic_above: bayesian(fit) - lowest,
    };
    let candidates: Vec<TermCandidate> = fits.iter().map(candidate).collect();
    let best = candidates.iter().position(|one| one.bic_above == 0.0).unwrap_or(0);
    let refused = refused.map(|reason| reason.to_string());
    Ok((fits.swap_remove(best), TermChoice { candidates, refused }))
}
