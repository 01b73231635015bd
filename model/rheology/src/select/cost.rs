//! Cost of one evaluation of a model, counted from its terms: the same number on every machine.

use crate::families::{DepthDrive, RelaxationTerm};
use serde::Serialize;

/// Additions and multiplications that one exponential takes: argument reduction and a polynomial of
/// degree about ten (Muller, "Elementary Functions", 3rd ed., chapter 4).
const EXPONENTIAL: usize = 20;

/// Cost of one exact step of constant length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct StepCost {
    /// Additions and multiplications, an exponential counted as twenty.
    pub operations: usize,
    /// State variables: numbers carried from step to step.
    pub states: usize,
    /// Functions of depth evaluated: powers and exponentials.
    pub drives: usize,
}

impl StepCost {
    /// Cost of a model of these terms.
    #[must_use]
    pub fn of(terms: &[RelaxationTerm]) -> Self {
        let one = terms.iter().map(|term| Self {
            operations: operations(term),
            states: usize::from(term.tau > 0.0),
            drives: drives(&term.elastic) + drives(&term.rate),
        });
        one.fold(Self { operations: 0, states: 0, drives: 0 }, |all, one| Self {
            operations: all.operations + one.operations,
            states: all.states + one.states,
            drives: all.drives + one.drives,
        })
    }
}

fn powers(drive: &DepthDrive) -> usize {
    drive.powers.iter().filter(|value| **value != 0.0).count()
}

fn softenings(drive: &DepthDrive) -> usize {
    drive.softening.iter().filter(|value| **value != 0.0).count()
}

fn drives(drive: &DepthDrive) -> usize {
    powers(drive) + softenings(drive) + usize::from(drive.exponential.is_some())
}

/// The steps of a relaxation term one by one, the decay of its constant step length known.
fn operations(term: &RelaxationTerm) -> usize {
    let RelaxationTerm { elastic, rate, .. } = term;
    // Each coefficient of the drive along the piece: elastic ones added, those of a rate times the
    // speed first, those of a softening with the greatest depth.
    let coefficients =
        powers(elastic) + 2 * powers(rate) + 3 * softenings(elastic) + 5 * softenings(rate);
    let degree = term.degree();
    // Moved to the start of the piece (a multiplication and an addition for each pair of powers), then
    // weighted (three for each power, one for the constant).
    let polynomial = if coefficients > 0 { degree * (degree + 1) + 3 * degree + 1 } else { 0 };
    // Elastic: value at the start, its growth over the piece (three exponentials). Rate: value at the
    // start and two exponentials of growth.
    let exponentials = elastic.exponential.map_or(0, |_| 4 * EXPONENTIAL + 9)
        + rate.exponential.map_or(0, |_| 3 * EXPONENTIAL + 8);
    // The state decays and takes the drive.
    let state = if term.tau > 0.0 { 2 } else { 0 };
    coefficients + polynomial + exponentials + state
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::families::{all_families, find_family};

    fn cost(key: &str, outer: &[f64], linear: &[f64]) -> StepCost {
        let model = find_family(key).unwrap().model(outer, linear).unwrap();
        StepCost::of(&model.terms().unwrap())
    }

    #[test]
    fn more_terms_cost_more() {
        let kelvin = cost("kelvin", &[1.0], &[0.1, 0.2]);
        assert_eq!(kelvin.states, 1);
        // One coefficient each way, moved and weighted, decay: 1 + 2 + 6 + 2.
        assert_eq!(kelvin.operations, 11);
        let third = cost("series-3", &[1.0], &[0.1, 0.2, 0.3, 0.4]);
        let fifth = cost("series-5", &[1.0], &[0.1, 0.2, 0.3, 0.4, 0.5, 0.6]);
        assert!(kelvin < third && third < fifth && fifth.states == 1);
        let two = cost("prony-2", &[1.0, 9.0], &[0.1, 0.2, 0.3]);
        assert_eq!(two.states, 2);
        let fung = cost("fung", &[0.1, 300.0, 0.15], &[0.15, 0.06]);
        assert_eq!(fung.states, 24);
        assert!(fung > fifth && all_families().len() > 10);
    }
}
