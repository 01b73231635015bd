//! From unknowns to the parameters of each record in their units and back, and where these may go.

use super::columns::{OuterPoint, ParameterPoint, coordinate, coordinate_slope};
use super::design::Scale;
use super::record::Record;
use super::sample::{FitError, FitSample};
use super::system::{Ranges, System, Unknown};
use crate::families::{Model, OuterRange};

/// Longest relaxation time searched, in lengths of the record.
const LENGTHS: f64 = 10.0;
/// Shortest relaxation time searched, as a share of the shortest sample interval: what relaxes within
/// an interval still shows in the samples after a corner.
const INTERVALS: f64 = 0.125;
/// Deepest contact position tried, as a share of the travel.
const CONTACT_SHARE_MAX: f64 = 0.85;
/// Share of its greatest depth by which the probe must retract in some record before softening can be
/// identified: less than a tenth would be extrapolated over all the rest.
const RETURN_MIN: f64 = 0.1;

impl System<'_> {
    /// Searched ranges of a record by itself.
    pub fn range(&self, record: usize) -> Ranges {
        let Record { samples, depths, .. } = &self.records[record];
        let outers = &self.known()[..self.layout().outers];
        let outers = outers.iter().filter_map(|one| one.range);
        let shallowest = depths.0 / self.depth_mm;
        Ranges {
            outers: outers
                .map(|range| match range {
                    OuterRange::Time => log_tau_range(samples),
                    OuterRange::PerDepth(low, high) => {
                        ((low / self.depth_mm).ln(), (high / self.depth_mm).ln())
                    }
                    OuterRange::Ratio(low, high) | OuterRange::Share(low, high) => {
                        (coordinate(range, low), coordinate(range, high))
                    }
                })
                .collect(),
            // Before its first depth a contact is not separable from other elastic coefficients and an offset, since
            // a shifted cubic is a cubic.
            contact: (shallowest, shallowest + CONTACT_SHARE_MAX),
        }
    }

    /// Refuses a family that softens where no record unloads.
    pub fn check_return(&self) -> Result<(), FitError> {
        let middle = self.range_middles();
        let columns = self.source.family.columns(&middle);
        let softens = columns.iter().flatten();
        if !softens.into_iter().any(|term| term.elastic.softens() || term.rate.softens()) {
            return Ok(());
        }
        let share = self.records.iter().map(Record::return_share);
        let share = share.fold(0.0, f64::max);
        if share >= RETURN_MIN {
            return Ok(());
        }
        Err(FitError::Unsupported {
            family: self.source.family.name(),
            reason: format!(
                "the probe retracts by {:.0} % of its greatest depth while the force is known, but the unloading parameters need {:.0} %; record the unloading, press deeper, or unload more slowly so that contact lasts",
                100.0 * share,
                100.0 * RETURN_MIN
            ),
        })
    }

    /// Outer parameters in the middle of their ranges.
    fn range_middles(&self) -> Vec<f64> {
        let ends = self.ranges[0].outers.iter().enumerate();
        ends.map(|(k, (low, high))| self.outer_value(k, 0.5 * (low + high))).collect()
    }

    /// An outer parameter in its unit, from its search coordinate.
    pub fn outer_value(&self, outer: usize, z: f64) -> f64 {
        match self.source.range_kind(outer) {
            OuterRange::Share(..) => z,
            _ => z.exp(),
        }
    }

    /// Points in the middle of all ranges, with no coefficients.
    pub fn middle_points(&self) -> Vec<ParameterPoint> {
        let fixed = |record: usize| {
            let middle = self.range_middles().into_iter().enumerate();
            middle.map(move |(k, value)| self.fixed(record, k).unwrap_or(value))
        };
        let each = 0..self.records.len();
        each.map(|record| ParameterPoint {
            outer: OuterPoint {
                values: fixed(record).collect(),
                contact: self.fixed_contact(record).unwrap_or(0.0),
            },
            at: vec![0.0; self.layout().linear_count()],
        })
        .collect()
    }

    /// The body of the first record, if the family allows its numbers.
    pub fn model(&self, points: &[ParameterPoint]) -> Result<Model, FitError> {
        let refused =
            |reason: String| FitError::Unsupported { family: self.source.family.name(), reason };
        // The search keeps within the bounds, so what the records do not hold ends on one.
        if let Some(parameter) = self.first_zero(points) {
            return Err(refused(format!(
                "the best fit has a {} of zero or less; use a family with fewer terms",
                self.known()[parameter].name
            )));
        }
        let layout = self.layout();
        let mut values = self.physical_values(0, &points[0]);
        values.truncate(layout.outers + layout.coefficients);
        let linear = values.split_off(layout.outers);
        let model = self.source.family.model(&values, &linear);
        model.map_err(|err| refused(err.to_string()))
    }

    /// Moves points to where [`System::pinned`] keeps a parameter.
    pub fn pin(&self, points: &mut [ParameterPoint], record: usize, parameter: usize, value: f64) {
        let layout = self.layout();
        for (other, point) in points.iter_mut().enumerate() {
            if !(self.shared[parameter] || other == record) {
                continue;
            }
            if parameter < layout.outers {
                point.outer.values[parameter] = value;
            } else if parameter == layout.contact() {
                point.outer.contact = value / self.depth_mm;
            } else {
                let k = parameter - layout.outers;
                let mut bare = self.source.to_bare(&point.at);
                bare[k] = value * self.source.units(self.depth_mm)[k];
                point.at = self.source.to_basis(&bare);
            }
        }
    }

    /// Least and greatest value that a parameter of a record may have, in its unit.
    pub fn limits(&self, record: usize, parameter: usize) -> (f64, f64) {
        let layout = self.layout();
        let ranges = &self.ranges[record];
        if parameter < layout.outers {
            let (low, high) = ranges.outers[parameter];
            let value = |z| self.outer_value(parameter, z);
            (value(low), value(high))
        } else if parameter == layout.contact() {
            let (low, high) = ranges.contact;
            (low * self.depth_mm, high * self.depth_mm)
        } else if self.known()[parameter].is_bound {
            (0.0, f64::INFINITY)
        } else {
            (f64::NEG_INFINITY, f64::INFINITY)
        }
    }

    /// Search coordinate of an outer parameter.
    pub fn coordinate(&self, outer: usize, value: f64) -> f64 {
        coordinate(self.source.range_kind(outer), value)
    }

    pub fn scale(&self, outer: &OuterPoint) -> Scale {
        Scale { depth_mm: self.depth_mm, contact: outer.contact }
    }

    /// The column of a linear unknown in a record, as coefficients of that record's columns; zero
    /// in other records.
    pub fn column(&self, record: usize, unknown: Unknown) -> Vec<f64> {
        let layout = self.layout();
        let mut unit = vec![0.0; layout.linear_count()];
        if !unknown.is_of(record) {
            return unit;
        }
        let k = unknown.parameter - layout.outers;
        unit[k] = 1.0;
        let is_free_alike = |k: usize| {
            let parameter = layout.outers + k;
            self.fixed(record, parameter).is_none()
                && self.shared[parameter] == self.shared[unknown.parameter]
        };
        // A combined column stands for its own bare one where those before it are free to make up for the rest.
        if k < self.source.combined_count() && !(0..k).all(is_free_alike) {
            self.source.to_basis(&unit)
        } else {
            unit
        }
    }

    /// Fixed values of a record as coefficients.
    pub fn fixed_coefficients(&self, record: usize) -> Vec<f64> {
        let units = self.source.units(self.depth_mm);
        let linear = self.layout().linear().zip(units);
        let bare: Vec<f64> =
            linear.map(|(k, unit)| self.fixed(record, k).unwrap_or(0.0) * unit).collect();
        self.source.to_basis(&bare)
    }

    /// A record's coefficients, from the linear unknowns.
    pub fn coefficients(&self, record: usize, solution: &[f64]) -> Vec<f64> {
        self.apply_change(record, &self.fixed_coefficients(record), solution)
    }

    /// A record's coefficients after a change of the linear unknowns.
    pub fn apply_change(&self, record: usize, at: &[f64], change: &[f64]) -> Vec<f64> {
        let mut all = at.to_vec();
        for (value, unknown) in change.iter().zip(&self.unknowns[..self.linear]) {
            for (slot, share) in all.iter_mut().zip(self.column(record, *unknown)) {
                *slot += value * share;
            }
        }
        all
    }

    /// All parameters of a record in their units.
    pub fn physical_values(&self, record: usize, point: &ParameterPoint) -> Vec<f64> {
        let layout = self.layout();
        let units = self.source.units(self.depth_mm);
        let bare = self.source.to_bare(&point.at);
        (0..layout.count())
            .map(|k| match self.fixed(record, k) {
                Some(value) => value,
                None if k < layout.outers => point.outer.values[k],
                None if k == layout.contact() => point.outer.contact * self.depth_mm,
                None => bare[k - layout.outers] / units[k - layout.outers],
            })
            .collect()
    }

    /// A free parameter of a record, in its unit, as a combination of small changes of the
    /// unknowns.
    pub fn combination(&self, record: usize, parameter: usize, point: &ParameterPoint) -> Vec<f64> {
        let layout = self.layout();
        let units = self.source.units(self.depth_mm);
        let mut combination = vec![0.0; self.unknowns.len()];
        for (slot, unknown) in combination.iter_mut().zip(&self.unknowns) {
            if !unknown.is_of(record) {
                continue;
            }
            let is_same = unknown.parameter == parameter;
            if layout.linear().contains(&unknown.parameter) {
                if layout.linear().contains(&parameter) {
                    let k = parameter - layout.outers;
                    let bare = self.source.to_bare(&self.column(record, *unknown));
                    *slot = bare[k] / units[k];
                }
            } else if is_same && parameter == layout.contact() {
                *slot = self.depth_mm;
            } else if is_same {
                let kind = self.source.range_kind(parameter);
                *slot = coordinate_slope(kind, point.outer.values[parameter]);
            }
        }
        combination
    }
}

/// The searched range of `ln tau`: a share of a sample interval to ten lengths of the record.
fn log_tau_range(samples: &[FitSample]) -> (f64, f64) {
    let length = samples[samples.len() - 1].t.0 - samples[0].t.0;
    let interval = length / (samples.len() - 1) as f64;
    let shortest =
        samples.windows(2).map(|pair| pair[1].t.0 - pair[0].t.0).fold(interval, f64::min);
    ((INTERVALS * shortest).ln(), (LENGTHS * length).ln())
}

/// The range that holds all of them.
pub(super) fn union(ranges: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
    ranges.reduce(|all, one| (all.0.min(one.0), all.1.max(one.1))).unwrap_or_default()
}
