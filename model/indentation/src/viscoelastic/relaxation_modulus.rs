//! The relaxation modulus.

use crate::invalid_value::{InvalidValue, check, positive};
use serde::{Deserialize, Serialize};

/// A shear relaxation modulus `G(t) = equilibrium + sum of modulus exp(-t / time)`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RelaxationModulus {
    /// In MPa (N/mm²).
    pub equilibrium_mpa: f64,
    pub terms: Vec<RelaxationMode>,
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RelaxationMode {
    pub modulus_mpa: f64,
    pub time_secs: f64,
}

impl RelaxationModulus {
    /// The modulus in MPa at a time in s after a step.
    #[must_use]
    pub fn modulus(&self, time_secs: f64) -> f64 {
        let decayed =
            |term: &RelaxationMode| term.modulus_mpa * (-time_secs / term.time_secs).exp();
        self.equilibrium_mpa + self.terms.iter().map(decayed).sum::<f64>()
    }

    /// Every modulus with its time; the equilibrium relaxes never.
    pub(crate) fn modes(&self) -> Result<Vec<RelaxationMode>, InvalidValue> {
        let equilibrium =
            RelaxationMode { modulus_mpa: self.equilibrium_mpa, time_secs: f64::INFINITY };
        let modes: Vec<RelaxationMode> = self.terms.iter().copied().chain([equilibrium]).collect();
        for mode in &modes {
            let modulus = mode.modulus_mpa;
            let is_valid = modulus >= 0.0 && modulus.is_finite();
            check(is_valid, "a modulus", modulus, "a number of MPa not below 0")?;
        }
        for term in &self.terms {
            positive("a relaxation time", term.time_secs, "a time above 0 s")?;
        }
        let sum = modes.iter().map(|mode| mode.modulus_mpa).sum();
        positive("the sum of the moduli", sum, "a series with a modulus above 0 MPa")?;
        Ok(modes)
    }
}
