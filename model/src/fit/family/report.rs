//! From the search's end to a fitted model and what is known of it.

use super::super::noise::{self, Blocks};
use super::super::record::measured;
use super::super::sample::{FitError, FitSample, Named};
use super::super::triangle::{Factor, Triangle};
use super::FamilyOptions;
use super::descent::{GAIN_EXACT, Place, descend, place};
use super::problem::{Problem, Rows};
use super::search::search;
use crate::families::{Family, Model};

/// Blocks of residuals from which their memory is judged, at most about.
const BLOCKS: usize = 400;
/// A search coordinate this close to an end of its range lies there.
const EDGE: f64 = 1e-3;
/// A scaled design worse than this does not separate its parameters; as for the modified Kelvin body.
const CONDITION_MAX: f64 = 1e6;

/// One parameter found.
#[derive(Clone, Debug, PartialEq)]
pub struct FamilyParameter {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Value in that unit.
    pub value: f64,
    /// Standard error, with allowance for the memory of the residuals; `None` for a derived number
    /// and for one stopped at an end of its range.
    pub std_error: Option<f64>,
    /// Standard uncertainty that calibration and compliance add, the same in every repeat; `None` where it is
    /// not known or not asked for.
    pub systematic_error: Option<f64>,
}

/// What belongs to one record.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordFit {
    /// Its name.
    pub name: String,
    /// Sensor offset in N, 0 where not fitted.
    pub offset: f64,
    /// Force in N at the start that fades, 0 where not fitted.
    pub initial: f64,
    /// Samples whose force counts.
    pub samples: usize,
    /// Root mean square of its residuals in N.
    pub rms: f64,
    /// Largest residual in N.
    pub worst: f64,
}

/// A family fitted to records.
#[derive(Clone, Debug, PartialEq)]
pub struct FamilyFit {
    /// The model.
    pub model: Model,
    /// Outer parameters, coefficients, derived numbers.
    pub parameters: Vec<FamilyParameter>,
    /// Each record's own part.
    pub records: Vec<RecordFit>,
    /// Samples whose force counts.
    pub samples: usize,
    /// Numbers the fit found.
    pub free: usize,
    /// Sum of squared residuals, each over its sigma.
    pub sum: f64,
    /// Root mean square residual in N.
    pub rms: f64,
    /// Independent samples that would say as much, from the memory of the residuals.
    pub effective_samples: f64,
    /// What to know of it, in sentences.
    pub warnings: Vec<String>,
}

/// Fits a family to one or several records with one body for all; each record has its own offset and
/// initial force.
///
/// ```
/// use palpate_model::families::{Family, PowerSeries};
/// use palpate_model::fit::{FamilyOptions, FitSample, fit_family};
/// # use palpate_model::viscoelastic::{KelvinState, ModifiedKelvin};
/// # use palpate_model::{Depth, Newtons, Seconds};
/// # let mut state = KelvinState::at_rest();
/// # let samples: Vec<FitSample> = (0..900)
/// #     .map(|i| {
/// #         let t = f64::from(i) * 0.1;
/// #         let depth = Depth((0.75 * t).min(30.0));
/// #         let dt = Seconds(if i == 0 { 0.0 } else { 0.1 });
/// #         let force = state.step(&ModifiedKelvin::THESIS, depth, dt);
/// #         FitSample { t: Seconds(t), depth, force, sigma: Newtons(0.02) }
/// #     })
/// #     .collect();
/// // `samples`: the thesis body on a ramp of 0.75 mm/s to 30 mm and a hold.
/// let family = PowerSeries::of_order(3).expect("one to five");
/// let fit = fit_family(&family, &[("run", &samples)], FamilyOptions::default())?;
/// assert!((fit.model.outer[0] - 1.023).abs() < 1e-6);
/// # Ok::<(), palpate_model::fit::FitError>(())
/// ```
pub fn fit_family(
    family: &dyn Family,
    records: &[(&str, &[FitSample])],
    options: FamilyOptions,
) -> Result<FamilyFit, FitError> {
    if records.is_empty() {
        return Err(FitError::TooFewSamples {
            samples: 0,
            parameters: family.linear().len() + family.outer().len(),
        });
    }
    let problem = Problem::new(family, records, options)?;
    let start = search(&problem).ok_or(FitError::Overflow)?;
    // What the thinned records refuse, all samples would at many times the cost.
    model(&problem, &start)?;
    let start = place(&problem, &start.z, Rows::All).ok_or(FitError::Overflow)?;
    let end = descend(&problem, start, Rows::All, GAIN_EXACT);
    let model = model(&problem, &end)?;
    let (residuals, factor) =
        Residuals::of(&problem, &end.z, &end.solution).ok_or(FitError::Overflow)?;
    let measured = problem.measured();
    let spare = measured - problem.free();
    let white = end.sum / spare.max(1) as f64;
    let effective = residuals.effective_samples(white);
    let scatter = (spare > 0).then(|| (white * measured as f64 / effective).sqrt());
    let mut warnings = Vec::new();
    if !end.is_converged {
        warnings.push("the search ended before it settled; take the numbers as rough".to_owned());
    }
    let (condition, _) = factor.condition(problem.free());
    if condition > CONDITION_MAX {
        warnings.push(
            "these records hardly separate its parameters; record a second speed or depth, or a longer hold"
                .to_owned(),
        );
    }
    let edges: Vec<bool> = end
        .z
        .iter()
        .zip(&problem.ranges)
        .map(|(z, (low, high))| *z < low + EDGE || *z > high - EDGE)
        .collect();
    let parameters = parameters(&problem, &model, &factor, scatter, &edges)?;
    for (parameter, _) in parameters.iter().zip(&edges).filter(|(_, edge)| **edge) {
        warnings.push(format!(
            "{} was stopped at an end of its range ({:.3e} {})",
            parameter.name, parameter.value, parameter.unit
        ));
    }
    Ok(FamilyFit {
        model,
        parameters,
        records: residuals.records,
        samples: measured,
        free: problem.free(),
        sum: end.sum / problem.sigma_scale().powi(2),
        rms: (residuals.square / measured as f64).sqrt(),
        effective_samples: effective,
        warnings,
    })
}

/// The body of [`fit_family`] from the thinned records alone, a small share of a standard error from
/// it and many times cheaper: for fits whose predictions are looked at and whose numbers are not.
pub fn fit_body(
    family: &dyn Family,
    records: &[(&str, &[FitSample])],
    options: FamilyOptions,
) -> Result<Model, FitError> {
    if records.is_empty() {
        return Err(FitError::TooFewSamples {
            samples: 0,
            parameters: family.linear().len() + family.outer().len(),
        });
    }
    let problem = Problem::new(family, records, options)?;
    let end = search(&problem).ok_or(FitError::Overflow)?;
    model(&problem, &end)
}

/// Fits records that differ little from each other, one call after the other: only the first is searched for.
/// Gives the values of all parameters, in the order of [`FamilyFit::parameters`].
pub(in super::super) fn refit_family(
    family: &dyn Family,
    options: FamilyOptions,
) -> impl FnMut(&[Named<'_>]) -> Result<Vec<f64>, FitError> {
    let mut known: Option<Vec<f64>> = None;
    move |records| {
        let problem = Problem::new(family, records, options)?;
        let z = match &known {
            Some(z) => z.clone(),
            None => search(&problem).ok_or(FitError::Overflow)?.z,
        };
        let start = place(&problem, &z, Rows::All).ok_or(FitError::Overflow)?;
        let end = descend(&problem, start, Rows::All, GAIN_EXACT);
        let model = model(&problem, &end)?;
        known.get_or_insert(end.z);
        let all = model.parameters().map_err(|_| FitError::Overflow)?;
        Ok(all.into_iter().map(|one| one.value).collect())
    }
}

/// The model at a place, if the family allows its numbers.
fn model(problem: &Problem<'_>, end: &Place) -> Result<Model, FitError> {
    let family = problem.family;
    let linear = &end.solution[..problem.coefficients];
    let names = family.linear();
    // The search keeps within the bounds, so what the records do not hold ends on one.
    if let Some(k) = (0..linear.len()).find(|&k| family.is_non_negative(k) && linear[k] <= 0.0) {
        return Err(FitError::Unsupported {
            family: family.name(),
            reason: format!(
                "{} would have to be zero or negative; these records hold fewer terms",
                names[k].0
            ),
        });
    }
    family
        .model(&problem.outer(&end.z), linear)
        .map_err(|err| FitError::Unsupported {
            family: family.name(),
            reason: err.to_string(),
        })
}

fn parameters(
    problem: &Problem<'_>,
    model: &Model,
    factor: &Factor,
    scatter: Option<f64>,
    edges: &[bool],
) -> Result<Vec<FamilyParameter>, FitError> {
    let (linear, free) = (problem.linear(), problem.free());
    let error = |slot: usize, stretch: f64| {
        let mut combination = vec![0.0; free];
        combination[slot] = stretch;
        let error = scatter? * factor.deviation(&combination);
        error.is_finite().then_some(error)
    };
    let all = model.parameters().map_err(|_| FitError::Overflow)?;
    let outers = problem.outers();
    Ok(all
        .into_iter()
        .enumerate()
        .map(|(index, parameter)| FamilyParameter {
            std_error: if index < outers {
                (!edges[index])
                    .then(|| error(linear + index, problem.stretch(index, parameter.value)))
                    .flatten()
            } else if index < outers + problem.coefficients {
                error(index - outers, 1.0)
            } else {
                None
            },
            name: parameter.name,
            unit: parameter.unit,
            value: parameter.value,
            systematic_error: None,
        })
        .collect())
}

/// Residuals of every record, in newtons and in blocks.
struct Residuals {
    records: Vec<RecordFit>,
    blocks: Vec<Blocks>,
    /// Sum of squares in N^2.
    square: f64,
}

impl Residuals {
    /// Them and the triangle of the same pass.
    fn of(problem: &Problem<'_>, z: &[f64], solution: &[f64]) -> Option<(Self, Factor)> {
        let free = problem.free();
        let mut triangle = Triangle::new(free + 1);
        let mut records: Vec<RecordFit> = problem
            .records
            .iter()
            .enumerate()
            .map(|(index, record)| {
                let (offset, initial) = problem.own_slots(index);
                RecordFit {
                    name: record.name.to_owned(),
                    offset: offset.map_or(0.0, |slot| solution[slot]),
                    initial: initial.map_or(0.0, |slot| solution[slot]),
                    samples: measured(record.samples),
                    rms: 0.0,
                    worst: 0.0,
                }
            })
            .collect();
        // Columns whose freedom the memory is judged net of: all of them for one record. Several records
        // share the body, so what of it one of them would have otherwise is misfit and stays in sight.
        let columns: Vec<Vec<usize>> = (0..records.len())
            .map(|record| match problem.own_slots(record) {
                _ if records.len() == 1 => (0..free).collect(),
                (offset, initial) => offset.into_iter().chain(initial).collect(),
            })
            .collect();
        let mut blocks: Vec<Blocks> = records
            .iter()
            .zip(&columns)
            .map(|(record, columns)| Blocks {
                length: record.samples.div_ceil(BLOCKS) as f64,
                columns: vec![Vec::new(); columns.len()],
                ..Blocks::default()
            })
            .collect();
        let mut sums = vec![0.0; free + 1];
        let (mut taken, mut present) = (0usize, 0usize);
        problem.slope_rows(z, solution, Rows::All, |record, step| {
            if record != present {
                (taken, present) = (0, record);
                sums.fill(0.0);
            }
            triangle.push(step.row, step.weight);
            let residual = step.row[free];
            records[record].rms += residual * residual;
            records[record].worst = records[record].worst.max(residual.abs());
            for (sum, value) in sums.iter_mut().zip(step.row) {
                *sum += value * step.weight;
            }
            taken += 1;
            let one = &mut blocks[record];
            if taken as f64 >= one.length {
                let over_root = 1.0 / one.length.sqrt();
                one.residuals.push(sums[free] * over_root);
                one.places.push(one.places.len());
                for (column, &slot) in one.columns.iter_mut().zip(&columns[record]) {
                    column.push(sums[slot] * over_root);
                }
                sums.fill(0.0);
                taken = 0;
            }
        })?;
        let square = records.iter().map(|record| record.rms).sum();
        for record in &mut records {
            record.rms = (record.rms / record.samples as f64).sqrt();
        }
        let residuals = Self {
            records,
            blocks,
            square,
        };
        Some((residuals, triangle.finish()))
    }

    /// Independent samples that say as much, all records together.
    fn effective_samples(&self, white: f64) -> f64 {
        let each = self
            .records
            .iter()
            .zip(&self.blocks)
            .map(|(record, blocks)| {
                let samples = record.samples as f64;
                match noise::memory(blocks, white) {
                    Some(memory) if memory.long_run() > 0.0 => {
                        (samples * white / memory.long_run()).clamp(1.0, samples)
                    }
                    _ => samples,
                }
            });
        each.sum::<f64>().max(1.0)
    }
}
