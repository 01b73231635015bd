//! Rigid indenters on a linear viscoelastic specimen with a constant Poisson's ratio.

mod contact;
mod creep;
mod history;
mod load_history;
mod relaxation_modulus;
mod repeated;

#[cfg(test)]
mod fractional_tests;
#[cfg(test)]
mod sine_tests;
#[cfg(test)]
mod tests;

pub use contact::{PowerLaw, lee_radok_force, lee_radok_force_of, ting_force};
pub use creep::{CreepSeries, CreepTerm};
pub use history::{DepthHistory, HistoryError};
pub(crate) use history::{Knot, Memory, Mode};
pub use load_history::{LoadHistoryError, load_and_slope, load_history};
pub(crate) use relaxation_modulus::{EXPONENT_MIN, fractional_rates};
pub use relaxation_modulus::{RelaxationMode, RelaxationModulus};
pub use repeated::repeated_contact_force;
