//! One or several records with one choice of free and shared parameters, as a linear problem for
//! any given relaxation times and contact positions (variable projection: Golub & Pereyra, SIAM J.
//! Numer. Anal. 10 (1973) 413-432).
//!
//! Every record is triangularised by itself with all its columns; the joint problem stacks those
//! small triangles with its columns mapped to the joint unknowns. So one record is the joint fit
//! of one, and fixing or sharing a parameter never touches the samples again.

use super::block_sums::{NoiseBlock, NoiseSums};
use super::design::{
    Coefficients, LANES, Lane, Rows, Scale, legendre_from_powers, powers_from_legendre, walk,
};
use super::options::{CONTACT, FitOptions, LINEAR, LINEAR_COUNT, TAU};
use super::record::{Record, constant_force, depths, force_square, measured};
use super::sample::{FitError, FitSample, check_samples, check_scale};
use super::thin::{Thin, unit};
use super::triangle::{Factor, Triangle};
use crate::vectors::wide;

/// Column of the slope by `log tau` in a record's own triangle; that by contact follows.
const TAU_SLOPE: usize = LINEAR_COUNT;
/// Columns of a record's own triangle at most: six linear, two slopes, the force.
pub(super) const WIDTH_MAX: usize = LINEAR_COUNT + 3;

/// The two parameters in which the model is not linear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Outer {
    /// `tau_eps` in s. Steps are taken in its logarithm, but that is never stored: rounding
    /// `ln 80` costs another parameter up to the tenth digit.
    pub tau: f64,
    /// Contact position over the depth scale.
    pub contact: f64,
}

/// All parameters of one record, scaled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    pub outer: Outer,
    pub at: Coefficients,
}

/// One number the fit finds: a parameter of one record, or of all.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Unknown {
    pub parameter: usize,
    pub record: Option<usize>,
}

/// Records, scales, and what is free.
#[derive(Clone, Debug)]
pub(super) struct System<'a> {
    pub records: Vec<Record<'a>>,
    /// Depth in mm that counts as one, in every record.
    pub depth_mm: f64,
    sigma_scale: f64,
    /// Values in physical units.
    fixed: [Option<f64>; 8],
    shared: [bool; 8],
    /// Linear unknowns, then outer ones.
    pub unknowns: Vec<Unknown>,
    pub linear: usize,
}

/// One record, triangularised at a point.
#[derive(Clone, Debug)]
pub(super) struct RecordFactor {
    pub factor: Factor,
    pub blocks: Vec<NoiseBlock>,
}

/// All records, triangularised at a point and stacked.
#[derive(Clone, Debug)]
pub(super) struct Pass {
    pub joint: Factor,
    pub records: Vec<RecordFactor>,
}

impl<'a> System<'a> {
    pub fn new(
        records: &[(&'a str, &'a [FitSample])],
        options: &FitOptions,
        shared: [bool; 8],
    ) -> Result<Self, FitError> {
        let fixed = *options.fixed();
        let several = records.len() > 1;
        let named = |name: &str, reason: FitError| {
            if several {
                FitError::InRecord {
                    record: name.to_owned(),
                    reason: Box::new(reason),
                }
            } else {
                reason
            }
        };
        let own = options.free_count() - if several { count(&shared, &fixed) } else { 0 };
        let mut depth_mm = 0.0f64;
        for (name, samples) in records {
            let measured = measured(samples);
            if measured < own.max(2) {
                let reason = FitError::TooFewSamples {
                    samples: measured,
                    parameters: own,
                };
                return Err(named(name, reason));
            }
            check_samples(samples).map_err(|reason| named(name, reason))?;
            let (shallowest, deepest) = depths(samples);
            if shallowest == deepest {
                let depth = deepest;
                return Err(named(name, FitError::ConstantDepth { depth }));
            }
            if let Some(force) = constant_force(samples) {
                return Err(named(name, FitError::ConstantForce { force }));
            }
            let contact = fixed[CONTACT].unwrap_or(shallowest);
            if deepest <= contact {
                return Err(named(name, FitError::NeverInTissue { deepest, contact }));
            }
            check_scale(samples).map_err(|reason| named(name, reason))?;
            depth_mm = depth_mm.max(deepest - contact);
        }
        let sigma_scale = records
            .iter()
            .flat_map(|(_, samples)| samples.iter())
            .find(|sample| sample.is_measured())
            .map_or(1.0, |sample| sample.sigma.0);
        let records: Vec<Record<'a>> = records
            .iter()
            .map(|&(name, samples)| Record {
                name,
                samples,
                thin: Thin::new(samples, depth_mm, sigma_scale),
                measured: measured(samples),
                depths: depths(samples),
                force_square: force_square(samples, sigma_scale),
            })
            .collect();
        let unknowns = unknowns(&fixed, &shared, records.len());
        let linear = unknowns
            .iter()
            .take_while(|unknown| is_linear(unknown.parameter))
            .count();
        let system = Self {
            records,
            depth_mm,
            sigma_scale,
            fixed,
            shared,
            unknowns,
            linear,
        };
        let measured = system.measured();
        if measured < system.unknowns.len() {
            return Err(FitError::TooFewSamples {
                samples: measured,
                parameters: system.unknowns.len(),
            });
        }
        Ok(system)
    }

    /// One of the records alone, with all its parameters its own.
    pub fn alone(&self, record: usize) -> Self {
        let unknowns = unknowns(&self.fixed, &[false; 8], 1);
        let linear = unknowns
            .iter()
            .take_while(|unknown| is_linear(unknown.parameter))
            .count();
        Self {
            records: vec![self.records[record].clone()],
            unknowns,
            linear,
            ..self.clone_without_records()
        }
    }

    fn clone_without_records(&self) -> Self {
        Self {
            records: Vec::new(),
            unknowns: Vec::new(),
            ..*self
        }
    }

    /// Samples whose force counts, in all records.
    pub fn measured(&self) -> usize {
        self.records.iter().map(|record| record.measured).sum()
    }

    /// Value a parameter is kept at, in its unit.
    pub fn fixed(&self, parameter: usize) -> Option<f64> {
        self.fixed[parameter]
    }

    /// Whether a free parameter is the same in every record.
    pub fn is_shared(&self, parameter: usize) -> bool {
        self.shared[parameter]
    }

    /// Scaled contact position kept, if it is.
    pub fn fixed_contact(&self) -> Option<f64> {
        self.fixed[CONTACT].map(|mm| mm / self.depth_mm)
    }

    /// Weight of a sample relative to the first.
    pub fn weight(&self, sample: &FitSample) -> f64 {
        self.sigma_scale / sample.sigma.0
    }

    pub fn scale(&self, outer: Outer) -> Scale {
        Scale {
            depth_mm: self.depth_mm,
            contact: outer.contact,
        }
    }

    /// The column of a linear unknown in a record, as coefficients of that record's columns; zero
    /// in other records.
    pub fn column(&self, record: usize, unknown: Unknown) -> Coefficients {
        if unknown.record.is_some_and(|own| own != record) {
            return [0.0; LINEAR_COUNT];
        }
        let k = unknown.parameter - LINEAR;
        let is_free_alike = |k: usize| {
            self.fixed[LINEAR + k].is_none()
                && self.shared[LINEAR + k] == self.shared[unknown.parameter]
        };
        // A Legendre term stands for its power where the lower powers are free to make up for it.
        if k < 3 && !(0..k).all(is_free_alike) {
            legendre_from_powers(&unit(k))
        } else {
            unit(k)
        }
    }

    /// Fixed values as coefficients.
    fn fixed_coefficients(&self) -> Coefficients {
        let units = linear_units(self.depth_mm);
        let scaled = std::array::from_fn(|k| self.fixed[LINEAR + k].unwrap_or(0.0) * units[k]);
        legendre_from_powers(&scaled)
    }

    /// A record's coefficients, from the linear unknowns.
    pub fn coefficients(&self, record: usize, solution: &[f64]) -> Coefficients {
        self.changed(record, &self.fixed_coefficients(), solution)
    }

    /// A record's coefficients after a change of the linear unknowns.
    pub fn changed(&self, record: usize, at: &Coefficients, change: &[f64]) -> Coefficients {
        let mut all = *at;
        for (value, unknown) in change.iter().zip(&self.unknowns[..self.linear]) {
            for (slot, share) in all.iter_mut().zip(self.column(record, *unknown)) {
                *slot += value * share;
            }
        }
        all
    }

    /// All parameters of a record in their units.
    pub fn physical(&self, point: &Point) -> [f64; 8] {
        let units = linear_units(self.depth_mm);
        let [p1, p2, p3] = powers_from_legendre(&point.at);
        let scaled = [p1, p2, p3, point.at[3], point.at[4], point.at[5]];
        std::array::from_fn(|index| match index {
            _ if self.fixed[index].is_some() => self.fixed[index].unwrap_or(f64::NAN),
            TAU => point.outer.tau,
            CONTACT => point.outer.contact * self.depth_mm,
            _ => scaled[index - LINEAR] / units[index - LINEAR],
        })
    }

    /// A free parameter of a record, in its unit, as a combination of small changes of the
    /// unknowns.
    pub fn combination(&self, record: usize, parameter: usize, point: &Point) -> Vec<f64> {
        let units = linear_units(self.depth_mm);
        let mut combination = vec![0.0; self.unknowns.len()];
        for (slot, unknown) in combination.iter_mut().zip(&self.unknowns) {
            if unknown.record.is_some_and(|own| own != record) {
                continue;
            }
            *slot = match parameter {
                TAU if unknown.parameter == TAU => point.outer.tau,
                CONTACT if unknown.parameter == CONTACT => self.depth_mm,
                TAU | CONTACT => 0.0,
                _ if is_linear(unknown.parameter) => {
                    let column = self.column(record, *unknown);
                    let k = parameter - LINEAR;
                    let [p1, p2, p3] = powers_from_legendre(&column);
                    let scaled = [p1, p2, p3, column[3], column[4], column[5]];
                    scaled[k] / units[k]
                }
                _ => 0.0,
            };
        }
        combination
    }

    /// All records triangularised at their points, with derivative columns. The last column is what
    /// the point leaves of the force, so that solutions are changes of the point: solving for a
    /// small change wins back the digits that the rounding of the triangle costs (iterative
    /// refinement; Bjorck, "Numerical Methods for Least Squares Problems", section 2.9).
    pub fn pass(&self, points: &[Point]) -> Pass {
        let records: Vec<RecordFactor> = self
            .records
            .iter()
            .zip(points)
            .map(|(record, point)| self.record_factor(record.samples, point))
            .collect();
        let joint = self.stack(
            records.iter().map(|record| &record.factor),
            Column::Residual,
        );
        Pass { joint, records }
    }

    /// All records triangularised at given outer parameters, without derivatives.
    pub fn values_pass(&self, outers: &[Outer]) -> Factor {
        let factors: Vec<Factor> = self
            .records
            .iter()
            .zip(outers)
            .map(|(record, outer)| self.values_factor(record.samples, *outer))
            .collect();
        self.stack(factors.iter(), Column::Force)
    }

    /// The thinned records at given outer parameters.
    pub fn thin_pass(&self, outers: &[Outer]) -> Factor {
        let factors: Vec<Factor> = self
            .records
            .iter()
            .zip(outers)
            .map(|(record, outer)| record.thin.factor(self.depth_mm, outer.tau, outer.contact))
            .collect();
        self.stack(factors.iter(), Column::Force)
    }

    /// Stacks the triangles of the records with their columns mapped to the unknowns.
    fn stack<'f>(&self, factors: impl Iterator<Item = &'f Factor>, last_is: Column) -> Factor {
        let with_slopes = last_is == Column::Residual;
        let unknowns = if with_slopes {
            self.unknowns.len()
        } else {
            self.linear
        };
        let mut joint = Triangle::new(unknowns + 1);
        let mut mapped = vec![0.0; unknowns + 1];
        for (record, factor) in factors.enumerate() {
            let columns = self.map(record, with_slopes);
            let fixed = match last_is {
                Column::Residual => [0.0; LINEAR_COUNT],
                Column::Force => self.fixed_coefficients(),
            };
            let last = factor.width() - 1;
            for i in 0..factor.width() {
                let row = factor.row(i);
                for (slot, column) in mapped.iter_mut().zip(&columns) {
                    *slot = column.of(row);
                }
                mapped[unknowns] = row[last] - product(&fixed, row);
                joint.push(&mapped, 1.0);
            }
        }
        joint.finish()
    }

    /// Where each unknown finds its column in a record's triangle.
    pub fn map(&self, record: usize, with_slopes: bool) -> Vec<Mapped> {
        let unknowns = if with_slopes {
            self.unknowns.len()
        } else {
            self.linear
        };
        self.unknowns[..unknowns]
            .iter()
            .map(|unknown| match unknown.parameter {
                _ if unknown.record.is_some_and(|own| own != record) => Mapped::Nowhere,
                TAU => Mapped::Slope(TAU_SLOPE),
                CONTACT => Mapped::Slope(self.slopes() + LINEAR_COUNT - 1),
                _ => Mapped::Linear(self.column(record, *unknown)),
            })
            .collect()
    }

    /// Weighted sum of squared forces.
    pub fn force_square(&self) -> f64 {
        self.records.iter().map(|record| record.force_square).sum()
    }

    /// How many outer parameters a record has.
    fn slopes(&self) -> usize {
        usize::from(self.fixed[TAU].is_none()) + usize::from(self.fixed[CONTACT].is_none())
    }

    fn record_factor(&self, samples: &[FitSample], point: &Point) -> RecordFactor {
        let width = LINEAR_COUNT + self.slopes() + 1;
        let mut triangle = Triangle::new(width);
        let mut sums = NoiseSums::new(samples.len());
        let (mut lanes, tau) = ([[0.0; LANES]; WIDTH_MAX], point.outer.tau);
        walk::<true>(samples, self.scale(point.outer), tau, |block, rows| {
            wide(
                #[inline(always)]
                || {
                    let columns = &mut lanes[..width];
                    rows.values(columns);
                    let mut next = LINEAR_COUNT;
                    if self.fixed[TAU].is_none() {
                        columns[next] = rows.tau_slope(&point.at, tau);
                        next += 1;
                    }
                    if self.fixed[CONTACT].is_none() {
                        columns[next] = rows.contact_slope(&point.at);
                    }
                    self.forces(block, columns);
                    subtract(columns, &point.at);
                    self.weigh(block, columns);
                    sums.add(columns, block);
                    triangle.push_lanes(columns, block.len());
                },
            );
        });
        RecordFactor {
            factor: triangle.finish(),
            blocks: sums.finish(),
        }
    }

    fn values_factor(&self, samples: &[FitSample], outer: Outer) -> Factor {
        let mut triangle = Triangle::new(LINEAR_COUNT + 1);
        let mut lanes = [[0.0; LANES]; LINEAR_COUNT + 1];
        walk::<false>(
            samples,
            self.scale(outer),
            outer.tau,
            |block, rows: &Rows| {
                wide(
                    #[inline(always)]
                    || {
                        rows.values(&mut lanes);
                        self.forces(block, &mut lanes);
                        self.weigh(block, &mut lanes);
                        triangle.push_lanes(&mut lanes, block.len());
                    },
                );
            },
        );
        triangle.finish()
    }

    /// Writes the force as the last column.
    #[inline(always)]
    fn forces(&self, block: &[FitSample], columns: &mut [Lane]) {
        let Some(last) = columns.last_mut() else {
            return;
        };
        for (force, sample) in last.iter_mut().zip(block) {
            *force = if sample.is_measured() {
                sample.force.0
            } else {
                0.0
            };
        }
    }

    /// Weighs all columns; censored samples weigh nothing.
    #[inline(always)]
    fn weigh(&self, block: &[FitSample], columns: &mut [Lane]) {
        let mut weights = [0.0; LANES];
        for (weight, sample) in weights.iter_mut().zip(block) {
            if sample.is_measured() {
                *weight = self.weight(sample);
            }
        }
        for column in columns {
            for (value, weight) in column.iter_mut().zip(&weights) {
                *value *= weight;
            }
        }
    }
}

/// Subtracts what the coefficients explain from the last column.
#[inline(always)]
fn subtract(columns: &mut [Lane], at: &Coefficients) {
    let Some((force, [c1, c2, c3, c4, c5, c6, ..])) = columns.split_last_mut() else {
        return;
    };
    for i in 0..LANES {
        let elastic = at[0] * c1[i] + at[1] * c2[i] + at[2] * c3[i];
        force[i] -= elastic + at[3] * c4[i] + (at[4] * c5[i] + at[5] * c6[i]);
    }
}

/// What the last column of a record's triangle holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Column {
    /// The measured force; there are no derivative columns.
    Force,
    /// What a point leaves of it.
    Residual,
}

/// Where an unknown finds its column in a record's triangle.
pub(super) enum Mapped {
    /// As a combination of the six linear columns.
    Linear(Coefficients),
    /// As one of the derivative columns.
    Slope(usize),
    /// It does not touch this record.
    Nowhere,
}

impl Mapped {
    /// The unknown's entry of a row.
    pub fn of(&self, row: &[f64]) -> f64 {
        match self {
            Self::Linear(column) => product(column, row),
            Self::Slope(index) => row[*index],
            Self::Nowhere => 0.0,
        }
    }
}

/// What to divide scaled coefficients of powers by for N/mm, N/mm^2, N/mm^3, N*s/mm^2, N, N.
pub(super) fn linear_units(depth_mm: f64) -> Coefficients {
    let x = depth_mm;
    [x, x * x, x * x * x, x * x, 1.0, 1.0]
}

/// Inner product of coefficients with the first columns of a row.
#[inline]
pub(super) fn product(coefficients: &Coefficients, row: &[f64]) -> f64 {
    let mut sum = 0.0;
    for (a, b) in coefficients.iter().zip(row) {
        sum += a * b;
    }
    sum
}

fn is_linear(parameter: usize) -> bool {
    (LINEAR..LINEAR + LINEAR_COUNT).contains(&parameter)
}

fn count(shared: &[bool; 8], fixed: &[Option<f64>; 8]) -> usize {
    (0..8).filter(|&k| shared[k] && fixed[k].is_none()).count()
}

fn unknowns(fixed: &[Option<f64>; 8], shared: &[bool; 8], records: usize) -> Vec<Unknown> {
    let is_alone = records == 1;
    let of = |parameter: usize| {
        let own = if shared[parameter] || is_alone {
            0
        } else {
            records
        };
        let once = (own == 0).then_some(Unknown {
            parameter,
            record: None,
        });
        let each = (0..own).map(move |record| Unknown {
            parameter,
            record: Some(record),
        });
        once.into_iter().chain(each)
    };
    (LINEAR..LINEAR + LINEAR_COUNT)
        .chain([TAU, CONTACT])
        .filter(|&parameter| fixed[parameter].is_none())
        .flat_map(of)
        .collect()
}
