//! The standard deviations that explain the sessions best.

use crate::likelihood::{DeviationFactor, Evaluation};
use crate::study::{Evidence, NestedStudy};
use argmin::core::{CostFunction, Error, Executor, Gradient};
use argmin::solver::linesearch::MoreThuenteLineSearch;
use argmin::solver::quasinewton::BFGS;
use nalgebra::{Cholesky, DMatrix, DVector};
use std::cell::RefCell;

const STEPS_MAX: u64 = 200;
/// Of a search that Newton's steps follow, or that looks for a place in an interval, for each root of a session: curvatures
/// grow with the number of sessions, so that the criterion is then within a millionth of the lowest.
const GRADIENT: f64 = 1e-3;
/// A step that lets the criterion fall by less than this is the last of such a search: near the rounding of a criterion of many
/// sessions a line search would try a hundred places to no end. Intervals end where it has risen by 3.84.
const FALL: f64 = 1e-6;
/// Steps of Newton after the search. One that is expected to let the criterion fall by less than this share of it, near its
/// rounding, is the last and is taken whole: what it leaves is its square.
const NEWTON_STEPS_MAX: usize = 12;
const FALL_MIN: f64 = 1e-12;
/// Share of a coordinate's scale over which gradients are differenced: the cube root of the rounding error.
const DIFFERENCE: f64 = 1e-5;
/// A search starts no coordinate nearer to zero: the criterion has no slope there, so that it would never leave.
const START_MIN: f64 = 0.1;
/// A median absolute deviation of a normal distribution, in standard deviations.
const MEDIAN_DEVIATION: f64 = 0.6745;

/// The numbers that are searched: of each level and, within it, each parameter a standard deviation over the scale of the
/// parameter.
#[derive(Clone, Debug)]
pub(crate) struct Coordinates {
    /// Scale of each parameter: how far its values scatter.
    pub scales: Vec<f64>,
    levels: usize,
    /// Whether a coordinate is a variance, which may be below zero, instead of a standard deviation.
    is_signed: bool,
}

/// The smallest size of a signed variance, over the square of its scale: the factor has no slope at zero.
const VARIANCE_MIN: f64 = 1e-12;

impl Coordinates {
    pub fn of(study: &NestedStudy) -> Self {
        let scales = (0..study.parameters).map(|k| scale(study, k)).collect();
        Self { scales, levels: study.parents.len() + 1, is_signed: false }
    }

    /// Place of the coordinate of a level and a parameter.
    pub fn place(&self, level: usize, parameter: usize) -> usize {
        level * self.scales.len() + parameter
    }

    pub fn start(&self) -> Vec<f64> {
        let even = (self.levels as f64).sqrt().recip();
        vec![even; self.levels * self.scales.len()]
    }

    /// The same with variances that may be below zero, and where a place is then.
    pub fn signed(&self, at: &[f64]) -> (Self, Vec<f64>) {
        let squares = at.iter().map(|value| value * value).collect();
        (Self { is_signed: true, ..self.clone() }, squares)
    }

    pub fn factors(&self, at: &[f64]) -> Vec<DeviationFactor> {
        let level = |at: &[f64]| {
            let sizes = at.iter().zip(&self.scales).map(|(value, scale)| self.size(*value) * scale);
            let sign = |value: &f64| if self.is_signed && *value < 0.0 { -1.0 } else { 1.0 };
            DeviationFactor {
                root: DMatrix::from_diagonal(&DVector::from_iterator(at.len(), sizes)),
                signs: DVector::from_iterator(at.len(), at.iter().map(sign)),
            }
        };
        at.chunks(self.scales.len()).map(level).collect()
    }

    /// Of the root of a covariance, over its scale.
    fn size(&self, value: f64) -> f64 {
        if self.is_signed { value.abs().max(VARIANCE_MIN).sqrt() } else { value }
    }

    fn gradient(&self, at: &[f64], by_factor: &[DMatrix<f64>]) -> Vec<f64> {
        let slopes =
            by_factor.iter().flat_map(|one| one.diagonal().iter().copied().collect::<Vec<_>>());
        let scaled = slopes.zip(self.scales.iter().cycle()).zip(at);
        scaled
            .map(|((slope, scale), value)| match self.is_signed {
                true => slope * scale * value.signum() / (2.0 * self.size(*value)),
                false => slope * scale,
            })
            .collect()
    }
}

/// How far the values of a parameter scatter, by their median absolute deviation: one far off, of a session that hardly
/// identifies the parameter, does not move it.
fn scale(study: &NestedStudy, parameter: usize) -> f64 {
    let is_known = |evidence: &Evidence| match evidence {
        Evidence::Exact => true,
        Evidence::Information(information) => information[(parameter, parameter)] > 0.0,
    };
    let known = study.sessions.iter().filter(|one| is_known(&one.evidence));
    let values: Vec<f64> = known.map(|one| one.values[parameter]).collect();
    let middle = median(values.clone());
    let deviation = median(values.into_iter().map(|value| (value - middle).abs()).collect());
    if deviation > 0.0 { deviation / MEDIAN_DEVIATION } else { 1.0 }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or_default()
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
    /// Second derivatives of the criterion, which no direction lets fall.
    pub curvature: DMatrix<f64>,
}

impl Criterion<'_> {
    pub fn evaluate(&self, at: &[f64]) -> Option<Evaluation> {
        let evaluation = self.study.evaluate(&self.coordinates.factors(at))?;
        evaluation.criterion.is_finite().then_some(evaluation)
    }

    fn gradient(&self, at: &[f64]) -> Option<Vec<f64>> {
        Some(self.with_gradient(at)?.1)
    }

    fn with_gradient(&self, at: &[f64]) -> Option<(f64, Vec<f64>)> {
        let factors = self.coordinates.factors(at);
        let (evaluation, gradient) = self.study.evaluate_with_gradient(&factors)?;
        Some((evaluation.criterion, self.coordinates.gradient(at, &gradient)))
    }

    /// The lowest point; `None` where the search ends elsewhere.
    pub fn minimum(&self, start: &[f64]) -> Option<Optimum> {
        let all: Vec<usize> = (0..start.len()).collect();
        // A first step of the size of a coordinate, whatever the number of sessions.
        let first = DVector::from_vec(self.gradient(start)?);
        let size = 0.3 / first.norm().max(1.0);
        let inverse = DMatrix::identity(all.len(), all.len()) * size;
        let (_, at) = self.search(start, &all, &inverse)?;
        self.newton(at)
    }

    /// The lowest criterion with one coordinate kept where it is at the start, and the place.
    pub fn profile(
        &self,
        start: &[f64],
        kept: usize,
        curvature: &DMatrix<f64>,
    ) -> Option<(f64, Vec<f64>)> {
        let free: Vec<usize> = (0..start.len()).filter(|&k| k != kept).collect();
        if free.is_empty() {
            return Some((self.evaluate(start)?.criterion, start.to_vec()));
        }
        let own = curvature.clone().remove_row(kept).remove_column(kept);
        // Where the curvature is not that of a minimum, as at zero, its size serves.
        let size = own.amax().max(1.0);
        let inverse = Cholesky::new(own).map_or_else(
            || DMatrix::identity(free.len(), free.len()) / size,
            |factor| factor.inverse(),
        );
        let mut lifted = start.to_vec();
        free.iter().for_each(|&k| lifted[k] = lifted[k].abs().max(START_MIN));
        self.search(&lifted, &free, &inverse)
    }

    fn search(
        &self,
        start: &[f64],
        free: &[usize],
        inverse_curvature: &DMatrix<f64>,
    ) -> Option<(f64, Vec<f64>)> {
        let best = RefCell::new((f64::INFINITY, start.to_vec()));
        let search = Search { criterion: self, free, start, best, slope: RefCell::default() };
        let rows = inverse_curvature.row_iter().map(|row| row.iter().copied().collect());
        let solver = BFGS::new(MoreThuenteLineSearch::new());
        let tolerance = GRADIENT * (self.study.sessions.len() as f64).sqrt();
        let solver = solver.with_tolerance_grad(tolerance).ok()?;
        let solver = solver.with_tolerance_cost(FALL).ok()?;
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
            let step = Cholesky::new(curvature.clone())?.solve(&gradient);
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
    /// The last place and the gradient there: the line search wants both at every place.
    slope: RefCell<Option<(Vec<f64>, Vec<f64>)>>,
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
        let (criterion, slope) = self.criterion.with_gradient(&at).unzip();
        let criterion = criterion.filter(|one| one.is_finite()).unwrap_or(f64::INFINITY);
        *self.slope.borrow_mut() = slope.map(|slope| (at.clone(), slope));
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
        let at = self.whole(inside);
        let known = self.slope.borrow().clone().filter(|(place, _)| *place == at);
        let gradient = known.map(|(_, slope)| slope).or_else(|| self.criterion.gradient(&at));
        let gradient = gradient.ok_or_else(|| Error::msg("no likelihood here"))?;
        Ok(self.free.iter().map(|&k| gradient[k]).collect())
    }
}
