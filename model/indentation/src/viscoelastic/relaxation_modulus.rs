//! The relaxation modulus.

use super::history::Knot;
use crate::invalid_value::{InvalidValue, check, positive};
use palpate_model::viscoelastic::{RateShare, mittag_leffler, rate_shares};
use serde::{Deserialize, Serialize};

/// A shear relaxation modulus `G(t) = equilibrium + sum of modulus E_alpha(-(t / time)^alpha)` with the Mittag-Leffler function: a
/// Prony series where the exponent `alpha` is one, as `E_1(-x) = exp(-x)`, and with one term below it the fractional Zener model
/// (Mainardi, Fractional Calculus and Waves in Linear Viscoelasticity, 2010, section 3.2).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RelaxationModulus {
    /// In MPa (N/mm²).
    pub equilibrium_mpa: f64,
    pub terms: Vec<RelaxationMode>,
    /// From 0.01 to 1.
    #[serde(default = "exponent_of_prony")]
    pub exponent: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RelaxationMode {
    pub modulus_mpa: f64,
    pub time_secs: f64,
}

/// Below it a force falls evenly over a hundred decades of time, and is at rest in any record.
pub(crate) const EXPONENT_MIN: f64 = 0.01;
/// A fractional relaxation is taken as exponentials to about `exp(-16)`, 1e-7 of its modulus.
const ACCURACY: f64 = 16.0;

fn exponent_of_prony() -> f64 {
    1.0
}

impl RelaxationModulus {
    /// The modulus in MPa at a time in s after a step.
    #[must_use]
    pub fn modulus(&self, time_secs: f64) -> f64 {
        let relaxed = |term: &RelaxationMode| {
            let age = (time_secs / term.time_secs).powf(self.exponent);
            term.modulus_mpa * mittag_leffler(self.exponent, age)
        };
        self.equilibrium_mpa + self.terms.iter().map(relaxed).sum::<f64>()
    }

    pub(crate) fn check(&self) -> Result<(), InvalidValue> {
        let moduli = self.terms.iter().map(|term| term.modulus_mpa).chain([self.equilibrium_mpa]);
        for modulus in moduli.clone() {
            let is_valid = modulus >= 0.0 && modulus.is_finite();
            check(is_valid, "a modulus", modulus, "a number of MPa not below 0")?;
        }
        for term in &self.terms {
            positive("a relaxation time", term.time_secs, "a time above 0 s")?;
        }
        let exponent = self.exponent;
        let is_valid = (EXPONENT_MIN..=1.0).contains(&exponent);
        check(is_valid, "the exponent", exponent, "a number from 0.01 to 1")?;
        positive("the sum of the moduli", moduli.sum(), "a series with a modulus above 0 MPa")
    }

    /// What relaxes exponentially, every modulus with its time, for a history; the equilibrium relaxes never.
    pub(crate) fn modes(&self, knots: &[Knot]) -> Result<Vec<RelaxationMode>, InvalidValue> {
        self.check()?;
        let time_secs = f64::INFINITY;
        let equilibrium = RelaxationMode { modulus_mpa: self.equilibrium_mpa, time_secs };
        if self.exponent == 1.0 {
            return Ok(self.terms.iter().copied().chain([equilibrium]).collect());
        }
        let shares = |term: &RelaxationMode| {
            let RelaxationMode { modulus_mpa, time_secs } = *term;
            let mode = move |one: RateShare| RelaxationMode {
                modulus_mpa: modulus_mpa * one.share,
                time_secs: time_secs * (-one.ln_rate).exp(),
            };
            fractional_rates(time_secs, self.exponent, knots).into_iter().map(mode)
        };
        Ok(self.terms.iter().flat_map(shares).chain([equilibrium]).collect())
    }
}

/// Rates over that of a time in s that together relax with an exponent, as far as the knots tell them from each other: what is
/// much faster than two of them, or much slower than all, is lumped.
pub(crate) fn fractional_rates(time_secs: f64, exponent: f64, knots: &[Knot]) -> Vec<RateShare> {
    let gaps = knots.windows(2).map(|pair| pair[1].time - pair[0].time).filter(|gap| *gap > 0.0);
    let (shortest, whole) = gaps
        .fold((f64::INFINITY, 0.0), |(least, sum): (f64, f64), gap| (least.min(gap), sum + gap));
    let ends = match whole > 0.0 {
        true => [(time_secs / whole).ln() - ACCURACY, (time_secs / shortest).ln() + ACCURACY],
        false => [-ACCURACY, ACCURACY],
    };
    rate_shares(exponent, ACCURACY, ends)
}
