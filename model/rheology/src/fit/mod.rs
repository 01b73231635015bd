//! Identification of force models.
//!
//! Start at [`fit()`]. The method is variable projection: for given outer parameters (relaxation times, curvatures) a
//! family of models is linear in everything else, so the fit is a search over a few numbers with a small least-squares
//! problem inside. A family supplies columns ([`columns`]); all else is the same for all.

mod autocorrelation;
mod band;
mod block_sums;
mod bootstrap;
mod columns;
mod curve_likelihood;
mod design;
mod identify;
mod inflation;
mod live;
mod log_statistics;
mod nonnegative;
mod options;
mod parameters;
mod passes;
mod predict;
mod profile;
mod record;
mod refine;
mod report;
mod richer;
mod sample;
mod search;
mod sentences;
mod signal;
mod solve;
mod system;
mod systematic;
mod thin;
mod triangle;
mod uncertainty;

pub use autocorrelation::ResidualAutocorrelation;
pub use band::PredictedForce;
pub use bootstrap::{Bootstrap, BootstrapInterval};
pub use curve_likelihood::{CurveLikelihood, LikelihoodExpansion};
pub use live::{LiveFit, ResidualBlocks};
pub use log_statistics::LogarithmStatistics;
pub use options::{FitOptions, PARAMETER_NAMES, PARAMETER_UNITS};
pub use predict::{ForcePrediction, predict};
pub use profile::ProfileInterval;
pub use report::{
    BudgetEntry, FitReport, FittedParameter, JointReport, NamedReport, NoiseEstimate,
};
pub use sample::{FitError, FitSample};
pub use signal::{
    ExpectedSignal, PressedSignal, Signal, SignalRecord, UnloadedMean, estimate_zero,
    fit_compliance_to_signal,
};
pub use solve::{FitSolution, fit, fit_body, fit_coefficients, fit_joint};
pub use systematic::{
    SystematicError, SystematicUncertainty, TermError, TracedRecord, estimate_systematic,
    estimate_systematic_jointly,
};
pub(crate) use triangle::{CONDITION_MAX, dominant_entries};
