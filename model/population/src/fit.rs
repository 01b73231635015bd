//! Means, effects and spreads of a population, and how well they are known.

use crate::likelihood::ShiftEstimate;
use crate::search::{Coordinate, Coordinates, Criterion, Optimum};
use crate::study::{NestedStudy, Study, StudyError};
use nalgebra::{Cholesky, DMatrix, DVector};
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};
use std::cell::RefCell;

/// A spread below this share of the scatter of the values is zero.
const ZERO: f64 = 1e-4;
/// Share of a coordinate's scale over which the covariance of the effects is differenced.
const SLOPE_STEP: f64 = 1e-5;
/// More degrees of freedom are as good as a normal distribution.
const FREEDOM_MAX: f64 = 1e9;
/// Coverage of every interval.
pub const COVERAGE: f64 = 0.95;
/// How far out an end of an interval is looked for, in widths of what the curvature says.
const ENDS_MAX: i32 = 60;

/// What a mean or an effect is known to be.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EffectEstimate {
    pub effect: String,
    pub parameter: String,
    /// In logarithms of the parameter.
    pub value: f64,
    /// With spreads of zero or more; the interval takes that without this bound, where a spread is zero.
    pub std_error: f64,
    /// Degrees of freedom by Satterthwaite (Biometrics Bulletin 2 (1946) 110-114).
    pub freedom: f64,
    /// Ends of the 95 % interval.
    pub interval: [f64; 2],
    /// Probability of a value as far from zero, or farther, if there were no effect.
    pub p_value: f64,
}

/// How far groups of a level scatter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Spread {
    pub level: String,
    pub parameter: String,
    /// Standard deviation of the logarithm.
    pub value: f64,
    /// Ends of the 95 % interval by the profile of the restricted likelihood; no upper end where none was found.
    pub interval: [Option<f64>; 2],
    /// Share of the variance of one session, without its own noise.
    pub share: f64,
    /// Whether the best value is zero: the sessions show no scatter of this level.
    pub is_zero: bool,
}

/// How far one group is from the mean of its like.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GroupShift {
    pub level: String,
    pub group: String,
    /// Most probable shift of each parameter, in logarithms, of the group with those it belongs to.
    pub shifts: Vec<f64>,
    pub std_errors: Vec<f64>,
}

/// A population.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PopulationFit {
    pub effects: Vec<EffectEstimate>,
    /// Covariance of the effects, those of the first column for all parameters first.
    #[serde(skip)]
    pub effect_covariance: DMatrix<f64>,
    pub spreads: Vec<Spread>,
    /// Factor of the covariance of each level.
    #[serde(skip)]
    pub factors: Vec<DMatrix<f64>>,
    /// Minus twice the logarithm of the restricted likelihood, but for what no spread changes.
    pub criterion: f64,
    pub groups: Vec<GroupShift>,
    /// The most probable parameters of each session, in logarithms.
    #[serde(skip)]
    pub modes: Vec<DVector<f64>>,
}

/// What is asked of a fit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PopulationOptions {
    /// Whether shifts of different parameters may be correlated.
    pub is_correlated: bool,
    /// Whether intervals of spreads are looked for, which needs most of the time.
    pub has_spread_intervals: bool,
}

/// The population of a study by restricted maximum likelihood (Patterson & Thompson, Biometrika 58 (1971) 545-554).
pub fn fit_population(
    study: &Study,
    options: PopulationOptions,
) -> Result<PopulationFit, StudyError> {
    let nested = study.nested()?;
    let coordinates = Coordinates::of(&nested, options.is_correlated);
    let fitter = Fitter {
        study,
        nested: &nested,
        criterion: Criterion { study: &nested, coordinates: &coordinates },
    };
    fitter.fit(options)
}

/// The covariance of the effects and how it changes with the spreads.
struct Judgement {
    covariance: DMatrix<f64>,
    /// By each coordinate of the spreads.
    slopes: Vec<DMatrix<f64>>,
    /// Covariance of these coordinates.
    spread_covariance: DMatrix<f64>,
}

impl Judgement {
    fn of(criterion: &Criterion<'_>, optimum: &Optimum) -> Option<Self> {
        let slope = |k: usize| {
            let shifted = |by: f64| {
                let mut other = optimum.at.clone();
                other[k] += by;
                Some(criterion.evaluate(&other)?.covariance)
            };
            Some((shifted(SLOPE_STEP)? - shifted(-SLOPE_STEP)?) / (2.0 * SLOPE_STEP))
        };
        Some(Self {
            covariance: optimum.evaluation.covariance.clone(),
            slopes: (0..optimum.at.len()).map(slope).collect::<Option<_>>()?,
            spread_covariance: inverse_of_the_known(&optimum.curvature) * 2.0,
        })
    }
}

struct Fitter<'a> {
    study: &'a Study,
    nested: &'a NestedStudy,
    criterion: Criterion<'a>,
}

impl Fitter<'_> {
    fn coordinates(&self) -> &Coordinates {
        self.criterion.coordinates
    }

    fn fit(&self, options: PopulationOptions) -> Result<PopulationFit, StudyError> {
        let start = self.coordinates().start();
        if self.criterion.evaluate(&start).is_none() {
            return Err(StudyError::Effects { effects: self.study.effects.join(", ") });
        }
        let optimum = self.criterion.minimum(&start).ok_or(StudyError::NoOptimum)?;
        let factors = self.coordinates().factors(&optimum.at);
        let effects = &optimum.evaluation.effects;
        let shifts = self.nested.shifts(&factors, effects).ok_or(StudyError::NoOptimum)?;
        let sessions = shifts.last().into_iter().flatten().enumerate();
        let modes = sessions.map(|(k, one)| &one.shift + self.nested.session_mean(k, effects));
        Ok(PopulationFit {
            effects: self.effects(&optimum).ok_or(StudyError::NoOptimum)?,
            effect_covariance: optimum.evaluation.covariance.clone(),
            spreads: self.spreads(&optimum, options.has_spread_intervals),
            criterion: optimum.evaluation.criterion,
            groups: self.groups(&shifts),
            modes: modes.collect(),
            factors: factors.into_iter().map(|factor| factor.root).collect(),
        })
    }

    fn effects(&self, optimum: &Optimum) -> Option<Vec<EffectEstimate>> {
        let judged = self.judge(optimum)?;
        let mut found = Vec::new();
        for (j, effect) in self.study.effects.iter().enumerate() {
            for (k, parameter) in self.study.parameters.iter().enumerate() {
                let index = j * self.study.parameters.len() + k;
                let value = optimum.evaluation.effects[index];
                let variance = judged.covariance[(index, index)];
                let slopes = judged.slopes.iter().map(|slope| slope[(index, index)]);
                let slopes = DVector::from_iterator(judged.slopes.len(), slopes);
                let uncertainty = (&judged.spread_covariance * &slopes).dot(&slopes);
                let freedom = (2.0 * variance * variance / uncertainty).clamp(1.0, FREEDOM_MAX);
                let student = StudentsT::new(0.0, 1.0, freedom).ok()?;
                let half = student.inverse_cdf(0.5 + 0.5 * COVERAGE) * variance.sqrt();
                found.push(EffectEstimate {
                    effect: effect.clone(),
                    parameter: parameter.clone(),
                    value,
                    std_error: optimum.evaluation.covariance[(index, index)].sqrt(),
                    freedom,
                    interval: [value - half, value + half],
                    p_value: 2.0 * student.cdf(-(value / variance.sqrt()).abs()),
                });
            }
        }
        Some(found)
    }

    /// By what intervals of means and effects are judged: where a spread is zero, by variances that may be below zero. A bound
    /// would make them too narrow or too wide by turns (Stroup & Littell, Conference on Applied Statistics in Agriculture, 2002).
    fn judge(&self, optimum: &Optimum) -> Option<Judgement> {
        let has_zero = optimum.at.iter().any(|value| value.abs() < ZERO);
        let free = has_zero.then(|| self.without_bounds(optimum)).flatten();
        free.or_else(|| Judgement::of(&self.criterion, optimum))
    }

    fn without_bounds(&self, optimum: &Optimum) -> Option<Judgement> {
        let (coordinates, start) = self.coordinates().signed(&optimum.at)?;
        let criterion = Criterion { study: self.nested, coordinates: &coordinates };
        Judgement::of(&criterion, &criterion.minimum(&start)?)
    }

    fn spreads(&self, optimum: &Optimum, has_intervals: bool) -> Vec<Spread> {
        let factors = self.coordinates().factors(&optimum.at);
        let variance = |level: usize, k: usize| factors[level].root.row(k).norm_squared();
        let mut spreads = Vec::new();
        for (level, name) in self.study.levels.iter().enumerate() {
            for (k, parameter) in self.study.parameters.iter().enumerate() {
                let value = variance(level, k).sqrt();
                let all: f64 = (0..factors.len()).map(|other| variance(other, k)).sum();
                let is_zero = value < ZERO * self.coordinates().scales[k];
                let interval = match has_intervals {
                    true => self.spread_interval(optimum, level, k),
                    false => [None, None],
                };
                spreads.push(Spread {
                    level: name.clone(),
                    parameter: parameter.clone(),
                    value: if is_zero { 0.0 } else { value },
                    interval,
                    share: if all > 0.0 { variance(level, k) / all } else { 0.0 },
                    is_zero,
                });
            }
        }
        spreads
    }

    /// Ends of an interval of a spread, where the profile of the criterion has risen by the quantile of chi squared with one
    /// degree of freedom (Venzon & Moolgavkar, Applied Statistics 37 (1988) 87-94).
    fn spread_interval(
        &self,
        optimum: &Optimum,
        level: usize,
        parameter: usize,
    ) -> [Option<f64>; 2] {
        let own = Coordinate { level, row: parameter, column: parameter };
        let Some(held) = self.coordinates().all.iter().position(|one| *one == own) else {
            return [None, None];
        };
        let limit = ChiSquared::new(1.0).map_or(f64::NAN, |one| one.inverse_cdf(COVERAGE));
        let lowest = optimum.evaluation.criterion;
        // Each place starts from the one before.
        let start = RefCell::new(optimum.at.clone());
        let rise = |value: f64| {
            let mut start = start.borrow_mut();
            start[held] = value;
            match self.criterion.profile(&start, held, &optimum.curvature) {
                Some((criterion, at)) => {
                    *start = at;
                    criterion - lowest - limit
                }
                None => f64::INFINITY,
            }
        };
        let best = optimum.at[held].abs();
        let low = if rise(0.0) <= 0.0 { Some(0.0) } else { crossing(0.0, best, rise) };
        start.borrow_mut().clone_from(&optimum.at);
        let outwards = (0..ENDS_MAX).map(|k| best.max(0.1) * 1.5f64.powi(k));
        let outside = outwards.skip(1).find(|value| rise(*value) > 0.0);
        let high = outside.and_then(|outside| crossing(outside, best, rise));
        [low, high].map(|end| end.map(|end| end * self.coordinates().scales[parameter]))
    }

    fn groups(&self, shifts: &[Vec<ShiftEstimate>]) -> Vec<GroupShift> {
        let levels = self.study.levels.iter().zip(&self.nested.names).zip(shifts);
        let groups = levels.flat_map(|((level, names), shifts)| {
            names.iter().zip(shifts).map(|(group, one)| GroupShift {
                level: level.clone(),
                group: group.clone(),
                shifts: one.shift.iter().copied().collect(),
                std_errors: one
                    .covariance
                    .diagonal()
                    .iter()
                    .map(|value| value.max(0.0).sqrt())
                    .collect(),
            })
        });
        groups.collect()
    }
}

/// Where a function changes sign between a point where it is above zero and one where it is not, to a thousandth of the
/// distance and of the value, by the secant with halving of the end that stays (the Illinois method of Dowell & Jarratt,
/// BIT 11 (1971) 168-174).
fn crossing(outside: f64, inside: f64, of: impl Fn(f64) -> f64) -> Option<f64> {
    let (mut above, mut below) = ((outside, of(outside)), (inside, of(inside)));
    let mut before = None;
    for _ in 0..60 {
        let (width, size) = (above.0 - below.0, above.0.abs().max(below.0.abs()));
        if width.abs() <= 1e-3 * size {
            return Some(0.5 * (above.0 + below.0));
        }
        let share = if above.1.is_finite() { below.1 / (below.1 - above.1) } else { 0.5 };
        // Not nearer to an end than half of the tolerance, so that both ends close in.
        let edge = 5e-4 * size / width.abs();
        let middle = below.0 + share.clamp(edge, 1.0 - edge) * width;
        let value = of(middle);
        // An end that stays twice counts half.
        let side = Some(value > 0.0);
        let share = if side == before { 0.5 } else { 1.0 };
        if value > 0.0 {
            (above, below.1) = ((middle, value), share * below.1);
        } else {
            (below, above.1) = ((middle, value), share * above.1);
        }
        before = side;
    }
    None
}

/// The inverse over the coordinates whose curvature says something: that of a spread of zero says nothing of how well the
/// spread is known, and no effect's covariance changes with it to first order.
fn inverse_of_the_known(curvature: &DMatrix<f64>) -> DMatrix<f64> {
    match Cholesky::new(curvature.clone()) {
        Some(factor) => factor.inverse(),
        None => {
            let eigen = curvature.clone().symmetric_eigen();
            let top = eigen.eigenvalues.amax();
            let inverse =
                eigen.eigenvalues.map(|value| if value > 1e-9 * top { 1.0 / value } else { 0.0 });
            &eigen.eigenvectors * DMatrix::from_diagonal(&inverse) * eigen.eigenvectors.transpose()
        }
    }
}
