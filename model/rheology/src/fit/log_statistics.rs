//! What a population needs of a session whose record it does not read again.

use super::curve_likelihood::{CurveLikelihood, LikelihoodExpansion};
use super::sample::FitError;
use super::solve::FitSolution;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The logarithms of the parameters of a record's body at its best fit, and their covariance: [`CurveLikelihood`] there, widened
/// for residuals that last as the standard errors are. The part of some parameters is what a fit says of these, the others being
/// found too.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LogarithmStatistics {
    /// In the order of the body's parameters.
    pub parameters: Vec<String>,
    /// One for each of these parameters, of the value in its unit.
    pub centre: Vec<f64>,
    /// One row for each of these parameters.
    pub covariance: Vec<Vec<f64>>,
    /// The body's other parameters, each with the reason why nothing is known of its logarithm.
    pub left_out: BTreeMap<String, String>,
}

impl LogarithmStatistics {
    /// Of a record of a fit.
    #[must_use]
    pub fn of(solution: &FitSolution<'_>, record: usize) -> Self {
        let (mut names, mut left_out) = (Vec::new(), BTreeMap::new());
        for name in solution.system.options.body_names() {
            match CurveLikelihood::of(solution, record, &[name]) {
                Ok(_) => names.push(name),
                Err(reason) => drop(left_out.insert(name.to_owned(), reason.to_string())),
            }
        }
        let parameters: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
        let found = CurveLikelihood::of(solution, record, &names);
        match found.ok().and_then(|likelihood| likelihood.expand_at_best()) {
            Some(LikelihoodExpansion { centre, covariance }) => {
                Self { parameters, centre, covariance, left_out }
            }
            None => {
                let advice = "leave one of the parameters out".to_owned();
                let reason =
                    FitError::Inseparable { names: parameters.clone(), advice }.to_string();
                left_out.extend(parameters.into_iter().map(|name| (name, reason.clone())));
                Self { left_out, ..Self::default() }
            }
        }
    }

    /// The part of some parameters; the reason where one has none.
    pub fn of_parameters(&self, names: &[String]) -> Result<LikelihoodExpansion, String> {
        let place = |name: &String| {
            let place = self.parameters.iter().position(|one| one == name);
            place.ok_or_else(|| match self.left_out.get(name) {
                Some(reason) => reason.clone(),
                None => format!("its fit has no parameter '{name}'"),
            })
        };
        let places = names.iter().map(place).collect::<Result<Vec<_>, _>>()?;
        let value = |row: usize, column: usize| self.covariance.get(row)?.get(column).copied();
        let row = |&row: &usize| places.iter().map(|&column| value(row, column)).collect();
        let centre = places.iter().map(|&place| self.centre.get(place).copied()).collect();
        let covariance = places.iter().map(row).collect();
        let found = Option::zip(centre, covariance);
        let (centre, covariance) = found.ok_or("its fit lacks a number for each parameter")?;
        Ok(LikelihoodExpansion { centre, covariance })
    }
}
