//! Means, effects and standard deviations of a population, and how well they are known.

use crate::likelihood::{DeviationFactor, ShiftEstimate};
use crate::profile::Profile;
use crate::search::{Coordinates, Criterion, Optimum};
use crate::study::{NestedStudy, Study, StudyError};
use nalgebra::{Cholesky, DMatrix, DVector};
use palpate_model::estimate::student_t975;
use serde::Serialize;
use statrs::distribution::{ChiSquared, Continuous, ContinuousCDF, StudentsT};

/// A standard deviation below this share of the scatter of the values is zero.
const ZERO: f64 = 1e-4;
/// Share of a coordinate's scale over which the covariance of the effects is differenced: the cube root of the rounding error.
const SLOPE_STEP: f64 = 1e-5;
/// More degrees of freedom are as good as a normal distribution.
const FREEDOM_MAX: f64 = 1e9;
/// Coverage probability of every interval.
pub const COVERAGE: f64 = 0.95;

/// What a mean or an effect is known to be.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct EffectEstimate {
    pub effect: String,
    pub parameter: String,
    /// In logarithms of the parameter.
    pub value: f64,
    /// With variances of zero or more; where one is zero the interval is that without this bound.
    pub std_error: f64,
    /// Degrees of freedom by Satterthwaite (Biometrics Bulletin 2 (1946) 110-114).
    pub freedom: f64,
    /// Ends of the 95 % interval.
    pub interval: [f64; 2],
    /// Probability of a value as far from zero, or farther, if there were no effect.
    pub p_value: f64,
}

/// The standard deviation between the groups of a level.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LevelDeviation {
    pub level: String,
    pub parameter: String,
    /// Of the logarithm.
    pub value: f64,
    /// Ends of the 95 % interval by the profile of the restricted likelihood; no upper end where none was found.
    pub interval: [Option<f64>; 2],
    /// Share of the variance of one session, without its own noise.
    pub share: f64,
    /// Whether the best value is zero: the sessions show no differences between groups of this level.
    pub is_zero: bool,
}

/// How far one group is from the group that it belongs to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct GroupShift {
    pub level: String,
    pub group: String,
    /// Most probable shift of each parameter, in logarithms.
    pub shifts: Vec<f64>,
    pub std_errors: Vec<f64>,
}

/// A population.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PopulationFit {
    /// Of each effect all parameters.
    pub effects: Vec<EffectEstimate>,
    /// Of each contrast all parameters.
    pub contrasts: Vec<EffectEstimate>,
    /// Of each level all parameters.
    pub standard_deviations: Vec<LevelDeviation>,
    /// Of each level all groups, of the last all sessions.
    pub groups: Vec<GroupShift>,
    /// Whether the intervals of the effects keep the bound on variances although one of them is zero, since without it no
    /// optimum was found.
    pub is_bounded: bool,
}

/// A sum of effects, such as the difference between two treatments.
#[derive(Clone, Debug, PartialEq)]
pub struct Contrast {
    pub name: String,
    /// By which each of [`Study::effects`] is multiplied.
    pub weights: Vec<f64>,
}

/// Options of a fit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PopulationOptions {
    /// Whether intervals of standard deviations are found, which takes most of the time.
    pub has_deviation_intervals: bool,
    pub contrasts: Vec<Contrast>,
}

/// The population of a study by restricted maximum likelihood (Patterson & Thompson, Biometrika 58 (1971) 545-554).
pub fn fit_population(
    study: &Study,
    options: &PopulationOptions,
) -> Result<PopulationFit, StudyError> {
    let nested = study.nested()?;
    for one in &options.contrasts {
        let (found, expected) = (one.weights.len(), study.effects.len());
        if found != expected {
            let session = one.name.clone();
            return Err(StudyError::Count { session, what: "weights", found, expected });
        }
    }
    let coordinates = Coordinates::of(&nested);
    let optimum = optimum(&nested, &coordinates)?;
    let criterion = Criterion { study: &nested, coordinates: &coordinates };
    Fitter { study, nested: &nested, criterion, optimum }.fit(options)
}

/// The most probable parameters of each session in their population, in logarithms.
pub(crate) fn most_probable(study: &Study) -> Result<Vec<DVector<f64>>, StudyError> {
    let nested = study.nested()?;
    let coordinates = Coordinates::of(&nested);
    let Optimum { at, evaluation, .. } = optimum(&nested, &coordinates)?;
    let shifts = nested.shifts(&coordinates.factors(&at), &evaluation.effects);
    let sessions = shifts.and_then(|mut shifts| shifts.pop()).ok_or(StudyError::NoOptimum)?;
    let mean = |session| nested.session_mean(session, &evaluation.effects);
    Ok(sessions.into_iter().enumerate().map(|(k, one)| one.whole + mean(k)).collect())
}

fn optimum(nested: &NestedStudy, coordinates: &Coordinates) -> Result<Optimum, StudyError> {
    let criterion = Criterion { study: nested, coordinates };
    criterion.minimum(&coordinates.start()).ok_or(StudyError::NoOptimum)
}

/// The covariance of the effects and how it changes with the standard deviations.
struct Judgement {
    covariance: DMatrix<f64>,
    /// By each coordinate of the standard deviations.
    slopes: Vec<DMatrix<f64>>,
    /// Covariance of these coordinates.
    coordinate_covariance: DMatrix<f64>,
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
            coordinate_covariance: Cholesky::new(optimum.curvature.clone())?.inverse() * 2.0,
        })
    }
}

struct Fitter<'a> {
    study: &'a Study,
    nested: &'a NestedStudy,
    criterion: Criterion<'a>,
    optimum: Optimum,
}

impl Fitter<'_> {
    fn coordinates(&self) -> &Coordinates {
        self.criterion.coordinates
    }

    fn factors(&self) -> Vec<DeviationFactor> {
        self.coordinates().factors(&self.optimum.at)
    }

    fn fit(&self, options: &PopulationOptions) -> Result<PopulationFit, StudyError> {
        let shifts = self.nested.shifts(&self.factors(), &self.optimum.evaluation.effects);
        let unbounded = self.has_zero().then(|| self.without_bounds()).flatten();
        let is_bounded = self.has_zero() && unbounded.is_none();
        let judged = unbounded.or_else(|| Judgement::of(&self.criterion, &self.optimum));
        let judged = judged.ok_or(StudyError::NoOptimum)?;
        Ok(PopulationFit {
            effects: self.effects(&judged).ok_or(StudyError::NoOptimum)?,
            contrasts: self.contrasts(&judged, &options.contrasts).ok_or(StudyError::NoOptimum)?,
            standard_deviations: self.deviations(options.has_deviation_intervals),
            groups: self.groups(&shifts.ok_or(StudyError::NoOptimum)?),
            is_bounded,
        })
    }

    fn effects(&self, judged: &Judgement) -> Option<Vec<EffectEstimate>> {
        let effects = self.study.effects.iter().enumerate();
        let own = effects.map(|(place, effect)| Contrast {
            name: effect.clone(),
            weights: (0..self.study.effects.len())
                .map(|k| f64::from(u8::from(k == place)))
                .collect(),
        });
        self.contrasts(judged, &own.collect::<Vec<_>>())
    }

    fn contrasts(&self, judged: &Judgement, all: &[Contrast]) -> Option<Vec<EffectEstimate>> {
        let parameters = self.study.parameters.len();
        let each = all.iter().flat_map(|one| (0..parameters).map(move |k| (one, k)));
        each.map(|(contrast, parameter)| self.contrast(judged, contrast, parameter)).collect()
    }

    fn contrast(
        &self,
        judged: &Judgement,
        contrast: &Contrast,
        parameter: usize,
    ) -> Option<EffectEstimate> {
        let evaluation = &self.optimum.evaluation;
        let count = self.study.parameters.len();
        let mut weights = DVector::zeros(evaluation.effects.len());
        for (place, weight) in contrast.weights.iter().enumerate() {
            weights[place * count + parameter] = *weight;
        }
        let form = |matrix: &DMatrix<f64>| (matrix * &weights).dot(&weights);
        let value = evaluation.effects.dot(&weights);
        let variance = form(&judged.covariance);
        let slopes = DVector::from_iterator(judged.slopes.len(), judged.slopes.iter().map(form));
        let uncertainty = (&judged.coordinate_covariance * &slopes).dot(&slopes);
        let freedom = (2.0 * variance * variance / uncertainty).clamp(1.0, FREEDOM_MAX);
        let student = student(freedom)?;
        let half = quantile(&student) * variance.sqrt();
        Some(EffectEstimate {
            effect: contrast.name.clone(),
            parameter: self.study.parameters[parameter].clone(),
            value,
            std_error: form(&evaluation.covariance).sqrt(),
            freedom,
            interval: [value - half, value + half],
            p_value: 2.0 * student.cdf(-(value / variance.sqrt()).abs()),
        })
    }

    fn has_zero(&self) -> bool {
        self.optimum.at.iter().any(|value| value.abs() < ZERO)
    }

    /// By what intervals of means and effects are judged where a variance is zero: by variances that may be below zero. The
    /// bound would make them too narrow or too wide by turns (Stroup & Littell, Conference on Applied Statistics in Agriculture,
    /// 2002).
    fn without_bounds(&self) -> Option<Judgement> {
        let (coordinates, start) = self.coordinates().signed(&self.optimum.at);
        let criterion = Criterion { study: self.nested, coordinates: &coordinates };
        Judgement::of(&criterion, &criterion.minimum(&start)?)
    }

    fn deviations(&self, has_intervals: bool) -> Vec<LevelDeviation> {
        let parameters = self.study.parameters.iter().enumerate();
        let size = |level: usize, k: usize| self.optimum.at[self.coordinates().place(level, k)];
        let variance = |level: usize, k: usize| size(level, k).powi(2);
        let levels = self.study.levels.iter().enumerate();
        let each = levels.flat_map(|(level, name)| {
            parameters.clone().map(move |(k, parameter)| {
                let all: f64 = (0..self.study.levels.len()).map(|other| variance(other, k)).sum();
                let is_zero = size(level, k).abs() < ZERO;
                let value = size(level, k).abs() * self.coordinates().scales[k];
                LevelDeviation {
                    level: name.clone(),
                    parameter: parameter.clone(),
                    value: if is_zero { 0.0 } else { value },
                    interval: if has_intervals { self.interval(level, k) } else { [None, None] },
                    share: if all > 0.0 { variance(level, k) / all } else { 0.0 },
                    is_zero,
                }
            })
        });
        each.collect()
    }

    /// Ends of an interval of a standard deviation, where the profile of the criterion has risen by the quantile of chi squared
    /// with one degree of freedom (Venzon & Moolgavkar, Applied Statistics 37 (1988) 87-94).
    fn interval(&self, level: usize, parameter: usize) -> [Option<f64>; 2] {
        let kept = self.coordinates().place(level, parameter);
        let limit = ChiSquared::new(1.0).map_or(f64::NAN, |one| one.inverse_cdf(COVERAGE));
        let ends = Profile::of(&self.criterion, &self.optimum, kept, limit).ends();
        ends.map(|end| end.map(|end| end * self.coordinates().scales[parameter]))
    }

    fn groups(&self, shifts: &[Vec<ShiftEstimate>]) -> Vec<GroupShift> {
        let sessions: Vec<String> =
            self.study.sessions.iter().map(|one| one.name.clone()).collect();
        let names = self.nested.names.iter().chain(std::iter::once(&sessions));
        let levels = self.study.levels.iter().zip(names).zip(shifts);
        let groups = levels.flat_map(|((level, names), shifts)| {
            names.iter().zip(shifts).map(|(group, one)| {
                let variances = one.own_covariance.diagonal();
                GroupShift {
                    level: level.clone(),
                    group: group.clone(),
                    shifts: one.own.iter().copied().collect(),
                    std_errors: variances.iter().map(|value| value.max(0.0).sqrt()).collect(),
                }
            })
        });
        groups.collect()
    }
}

pub(crate) fn student(freedom: f64) -> Option<StudentsT> {
    StudentsT::new(0.0, 1.0, freedom).ok()
}

/// Student's t at 97.5 %. The approximation is good to a millionth from 30 degrees of freedom on; below, Newton's steps follow:
/// the library's own search does not end for some degrees of freedom, and its distribution is rough for many.
pub(crate) fn quantile(student: &StudentsT) -> f64 {
    let freedom = student.freedom();
    // Each step squares an error of a hundredth at most.
    let steps = if freedom < 30.0 { 4 } else { 0 };
    (0..steps).fold(student_t975(freedom), |at, _| {
        at - (student.cdf(at) - (0.5 + 0.5 * COVERAGE)) / student.pdf(at)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By R's `qt`.
    #[test]
    fn quantiles_are_those_of_a_table_and_fall_with_the_degrees_of_freedom() {
        let at = |freedom: f64| quantile(&StudentsT::new(0.0, 1.0, freedom).unwrap());
        for (freedom, expected) in [
            (1.0, 12.706_204_736),
            (2.5, 3.574_654_842),
            (3.0, 3.182_446_305),
            (12.0, 2.178_812_830),
        ] {
            assert!((at(freedom) - expected).abs() < 1e-8, "{freedom} {}", at(freedom));
        }
        assert!((at(FREEDOM_MAX) - 1.959_963_985).abs() < 1e-6);
        let all: Vec<f64> = (0..3000).map(|k| at(1.007f64.powi(k).min(FREEDOM_MAX))).collect();
        assert!(all.windows(2).all(|pair| pair[1] <= pair[0]));
    }
}
