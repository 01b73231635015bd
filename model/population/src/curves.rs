//! The population of whole curves: each session enters with its likelihood where the population expects its body.

use crate::fit::{PopulationFit, PopulationOptions, fit_population};
use crate::study::{Evidence, Study, StudyError};
use nalgebra::{Cholesky, DMatrix};

/// Rounds at most, and the largest change of a session's most probable body that ends them, in standard deviations of what
/// the session tells by itself.
const ROUNDS_MAX: usize = 30;
const CHANGE: f64 = 1e-4;

/// What a session's curve tells around a body: the normal distribution with its slope and curvature there.
#[derive(Clone, Debug, PartialEq)]
pub struct CurveEvidence {
    /// Logarithms of the parameters.
    pub centre: Vec<f64>,
    pub covariance: DMatrix<f64>,
}

/// A population of curves, and how it was found.
#[derive(Clone, Debug, PartialEq)]
pub struct CurvePopulation {
    pub fit: PopulationFit,
    /// The study with what the curves told last.
    pub study: Study,
    pub rounds: usize,
    pub is_converged: bool,
}

/// The population of a study whose sessions' curves tell more than a value and its covariance: in turn, the curves are
/// expanded around the most probable body of each session, and the population is found of what they tell there (Lindstrom &
/// Bates, Biometrics 46 (1990) 673-687). `expand` gets the place of a session and the logarithms of a body; without an answer
/// what the session told before stands. `heard` is called after each round.
pub fn fit_curves(
    mut study: Study,
    options: PopulationOptions,
    mut expand: impl FnMut(usize, &[f64]) -> Option<CurveEvidence>,
    mut heard: impl FnMut(usize),
) -> Result<CurvePopulation, StudyError> {
    let plain = PopulationOptions { has_spread_intervals: false, ..options };
    let (mut rounds, mut is_converged) = (0, false);
    while rounds < ROUNDS_MAX && !is_converged {
        let fit = fit_population(&study, plain)?;
        let mut largest = 0.0f64;
        for (index, (session, mode)) in study.sessions.iter_mut().zip(&fit.modes).enumerate() {
            let Some(told) = expand(index, mode.as_slice()) else { continue };
            let Some(factor) = Cholesky::new(told.covariance.clone()) else { continue };
            let deviations = told.covariance.diagonal().map(f64::sqrt);
            let pairs = told.centre.iter().zip(&session.values).zip(&deviations);
            largest =
                pairs.fold(largest, |most, ((new, old), sd)| most.max((new - old).abs() / sd));
            session.values = told.centre;
            session.evidence = Evidence::Information(factor.inverse());
        }
        rounds += 1;
        is_converged = largest < CHANGE;
        heard(rounds);
    }
    let fit = fit_population(&study, options)?;
    Ok(CurvePopulation { fit, study, rounds, is_converged })
}
