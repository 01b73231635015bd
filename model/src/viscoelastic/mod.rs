//! Viscoelastic force models.

pub mod admissibility;
mod exact_step;
mod kelvin;
mod mittag_leffler;
mod psi;

pub use exact_step::{CompensatedSum, ContactPieces, NEGLIGIBLE, StepWeights, forcing};
pub use kelvin::{BodyError, KelvinState, ModifiedKelvin};
pub use mittag_leffler::{RateShare, mittag_leffler, rate_shares};
pub use psi::{PSI_COUNT, psi_all, psi_derivatives, psi_first};
pub use psi::{psi, psi_derivative};
