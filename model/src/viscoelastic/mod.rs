//! Viscoelastic force models.

mod exact_step;
mod kelvin;
mod psi;

pub use kelvin::{BodyError, KelvinState, ModifiedKelvin};
pub(crate) use psi::psi_all;
pub use psi::{psi, psi_derivative};
