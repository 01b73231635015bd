//! From the parameters of single sessions to the population that their specimens come from.
//!
//! The parameters of one session are a vector of logarithms with an uncertainty. They scatter from animal to animal, within an
//! animal from specimen to specimen, and so on down to the repeat; [`fit_population`] finds how far, and the means and effects of
//! covariates, from all sessions together. It never reads a file, a port or a clock and starts no thread.
//!
//! Start at [`Study`].
#![cfg_attr(not(test), warn(clippy::too_many_lines))]

mod agreement;
mod comparisons;
mod curves;
mod draw;
mod fit;
mod influence;
mod likelihood;
mod plan;
mod profile;
mod scores;
mod search;
mod study;
#[cfg(test)]
mod tests;

pub use agreement::{Agreement, AgreementError, PairedPlace, agreement};
pub use comparisons::holm;
pub use curves::{CurveEvidence, CurveRounds, expand_curves};
pub use draw::MemberDistribution;
pub use fit::{
    COVERAGE, Contrast, EffectEstimate, GroupShift, LevelDeviation, PopulationFit,
    PopulationOptions, fit_population,
};
pub use influence::{GroupPlace, Influence, influence};
/// A symmetric matrix of one row for each parameter.
pub use nalgebra::DMatrix as SymmetricMatrix;
pub use plan::{ASSURANCE, PlannedEffect, PlannedStudy, plan_study};
pub use scores::{NormalScore, normal_scores, outlying_group};
pub use study::{Evidence, Study, StudyError, StudySession};
