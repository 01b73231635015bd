//! Families of force models and their fitted members.
//!
//! A [`Family`] is an equation; a [`Model`] is a family with numbers; a [`Body`] is a model that
//! remembers its depth history. One family to a file. All share one exact step: every family is a sum of
//! [`Relaxation`] terms driven by powers and exponentials of depth, and the response of such a term
//! to a straight piece of depth has a closed form.
//!
//! Galford's four-element body is left out: no public text that defines it could be verified.

mod exponential;
mod exponential_step;
mod family;
mod fractional;
mod kelvin;
mod maxwell;
mod model;
mod power_series;
mod prony;
mod quadrature;
mod quasi_linear;
mod relaxation;
mod response;
mod unloading;
mod voigt;

pub use exponential::ExponentialKelvin;
pub use family::{Family, Kernel, Live, Outer, OuterRange};
pub use fractional::{FRACTIONAL_DIGITS, FractionalZener};
pub use kelvin::Kelvin;
pub use maxwell::Maxwell;
pub(crate) use model::joined;
pub use model::{AlongError, Body, Model, ModelError, ModelParameter};
pub use power_series::PowerSeries;
pub use prony::{Prony, TERMS_COMPARED, TERMS_MAX};
pub use quasi_linear::{QUASI_LINEAR_NODES, QuasiLinear};
pub use relaxation::{Drive, POWER_MAX, Relaxation, SOFTENING_MAX};
pub use response::{Response, StepError};
pub use unloading::Unloading;
pub use voigt::Voigt;

use std::sync::Arc;
use thiserror::Error;

/// No family has this key.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("there is no model family '{key}'; there are {known}")]
pub struct UnknownFamily {
    /// What was asked for.
    pub key: String,
    /// Keys there are.
    pub known: String,
}

/// All families, the simplest first: what a selection compares. One Prony term is the Kelvin body;
/// unloading of other orders than the third is there by its key.
#[must_use]
pub fn all() -> Vec<Arc<dyn Family>> {
    let mut all: Vec<Arc<dyn Family>> = vec![Arc::new(Voigt), Arc::new(Maxwell), Arc::new(Kelvin)];
    for order in 1..=POWER_MAX {
        all.extend(PowerSeries::of_order(order).map(|family| Arc::new(family) as Arc<dyn Family>));
    }
    all.push(Arc::new(ExponentialKelvin));
    for terms in 2..=TERMS_COMPARED {
        all.extend(Prony::of_terms(terms).map(|family| Arc::new(family) as Arc<dyn Family>));
    }
    all.push(Arc::new(FractionalZener::default()));
    all.push(Arc::new(QuasiLinear::default()));
    all.extend(Unloading::of_order(3).map(|family| Arc::new(family) as Arc<dyn Family>));
    all
}

/// The family of a key such as `series-3`, `unloading-3` or `fung-8`.
pub fn by_key(key: &str) -> Result<Arc<dyn Family>, UnknownFamily> {
    let found: Option<Arc<dyn Family>> = match key {
        "voigt" => Some(Arc::new(Voigt)),
        "maxwell" => Some(Arc::new(Maxwell)),
        "kelvin" => Some(Arc::new(Kelvin)),
        "exponential" => Some(Arc::new(ExponentialKelvin)),
        "fung" => Some(Arc::new(QuasiLinear::default())),
        "fractional" => Some(Arc::new(FractionalZener::default())),
        _ => key.split_once('-').and_then(|(kind, number)| {
            let number: usize = number.parse().ok()?;
            match kind {
                "series" => PowerSeries::of_order(number).map(|one| Arc::new(one) as _),
                "unloading" => Unloading::of_order(number).map(|one| Arc::new(one) as _),
                "prony" => Prony::of_terms(number).map(|one| Arc::new(one) as _),
                "fung" => QuasiLinear::of_nodes(number).map(|one| Arc::new(one) as _),
                "fractional" => u32::try_from(number)
                    .ok()
                    .and_then(FractionalZener::of_digits)
                    .map(|one| Arc::new(one) as _),
                _ => None,
            }
        }),
    };
    found.ok_or_else(|| UnknownFamily {
        key: key.to_owned(),
        known: all()
            .iter()
            .map(|family| family.key())
            .collect::<Vec<_>>()
            .join(", "),
    })
}
