//! Gain and cost of each extra term.

use super::cost::StepCost;
use super::run::ModelCandidate;
use crate::families::find_family;
use serde::Serialize;

#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LadderStep {
    pub from: String,
    pub to: String,
    pub adds: &'static str,
    pub free_more: i64,
    /// Root mean square of the fit before and after, in N.
    pub rms_n: [f64; 2],
    /// Root mean square error of prediction before and after, in N; null where not both are known.
    pub prediction_rms_n: Option<[f64; 2]>,
    /// Change of BIC: below zero the term is worth its numbers.
    pub bic_change: f64,
    /// Cost of an evaluation before and after.
    pub cost: [StepCost; 2],
}

/// The steps between families that were fitted, in the order of those they lead to.
pub(super) fn steps(candidates: &[ModelCandidate]) -> Vec<LadderStep> {
    let rungs = candidates.iter().flat_map(|after| {
        let simpler = find_family(&after.family).map_or(Vec::new(), |family| family.adds_to());
        simpler.into_iter().map(move |(key, adds)| (key, adds, after))
    });
    let step = |(key, adds, after): (String, &'static str, &ModelCandidate)| {
        let before = candidates.iter().find(|one| one.family == key)?;
        let predictions = before.prediction.as_ref().zip(after.prediction.as_ref());
        Some(LadderStep {
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
    rungs.filter_map(step).collect()
}
