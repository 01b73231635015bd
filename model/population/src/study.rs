//! The sessions of a study and how they are nested.

use nalgebra::{DMatrix, DVector};
use std::collections::HashMap;
use thiserror::Error;

/// What one session knows of the parameters of its body.
#[derive(Clone, Debug, PartialEq)]
pub enum Evidence {
    /// The values themselves, without an error.
    Exact,
    /// The curvature of the logarithm of the likelihood at the values, with its sign turned: the inverse of their
    /// covariance. It may be singular, where a curve does not depend on a parameter.
    Information(DMatrix<f64>),
}

/// One session.
#[derive(Clone, Debug, PartialEq)]
pub struct StudySession {
    /// By which a refusal names it.
    pub name: String,
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
        "a population with these effects and levels needs {needed} sessions or more, not {found}; add sessions, or leave out effects or levels"
    )]
    Sessions { found: usize, needed: usize },
    #[error("the sessions are of one {level}; add sessions of another one")]
    OneGroup { level: String },
    #[error(
        "each {outer} has one {inner}, so their standard deviations cannot be separated; leave one of the two levels out"
    )]
    SameGroups { outer: String, inner: String },
    #[error("{session} has {found} {what}, not {expected}; give {expected}")]
    Count { session: String, what: &'static str, found: usize, expected: usize },
    #[error(
        "{session} has a {what} that is not a finite number; correct it, or leave the session out"
    )]
    NotFinite { session: String, what: &'static str },
    #[error(
        "the information of {session} is not the inverse of a covariance; fit the session again"
    )]
    Information { session: String },
    #[error("no session determines {parameter}; leave the parameter out")]
    NoInformation { parameter: String },
    #[error(
        "the effects {effects} cannot be separated: one is a sum of the others in every session; leave one out"
    )]
    Effects { effects: String },
    #[error(
        "no standard deviations were found that explain the sessions best; leave out a level or a parameter"
    )]
    NoOptimum,
}

/// Columns of a design of which less than this share is not a sum of the others are such a sum.
const DEPENDENT: f64 = 1e-9;

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
        for one in &self.sessions {
            let session = || one.name.clone();
            for (what, found, expected) in [
                ("groups", one.groups.len(), self.levels.len() - 1),
                ("effects", one.design.len(), self.effects.len()),
                ("values", one.values.len(), count),
            ] {
                if found != expected {
                    return Err(StudyError::Count { session: session(), what, found, expected });
                }
            }
            for (what, values) in [("design", &one.design), ("value", &one.values)] {
                if values.iter().any(|value| !value.is_finite()) {
                    return Err(StudyError::NotFinite { session: session(), what });
                }
            }
            if let Evidence::Information(information) = &one.evidence {
                let is_square = information.shape() == (count, count);
                let is_finite = information.iter().all(|value| value.is_finite());
                if !is_square || !is_finite || !is_covariance(information) {
                    return Err(StudyError::Information { session: session() });
                }
            }
        }
        // One more than the means and standard deviations of a parameter.
        let needed = self.effects.len() + self.levels.len() + 1;
        if self.sessions.len() < needed {
            return Err(StudyError::Sessions { found: self.sessions.len(), needed });
        }
        self.check_information()?;
        self.check_effects()
    }

    fn check_information(&self) -> Result<(), StudyError> {
        let is_known = |k: usize| {
            self.sessions.iter().any(|one| match &one.evidence {
                Evidence::Exact => true,
                Evidence::Information(information) => information[(k, k)] > 0.0,
            })
        };
        match (0..self.parameters.len()).find(|&k| !is_known(k)) {
            Some(k) => Err(StudyError::NoInformation { parameter: self.parameters[k].clone() }),
            None => Ok(()),
        }
    }

    fn check_effects(&self) -> Result<(), StudyError> {
        let rows = self.sessions.iter().flat_map(|one| one.design.iter().copied());
        let design = DMatrix::from_row_iterator(self.sessions.len(), self.effects.len(), rows);
        // Each column over its size, so that units do not matter.
        let columns = design.column_iter().map(|column| column.try_normalize(0.0));
        let scaled = columns.collect::<Option<Vec<_>>>().map(|all| DMatrix::from_columns(&all));
        match scaled.is_some_and(|scaled| scaled.rank(DEPENDENT) == self.effects.len()) {
            true => Ok(()),
            false => Err(StudyError::Effects { effects: self.effects.join(", ") }),
        }
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

    /// Names of its group of a level and of those that this belongs to, the outermost first; of the last level with its own name.
    #[must_use]
    pub fn path(&self, level: usize) -> Vec<&str> {
        let groups = self.groups.iter().take(level + 1).map(String::as_str);
        let own = (level >= self.groups.len()).then_some(self.name.as_str());
        groups.chain(own).collect()
    }
}
