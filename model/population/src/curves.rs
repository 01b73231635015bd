//! The population of whole curves: each session enters with its likelihood where the population expects its body.

use crate::fit::most_probable;
use crate::study::{Evidence, Study, StudyError};
use nalgebra::{Cholesky, DMatrix};

/// Rounds at most, and the largest change of the centre of a session's expansion that ends them, in its standard deviations.
const ROUNDS_MAX: usize = 30;
const CHANGE: f64 = 1e-4;

/// The likelihood of a session's curve around a model: the normal distribution with its slope and curvature there.
#[derive(Clone, Debug, PartialEq)]
pub struct CurveEvidence {
    /// Logarithms of the parameters.
    pub centre: Vec<f64>,
    pub covariance: DMatrix<f64>,
}

impl CurveEvidence {
    /// Of a covariance by its rows, whose halves differ by rounding.
    #[must_use]
    pub fn of_rows(centre: Vec<f64>, rows: &[Vec<f64>]) -> Self {
        let count = centre.len();
        let covariance = DMatrix::from_fn(count, count, |row, column| {
            0.5 * (rows[row][column] + rows[column][row])
        });
        Self { centre, covariance }
    }

    /// The evidence of a session; `None` where the covariance is none.
    #[must_use]
    pub fn evidence(&self) -> Option<Evidence> {
        Some(Evidence::Information(Cholesky::new(self.covariance.clone())?.inverse()))
    }
}

/// How the curves of a study were expanded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CurveRounds {
    pub rounds: usize,
    /// False where the expansions still moved, or one of the last round failed.
    pub is_converged: bool,
}

/// Expands the curves of a study's sessions around what the population says of each, and finds the population from these
/// expansions, in turn until nothing changes (Lindstrom & Bates, Biometrics 46 (1990) 673-687). `expand` gets the most probable
/// parameters of all sessions, in logarithms; a session without an answer keeps the expansion that it had.
pub fn expand_curves<E: From<StudyError>>(
    study: &mut Study,
    mut expand: impl FnMut(&[Vec<f64>]) -> Result<Vec<Option<CurveEvidence>>, E>,
) -> Result<CurveRounds, E> {
    for rounds in 1..=ROUNDS_MAX {
        let modes = most_probable(study)?;
        let modes: Vec<Vec<f64>> = modes.iter().map(|one| one.as_slice().to_vec()).collect();
        let mut largest = 0.0f64;
        for (session, found) in study.sessions.iter_mut().zip(expand(&modes)?) {
            let evidence = found.as_ref().and_then(CurveEvidence::evidence);
            let (Some(found), Some(evidence)) = (found, evidence) else {
                largest = f64::INFINITY;
                continue;
            };
            let deviations = found.covariance.diagonal().map(f64::sqrt);
            let pairs = found.centre.iter().zip(&session.values).zip(&deviations);
            let changes = pairs.map(|((new, old), deviation)| (new - old).abs() / deviation);
            largest = changes.fold(largest, f64::max);
            (session.values, session.evidence) = (found.centre, evidence);
        }
        if largest < CHANGE {
            return Ok(CurveRounds { rounds, is_converged: true });
        }
    }
    Ok(CurveRounds { rounds: ROUNDS_MAX, is_converged: false })
}
