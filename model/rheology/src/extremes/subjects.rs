//! Subjects of the paths: the exact step of every family, and every integrator.

use super::judge::{ExtremesSubject, Oracle, PathCase, TOLERANCE};
use crate::families::{Model, RelaxationTerm};
use crate::integrators::{Precision, Real, Scheme, SeriesBody};
use crate::reference::{Reference, RuleReference};
use palpate_model::units::{Depth, Seconds};

/// A member of a family, stepped by its own exact step.
#[derive(Clone, Debug)]
pub struct FamilyBody(pub Model);

impl ExtremesSubject for FamilyBody {
    fn name(&self) -> String {
        self.0.family.clone()
    }

    fn terms(&self) -> Result<Vec<RelaxationTerm>, String> {
        let model = self.0.clone().checked().map_err(|err| err.to_string())?;
        model.terms().map_err(|err| err.to_string())
    }

    fn forces(&self, path: &PathCase) -> Result<Vec<f64>, String> {
        let model = self.0.clone().checked().map_err(|err| err.to_string())?;
        let mut body = model.at_rest_from(Depth(path.start)).map_err(|err| err.to_string())?;
        let forces = path.steps.iter().map(|&(dt, depth)| {
            let force = body.step(Depth(depth), Seconds(dt));
            force.map(|force| force.0).map_err(|err| err.to_string())
        });
        forces.collect()
    }
}

/// The thesis body, with another relaxation time, stepped by an integrator.
#[derive(Clone, Copy, Debug)]
pub struct SchemeBody {
    pub scheme: Scheme,
    pub precision: Precision,
    pub body: SeriesBody<3>,
}

/// An error of single precision, relative to the peak force: some ten roundings of 6e-8, and the
/// depths themselves are rounded.
const TOLERANCE_SINGLE: f64 = 3e-6;

impl SchemeBody {
    fn run<R: Real>(&self, path: &PathCase) -> Result<Vec<f64>, String> {
        let Some(&(dt, _)) = path.steps.first() else {
            return Ok(Vec::new());
        };
        let depths = std::iter::once(path.start).chain(path.steps.iter().map(|step| step.1));
        let depths: Vec<R> = depths.map(R::of).collect();
        let mut forces = Vec::new();
        self.scheme.respond(&self.body, dt, &depths, &mut forces).map_err(|err| err.to_string())?;
        Ok(forces.iter().skip(1).map(|force| force.to_f64()).collect())
    }
}

impl ExtremesSubject for SchemeBody {
    fn name(&self) -> String {
        format!("{}, {}", self.scheme.name(), self.precision.name())
    }

    fn terms(&self) -> Result<Vec<RelaxationTerm>, String> {
        let body = self.body.checked().map_err(|err| err.to_string())?;
        Ok(vec![body.term()])
    }

    fn forces(&self, path: &PathCase) -> Result<Vec<f64>, String> {
        match self.precision {
            Precision::F32 => self.run::<f32>(path),
            Precision::F64 => self.run::<f64>(path),
        }
    }

    /// The exact response, or what the rule's textbook makes of it.
    fn oracle(&self, start: Depth, digits: usize) -> Result<Oracle, String> {
        if let Some(rule) = RuleReference::new(self.scheme, &self.body, start, digits) {
            return Ok(Oracle::Rule(rule));
        }
        let exact = Reference::with_digits(&self.terms()?, start, digits);
        exact.map(Oracle::Exact).map_err(|err| err.to_string())
    }

    fn tolerance(&self, _path: &PathCase) -> f64 {
        match self.precision {
            Precision::F32 => TOLERANCE_SINGLE,
            Precision::F64 => TOLERANCE,
        }
    }

    /// Beyond its limit of stability.
    fn may_refuse(&self, path: &PathCase) -> bool {
        let h = path.steps.first().map_or(0.0, |step| step.0) / self.body.tau_eps;
        self.scheme.stability_limit().is_some_and(|limit| h >= limit)
    }
}
