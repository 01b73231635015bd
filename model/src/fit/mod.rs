//! Identification of force models.
//!
//! Start at [`fit()`]. The method is variable projection: for a given relaxation time the model is
//! linear in everything else, so the fit is a search over one number with a small least-squares
//! problem inside.

mod block_sums;
mod bootstrap;
mod design;
mod family;
mod identify;
mod live;
mod maxwell;
mod noise;
mod options;
mod profile;
mod record;
mod refine;
mod report;
mod sample;
mod scan;
mod sentences;
mod solve;
mod system;
mod systematic;
mod thin;
mod triangle;
mod uncertainty;

pub use bootstrap::{Bootstrap, BootstrapInterval};
pub use family::{
    FamilyFit, FamilyOptions, FamilyParameter, Predicted, RecordFit, fit_body, fit_family,
    fit_family_at, predict,
};
pub use live::{LiveEstimate, LiveFit, ResidualBlocks, Verdict};
pub use maxwell::{MaxwellFit, StrainSample, fit_maxwell};
pub use options::{FitOptions, PARAMETER_NAMES, PARAMETER_UNITS};
pub use profile::ProfileInterval;
pub use report::{FitReport, JointReport, MODEL_NAME, NamedReport, NoiseFound, Parameter};
pub use sample::{FitError, FitSample};
pub use solve::{Fitted, fit, fit_joint};
pub use systematic::{
    Systematic, SystematicError, TermError, Traced, systematic, systematic_family, systematic_joint,
};
