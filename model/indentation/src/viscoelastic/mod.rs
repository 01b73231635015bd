//! Rigid indenters on a linear viscoelastic half-space with a constant Poisson's ratio.

mod contact;
mod history;
mod prony;
mod repeated;

#[cfg(test)]
mod tests;

pub use contact::{PowerLaw, lee_radok_force, lee_radok_force_of, ting_force};
pub use history::{DepthHistory, HistoryError};
pub(crate) use history::{Knot, Memory, Mode};
pub use prony::{PronySeries, PronyTerm};
pub use repeated::repeated_contact_force;
