//! Families of force models and their fitted members.
//!
//! A [`Family`] is an equation; a [`Model`] is a family with numbers; a [`ModelState`] is a model
//! with its depth history. One family to a file. All share one exact step: every family is a sum of
//! [`RelaxationTerm`] terms driven by powers and exponentials of depth, and the response of such a term
//! to a straight piece of depth has a closed form.
//!
//! A family is registered by one line in `table.rs`.
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
mod spectrum;
mod stretched;
mod table;
mod unloading;
mod voigt;

pub use family::{Family, Kernel, OuterParameter, OuterRange};
pub use kelvin::Kelvin;
pub use maxwell::Maxwell;
pub(crate) use model::joined;
pub use model::{Model, ModelError, ModelParameter, ModelPathError, ModelState};
pub use power_series::PowerSeries;
pub use prony::{Prony, TERMS_COMPARED, TERMS_MAX};
pub use relaxation::{DepthDrive, POWER_MAX, RelaxationTerm, SOFTENING_MAX};
pub use response::{Response, StepError};
pub use table::{UnknownFamily, all_families, find_family};
