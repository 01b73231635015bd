//! The fit of any model family to one or several records.
//!
//! The same method as for the modified Kelvin body, variable projection, without what makes that one
//! fast: for given outer parameters the problem is linear, a grid over the outer parameters finds the
//! deepest valleys on the thinned records, damped Gauss-Newton steps follow them, first there and
//! then on every sample.

mod curve;
mod descent;
mod given;
mod nonnegative;
mod predict;
mod problem;
mod report;
mod search;

pub use given::fit_family_at;
pub use predict::{Predicted, predict};
pub(super) use report::refit_family;
pub use report::{FamilyFit, FamilyParameter, RecordFit, fit_body, fit_family};

/// What a family's fit finds besides the body: the same for every family, or they could not be
/// compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FamilyOptions {
    /// Whether each record has a sensor offset of its own.
    pub offset: bool,
    /// Whether each record may start with a force that fades, where the family has one relaxation time.
    pub initial: bool,
}

impl Default for FamilyOptions {
    /// Both, as in the fit of the modified Kelvin body.
    fn default() -> Self {
        Self {
            offset: true,
            initial: true,
        }
    }
}
