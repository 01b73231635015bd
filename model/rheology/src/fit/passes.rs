//! Passes over the samples: every record as a triangle of its columns, and all of them stacked.

use super::block_sums::{NoiseBlock, NoiseSums};
use super::columns::{OuterPoint, ParameterPoint, Slope};
use super::design::{LANES, Lane};
use super::nonnegative::non_negative;
use super::record::Record;
use super::sample::FitSample;
use super::system::{Rows, System};
use super::triangle::{Factor, Triangle};
use crate::vectors::run_wide;

/// One record, triangularised at a point.
#[derive(Clone, Debug)]
pub(super) struct RecordFactor {
    pub factor: Factor,
    pub blocks: Vec<NoiseBlock>,
}

impl RecordFactor {
    /// Subtracts what these errors, whose columns stand before the residual, explain of it.
    fn subtract_errors(&mut self, errors: &[f64]) {
        let subtract = |row: &mut [f64]| {
            let Some((residual, columns)) = row.split_last_mut() else { return };
            let from = columns.len() - errors.len();
            *residual -= product(errors, &columns[from..]);
        };
        self.factor.rows_mut().for_each(subtract);
        self.blocks.iter_mut().for_each(|block| subtract(&mut block.sums));
    }
}

/// All records, triangularised at a point and stacked.
#[derive(Clone, Debug)]
pub(super) struct Pass {
    pub joint: Factor,
    pub records: Vec<RecordFactor>,
    /// The joint triangle with the errors of the calibration in front, where these are found too.
    pub with_errors: Option<Factor>,
}

/// Content of the last column of a record's triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Column {
    /// The measured force; there are no derivative columns.
    Force,
    /// The measured force minus that of the point.
    Residual,
}

/// Where an unknown finds its column in a record's triangle.
pub(super) enum UnknownPlace {
    /// As a combination of the linear columns.
    Linear(Vec<f64>),
    /// As one of the derivative columns.
    Slope(usize),
    /// It does not touch this record.
    Nowhere,
}

impl UnknownPlace {
    /// The unknown's entry of a row.
    pub fn of(&self, row: &[f64]) -> f64 {
        match self {
            Self::Linear(column) => product(column, row),
            Self::Slope(index) => row[*index],
            Self::Nowhere => 0.0,
        }
    }
}

impl System<'_> {
    /// The parameters by which the force of a record is derived, in the order of its slopes.
    pub fn slopes(&self, record: usize) -> Vec<Slope> {
        let layout = self.layout();
        let outers = (0..layout.outers).map(|k| (k, Slope::Outer(k)));
        outers
            .chain([(layout.contact(), Slope::Contact)])
            .filter(|(k, _)| self.fixed(record, *k).is_none())
            .map(|(_, slope)| slope)
            .collect()
    }

    /// All records triangularised at their points, with derivative columns. The last column is what
    /// the point leaves of the force, so that solutions are changes of the point: solving for a
    /// small change wins back the digits that the rounding of the triangle costs (iterative
    /// refinement; Bjorck, "Numerical Methods for Least Squares Problems", section 2.9).
    pub fn pass(&self, points: &[ParameterPoint], rows: Rows) -> Option<Pass> {
        let each = points.iter().enumerate();
        let records: Option<Vec<RecordFactor>> = each
            .map(|(record, point)| self.record_factor(record, point, rows, Column::Residual))
            .collect();
        let mut records = records?;
        let factors = records.iter().map(|record| &record.factor);
        let mut joint = self.stack(factors, Column::Residual);
        self.push_contacts(points, &mut joint);
        let errors = self.errors.count;
        if errors == 0 {
            return Some(Pass { joint: joint.finish(), records, with_errors: None });
        }
        let mut row = vec![0.0; errors + self.unknowns.len() + 1];
        for k in 0..errors {
            row.fill(0.0);
            row[k] = 1.0;
            row[errors + self.unknowns.len()] = -self.errors.found[k];
            joint.push(&row, self.sigma_scale);
        }
        let whole = joint.finish();
        let found = whole.solve(errors + self.unknowns.len());
        records.iter_mut().for_each(|record| record.subtract_errors(&found[..errors]));
        Some(Pass { joint: whole.without_first(errors), records, with_errors: Some(whole) })
    }

    /// All records triangularised at given outer parameters, without derivatives.
    pub fn values_pass(&self, outers: &[OuterPoint], rows: Rows) -> Option<Factor> {
        let each = outers.iter().enumerate();
        let factors: Option<Vec<Factor>> = each
            .map(|(record, outer)| {
                let at = vec![0.0; self.layout().linear_count()];
                let point = ParameterPoint { outer: outer.clone(), at };
                let factor = self.record_factor(record, &point, rows, Column::Force)?.factor;
                (rows == Rows::Thin || factor.is_finite()).then_some(factor)
            })
            .collect();
        Some(self.stack(factors?.iter(), Column::Force).finish())
    }

    /// The best coefficients at given outer parameters and the weighted sum of squares left; `None` where these are no
    /// finite numbers.
    pub fn solved(&self, outers: &[OuterPoint], rows: Rows) -> Option<(Vec<ParameterPoint>, f64)> {
        let (solution, sum) = self.bounded(&self.values_pass(outers, rows)?);
        let is_finite = sum.is_finite() && solution.iter().all(|value| value.is_finite());
        is_finite.then(|| (self.points(outers, &solution), sum))
    }

    /// The weighted sum of squares left at given outer parameters, infinite where the family has no finite force; parameters
    /// that are not separable there do not matter to it.
    pub fn sum(&self, outers: &[OuterPoint], rows: Rows) -> f64 {
        let factor = self.values_pass(outers, rows);
        factor.map_or(f64::INFINITY, |factor| self.bounded(&factor).1)
    }

    /// The best linear unknowns within their bounds, and the sum of squares left.
    fn bounded(&self, factor: &Factor) -> (Vec<f64>, f64) {
        let solution = factor.solve(self.linear);
        let bounds = self.bounds();
        let is_over = |(value, bound): (&f64, &bool)| *value < 0.0 && *bound;
        // Few places need it, and those that do are no better than the bounds allow.
        if solution.iter().zip(&bounds).any(is_over) {
            let solution = non_negative(factor, &bounds);
            let sum = factor.residual_sum_of(&solution);
            return (solution, sum);
        }
        (solution, factor.residual_sum(self.linear))
    }

    /// Points at given outer parameters with these linear unknowns.
    pub fn points(&self, outers: &[OuterPoint], solution: &[f64]) -> Vec<ParameterPoint> {
        let each = outers.iter().enumerate();
        each.map(|(record, outer)| ParameterPoint {
            outer: outer.clone(),
            at: self.coefficients(record, solution),
        })
        .collect()
    }

    /// Stacks the triangles of the records with their columns mapped to the unknowns.
    fn stack<'f>(&self, factors: impl Iterator<Item = &'f Factor>, last_is: Column) -> Triangle {
        let unknowns = match last_is {
            Column::Residual => self.unknowns.len(),
            Column::Force => self.linear,
        };
        let errors = match last_is {
            Column::Residual => self.errors.count,
            Column::Force => 0,
        };
        let mut joint = Triangle::new(errors + unknowns + 1);
        let mut mapped = vec![0.0; errors + unknowns + 1];
        for (record, factor) in factors.enumerate() {
            let columns = self.map(record, unknowns);
            let fixed = match last_is {
                Column::Residual => Vec::new(),
                Column::Force => self.fixed_coefficients(record),
            };
            let last = factor.width() - 1;
            for i in 0..factor.width() {
                let row = factor.row(i);
                mapped[..errors].copy_from_slice(&row[last - errors..last]);
                for (slot, column) in mapped[errors..].iter_mut().zip(&columns) {
                    *slot = column.of(row);
                }
                mapped[errors + unknowns] = row[last] - product(&fixed, row);
                joint.push(&mapped, 1.0);
            }
        }
        joint
    }

    /// Where each of the first `unknowns` finds its column in a record's triangle.
    pub fn map(&self, record: usize, unknowns: usize) -> Vec<UnknownPlace> {
        let layout = self.layout();
        let slopes = self.slopes(record);
        let place = |slope: Slope| slopes.iter().position(|&one| one == slope);
        let place = |slope: Slope| {
            let place = place(slope).map(|k| UnknownPlace::Slope(layout.linear_count() + k));
            place.unwrap_or(UnknownPlace::Nowhere)
        };
        self.unknowns[..unknowns]
            .iter()
            .map(|unknown| match unknown.parameter {
                _ if !unknown.is_of(record) => UnknownPlace::Nowhere,
                k if k < layout.outers => place(Slope::Outer(k)),
                k if k == layout.contact() => place(Slope::Contact),
                _ => UnknownPlace::Linear(self.column(record, *unknown)),
            })
            .collect()
    }

    /// Weighted sum of squared forces.
    pub fn force_square(&self) -> f64 {
        self.records.iter().map(|record| record.force_square).sum()
    }

    fn record_factor(
        &self,
        record: usize,
        point: &ParameterPoint,
        rows: Rows,
        last_is: Column,
    ) -> Option<RecordFactor> {
        let Record { samples, thin, .. } = &self.records[record];
        let is_residual = last_is == Column::Residual;
        let slopes = if is_residual { self.slopes(record) } else { Vec::new() };
        let scale = self.scale(&point.outer);
        if let (Some(term), true, Rows::All) = (&self.signals[record], is_residual, rows) {
            return self.signal_factor(record, term, point, &slopes);
        }
        if rows == Rows::Thin {
            let factor = self.source.thin_factor(&thin.blocks, scale, point, &slopes)?;
            let factor = if is_residual { factor.subtract_explained(&point.at) } else { factor };
            return Some(RecordFactor { factor, blocks: Vec::new() });
        }
        let width = self.layout().linear_count() + slopes.len() + 1;
        let mut triangle = Triangle::new(width);
        let mut sums = NoiseSums::new(samples.len(), width);
        let mut lanes = vec![[0.0; LANES]; width];
        self.source.walk(samples, scale, point, &slopes, |block, filled| {
            run_wide(
                #[inline(always)]
                || {
                    filled.write(&mut lanes, point, &slopes);
                    self.forces(block, &mut lanes);
                    if is_residual {
                        subtract(&mut lanes, &point.at);
                    }
                    self.weigh(block, &mut lanes);
                    if is_residual {
                        sums.add(&lanes, block);
                    }
                    triangle.push_lanes(&mut lanes, block.len());
                },
            );
        })?;
        Some(RecordFactor { factor: triangle.finish(), blocks: sums.finish() })
    }

    /// Writes the force as the last column.
    #[inline(always)]
    fn forces(&self, block: &[FitSample], columns: &mut [Lane]) {
        let Some(last) = columns.last_mut() else {
            return;
        };
        for (force, sample) in last.iter_mut().zip(block) {
            *force = if sample.is_measured() { sample.force.0 } else { 0.0 };
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
fn subtract(columns: &mut [Lane], at: &[f64]) {
    let Some((force, columns)) = columns.split_last_mut() else {
        return;
    };
    let mut modelled = [0.0; LANES];
    // The record's own columns first: they are the smaller, and rounded with the others.
    for (column, share) in columns[..at.len()].iter().zip(at).rev() {
        for (sum, value) in modelled.iter_mut().zip(column) {
            *sum += share * value;
        }
    }
    for (force, modelled) in force.iter_mut().zip(&modelled) {
        *force -= modelled;
    }
}

/// Inner product of coefficients with the first columns of a row.
#[inline]
pub(super) fn product(coefficients: &[f64], row: &[f64]) -> f64 {
    let mut sum = 0.0;
    for (a, b) in coefficients.iter().zip(row) {
        sum += a * b;
    }
    sum
}
