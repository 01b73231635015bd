//! Identification of force models.
//!
//! Start at [`fit()`]. The method is variable projection: for a given relaxation time the model is
//! linear in everything else, so the fit is a search over one number with a small least-squares
//! problem inside.

mod design;
mod identify;
mod live;
mod options;
mod problem;
mod refine;
mod report;
mod sample;
mod scan;
mod solve;
mod triangle;

pub use live::{LiveEstimate, LiveFit, ResidualBlocks, Verdict};
pub use options::{FitOptions, PARAMETER_NAMES, PARAMETER_UNITS};
pub use report::{FitReport, MODEL_NAME, Parameter};
pub use sample::{FitError, FitSample};
pub use solve::fit;
