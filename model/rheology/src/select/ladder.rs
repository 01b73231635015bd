//! What each extra term buys and what it costs.

use super::cost::Cost;
use super::run::Candidate;
use serde::Serialize;

/// Families and the ones that add something to them.
const RUNGS: [(&str, &str, &str); 16] = [
    (
        "voigt",
        "kelvin",
        "relaxation of the spring beside the dashpot",
    ),
    ("maxwell", "kelvin", "a spring that holds"),
    ("kelvin", "prony-2", "a second relaxation time"),
    ("prony-2", "prony-3", "a third relaxation time"),
    ("prony-3", "prony-4", "a fourth relaxation time"),
    ("prony-4", "prony-5", "a fifth relaxation time"),
    ("prony-5", "prony-6", "a sixth relaxation time"),
    (
        "kelvin",
        "fractional",
        "a continuous spread of relaxation times",
    ),
    ("series-1", "series-2", "a square of depth"),
    ("series-2", "series-3", "a cube of depth"),
    ("series-3", "series-4", "a fourth power of depth"),
    ("series-4", "series-5", "a fifth power of depth"),
    ("series-3", "unloading-3", "softness after greater depth"),
    ("kelvin", "exponential", "stiffness that grows with force"),
    (
        "exponential",
        "fung",
        "a continuous spread of relaxation times",
    ),
    ("fractional", "fung", "stiffness that grows with force"),
];

/// One extra term.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Step {
    /// Family without it.
    pub from: String,
    /// Family with it.
    pub to: String,
    /// What is added, in words.
    pub adds: &'static str,
    /// Numbers more to find.
    pub free_more: i64,
    /// Root mean square of the fit before and after, in N.
    pub rms_n: [f64; 2],
    /// Root mean square error of prediction before and after, in N; null where not both are known.
    pub prediction_rms_n: Option<[f64; 2]>,
    /// Change of BIC: below zero the term is worth its numbers.
    pub bic_change: f64,
    /// Cost of an evaluation before and after.
    pub cost: [Cost; 2],
}

/// The steps between families that were fitted.
pub(super) fn steps(candidates: &[Candidate]) -> Vec<Step> {
    let find = |key: &str| candidates.iter().find(|one| one.family == key);
    let step = |(from, to, adds): &(&str, &str, &'static str)| {
        let (before, after) = (find(from)?, find(to)?);
        let predictions = before.prediction.as_ref().zip(after.prediction.as_ref());
        Some(Step {
            from: before.family.clone(),
            to: after.family.clone(),
            adds,
            free_more: after.free as i64 - before.free as i64,
            rms_n: [before.rms_n, after.rms_n],
            prediction_rms_n: predictions.map(|(one, two)| [one.rms_n, two.rms_n]),
            bic_change: after.bic - before.bic,
            cost: [before.cost, after.cost],
        })
    };
    RUNGS.iter().filter_map(step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::families::by_key;

    #[test]
    fn every_rung_is_a_family() {
        for (from, to, _) in RUNGS {
            assert!(by_key(from).is_ok() && by_key(to).is_ok(), "{from} {to}");
        }
    }
}
