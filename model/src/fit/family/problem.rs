//! Records and a family as a linear problem for any given outer parameters.

use super::super::record::{constant_force, depths, measured};
use super::super::sample::{FitError, FitSample, check_samples, check_scale};
use super::super::scan::{log_tau_range, union};
use super::super::thin::Thin;
use super::super::triangle::{Factor, Triangle};
use super::FamilyOptions;
use crate::families::{Family, OuterRange, Relaxation, Response, joined};
use crate::units::{Depth, Seconds};

/// Half the step of outer parameters over which columns are differenced: the error of central
/// differences and that of rounding are both near 1e-10 there, and Gauss-Newton needs no more than a
/// direction.
const DIFFERENCE: f64 = 1e-5;

/// Share of its greatest depth by which the probe must come back in some record before what having
/// been deeper adds can be told: less than a tenth would be extrapolated over all the rest.
const RETURN_MIN: f64 = 0.1;

/// One record.
#[derive(Clone)]
pub(super) struct Record<'a> {
    pub name: &'a str,
    pub samples: &'a [FitSample],
    thin: Thin,
}

/// Which rows a pass takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rows {
    /// Blocks of samples, for searching.
    Thin,
    /// Every sample.
    All,
}

/// A family and records.
#[derive(Clone)]
pub(super) struct Problem<'a> {
    pub family: &'a dyn Family,
    pub records: Vec<Record<'a>>,
    pub options: FamilyOptions,
    sigma_scale: f64,
    /// Searched range of every outer parameter, in search coordinates.
    pub ranges: Vec<(f64, f64)>,
    kinds: Vec<OuterRange>,
    /// Coefficients of the family.
    pub coefficients: usize,
    fades: bool,
}

impl<'a> Problem<'a> {
    pub fn new(
        family: &'a dyn Family,
        records: &[(&'a str, &'a [FitSample])],
        options: FamilyOptions,
    ) -> Result<Self, FitError> {
        let outer = family.outer();
        let coefficients = family.linear().len();
        let several = records.len() > 1;
        let named = |name: &str, reason: FitError| match several {
            true => FitError::InRecord {
                record: name.to_owned(),
                reason: Box::new(reason),
            },
            false => reason,
        };
        let mut depth_mm = 0.0f64;
        for (name, samples) in records {
            check(samples).map_err(|reason| named(name, reason))?;
            depth_mm = depth_mm.max(depths(samples).1);
        }
        let sigma_scale = records
            .iter()
            .flat_map(|(_, samples)| samples.iter())
            .find(|sample| sample.is_measured())
            .map_or(1.0, |sample| sample.sigma.0);
        let times = union(records.iter().map(|(_, samples)| log_tau_range(samples)));
        let fading: Vec<f64> = vec![1.0; outer.len()];
        let problem = Self {
            fades: options.initial && family.fading(&fading).is_some(),
            family,
            options,
            sigma_scale,
            ranges: outer
                .iter()
                .map(|one| match one.range {
                    OuterRange::Time => times,
                    OuterRange::PerDepth(low, high) => {
                        ((low / depth_mm).ln(), (high / depth_mm).ln())
                    }
                    OuterRange::Ratio(low, high) => (low.ln(), high.ln()),
                    OuterRange::Share(low, high) => (low, high),
                })
                .collect(),
            kinds: outer.iter().map(|one| one.range).collect(),
            coefficients,
            records: records
                .iter()
                .map(|&(name, samples)| Record {
                    name,
                    samples,
                    thin: Thin::new(samples, depth_mm, sigma_scale),
                })
                .collect(),
        };
        if problem.measured() < problem.free() {
            return Err(FitError::TooFewSamples {
                samples: problem.measured(),
                parameters: problem.free(),
            });
        }
        problem.check_return()?;
        Ok(problem)
    }

    /// Refuses a family that softens where no record unloads.
    fn check_return(&self) -> Result<(), FitError> {
        let middle: Vec<f64> = self.ranges.iter().map(|(a, b)| 0.5 * (a + b)).collect();
        let columns = self.family.columns(&self.outer(&middle));
        let softens = |term: &Relaxation| term.elastic.softens() || term.rate.softens();
        if !columns.iter().flatten().any(softens) {
            return Ok(());
        }
        let share = self.records.iter().map(|record| returned(record.samples));
        let share = share.fold(0.0, f64::max);
        if share >= RETURN_MIN {
            return Ok(());
        }
        Err(FitError::Unsupported {
            family: self.family.name(),
            reason: format!(
                "while its force is known the probe comes back by {:.0} % of its greatest depth, and {:.0} % are needed to tell unloading from loading; record the unloading, press deeper, or come back more slowly so that the tissue keeps touching",
                100.0 * share,
                100.0 * RETURN_MIN
            ),
        })
    }

    /// The same records and ranges with another member of the family.
    pub fn with<'b>(&self, family: &'b dyn Family) -> Problem<'b>
    where
        'a: 'b,
    {
        Problem {
            family,
            ..self.clone()
        }
    }

    /// Samples whose force counts.
    pub fn measured(&self) -> usize {
        self.records
            .iter()
            .map(|record| measured(record.samples))
            .sum()
    }

    /// Outer parameters.
    pub fn outers(&self) -> usize {
        self.kinds.len()
    }

    /// Linear unknowns: coefficients, then each record's offset and initial force.
    pub fn linear(&self) -> usize {
        self.coefficients + self.records.len() * self.own()
    }

    /// All unknowns.
    pub fn free(&self) -> usize {
        self.linear() + self.outers()
    }

    /// Linear unknowns of each record alone.
    fn own(&self) -> usize {
        usize::from(self.options.offset) + usize::from(self.fades)
    }

    /// Slots of a record's offset and initial force among the linear unknowns.
    pub fn own_slots(&self, record: usize) -> (Option<usize>, Option<usize>) {
        let start = self.coefficients + record * self.own();
        let initial = start + usize::from(self.options.offset);
        (
            self.options.offset.then_some(start),
            self.fades.then_some(initial),
        )
    }

    /// Outer parameters in their units, from search coordinates.
    pub fn outer(&self, z: &[f64]) -> Vec<f64> {
        z.iter()
            .zip(&self.kinds)
            .map(|(&z, kind)| match kind {
                OuterRange::Share(..) => z,
                _ => z.exp(),
            })
            .collect()
    }

    /// Derivative of an outer parameter by its search coordinate.
    pub fn stretch(&self, index: usize, value: f64) -> f64 {
        match self.kinds[index] {
            OuterRange::Share(..) => 1.0,
            _ => value,
        }
    }

    pub fn weight(&self, sample: &FitSample) -> f64 {
        self.sigma_scale / sample.sigma.0
    }

    /// The sigma that weighs one.
    pub fn sigma_scale(&self) -> f64 {
        self.sigma_scale
    }

    /// Triangle of the linear unknowns and the force; `None` where a column is not finite.
    pub fn values(&self, z: &[f64], rows: Rows) -> Option<Factor> {
        let outer = self.outer(z);
        let columns = self.family.columns(&outer);
        let fading = self.family.fading(&outer);
        self.columns_factor(&columns, fading, rows)
    }

    /// The same for any columns, in the place of the family's.
    pub fn columns_factor(
        &self,
        columns: &[Vec<Relaxation>],
        fading: Option<f64>,
        rows: Rows,
    ) -> Option<Factor> {
        let linear = columns.len() + self.records.len() * self.own();
        let mut triangle = Triangle::new(linear + 1);
        let mut row = vec![0.0; linear + 1];
        for record in 0..self.records.len() {
            let own = columns.len() + record * self.own();
            self.walk(record, rows, &[columns], |step| {
                row.fill(0.0);
                row[..columns.len()].copy_from_slice(&step.values[0]);
                self.own_columns(&mut row[own..linear], step.elapsed, fading);
                row[linear] = step.force;
                triangle.push(&row, step.weight);
            })?;
        }
        let factor = triangle.finish();
        factor.residual_sum(linear).is_finite().then_some(factor)
    }

    fn own_columns(&self, slots: &mut [f64], elapsed: f64, fading: Option<f64>) {
        let mut slots = slots.iter_mut();
        if self.options.offset
            && let Some(slot) = slots.next()
        {
            *slot = 1.0;
        }
        if let (true, Some(slot), Some(tau)) = (self.fades, slots.next(), fading) {
            *slot = (-elapsed / tau).exp();
        }
    }

    /// Triangle of the linear unknowns, the outer ones and what `solution` leaves of the force.
    pub fn slopes(&self, z: &[f64], solution: &[f64], rows: Rows) -> Option<Factor> {
        let mut triangle = Triangle::new(self.free() + 1);
        self.slope_rows(z, solution, rows, |_, step| {
            triangle.push(step.row, step.weight);
        })?;
        Some(triangle.finish())
    }

    /// Visits the rows `[columns, outer slopes, residual]`, with the record they belong to.
    pub fn slope_rows(
        &self,
        z: &[f64],
        solution: &[f64],
        rows: Rows,
        mut visit: impl FnMut(usize, &SlopeRow<'_>),
    ) -> Option<()> {
        let outer = self.outer(z);
        let columns = self.family.columns(&outer);
        let fading = self.family.fading(&outer);
        // The body shifted both ways along every outer parameter, without the terms that a shift
        // leaves as they are: they cancel in the difference.
        let mut bodies = vec![columns];
        let mut fadings = vec![fading];
        for i in 0..z.len() {
            let [up, down] = [1.0, -1.0].map(|sign| {
                let mut shifted = z.to_vec();
                shifted[i] += sign * DIFFERENCE;
                let outer = self.outer(&shifted);
                let coefficients = solution[..self.coefficients].iter().copied();
                fadings.push(self.family.fading(&outer));
                joined(&self.family.columns(&outer), coefficients)
            });
            let only = |one: &[Relaxation], other: &[Relaxation]| {
                let kept = one.iter().filter(|term| !other.contains(term));
                vec![kept.copied().collect::<Vec<_>>()]
            };
            bodies.push(only(&up, &down));
            bodies.push(only(&down, &up));
        }
        let bodies: Vec<&[Vec<Relaxation>]> = bodies.iter().map(Vec::as_slice).collect();
        let (linear, free) = (self.linear(), self.free());
        let mut row = vec![0.0; free + 1];
        for record in 0..self.records.len() {
            let own = self.coefficients + record * self.own();
            let (_, initial) = self.own_slots(record);
            let initial = initial.map_or(0.0, |slot| solution[slot]);
            let faded = |k: usize, elapsed: f64| {
                fadings[k].map_or(0.0, |tau| initial * (-elapsed / tau).exp())
            };
            self.walk(record, rows, &bodies, |step| {
                row.fill(0.0);
                row[..self.coefficients].copy_from_slice(&step.values[0]);
                self.own_columns(&mut row[own..own + self.own()], step.elapsed, fading);
                for i in 0..z.len() {
                    let [up, down] =
                        [1, 2].map(|k| step.values[2 * i + k][0] + faded(2 * i + k, step.elapsed));
                    row[linear + i] = (up - down) / (2.0 * DIFFERENCE);
                }
                let modelled = row[..linear].iter().zip(solution);
                row[free] = step.force - modelled.map(|(a, b)| a * b).sum::<f64>();
                visit(
                    record,
                    &SlopeRow {
                        row: &row,
                        weight: step.weight,
                    },
                );
            })?;
        }
        Some(())
    }

    /// Moves several bodies along a record and visits every row whose force counts.
    fn walk(
        &self,
        record: usize,
        rows: Rows,
        bodies: &[&[Vec<Relaxation>]],
        mut visit: impl FnMut(&Step<'_>),
    ) -> Option<()> {
        let Record { samples, thin, .. } = &self.records[record];
        let start = samples[0].depth;
        let mut moving: Vec<Response> = bodies
            .iter()
            .map(|columns| Response::new(columns, start))
            .collect();
        let mut values: Vec<Vec<f64>> = bodies.iter().map(|one| vec![0.0; one.len()]).collect();
        let mut visit = |elapsed: f64, force: f64, weight: f64, values: &[Vec<f64>]| {
            visit(&Step {
                values,
                elapsed,
                force,
                weight,
            });
        };
        match rows {
            Rows::Thin => {
                let mut elapsed = 0.0;
                for block in &thin.blocks {
                    for (one, values) in moving.iter_mut().zip(&mut values) {
                        values.fill(0.0);
                        let (depth, dt) = (Depth(block.depth), Seconds(block.dt));
                        if block.dt > 0.0 {
                            one.step_mean(depth, dt, block.count, values).ok()?;
                        } else {
                            one.add_to(values);
                        }
                    }
                    elapsed += block.dt;
                    if block.weight > 0.0 {
                        // The fading force over a block: at its middle, to second order.
                        let middle = elapsed - 0.5 * block.dt * (1.0 - 1.0 / block.count as f64);
                        visit(middle, block.force, block.weight, &values);
                    }
                }
            }
            Rows::All => {
                let mut before = samples[0].t.0;
                for (index, sample) in samples.iter().enumerate() {
                    for (one, values) in moving.iter_mut().zip(&mut values) {
                        if index > 0 {
                            one.step(sample.depth, Seconds(sample.t.0 - before)).ok()?;
                        }
                        if sample.is_measured() {
                            values.fill(0.0);
                            one.add_to(values);
                        }
                    }
                    before = sample.t.0;
                    if sample.is_measured() {
                        let elapsed = sample.t.0 - samples[0].t.0;
                        visit(elapsed, sample.force.0, self.weight(sample), &values);
                    }
                }
            }
        }
        Some(())
    }
}

/// One row of a walk: the columns of every body there.
struct Step<'s> {
    values: &'s [Vec<f64>],
    /// Since the first sample, in s.
    elapsed: f64,
    force: f64,
    weight: f64,
}

/// One row with slopes.
pub(super) struct SlopeRow<'s> {
    /// Columns, outer slopes, residual.
    pub row: &'s [f64],
    pub weight: f64,
}

/// Share of the greatest depth before by which the probe comes back while its force counts, at most.
fn returned(samples: &[FitSample]) -> f64 {
    let (mut deepest, mut share) = (0.0f64, 0.0f64);
    for sample in samples {
        deepest = deepest.max(sample.depth.0);
        if sample.is_measured() && deepest > 0.0 {
            share = share.max(1.0 - sample.depth.0.max(0.0) / deepest);
        }
    }
    share
}

fn check(samples: &[FitSample]) -> Result<(), FitError> {
    let measured = measured(samples);
    if measured < 2 {
        return Err(FitError::TooFewSamples {
            samples: measured,
            parameters: 2,
        });
    }
    check_samples(samples)?;
    let (shallowest, deepest) = depths(samples);
    if shallowest == deepest {
        return Err(FitError::ConstantDepth { depth: deepest });
    }
    if let Some(force) = constant_force(samples) {
        return Err(FitError::ConstantForce { force });
    }
    if deepest <= 0.0 {
        return Err(FitError::NeverInTissue {
            deepest,
            contact: 0.0,
        });
    }
    check_scale(samples)
}
