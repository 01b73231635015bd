//! The spreads that explain the sessions best.

use crate::likelihood::{Evaluation, SpreadFactor};
use crate::study::NestedStudy;
use argmin::core::{CostFunction, Error, Executor, Gradient};
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::quasinewton::BFGS;
use nalgebra::{Cholesky, DMatrix, DVector};
use std::cell::RefCell;

const STEPS_MAX: u64 = 200;
/// Of a search that Newton's steps follow, or that looks for a place in an interval, for each root of a session: curvatures
/// grow with the number of sessions, so that the criterion is then within a millionth of the lowest.
const GRADIENT: f64 = 1e-4;
/// Steps of Newton after the search. One that is expected to let the criterion fall by less than this share of it, near its
/// rounding, is the last and is taken whole: what it leaves is its square.
const NEWTON_STEPS_MAX: usize = 12;
const FALL_MIN: f64 = 1e-12;
/// Share of a coordinate's scale over which gradients are differenced: the cube root of the rounding error.
const DIFFERENCE: f64 = 1e-5;

/// One number of a spread: an entry of the factor of a level's covariance, over a scale of its parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Coordinate {
    pub level: usize,
    pub row: usize,
    pub column: usize,
}

/// The numbers that are searched.
#[derive(Clone, Debug)]
pub(crate) struct Coordinates {
    pub all: Vec<Coordinate>,
    /// Scale of each parameter: how far its values scatter.
    pub scales: Vec<f64>,
    levels: usize,
    /// Whether a coordinate is a variance, which may be below zero, instead of an entry of a factor.
    is_signed: bool,
}

/// The smallest size of a signed variance, over the square of its scale: the factor has no slope at zero.
const VARIANCE_MIN: f64 = 1e-12;

impl Coordinates {
    /// Spreads of each parameter by itself, or with all correlations.
    pub fn of(study: &NestedStudy, is_correlated: bool) -> Self {
        let levels = study.parents.len() + 1;
        let parameters = study.parameters;
        let all = (0..levels).flat_map(|level| {
            (0..parameters).flat_map(move |row| {
                let first = if is_correlated { 0 } else { row };
                (first..=row).map(move |column| Coordinate { level, row, column })
            })
        });
        let scales = (0..parameters).map(|k| {
            let values = study.sessions.iter().map(|one| one.values[k]);
            let mean = values.clone().sum::<f64>() / study.sessions.len() as f64;
            let square = values.map(|value| (value - mean).powi(2)).sum::<f64>();
            let scale = (square / study.sessions.len() as f64).sqrt();
            if scale > 0.0 { scale } else { 1.0 }
        });
        Self { all: all.collect(), scales: scales.collect(), levels, is_signed: false }
    }

    pub fn start(&self) -> Vec<f64> {
        let even = (self.levels as f64).sqrt().recip();
        self.all.iter().map(|one| if one.row == one.column { even } else { 0.0 }).collect()
    }

    /// The same with variances that may be below zero, and where a place is then; `None` where spreads are correlated.
    pub fn signed(&self, at: &[f64]) -> Option<(Self, Vec<f64>)> {
        let is_alone = self.all.iter().all(|one| one.row == one.column);
        let squares = at.iter().map(|value| value * value).collect();
        is_alone.then(|| (Self { is_signed: true, ..self.clone() }, squares))
    }

    pub fn factors(&self, at: &[f64]) -> Vec<SpreadFactor> {
        let parameters = self.scales.len();
        let none = SpreadFactor::of(DMatrix::zeros(parameters, parameters));
        let mut factors = vec![none; self.levels];
        for (one, value) in self.all.iter().zip(at) {
            let factor = &mut factors[one.level];
            let size = if self.is_signed { root_of(*value) } else { *value };
            factor.root[(one.row, one.column)] = size * self.scales[one.row];
            if self.is_signed && *value < 0.0 {
                factor.signs[one.row] = -1.0;
            }
        }
        factors
    }

    fn gradient(&self, at: &[f64], by_factor: &[DMatrix<f64>]) -> Vec<f64> {
        let slope = |(one, value): (&Coordinate, &f64)| {
            let slope = by_factor[one.level][(one.row, one.column)] * self.scales[one.row];
            match self.is_signed {
                true => slope * value.signum() / (2.0 * root_of(*value)),
                false => slope,
            }
        };
        self.all.iter().zip(at).map(slope).collect()
    }
}

fn root_of(variance: f64) -> f64 {
    variance.abs().max(VARIANCE_MIN).sqrt()
}

/// The criterion over the coordinates.
pub(crate) struct Criterion<'a> {
    pub study: &'a NestedStudy,
    pub coordinates: &'a Coordinates,
}

/// The lowest point of a criterion.
#[derive(Clone, Debug)]
pub(crate) struct Optimum {
    pub at: Vec<f64>,
    pub evaluation: Evaluation,
    /// Second derivatives of the criterion.
    pub curvature: DMatrix<f64>,
}

impl Criterion<'_> {
    pub fn evaluate(&self, at: &[f64]) -> Option<Evaluation> {
        let evaluation = self.study.evaluate(&self.coordinates.factors(at))?;
        evaluation.criterion.is_finite().then_some(evaluation)
    }

    fn gradient(&self, at: &[f64]) -> Option<Vec<f64>> {
        let (_, gradient) = self.study.evaluate_with_gradient(&self.coordinates.factors(at))?;
        Some(self.coordinates.gradient(at, &gradient))
    }

    /// The lowest point.
    pub fn minimum(&self, start: &[f64]) -> Option<Optimum> {
        let all: Vec<usize> = (0..start.len()).collect();
        // A first step of the size of a coordinate, whatever the number of sessions.
        let first = DVector::from_vec(self.gradient(start)?);
        let size = 0.3 / first.norm().max(1.0);
        let inverse = DMatrix::identity(all.len(), all.len()) * size;
        let (_, at) = self.search(start, &all, &inverse)?;
        self.newton(at)
    }

    /// The lowest criterion with one coordinate held where it is at the start, and the place.
    pub fn profile(
        &self,
        start: &[f64],
        held: usize,
        curvature: &DMatrix<f64>,
    ) -> Option<(f64, Vec<f64>)> {
        let free: Vec<usize> = (0..start.len()).filter(|&k| k != held).collect();
        if free.is_empty() {
            return Some((self.evaluate(start)?.criterion, start.to_vec()));
        }
        let own = curvature.clone().remove_row(held).remove_column(held);
        // Where the curvature is not that of a minimum, as at a spread of zero, its size serves.
        let size = own.amax().max(1.0);
        let inverse = Cholesky::new(own).map_or_else(
            || DMatrix::identity(free.len(), free.len()) / size,
            |factor| factor.inverse(),
        );
        self.search(start, &free, &inverse)
    }

    fn search(
        &self,
        start: &[f64],
        free: &[usize],
        inverse_curvature: &DMatrix<f64>,
    ) -> Option<(f64, Vec<f64>)> {
        let best = RefCell::new((f64::INFINITY, start.to_vec()));
        let search = Search { criterion: self, free, start, best };
        let rows = inverse_curvature.row_iter().map(|row| row.iter().copied().collect());
        let solver = BFGS::new(MoreThuenteLineSearch::new());
        let tolerance = GRADIENT * (self.study.sessions.len() as f64).sqrt();
        let solver = solver.with_tolerance_grad(tolerance).ok()?;
        let inside: Vec<f64> = free.iter().map(|&k| start[k]).collect();
        let executor = Executor::new(&search, solver).configure(|state| {
            state.param(inside).inv_hessian(rows.collect::<Vec<Vec<f64>>>()).max_iters(STEPS_MAX)
        });
        // The line search ends with an error where rounding hides any further fall; the lowest point stands all the same.
        let _ = executor.run();
        let (lowest, at) = search.best.into_inner();
        lowest.is_finite().then_some((lowest, at))
    }

    /// Steps of Newton to where the criterion falls no further.
    fn newton(&self, mut at: Vec<f64>) -> Option<Optimum> {
        let mut evaluation = self.evaluate(&at)?;
        for _ in 0..NEWTON_STEPS_MAX {
            let curvature = self.curvature(&at)?;
            let gradient = DVector::from_vec(self.gradient(&at)?);
            let Some(factor) = Cholesky::new(curvature.clone()) else {
                return Some(Optimum { at, evaluation, curvature });
            };
            let step = factor.solve(&gradient);
            let fall = 0.5 * step.dot(&gradient);
            let moved = |share: f64| -> Vec<f64> {
                at.iter().zip(&step).map(|(at, by)| at - share * by).collect()
            };
            if fall <= FALL_MIN * (1.0 + evaluation.criterion.abs()) {
                let at = moved(1.0);
                let evaluation = self.evaluate(&at)?;
                return Some(Optimum { at, evaluation, curvature });
            }
            let mut share = 1.0;
            loop {
                let next = moved(share);
                match self.evaluate(&next) {
                    Some(better) if better.criterion < evaluation.criterion => {
                        (at, evaluation) = (next, better);
                        break;
                    }
                    // Rounding: no shorter step is lower.
                    _ if share < 1e-3 => return Some(Optimum { at, evaluation, curvature }),
                    _ => share *= 0.5,
                }
            }
        }
        None
    }

    /// Second derivatives, by differences of the exact gradient.
    fn curvature(&self, at: &[f64]) -> Option<DMatrix<f64>> {
        let slopes = (0..at.len()).map(|k| {
            let shifted = |by: f64| {
                let mut other = at.to_vec();
                other[k] += by;
                Some(DVector::from_vec(self.gradient(&other)?))
            };
            Some((shifted(DIFFERENCE)? - shifted(-DIFFERENCE)?) / (2.0 * DIFFERENCE))
        });
        let slopes = slopes.collect::<Option<Vec<_>>>()?;
        let curvature = DMatrix::from_columns(&slopes);
        Some((&curvature + curvature.transpose()) * 0.5)
    }
}

struct Search<'a, 'b> {
    criterion: &'a Criterion<'b>,
    free: &'a [usize],
    start: &'a [f64],
    best: RefCell<(f64, Vec<f64>)>,
}

impl Search<'_, '_> {
    fn whole(&self, inside: &[f64]) -> Vec<f64> {
        let mut at = self.start.to_vec();
        self.free.iter().zip(inside).for_each(|(&k, value)| at[k] = *value);
        at
    }
}

impl CostFunction for &Search<'_, '_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, inside: &Self::Param) -> Result<f64, Error> {
        let at = self.whole(inside);
        let criterion = self.criterion.evaluate(&at).map_or(f64::INFINITY, |one| one.criterion);
        let mut best = self.best.borrow_mut();
        if criterion < best.0 {
            *best = (criterion, at);
        }
        Ok(criterion)
    }
}

impl Gradient for &Search<'_, '_> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, inside: &Self::Param) -> Result<Vec<f64>, Error> {
        let gradient = self.criterion.gradient(&self.whole(inside));
        let gradient = gradient.ok_or_else(|| Error::msg("no likelihood here"))?;
        Ok(self.free.iter().map(|&k| gradient[k]).collect())
    }
}
