//! The sessions of a study and how they are nested.

use nalgebra::{DMatrix, DVector};
use std::collections::HashMap;
use thiserror::Error;

/// What one session tells of the parameters of its body.
#[derive(Clone, Debug, PartialEq)]
pub enum Evidence {
    /// The values themselves, without an error.
    Exact,
    /// The curvature of the logarithm of the likelihood at the values, with its sign turned: the inverse of their
    /// covariance. It may be singular, where a curve does not tell a parameter.
    Information(DMatrix<f64>),
}

/// One session.
#[derive(Clone, Debug, PartialEq)]
pub struct StudySession {
    /// Names of the groups that it belongs to, the outermost first (animal, specimen, site): one for each level but the last.
    pub groups: Vec<String>,
    /// The value of each effect, one for each column of [`Study::effects`].
    pub design: Vec<f64>,
    /// Logarithms of the parameters, one for each of [`Study::parameters`].
    pub values: Vec<f64>,
    pub evidence: Evidence,
}

/// Sessions, nested in groups.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Study {
    pub parameters: Vec<String>,
    /// Columns of the design: the intercept and what may move the mean.
    pub effects: Vec<String>,
    /// Levels from the outermost to the session itself, such as animal, specimen, site, repeat.
    pub levels: Vec<String>,
    pub sessions: Vec<StudySession>,
}

/// A study that says nothing of a population.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum StudyError {
    #[error(
        "the study has {sessions} sessions for {numbers} means and spreads; give more sessions"
    )]
    Sessions { sessions: usize, numbers: usize },
    #[error("the study has one {level} only; its spread needs two or more")]
    OneGroup { level: String },
    #[error(
        "each {outer} has one {inner}, so that their spreads cannot be told apart; leave one of both levels out"
    )]
    SameGroups { outer: String, inner: String },
    #[error("session {session} has {found} {what}; give {expected}")]
    Count { session: usize, what: &'static str, found: usize, expected: usize },
    #[error(
        "session {session} has a {what} that is not a finite number; leave the session out or correct it"
    )]
    NotFinite { session: usize, what: &'static str },
    #[error(
        "the information of session {session} is not a covariance's inverse; fit the session again"
    )]
    Information { session: usize },
    #[error(
        "the effects {effects} cannot be told apart: one is a sum of the others in every session; leave one out"
    )]
    Effects { effects: String },
    #[error(
        "no spreads were found that explain the sessions; look at the values of single sessions for one far off"
    )]
    NoOptimum,
}

/// A study whose groups are numbers.
#[derive(Clone, Debug)]
pub(crate) struct NestedStudy {
    pub sessions: Vec<StudySession>,
    /// Of each level but the sessions' own, the outermost first: the group of the level above that each group belongs to;
    /// zeros for the outermost.
    pub parents: Vec<Vec<usize>>,
    /// The innermost group of each session.
    pub owner: Vec<usize>,
    /// Names of the groups of each level, each behind those that it belongs to.
    pub names: Vec<Vec<String>>,
    pub parameters: usize,
    pub effects: usize,
}

impl Study {
    pub(crate) fn nested(&self) -> Result<NestedStudy, StudyError> {
        self.check()?;
        let outer = self.levels.len() - 1;
        let mut study = NestedStudy {
            sessions: self.sessions.clone(),
            parents: vec![Vec::new(); outer],
            owner: Vec::with_capacity(self.sessions.len()),
            names: vec![Vec::new(); outer],
            parameters: self.parameters.len(),
            effects: self.effects.len(),
        };
        let mut known: Vec<HashMap<(usize, &str), usize>> = vec![HashMap::new(); outer];
        for session in &self.sessions {
            let (mut parent, mut path) = (0, String::new());
            for (level, name) in session.groups.iter().enumerate() {
                path = if level == 0 { name.clone() } else { format!("{path} / {name}") };
                let next = study.parents[level].len();
                let index = *known[level].entry((parent, name)).or_insert(next);
                if index == next {
                    study.parents[level].push(parent);
                    study.names[level].push(path.clone());
                }
                parent = index;
            }
            study.owner.push(parent);
        }
        self.check_levels(&study)?;
        Ok(study)
    }

    fn check(&self) -> Result<(), StudyError> {
        let count = self.parameters.len();
        for (session, one) in self.sessions.iter().enumerate() {
            for (what, found, expected) in [
                ("groups", one.groups.len(), self.levels.len() - 1),
                ("effects", one.design.len(), self.effects.len()),
                ("values", one.values.len(), count),
            ] {
                if found != expected {
                    return Err(StudyError::Count { session, what, found, expected });
                }
            }
            for (what, values) in [("design", &one.design), ("value", &one.values)] {
                if values.iter().any(|value| !value.is_finite()) {
                    return Err(StudyError::NotFinite { session, what });
                }
            }
            if let Evidence::Information(information) = &one.evidence {
                let is_square = information.shape() == (count, count);
                let is_finite = information.iter().all(|value| value.is_finite());
                if !is_square || !is_finite || !is_covariance(information) {
                    return Err(StudyError::Information { session });
                }
            }
        }
        let numbers = count * (self.effects.len() + self.levels.len());
        if self.sessions.len() * count <= numbers {
            return Err(StudyError::Sessions { sessions: self.sessions.len(), numbers });
        }
        Ok(())
    }

    fn check_levels(&self, study: &NestedStudy) -> Result<(), StudyError> {
        let mut counts: Vec<usize> = study.parents.iter().map(Vec::len).collect();
        counts.push(self.sessions.len());
        if counts[0] < 2 {
            return Err(StudyError::OneGroup { level: self.levels[0].clone() });
        }
        for level in 1..counts.len() {
            if counts[level] == counts[level - 1] {
                return Err(StudyError::SameGroups {
                    outer: self.levels[level - 1].clone(),
                    inner: self.levels[level].clone(),
                });
            }
        }
        Ok(())
    }
}

/// Symmetric, and no variance below zero but for rounding.
fn is_covariance(matrix: &DMatrix<f64>) -> bool {
    let size = matrix.amax();
    let asymmetry = (matrix - matrix.transpose()).amax();
    let lowest = matrix.clone().symmetric_eigenvalues().min();
    asymmetry <= 1e-9 * size && lowest >= -1e-9 * size
}

impl StudySession {
    pub(crate) fn vector(&self) -> DVector<f64> {
        DVector::from_column_slice(&self.values)
    }
}
