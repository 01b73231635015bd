//! Coefficients for outer parameters that were laid down beforehand.

use super::super::sample::{FitError, FitSample};
use super::FamilyOptions;
use super::nonnegative::non_negative;
use super::problem::{Problem, Rows};
use crate::families::{Family, Model, ModelError};

/// The model of a family with its outer parameters given: only the coefficients are fitted, those that
/// must not be negative not below zero. Neither offset nor initial force.
///
/// This is how a generalised Maxwell body is fitted whose relaxation times were laid down beforehand, one
/// to a decade. Errors as [`fit_family`](super::fit_family).
pub fn fit_family_at(
    family: &dyn Family,
    outer: &[f64],
    records: &[(&str, &[FitSample])],
) -> Result<Model, FitError> {
    let options = FamilyOptions {
        offset: false,
        initial: false,
    };
    let problem = Problem::new(family, records, options)?;
    let refused = |err: ModelError| FitError::Unsupported {
        family: family.name(),
        reason: err.to_string(),
    };
    // Judged before it is used: its numbers are the caller's.
    family
        .model(outer, &vec![0.0; problem.coefficients])
        .map_err(refused)?;
    let columns = family.columns(outer);
    let factor = problem
        .columns_factor(&columns, None, Rows::All)
        .ok_or(FitError::Overflow)?;
    let is_bound: Vec<bool> = (0..problem.coefficients)
        .map(|k| family.is_non_negative(k))
        .collect();
    family
        .model(outer, &non_negative(&factor, &is_bound))
        .map_err(refused)
}
