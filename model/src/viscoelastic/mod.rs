//! Viscoelastic force models.

pub mod admissibility;
mod exact_step;
mod kelvin;
mod maxwell;
mod psi;

pub(crate) use exact_step::{Compensated, NEGLIGIBLE, Pieces, StepWeights, forcing};
pub use kelvin::{BodyError, KelvinState, ModifiedKelvin};
pub(crate) use maxwell::MaxwellStep;
pub use maxwell::{Integrator, Maxwell, MaxwellState};
pub(crate) use psi::{PSI_COUNT, psi_all, psi_derivatives, psi_first};
pub use psi::{psi, psi_derivative};
