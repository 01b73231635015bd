//! What a record says of its parameters at any values of them, and not only at those that fit it best.

use super::columns::ParameterPoint;
use super::refine::{GAIN_THIN, StopRule, refine};
use super::sample::FitError;
use super::solve::FitSolution;
use super::system::Rows;

/// The likelihood of one record over the logarithms of some parameters of its body; all other parameters follow these.
///
/// Residuals that are autocorrelated know less than independent ones: the distance from the best fit counts in shares of
/// how much wider its standard errors are for it (the curvature adjustment of a composite likelihood: Ribatet, Cooley &
/// Davison, Statistica Sinica 22 (2012) 813-845).
#[derive(Debug)]
pub struct CurveLikelihood<'f, 'a> {
    solution: &'f FitSolution<'a>,
    record: usize,
    parameters: Vec<usize>,
    best: Vec<f64>,
    /// Standard error over that of independent noise.
    widening: Vec<f64>,
}

/// The normal distribution of the parameters that has the slope and the curvature of a likelihood at one place: what a step
/// of Gauss and Newton from there makes of it (Lindstrom & Bates, Biometrics 46 (1990) 673-687).
#[derive(Clone, Debug, PartialEq)]
pub struct LikelihoodExpansion {
    /// Logarithms of the parameters at its centre.
    pub centre: Vec<f64>,
    pub covariance: Vec<Vec<f64>>,
}

impl<'f, 'a> CurveLikelihood<'f, 'a> {
    /// Of a record of a fit, over parameters by their names.
    pub fn of(
        solution: &'f FitSolution<'a>,
        record: usize,
        names: &[&str],
    ) -> Result<Self, FitError> {
        let options = &solution.system.options;
        let parameters = names.iter().map(|name| options.index_of(name));
        let parameters = parameters.collect::<Result<Vec<_>, _>>()?;
        let values = solution.system.physical_values(record, &solution.refined.points[record]);
        let estimates = solution.estimates(record);
        let (mut best, mut widening) = (Vec::new(), Vec::new());
        for (&name, &parameter) in names.iter().zip(&parameters) {
            let (value, name) = (values[parameter], name.to_owned());
            if solution.system.fixed(record, parameter).is_some() {
                return Err(FitError::NotFitted { name });
            }
            if value <= 0.0 {
                return Err(FitError::NoLogarithm { name, value });
            }
            let Some(estimate) = estimates[parameter] else {
                return Err(FitError::AtRangeEnd { name });
            };
            best.push(value.ln());
            widening.push(estimate.inflation.sqrt());
        }
        Ok(Self { solution, record, parameters, best, widening })
    }

    /// Logarithms of the parameters at the best fit.
    pub fn best(&self) -> &[f64] {
        &self.best
    }

    /// The likelihood around logarithms of the parameters; `None` where the record allows no finite force, or determines none
    /// of the parameters.
    pub fn expand(&self, logarithms: &[f64]) -> Option<LikelihoodExpansion> {
        let (system, record) = (&self.solution.system, self.record);
        let apart = self.best.iter().zip(&self.widening).zip(logarithms);
        let inside: Vec<f64> = apart.map(|((best, wide), at)| best + (at - best) / wide).collect();
        let (mut pinned, mut points) = (system.clone(), self.solution.refined.points.clone());
        for (&parameter, at) in self.parameters.iter().zip(&inside) {
            pinned = pinned.pinned(record, parameter, at.exp());
            pinned.pin(&mut points, record, parameter, at.exp());
        }
        if !pinned.unknowns.is_empty() {
            points = refine(&pinned, &points, Rows::All, StopRule::Gain(GAIN_THIN))?.points;
        }
        self.around(&points, &inside)
    }

    /// The likelihood around the best fit, where nothing has to follow; `None` as of [`Self::expand`].
    pub fn expand_at_best(&self) -> Option<LikelihoodExpansion> {
        self.around(&self.solution.refined.points, &self.best)
    }

    /// Around points at which the parameters have the logarithms `inside`.
    fn around(&self, points: &[ParameterPoint], inside: &[f64]) -> Option<LikelihoodExpansion> {
        let (system, record) = (&self.solution.system, self.record);
        let scatter = self.solution.uncertainty().scatter?;
        let pass = system.pass(points, Rows::All)?;
        let step = pass.joint.solve(system.unknowns.len());
        let combinations = self.parameters.iter().zip(inside).map(|(&parameter, at)| {
            let own = system.combination(record, parameter, &points[record]);
            own.into_iter().map(|share| share * (-at).exp()).collect()
        });
        let combinations: Vec<Vec<f64>> = combinations.collect();
        let product = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let centre = combinations.iter().zip(inside).zip(&self.best).zip(&self.widening);
        let centre = centre.map(|(((combination, at), best), wide)| {
            best + wide * (at + product(combination, &step) - best)
        });
        let covariance = combinations.iter().zip(&self.widening).map(|(one, wide)| {
            let influence = pass.joint.influence(one);
            let row = combinations.iter().zip(&self.widening);
            row.map(|(other, own)| scatter * scatter * wide * own * product(other, &influence))
                .collect()
        });
        let found =
            LikelihoodExpansion { centre: centre.collect(), covariance: covariance.collect() };
        let numbers = found.centre.iter().chain(found.covariance.iter().flatten());
        numbers.into_iter().all(|number| number.is_finite()).then_some(found)
    }
}
