//! How many terms a record is worth.

use super::RelaxationError;
use super::record::{JudgedFit, Press, Record};
use palpate_indentation::{RelaxationFamily, TERMS_MAX};
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
) -> Result<(JudgedFit, TermChoice), RelaxationError> {
    let (mut fits, mut refused, mut too_few) = (Vec::new(), None, None);
    for count in 1..=TERMS_MAX {
        match record.fit(press, RelaxationFamily::Prony { terms: count }) {
            Ok(fit) => fits.push(fit),
            // More terms may describe it.
            Err(err @ RelaxationError::Autocorrelated { .. }) => too_few = Some(err),
            // What is refused with so many terms is so with more.
            Err(err @ RelaxationError::Fit(_)) => {
                refused = Some(err);
                break;
            }
            Err(err) => return Err(err),
        }
    }
    let squares =
        |one: &JudgedFit| one.fit.residuals_newtons.iter().map(|one| one * one).sum::<f64>();
    let closest = fits.iter().min_by(|a, b| squares(a).total_cmp(&squares(b)));
    let Some(closest) = closest else {
        return Err(too_few.or(refused).unwrap_or(RelaxationError::NoPress));
    };
    let effective = closest.memory.effective_samples();
    let samples = record.forces.len() as f64;
    let bayesian =
        |one: &JudgedFit| criteria(squares(one) / samples, effective, one.fit.tangents.len()).1;
    let lowest = fits.iter().map(bayesian).fold(f64::INFINITY, f64::min);
    let candidate = |one: &JudgedFit| TermCandidate {
        terms: one.fit.modulus.terms.len(),
        residual_n: one.fit.residual_newtons,
        bic_above: bayesian(one) - lowest,
    };
    let candidates: Vec<TermCandidate> = fits.iter().map(candidate).collect();
    let best = candidates.iter().position(|one| one.bic_above == 0.0).unwrap_or(0);
    let refused = refused.map(|reason| reason.to_string());
    Ok((fits.swap_remove(best), TermChoice { candidates, refused }))
}
