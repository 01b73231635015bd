//! Validity of stored curves.

use super::{FamilyRow, IntegratorRow, MeasuredCost, TRADE_FORMAT, TradeCurves};
use crate::integrators::Precision;
use thiserror::Error;

#[derive(Clone, Debug, PartialEq, Error)]
pub enum CurveError {
    #[error(
        "these curves have format {0}, but this version of palpate reads format {TRADE_FORMAT}; measure again"
    )]
    Format(u32),
    #[error("the curves give {what} of {value}, which is not possible; measure again")]
    Number { what: String, value: f64 },
    #[error(
        "the numbers of {0} contradict each other, so the curves were edited after the measurement; measure again"
    )]
    Contradiction(String),
    #[error(
        "{what}: the curves give an error of {stored:e}, but this version of palpate finds {found:e}; measure again"
    )]
    Error { what: String, stored: f64, found: f64 },
    #[error("the curves have no row {0}; measure again")]
    Missing(String),
}

/// Errors computed twice agree to this share: the same arithmetic, but exponentials of the system's own
/// library, whose last digit may differ.
const AGREE: f64 = 1e-6;
/// Errors of what was fitted agree to this share: a fit stops within a small share of a standard error.
const AGREE_FITTED: f64 = 1e-4;
/// Errors of so small a share of the force are its last digits, and come out differently elsewhere.
const LAST_DIGITS: f64 = 1e-12;
/// The same in f32: sixteen last digits of the force, of which an order of additions changes one or two.
const LAST_DIGITS_F32: f64 = 1e-6;

/// Share of the force below which an error in this precision is rounding.
#[must_use]
pub const fn rounding_share(precision: Precision) -> f64 {
    match precision {
        Precision::F64 => LAST_DIGITS,
        Precision::F32 => LAST_DIGITS_F32,
    }
}

impl TradeCurves {
    /// The curves themselves if they can have been measured: right format, possible numbers, no
    /// contradiction.
    pub fn checked(self) -> Result<Self, CurveError> {
        if self.format != TRADE_FORMAT {
            return Err(CurveError::Format(self.format));
        }
        let number = |what: &str, value: f64, is_possible: bool| {
            let what = what.to_owned();
            is_possible.then_some(()).ok_or(CurveError::Number { what, value })
        };
        let error = |what: &str, value: f64| number(what, value, value >= 0.0 && value.is_finite());
        let positive =
            |what: &str, value: f64| number(what, value, value > 0.0 && value.is_finite());
        for peak in [self.peak.ramp_hold_n, self.peak.poke_n] {
            positive("a peak force", peak)?;
        }
        for MeasuredCost { ns, spread, halves } in self.costs() {
            positive("a time in ns", *ns)?;
            error("a spread", *spread)?;
            error("a difference of halves", *halves)?;
        }
        for row in &self.integrators {
            positive("a step in s", row.step_s)?;
            if let Some(force) = row.error {
                error("an error in N", force.ramp_hold_n)?;
                error("an error in N", force.poke_n)?;
            }
            let name = format!("{} at {} s", row.scheme.name(), row.step_s);
            if row.error.is_some() == row.refused.is_some()
                || (row.second_ns * row.step_s / row.cost.ns - 1.0).abs() > 1e-9
            {
                return Err(CurveError::Contradiction(name));
            }
        }
        for row in &self.families {
            positive("a peak force", row.peak_n)?;
            error("an error in N", row.error_n)?;
        }
        for row in &self.fit {
            error("an error in N", row.error_n)?;
            error("an error of tau", row.tau_error)?;
            positive("a rate in Hz", row.rate_hz)?;
        }
        for row in &self.live {
            error("an error of tau", row.tau_error.unwrap_or(0.0))?;
        }
        let mut marked = self.clone();
        marked.mark_fronts();
        if marked != self {
            return Err(CurveError::Contradiction("the rows marked as best".into()));
        }
        Ok(self)
    }

    /// Whether the errors are those of `now`, computed afresh for the same rows.
    pub fn agrees_with(&self, now: &Self) -> Result<(), CurveError> {
        let peak = self.peak;
        same("the ramp and hold", peak.ramp_hold_n, now.peak.ramp_hold_n, LAST_DIGITS)?;
        same("the poke", peak.poke_n, now.peak.poke_n, LAST_DIGITS)?;
        self.integrators_agree(now)?;
        for row in &now.families {
            let name = format!("{} for {}", row.family, row.target);
            let is_same =
                |one: &FamilyRow| (&one.family, &one.target) == (&row.family, &row.target);
            let stored = find(&self.families, &name, is_same)?;
            same(&name, stored.peak_n, row.peak_n, LAST_DIGITS)?;
            alike(&name, stored.error_n, row.error_n, row.peak_n)?;
        }
        for row in &now.fit {
            let name = format!("the fit at {} Hz", row.rate_hz);
            let stored = find(&self.fit, &name, |one| one.rate_hz == row.rate_hz)?;
            alike(&name, stored.tau_error, row.tau_error, 1.0)?;
            alike(&name, stored.error_n, row.error_n, peak.ramp_hold_n)?;
        }
        for row in &now.live {
            let name = format!("the live fit with {} relaxation times", row.nodes);
            let stored = find(&self.live, &name, |one| one.nodes == row.nodes)?;
            match (stored.tau_error, row.tau_error) {
                (Some(stored), Some(found)) => alike(&name, stored, found, 1.0)?,
                (None, None) => {}
                _ => return Err(CurveError::Contradiction(name)),
            }
        }
        Ok(())
    }

    fn integrators_agree(&self, now: &Self) -> Result<(), CurveError> {
        let peak = self.peak;
        for row in &now.integrators {
            let name =
                format!("{} at {} s in {}", row.scheme.name(), row.step_s, row.precision.name());
            let key = |one: &IntegratorRow| (one.scheme, one.precision, one.step_s);
            let stored = find(&self.integrators, &name, |one| key(one) == key(row))?;
            match (stored.error, row.error) {
                (None, None) => {}
                (Some(stored), Some(found)) => {
                    let share = rounding_share(row.precision);
                    same(&name, stored.ramp_hold_n, found.ramp_hold_n, share * peak.ramp_hold_n)?;
                    same(&name, stored.poke_n, found.poke_n, share * peak.poke_n)?;
                }
                _ => return Err(CurveError::Contradiction(name)),
            }
        }
        Ok(())
    }
}

fn find<'a, T>(
    rows: &'a [T],
    name: &str,
    is_same: impl Fn(&T) -> bool,
) -> Result<&'a T, CurveError> {
    rows.iter().find(|row| is_same(row)).ok_or_else(|| CurveError::Missing(name.to_owned()))
}

fn within(
    share: f64,
    what: &str,
    [stored, found]: [f64; 2],
    rounding: f64,
) -> Result<(), CurveError> {
    if (stored - found).abs() <= share * stored.max(found) + rounding {
        return Ok(());
    }
    Err(CurveError::Error { what: what.to_owned(), stored, found })
}

/// Whether computed errors are the same.
fn same(what: &str, stored: f64, found: f64, rounding: f64) -> Result<(), CurveError> {
    within(AGREE, what, [stored, found], rounding)
}

/// The same of what was fitted, for forces of this size.
fn alike(what: &str, stored: f64, found: f64, size: f64) -> Result<(), CurveError> {
    within(AGREE_FITTED, what, [stored, found], LAST_DIGITS * size)
}
