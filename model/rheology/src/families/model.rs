//! A fitted model: a family with its parameters known.

use super::family::Family;
use super::relaxation::RelaxationTerm;
use super::response::{Response, StepError, plain};
use super::{UnknownFamily, find_family};
use palpate_model::units::{Depth, Newtons, Seconds};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A named number with its unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelParameter {
    pub name: String,
    /// Value, in `unit`.
    pub value: f64,
    pub unit: String,
}

impl ModelParameter {
    pub(super) fn new(name: &str, value: f64, unit: &str) -> Self {
        Self { name: name.to_owned(), value, unit: unit.to_owned() }
    }
}

/// A model of one family with all its parameters.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Model {
    pub family: String,
    /// Outer parameters, in the family's order and units.
    pub outer: Vec<f64>,
    /// Coefficients, in the family's order and units.
    pub linear: Vec<f64>,
}

/// Numbers that are no model.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ModelError {
    #[error(transparent)]
    Family(#[from] UnknownFamily),
    #[error(
        "a model of family {family} needs {wanted} numbers, but {given} are given; give {names}"
    )]
    Count { family: String, wanted: usize, given: usize, names: String },
    #[error("{family}: {name} cannot be {}; it must be {must}", plain(.value))]
    Value { family: String, name: String, value: f64, must: &'static str },
}

#[derive(Clone, Debug, PartialEq, Error)]
pub enum ModelPathError {
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Step(#[from] StepError),
}

impl Model {
    /// The model, if its numbers describe one: positive times, finite coefficients.
    pub fn checked(self) -> Result<Self, ModelError> {
        let family = find_family(&self.family)?;
        let (outer, linear) = (family.outer(), family.linear());
        if outer.len() != self.outer.len() || linear.len() != self.linear.len() {
            let names = outer.iter().map(|one| one.name.clone());
            let names: Vec<String> =
                names.chain(linear.iter().map(|(name, _)| name.clone())).collect();
            return Err(ModelError::Count {
                family: self.family.clone(),
                wanted: outer.len() + linear.len(),
                given: self.outer.len() + self.linear.len(),
                names: names.join(", "),
            });
        }
        let bad = |name: &str, value: f64, must: &'static str| ModelError::Value {
            family: self.family.clone(),
            name: name.to_owned(),
            value,
            must,
        };
        for (known, &value) in outer.iter().zip(&self.outer) {
            if let Err(must) = known.range.allows(value) {
                return Err(bad(&known.name, value, must));
            }
        }
        for ((name, _), &value) in linear.iter().zip(&self.linear) {
            if !value.is_finite() {
                return Err(bad(name, value, "a finite number"));
            }
        }
        Ok(self)
    }

    /// Its terms, those of one relaxation time joined, ready for any depth history.
    pub fn terms(&self) -> Result<Vec<RelaxationTerm>, ModelError> {
        let family = find_family(&self.family)?;
        Ok(joined(&family.columns(&self.outer), self.linear.iter().copied()))
    }

    /// The body, relaxed with the probe at `depth`.
    pub fn at_rest_from(&self, depth: Depth) -> Result<ModelState, ModelPathError> {
        if !depth.is_finite() {
            return Err(StepError::Depth(depth.0).into());
        }
        let response = Response::new(&[self.terms()?], depth);
        if !response.sum().is_finite() {
            return Err(StepError::Rest { depth: depth.0 }.into());
        }
        Ok(ModelState { response })
    }

    /// The force in N along a path of `(time, depth)`, from a body relaxed at its first point.
    pub fn along(
        &self,
        path: impl IntoIterator<Item = (Seconds, Depth)>,
    ) -> Result<Vec<f64>, ModelPathError> {
        let mut path = path.into_iter();
        let Some((mut before, start)) = path.next() else {
            return Ok(Vec::new());
        };
        if !before.is_finite() {
            return Err(StepError::Time(before.0).into());
        }
        let mut body = self.at_rest_from(start)?;
        let mut forces = vec![body.force().0];
        for (t, depth) in path {
            forces.push(body.step(depth, Seconds(t.0 - before.0))?.0);
            before = t;
        }
        Ok(forces)
    }

    /// All parameters: outer ones, coefficients, and what the literature makes of them.
    pub fn parameters(&self) -> Result<Vec<ModelParameter>, ModelError> {
        let family = find_family(&self.family)?;
        let outer = family.outer().into_iter().zip(&self.outer);
        let outer = outer.map(|(one, value)| ModelParameter::new(&one.name, *value, one.unit));
        let linear = family.linear().into_iter().zip(&self.linear);
        let linear = linear.map(|((name, unit), value)| ModelParameter::new(&name, *value, unit));
        let mut all: Vec<ModelParameter> = outer.chain(linear).collect();
        all.extend(family.derived(&self.outer, &self.linear));
        Ok(all)
    }
}

/// Columns times coefficients, terms of one relaxation time joined: each costs a state.
pub(crate) fn joined(
    columns: &[Vec<RelaxationTerm>],
    linear: impl IntoIterator<Item = f64>,
) -> Vec<RelaxationTerm> {
    let mut joined: Vec<RelaxationTerm> = Vec::new();
    for (column, coefficient) in columns.iter().zip(linear) {
        for term in column {
            let term = term.scaled(coefficient);
            match joined.iter_mut().find_map(|one| one.plus(&term).map(|sum| (one, sum))) {
                Some((one, sum)) => *one = sum,
                None => joined.push(term),
            }
        }
    }
    joined
}

/// A model with its depth history.
#[derive(Clone, Debug)]
pub struct ModelState {
    response: Response,
}

impl ModelState {
    /// Moves straight to `depth` within `dt` and returns the force there.
    pub fn step(&mut self, depth: Depth, dt: Seconds) -> Result<Newtons, StepError> {
        self.response.step(depth, dt)?;
        Ok(self.force())
    }

    pub fn force(&self) -> Newtons {
        Newtons(self.response.sum())
    }
}

impl dyn Family + '_ {
    pub fn model(&self, outer: &[f64], linear: &[f64]) -> Result<Model, ModelError> {
        Model { family: self.key(), outer: outer.to_vec(), linear: linear.to_vec() }.checked()
    }
}
